"""A calibration shown in simulation: the verb `calibrate_campaign`.

The robot of a scenario is believed wrongly, as the scenario's perturbations say. It goes to poses
by the lengths that its believed model has there, and rests where its true cables hold it, some of
them slack; winches, tension sensors and the camera record. The same servo then believes in the
calibrated robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, TypeVar

import numpy as np
from cyclopts import Parameter
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.calibration import (
    Calibration,
    NextCount,
    calibration_fit,
    fit_robot,
    with_next_poses,
)
from cdpr_drake.analyses.fits.fit import Fit, kept_fit
from cdpr_drake.analyses.fits.prediction import FRAMES_KNOWN
from cdpr_drake.analyses.fits.robots import (
    calibration_model,
    find_mount,
    in_short_hops,
    rest_poses,
    schema_pose,
)
from cdpr_drake.analyses.fits.setup import CalibrationTask, Sigmas
from cdpr_drake.analyses.fits.tags import TagPlace
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    ScenarioWord,
    Switch,
    whole,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.planning.path_files import path_poses
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE, write_run_inputs
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.arrays import Array
from cdpr_drake.calibration.guesses import with_tags
from cdpr_drake.calibration.measurements import simulated_corners
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.pose_design import choose_poses, informing_rows
from cdpr_drake.calibration.pose_search import guessed_stations
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.stations import Point, Stations
from cdpr_drake.errors import CalibrationError, EquilibriumError, ScenarioError
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

PRIORS = {
    "exit_points": 0.01, "anchor_points": 0.005, "length_offsets": 0.02, "camera.r?": 0.02,
    "camera.[xyz]": 0.005,
}  # fmt: skip
"""Standard deviations that a campaign takes as known of a robot beforehand [m, rad]."""

UNKNOWN = ("exit_points", "anchor_points", "length_offsets", "camera")

POSES, CANDIDATES = 30, 3
"""Default number of poses, and poses that are drawn for each that is chosen."""

SIGMAS = Sigmas(lengths=1e-4, tensions=0.1)
PIXEL_NOISE = 0.1
"""Noise of corners [px] if the scenario has none."""

SLACK_SHARE = 0.01
"""A cable with less tension than this share of the weight is slack: its length tells nothing."""

FEWEST = 6
"""A pose with fewer taut cables and no tag in view tells nothing."""

CABLES = "elastic"
"""Law of the true cables while they rest."""

BEFORE, TRUE = "believed before", "true"
"""Robots that a trial believes in, beside the fitted one."""

S = TypeVar("S")


def campaign_scenario(scenario: Any, kind: type[S], accepted: str) -> S:
    """The scenario of a campaign, by name or file.

    Raises:
        ScenarioError: It is unknown or of another kind.
    """
    loaded = load_scenario(str(scenario)) if isinstance(scenario, str | Path) else scenario
    if not isinstance(loaded, kind):
        raise ScenarioError(f"scenario: found {loaded.name}, a {loaded.kind}; accepted: {accepted}")
    return loaded


@dataclass(frozen=True, eq=False)
class Scene:
    """The robot of a servo as it is and as it is believed, its camera and tags.

    Attributes:
        scenario: The servo.
        robot, nominal: The robot as it is, and as it is believed.
        true, believed: Their models, with tags.
        X_WP0: Pose in which the platform is believed to begin [m].
        mount, pinhole: The camera.
        targets: Tags by their numbers.
        random: Draws poses and noise.
    """

    scenario: Scenario
    robot: Robot
    nominal: Robot
    true: CalibrationModel
    believed: CalibrationModel
    X_WP0: RigidTransform
    mount: str
    pinhole: Pinhole
    targets: dict[int, PointTarget]
    random: np.random.Generator

    @classmethod
    def of(cls, scenario: Scenario) -> Scene:
        """The scene of a servo with the camera on the platform and tags in the world.

        Raises:
            CalibrationError: The scenario's camera or target is not accepted.
        """
        robot, random = load_robot(scenario.robot), np.random.default_rng([scenario.seed, 17])
        tags, targets = _tags(scenario)
        mount = find_mount(robot, scenario.camera.mount).name
        pinhole, belief = servo_pinhole(scenario.camera, robot), believed_robot(scenario, robot)
        cables = [
            replace(cable, exit_point=cable.base_of(belief.cables.p_WA[:, k]),
                    anchor_point=np.array(belief.cables.p_PB[:, k]))
            for k, cable in enumerate(robot.cables)
        ]  # fmt: skip
        cameras = [
            replace(camera, pose=schema_pose(belief.X_PC)) if camera.name == mount else camera
            for camera in robot.cameras
        ]
        nominal = replace(robot, cables=cables, cameras=cameras)
        true, believed = (
            with_tags(calibration_model(each, mount), tags) for each in (robot, nominal)
        )
        return cls(
            scenario, robot, nominal, true, believed, belief.X_WP0, mount, pinhole, targets, random
        )

    @property
    def corner_sigma(self) -> float:
        """Noise of corners [px]."""
        return self.scenario.camera.pixel_noise or PIXEL_NOISE

    def telling_poses(self, count: int) -> list[RigidTransform]:
        """Poses of which most is expected, each near the one before."""
        candidates, _ = rest_poses(self.nominal, CANDIDATES * count, self.random)
        uv = simulated_corners(
            self.believed, candidates, self.targets, self.pinhole, 0.0, self.random
        )
        program = CalibrationProgram(self.believed, candidates, [*UNKNOWN, "tags"])
        lengths = Point(self.believed, Stations.at(candidates)).numbers[:, :, 0]
        program.AddLengths(lengths, SIGMAS.lengths)
        points = {tag: target.points for tag, target in self.targets.items()}
        program.AddTagCorners(points, uv, SIGMAS.corners, self.pinhole)
        for name, std in PRIORS.items():
            program.AddPrior([name], std)
        problem, at = program.least_squares(), program.at()
        equations = problem.normal_equations(at, 0.0)
        known = equations.S - equations.S_data + FRAMES_KNOWN * np.eye(len(equations.S))
        chosen, _ = choose_poses(informing_rows(problem, at), count, known)
        return in_short_hops([candidates[k] for k in chosen], self.nominal.home.transform())


@dataclass(frozen=True, eq=False)
class Record:
    """What a campaign recorded.

    Attributes:
        log: The measurements.
        poses: Poses in which the platform truly rested, X_WP [m].
        goals: Poses to which it was sent.
        first: Readings of the winches at the servo's initial pose, shape (m,) [m].
        remarks: Sentences on poses that told nothing.
    """

    log: Measurements
    poses: list[RigidTransform]
    goals: list[RigidTransform]
    first: Array
    remarks: tuple[str, ...]


def record(scene: Scene, goals: Sequence[RigidTransform]) -> Record:
    """What sensors record where a robot rests that goes to poses X_WP [m].

    Raises:
        CalibrationError: It rests at too few poses.
    """
    robot, true, random = scene.robot, scene.true, scene.random
    holding = hold_robot(robot, scene.scenario.initial_pose.transform(), true.cables, CABLES)
    at = Point(scene.believed, Stations.at([scene.X_WP0, *goals])).numbers[:, :, 0]
    rested, counted, tensions, sent = [], [], [], []
    weight = robot.platform.mass * robot.gravity
    for goal, lengths in zip(goals, at[1:], strict=True):
        l0 = holding.unstrained_lengths + lengths - at[0]
        try:
            rest = equilibrium_near(true.cables, CABLES, rigid_platform(robot), l0, goal)
        except EquilibriumError:
            continue
        taut = rest.tensions > SLACK_SHARE * weight
        in_view = simulated_corners(true, [rest.X_WP], scene.targets, scene.pinhole, 0.0, random)
        if np.sum(taut) < FEWEST and not np.isfinite(in_view).any():
            continue
        rested.append(rest.X_WP)
        counted.append(np.where(taut, lengths, np.nan))
        tensions.append(rest.tensions)
        sent.append(goal)
    least = max(6, len(goals) // 2)
    if len(rested) < least:
        raise CalibrationError(
            f"campaign: found rest at {len(rested)} of {len(goals)} poses; accepted: at least "
            f"{least}, of more poses or with a belief that is nearer to the truth"
        )
    noise = SIGMAS.lengths * random.standard_normal((len(rested), true.cables.count))
    uv = simulated_corners(true, rested, scene.targets, scene.pinhole, scene.corner_sigma, random)
    t = np.array(tensions)
    log = Measurements(
        Path(f"campaign of {scene.scenario.name}"), len(rested), lengths=np.array(counted) + noise,
        tensions=np.maximum(t + SIGMAS.tensions * random.standard_normal(t.shape), 0.0),
        corners={tag: uv[:, k] for k, tag in enumerate(scene.targets)},
    )  # fmt: skip
    lost = len(goals) - len(rested)
    remarks = (f"{lost} poses told nothing",) if lost else ()
    return Record(log, rested, sent, at[0], remarks)


def calibrated(
    scene: Scene, recorded: Record, say: Callable[[str], None] = lambda words: None
) -> Calibration:
    """The calibration of what a campaign recorded.

    Raises:
        CalibrationError: The log does not tell what is unknown.
    """
    camera = scene.scenario.camera
    tags = {k: TagPlace(2.0 * float(np.max(T.points[0]))) for k, T in scene.targets.items()}
    task = CalibrationTask(
        robot=scene.nominal, log=recorded.log, unknown=UNKNOWN, priors=dict(PRIORS),
        sigmas=replace(SIGMAS, corners=scene.corner_sigma), tags=tags, mount=scene.mount,
        image_size=(camera.width, camera.height), start=recorded.goals[0], rest=False,
    )  # fmt: skip
    return fit_robot(task, None, say)


def point_errors(scene: Scene, calibration: Calibration) -> dict[str, float]:
    """Root mean square distances of points from the true robot, before and after [m].

    Without what moves a whole frame of the calibrated robot.
    """
    truth, before = calibration_model(scene.robot, scene.mount), scene.believed
    result, errors = calibration.result, {}
    names = np.array(result.names)
    difference = np.zeros(len(names))
    points = {"exit_point": "p_WA", "anchor_point": "p_PB"}
    mine = {single: np.array([f".{single}." in name for name in names]) for single in points}
    for single, key in points.items():
        off = getattr(result.model.cables, key) - getattr(truth.cables, key)
        difference[mine[single]] = off.T.ravel()
    left = result.without_frames(difference)
    for single, key in points.items():
        first = (getattr(before.cables, key) - getattr(truth.cables, key)).T
        errors[f"{single}s_before_m"] = float(np.sqrt(np.mean(np.sum(first**2, axis=1))))
        after = left[mine[single]].reshape(-1, 3)
        errors[f"{single}s_after_m"] = float(np.sqrt(np.mean(np.sum(after**2, axis=1))))
    return errors


def calibrated_scenario(
    scene: Scene, recorded: Record, calibration: Calibration, robot_file: str
) -> Scenario:
    """The servo with the calibrated robot in the place of what was believed wrongly.

    The platform's first pose is where the calibrated robot has the lengths that winches counted
    there; `robot_file` is the calibrated robot as a file.
    """
    perturbations, model = scene.scenario.perturbations, calibration.result.model
    start, lengths = scene.scenario.initial_pose.transform(), recorded.log.lengths
    assert lengths is not None
    program = CalibrationProgram(model, [start], ())
    program.AddLengths(recorded.first[None], SIGMAS.lengths, first_readings(lengths))
    (X_WP0,) = guessed_stations(model, program.terms, 1, start).poses()
    kept = ("image_bias", "slack", "winch_offset", "winch_offset_spread", "slack_at_rest")
    changed = replace(
        type(perturbations)(), believed_robot=robot_file, initial_pose=schema_pose(X_WP0),
        **{name: getattr(perturbations, name) for name in kept},
    )  # fmt: skip
    return replace(scene.scenario, perturbations=changed)


def servo(scenario: Scenario) -> dict[str, float | str]:
    """How a servo ends, and the largest distance of its camera from the straight line [m]."""
    run = ServoRun(scenario).simulate()
    return {
        "outcome": run.outcome.name.lower(),
        "time_s": run.sim_time,
        "off_line_m": float(np.max(distances_from_line(run.camera_path, *run.camera_line))),
    }


@verb()
def calibrate_campaign(
    scenario: ScenarioWord, *, poses: Annotated[int | None, whole(6, 200)] = None,
    poses_from: InputFile = None, propose: NextCount = None, folder: OutFolder = None,
    overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Calibrates the wrongly believed robot of a visual servo in simulation, and servoes again.

    It goes to poses, and is calibrated from what winches, tension sensors and the camera record
    where it rests; the servo then runs again with the calibrated robot. Writes what calibrate
    writes, and a folder that cdpr simulate takes: scenario.yaml, robot.yaml, the true robot, and
    believed_robot.yaml, the calibrated one.

    Args:
        scenario: Visual servo with the camera on the platform and tags in the world.
        poses: Number of poses, those expected to tell most; default: 30.
        poses_from: File of poses to go to instead, as of cdpr plan --path, such as next_poses.csv;
            in Python also poses.
        propose: Also propose so many poses that would tell most next, in next_poses.csv.
        folder: Results folder; default: a new one below runs/; in Python nothing is kept.
        overwrite: Replace other results in the folder.
        formats: Formats of the figures' files.
        follow: Who follows.

    Raises:
        ScenarioError: The scenario is unknown, or no visual servo.
        CalibrationError: Its camera or target is not accepted, or the robot rests at too few poses.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = campaign_scenario(scenario, Scenario, "a visual servo")
    if poses is not None and poses_from is not None:
        raise CalibrationError("poses: found beside poses_from; accepted: one of them")
    scene, goals = Scene.of(loaded), None
    if poses_from is not None:
        goals = path_poses(scene.robot, poses_from).poses
    count = POSES if poses is None else poses

    def work() -> Fit:
        follow.doing("Choosing poses")
        sent = scene.telling_poses(count) if goals is None else goals
        follow.doing(f"Going to {len(sent)} poses")
        recorded = record(scene, sent)
        calibration = calibrated(scene, recorded, follow.doing)
        return _campaign_fit(scene, recorded, calibration, propose, follow)

    arguments = {
        "verb": "calibrate_campaign", "scenario": loaded, "robot": scene.robot,
        "believed": scene.nominal, "pinhole": scene.pinhole, "poses": goals or count,
        "propose": propose,
    }  # fmt: skip
    return kept_fit(f"campaign-{loaded.name}", arguments, work, folder, overwrite, formats, follow)


def _campaign_fit(
    scene: Scene, recorded: Record, calibration: Calibration, propose: int | None, follow: Follow
) -> Fit:
    """The fit of a campaign, with the servo that believes in it."""
    fit = calibration_fit(calibration)

    def believing(folder: Path) -> Scenario:
        """The servo that believes in the calibrated robot, from its file in a folder."""
        file = folder / BELIEVED_FILE
        file.write_text(dump_typed(fit.model), encoding="utf-8")
        return calibrated_scenario(scene, recorded, calibration, str(file))

    def write(folder: Path) -> None:
        """Writes what is simulated, what is believed, and the scenario, as of every run."""
        write_run_inputs(folder, believing(folder), scene.robot)

    exact = replace(scene.scenario, perturbations=type(scene.scenario.perturbations)())
    with TemporaryDirectory() as place:
        scenarios = {BEFORE: scene.scenario, "calibrated": believing(Path(place)), TRUE: exact}
        trials = in_turn(scenarios, servo, follow, "Servoing")
    if propose is not None:
        fit = with_next_poses(fit, propose, follow.doing)
    errors = point_errors(scene, calibration)
    tables = [
        Table(
            "Points, distance from the true robot, rms", ("points", "before [mm]", "after [mm]"),
            [(f"{points} points",
              *(f"{1e3 * errors[f'{points}_points_{when}_m']:.3g}" for when in ("before", "after")))
             for points in ("exit", "anchor")],
        ),
        Table(
            f"Servo {scene.scenario.name}", ("robot believed in", "outcome", "off line [mm]"),
            [(who, str(row["outcome"]), f"{1e3 * float(row['off_line_m']):.2f}")
             for who, row in trials.items()],
        ),
    ]  # fmt: skip
    campaign = {**errors, "remarks": list(recorded.remarks)}
    return replace(
        fit.with_more(tables, details={"campaign": campaign, "servo": trials}),
        model_file=BELIEVED_FILE, writer=write,
    )  # fmt: skip


def in_turn(
    trials: Mapping[str, S], run: Callable[[S], dict[str, Any]], follow: Follow, what: str
) -> dict[str, dict[str, Any]]:
    """What each trial gives, by the robot that is believed in."""
    results = {}
    for who, trial in trials.items():
        follow.doing(f"{what}, {who}")
        results[who] = run(trial)
    return results


def _tags(scenario: Scenario) -> tuple[dict[int, RigidTransform], dict[int, PointTarget]]:
    target = scenario.target
    if target.kind not in ("tag", "tag_bundle") or not scenario.target_rests():
        raise CalibrationError(
            f"target: found {target.kind}, {'at rest' if scenario.target_rests() else 'moving'}; "
            "accepted: a tag or tag_bundle that rests in the world"
        )
    X_WO = target.pose.transform()
    if target.kind == "tag":
        return {target.tag_id: X_WO}, {target.tag_id: TagTarget(target.tag_id, target.size)}
    poses = {tag.tag_id: X_WO @ tag.pose.transform() for tag in target.tags}
    return poses, {tag.tag_id: TagTarget(tag.tag_id, tag.size) for tag in target.tags}
