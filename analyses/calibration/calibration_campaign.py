"""A simulated campaign: poses are chosen, gone to and recorded, and the robot is calibrated.

The robot of a scenario is believed wrongly, as the scenario's perturbations say. It goes to poses
by the lengths that its believed model has there, and rests where its true cables hold it, some of
them slack; winches, tension sensors and the camera record. The same servo can then believe in
what was found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.calibrated_robots import calibration_model, find_mount
from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask, Sigmas, TagPlace
from cdpr_drake.analyses.calibration.calibration_task import Calibration, calibrate
from cdpr_drake.analyses.calibration.candidate_poses import in_short_hops, rest_poses
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import simulated_corners
from cdpr_drake.calibration.pose_design import choose_poses, informing_rows
from cdpr_drake.calibration.pose_search import guessed_stations
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError, EquilibriumError
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import angles_from_rotation, place_error
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.target import PointTarget

PRIORS = {
    "exit_points": 0.01, "anchor_points": 0.005, "length_offsets": 0.02, "camera.r?": 0.02,
    "camera.[xyz]": 0.005,
}  # fmt: skip
"""What a campaign takes as known of a robot beforehand [m, rad]."""

UNKNOWN = ("exit_points", "anchor_points", "length_offsets", "camera")
CANDIDATES = 3
"""Poses that are drawn for each that is chosen."""

SIGMAS = Sigmas(lengths=1e-4, tensions=0.1)
SLACK_SHARE = 0.01
"""A cable with less tension than this share of the weight is slack: its length tells nothing."""

FEWEST = 6
"""A pose with fewer taut cables and no tag in view tells nothing."""

CABLES = "elastic"
"""Law of the true cables while they rest."""


@dataclass(frozen=True, eq=False)
class Campaign:
    """What a campaign recorded and found.

    Attributes:
        scenario: The servo whose robot was calibrated.
        calibration: What was found.
        poses: Where the platform truly rested.
        first: Readings of the winches at the servo's initial pose, shape (m,) [m].
        misses: How far it rested from where it was sent [m].
        remarks: What should be known of it, in words.
    """

    scenario: Scenario
    calibration: Calibration
    poses: list[RigidTransform]
    first: Array
    misses: Array
    remarks: tuple[str, ...]

    def errors(self) -> dict[str, float]:
        """Root mean square distances from the true robot, before and after [m].

        Without what moves a whole frame of the found robot.
        """
        truth = calibration_model(load_robot(self.scenario.robot), self.calibration.mount)
        result, found = self.calibration.result, {}
        model, before = (
            result.model,
            calibration_model(self.calibration.task.robot, self.calibration.mount),
        )
        names = np.array(result.names)
        difference = np.zeros(len(names))
        points = {"exit_point": "p_WA", "anchor_point": "p_PB"}
        for single, key in points.items():
            mine = np.array([f".{single}." in name for name in names])
            difference[mine] = (getattr(model.cables, key) - getattr(truth.cables, key)).T.ravel()
        left = result.without_frames(difference)
        for single, key in points.items():
            mine = np.array([f".{single}." in name for name in names])
            first = (getattr(before.cables, key) - getattr(truth.cables, key)).T
            found[f"{single}s_before_m"] = float(np.sqrt(np.mean(np.sum(first**2, axis=1))))
            after = left[mine].reshape(-1, 3)
            found[f"{single}s_after_m"] = float(np.sqrt(np.mean(np.sum(after**2, axis=1))))
        return found


def run_campaign(
    scenario: Scenario,
    count: int,
    say: Callable[[str], None] = lambda words: None,
    goals: Sequence[RigidTransform] | None = None,
) -> Campaign:
    """Chooses poses, records them and calibrates.

    Args:
        scenario: A visual servo with the camera on the platform and tags in the world.
        count: Poses to go to.
        say: Told what is done now.
        goals: Poses to go to in the place of those that are chosen, X_WP [m].

    Raises:
        CalibrationError: The scenario's camera or target is not accepted, or the robot can rest at
            too few poses.
    """
    robot, random = load_robot(scenario.robot), np.random.default_rng([scenario.seed, 17])
    tags, targets = _tags(scenario)
    mount = find_mount(robot, scenario.camera.mount)
    pinhole = servo_pinhole(scenario.camera, robot)
    belief = believed_robot(scenario, robot)
    nominal = _with(robot, belief.cables.p_WA, belief.cables.p_PB, mount.name, belief.X_PC)
    true = with_tags(calibration_model(robot, mount.name), tags)
    believed = with_tags(calibration_model(nominal, mount.name), tags)
    if goals is None:
        say("Choosing poses")
        goals = _goals(nominal, believed, count, (targets, pinhole), random)
    count = len(goals)
    say(f"Going to {len(goals)} poses")
    holding = hold_robot(robot, scenario.initial_pose.transform(), true.cables, CABLES)
    at = Point(believed, Stations.at([belief.X_WP0, *goals])).numbers[:, :, 0]
    rested, counted, tensions, sent = [], [], [], []
    weight = robot.platform.mass * robot.gravity
    for goal, lengths in zip(goals, at[1:], strict=True):
        l0 = holding.unstrained_lengths + lengths - at[0]
        try:
            rest = equilibrium_near(true.cables, CABLES, rigid_platform(robot), l0, goal)
        except EquilibriumError:
            continue
        taut = rest.tensions > SLACK_SHARE * weight
        in_view = simulated_corners(true, [rest.X_WP], targets, pinhole, 0.0, random)
        if np.sum(taut) < FEWEST and not np.isfinite(in_view).any():
            continue
        rested.append(rest.X_WP)
        counted.append(np.where(taut, lengths, np.nan))
        tensions.append(rest.tensions)
        sent.append(goal)
    least = max(6, count // 2)
    if len(rested) < least:
        raise CalibrationError(
            f"campaign: found rest at {len(rested)} of {count} poses; accepted: at least {least}, "
            "of more poses or with a belief that is nearer to the truth"
        )
    noise = SIGMAS.lengths * random.standard_normal((len(rested), true.cables.count))
    uv = simulated_corners(
        true, rested, targets, pinhole, scenario.camera.pixel_noise or 0.1, random
    )
    t = np.array(tensions)
    log = CalibrationLog(
        Path(f"campaign of {scenario.name}"), len(rested), lengths=np.array(counted) + noise,
        tensions=np.maximum(t + SIGMAS.tensions * random.standard_normal(t.shape), 0.0),
        corners={tag: uv[:, k] for k, tag in enumerate(targets)},
    )  # fmt: skip
    task = CalibrationTask(
        nominal, UNKNOWN, dict(PRIORS), replace(SIGMAS, corners=scenario.camera.pixel_noise or 0.1),
        {tag: TagPlace(2.0 * float(np.max(T.points[0]))) for tag, T in targets.items()}, mount.name,
        (scenario.camera.width, scenario.camera.height), sent[0], False,
    )  # fmt: skip
    calibration = calibrate(task, log, say)
    misses = np.array([place_error(X, Y) for X, Y in zip(rested, sent, strict=True)])
    remarks = () if len(rested) == count else (f"{count - len(rested)} poses told nothing",)
    return Campaign(scenario, calibration, rested, at[0], misses, remarks)


def calibrated_scenario(campaign: Campaign, robot_file: str) -> Scenario:
    """The servo of a campaign with what was found, in the place of what was believed wrongly.

    The platform's first pose is where the found robot has the lengths that winches counted there.

    Args:
        campaign: The campaign.
        robot_file: The robot that was found, as a file.
    """
    kept, model = campaign.scenario.perturbations, campaign.calibration.result.model
    start = campaign.scenario.initial_pose.transform()
    program = CalibrationProgram(model, [start], ())
    lengths = campaign.calibration.log.lengths
    assert lengths is not None
    program.AddLengths(campaign.first[None], SIGMAS.lengths, first_readings(lengths))
    (X_WP0,) = guessed_stations(model, program.terms, 1, start).poses()
    angles = np.degrees(angles_from_rotation(X_WP0.rotation()))
    perturbations = replace(
        type(kept)(), believed_robot=robot_file,
        initial_pose=Pose(position=np.array(X_WP0.translation()), angles_deg=angles),
        image_bias=kept.image_bias, slack=kept.slack, winch_offset=kept.winch_offset,
        winch_offset_spread=kept.winch_offset_spread, slack_at_rest=kept.slack_at_rest,
    )  # fmt: skip
    return replace(campaign.scenario, perturbations=perturbations)


def servo_again(
    campaign: Campaign, robot_file: str, say: Callable[[str], None] = lambda words: None
) -> dict[str, dict[str, float | str]]:
    """The servo with what was believed before, with what was found, and with the true robot.

    Returns:
        Of each, how it ended, and the largest distance of the camera from the straight line [m].
    """
    exact = replace(campaign.scenario, perturbations=type(campaign.scenario.perturbations)())
    found: dict[str, dict[str, float | str]] = {}
    for name, scenario in {
        "believed before": campaign.scenario,
        "calibrated": calibrated_scenario(campaign, robot_file),
        "true": exact,
    }.items():
        say(f"Servoing, {name}")
        run = ServoRun(scenario).simulate()
        path, line = run.camera_path, run.camera_line
        found[name] = {
            "outcome": run.outcome.name.lower(),
            "time_s": run.sim_time,
            "off_line_m": float(np.max(distances_from_line(path, *line))),
        }
    return found


def _tags(scenario: Scenario) -> tuple[dict[int, RigidTransform], dict[int, PointTarget]]:
    target = scenario.target
    kinds = ("tag", "tag_bundle")
    if target.kind not in kinds or not scenario.target_rests():
        raise CalibrationError(
            f"target: found {target.kind}, {'at rest' if scenario.target_rests() else 'moving'}; "
            "accepted: a tag or tag_bundle that rests in the world"
        )
    X_WO = target.pose.transform()
    if target.kind == "tag":
        return {target.tag_id: X_WO}, {target.tag_id: TagTarget(target.tag_id, target.size)}
    poses = {tag.tag_id: X_WO @ tag.pose.transform() for tag in target.tags}
    return poses, {tag.tag_id: TagTarget(tag.tag_id, tag.size) for tag in target.tags}


def _goals(
    nominal: Robot, believed: Any, count: int, camera: Any, random: np.random.Generator
) -> list[RigidTransform]:
    """Poses of which most is expected, each near the one before."""
    targets, pinhole = camera
    candidates, _ = rest_poses(nominal, CANDIDATES * count, random)
    uv = simulated_corners(believed, candidates, targets, pinhole, 0.0, random)
    program = CalibrationProgram(believed, candidates, [*UNKNOWN, "tags"])
    program.AddLengths(Point(believed, Stations.at(candidates)).numbers[:, :, 0], SIGMAS.lengths)
    program.AddTagCorners({k: T.points for k, T in targets.items()}, uv, SIGMAS.corners, pinhole)
    for name, std in PRIORS.items():
        program.AddPrior([name], std)
    problem, at = program.least_squares(), program.at()
    equations = problem.normal_equations(at, 0.0)
    known = equations.S - equations.S_data + 1e-4 * np.eye(len(equations.S))
    chosen, _ = choose_poses(informing_rows(problem, at), count, known)
    return in_short_hops([candidates[k] for k in chosen], nominal.home.transform())


def _with(robot: Robot, p_WA: Array, p_PB: Array, mount: str, X_PC: RigidTransform) -> Robot:
    """A robot with other points and another pose of a camera."""
    cables = [
        replace(cable, exit_point=cable.base_of(p_WA[:, k]), anchor_point=np.array(p_PB[:, k]))
        for k, cable in enumerate(robot.cables)
    ]
    angles = np.degrees(angles_from_rotation(X_PC.rotation()))
    pose = Pose(position=np.array(X_PC.translation()), angles_deg=angles)
    cameras = [replace(one, pose=pose) if one.name == mount else one for one in robot.cameras]
    return replace(robot, cables=cables, cameras=cameras)
