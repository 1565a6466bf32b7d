"""An identification shown in simulation: the verb `identify_campaign`.

The robot of a scenario carries a payload that its controller does not know, on cables and winches
that are not quite those of its file, or it is believed to be another one, as the scenario says. It
follows an excitation by motor torques on elastic cables; tracker and tension sensors are noisy.
The identified robot is validated on the scenario's own motion, recorded in the same way, and
follows that motion again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.campaign import BEFORE, TRUE, campaign_scenario, in_turn
from cdpr_drake.analyses.fits.dynamics import (
    IdentificationTask,
    fit_dynamics,
    identified_robot,
)
from cdpr_drake.analyses.fits.fit import ROBOT, Fit, Groups, group_names, kept_fit
from cdpr_drake.analyses.fits.identification import identification_fit
from cdpr_drake.analyses.fits.robots import schema_pose
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    OutFolder,
    ScenarioWord,
    Switch,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE
from cdpr_drake.analyses.runs.log import Log, column_names
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.poses import (
    pose_from_row,
    pose_row,
    pose_rows_distance,
    rotation_from_vector,
)
from cdpr_drake.identification.excitation import ExcitationTask, design_excitation
from cdpr_drake.identification.regressor import central_parameters, six_of
from cdpr_drake.models.cable_schema import OwnMaterial
from cdpr_drake.models.robot_dynamics import dynamic_model, platform_size
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.loops.motor_tracking import MotorTracking, TrackingSettings
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import Stretch, TensionScenario
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNKNOWN = ("mass", "center_of_mass", "inertia", "stiffness", "friction", "static_friction")
"""Groups that a campaign identifies by default."""

TRUE_FILE, SCENARIO_FILE = "true_robot.yaml", "scenario.yaml"
"""Files of a campaign's folder: the robot as it is, and the excitation as a scenario."""

IDENTIFIED = "identified"
"""The identified robot among those that a trial believes in."""

PAYLOAD_SHARE = 0.25
"""Mass of the unknown payload over the platform's."""

AS_MOUNTED, RETARDATION = 0.01, 0.002
"""Stiffness of cables as they are mounted, over that of their fibres, and their damping [s], as in
the scenario acrobot_torque_servo: ropes, pulleys' mounts and sensors give."""

STIFFNESS_SPREAD, FRICTION_SPREAD = 0.25, 0.4
"""True stiffness and friction are drawn within these shares about the believed ones."""

LOG_RATE, BANDWIDTH = 250.0, 8.0
"""Rows per second of what is recorded, and smoothing [Hz]."""

SIGMA_TENSIONS, SIGMA_PLACE, SIGMA_TURN, SIGMA_LENGTHS = 0.2, 1e-4, 2e-4, 1e-5
"""Noise of tension sensors [N], of a tracker [m, rad] and of encoders [m]."""

STEP = 2.5e-4
"""Of the simulation [s]."""

POSES, SHORTEST = 14, 0.5
"""Poses of an excitation, and the least time from one to the next [s]."""

BOX_SHARE, TURN = 0.35, 0.35
"""Half the box of an excitation over that of the frame, about home's place in the plane, and turns
[rad]."""

RESERVE = 0.15
"""Share of the limits of tensions that an excitation leaves to feedback, over the weight."""

ACCELERATION = 15.0
"""Largest acceleration of cables [m/s^2]."""


@verb()
def identify_campaign(
    scenario: ScenarioWord, *, unknown: Groups = UNKNOWN, folder: OutFolder = None,
    overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Identifies a scenario's robot with an unknown payload in simulation, and tracks again.

    It follows the excitation that tells most, is identified from what tracker, tension sensors and
    winches record, and follows the scenario's own motion again. Writes what identify writes, logs
    that identify reads, the true and the believed robot, and the excitation as scenario.yaml.

    Args:
        scenario: Dynamic control of a robot whose winches have motors.
        unknown: Groups of parameters.
        folder: Results folder; default: runs/identify-campaign-SCENARIO; in Python nothing is kept.
        overwrite: Replace results in the folder.
        formats: Formats of the figures.
        follow: Who follows the work.

    Raises:
        ScenarioError: The scenario is unknown, or of another kind.
        IdentificationError: The robot is of no such kind.
        RobotFileError: Its file does not say enough of the motors.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = campaign_scenario(scenario, TensionScenario, "a scenario of tension_control")
    groups = group_names(unknown)
    file = loaded.perturbations.believed_robot
    arguments = {
        **TensionRun(loaded).arguments(),
        "verb": "identify_campaign",
        "unknown": groups,
        "believed": None if file is None else load_robot(file),
    }

    return kept_fit(
        f"identify-campaign-{loaded.name}", arguments,
        lambda: simulate_campaign(loaded, groups, follow), folder, overwrite, formats, follow,
    )  # fmt: skip


def simulate_campaign(
    scenario: TensionScenario, unknown: tuple[str, ...] = UNKNOWN, follow: Follow = NOBODY
) -> Fit:
    """Designs an excitation, records it, identifies, validates, and tracks again.

    `Fit.details` has distances from the desired pose by the robot that is believed in.

    Raises:
        IdentificationError: The robot is of no such kind.
        RobotFileError: Its file does not say enough of the motors.
    """
    random = np.random.default_rng([scenario.seed, 23])
    true, believed = campaign_robots(scenario, random)
    follow.doing("Choosing the excitation")
    excitation = design_excitation(
        excitation_task(scenario, believed), POSES, random, say=follow.doing
    )
    own = scenario.trajectory.trajectory()
    logs: dict[str, Log] = {}
    for name, motion in {"excitation": excitation.trajectory, "validation": own}.items():
        log, _ = _track(scenario, true, believed, motion, follow, name)
        logs[name] = recorded(log, random)
    task = IdentificationTask(
        robot=believed, unknown=unknown, pulleys=scenario.cables.pulleys,
        sigma_lengths=SIGMA_LENGTHS,
    )  # fmt: skip
    excited, validation = (_as_read(Path(f"{name}.csv"), log) for name, log in logs.items())
    identification = fit_dynamics(task, excited, validation, follow.doing, BANDWIDTH)
    identified, _ = identified_robot(believed, identification.result)

    def errors(robot: Robot) -> dict[str, float]:
        """Distances [m] and angles [rad] from the desired pose on the scenario's own motion."""
        log, failures = _track(scenario, true, robot, own, follow, "tracking")
        distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        return {
            "largest_m": float(np.max(distance)), "mean_m": float(np.mean(distance)),
            "largest_rad": float(np.max(angle)), "mean_rad": float(np.mean(angle)),
            "infeasible_steps": float(failures),
        }  # fmt: skip

    robots = {BEFORE: believed, IDENTIFIED: identified, TRUE: true}
    tracking = in_turn(robots, errors, follow, "Tracking")

    def write(folder: Path) -> None:
        """Writes the logs."""
        names = [cable.name for cable in true.cables]
        for name, log in logs.items():
            columns = column_names(log, {"cables": names})
            table = np.column_stack(list(log.values())).T
            write_columns(folder / f"{name}.csv", dict(zip(columns, table, strict=True)))

    table = Table(
        f"Tracking of {scenario.name}, not fitted",
        ("robot believed in", "largest [mm]", "mean [mm]", "largest [deg]", "mean [deg]"),
        [(who, *(f"{1e3 * row[f'{which}_m']:.3f}" for which in ("largest", "mean")),
          *(f"{np.degrees(row[f'{which}_rad']):.3f}" for which in ("largest", "mean")))
         for who, row in tracking.items()],
    )  # fmt: skip
    motion = excitation.trajectory
    numbers = {
        "scenario": scenario.name, "seed": scenario.seed, "tracking": tracking,
        "excitation": {
            "poses": len(motion.poses) - 1, "duration_s": motion.end_time,
            "log_det_per_time": excitation.score,
            "log_det_per_time_of_random_poses": excitation.first_score,
            "condition": excitation.condition,
        },
    }  # fmt: skip
    fit = identification_fit(identification, dynamic_model(true)).with_more(
        [table], details={"campaign": numbers},
        drawings={"tracking": lambda: _tracking_figure(scenario.name, tracking)},
        texts={
            TRUE_FILE: dump_typed(true), BELIEVED_FILE: dump_typed(believed),
            SCENARIO_FILE: dump_typed(_excitation_scenario(scenario, motion)),
        },
    )  # fmt: skip
    return replace(fit, writer=write)


def _excitation_scenario(own: TensionScenario, motion: PoseTrajectory) -> TensionScenario:
    """The excitation as a scenario of the true robot, believed to be the identified one."""
    poses = list(map(schema_pose, motion.poses))
    trajectory = replace(
        own.trajectory, start=poses[0], pause=motion.start_time, file=None,
        stretches=[
            Stretch(pose=pose, duration=duration)
            for pose, duration in zip(poses[1:], motion.durations, strict=True)
        ],
    )  # fmt: skip
    return replace(
        own, name="excitation", title=f"Excitation for the robot of {own.name}", robot=TRUE_FILE,
        duration=motion.end_time + 0.2, trajectory=trajectory,
        perturbations=replace(own.perturbations, believed_robot=ROBOT),
    )  # fmt: skip


def campaign_robots(scenario: TensionScenario, random: np.random.Generator) -> tuple[Robot, Robot]:
    """The robot as it is, and as it is believed to be.

    Where the scenario does not say what is believed, its robot is, on cables as mounted; the true
    one has a point mass in its platform's box, and other stiffness and friction.
    """
    file = scenario.perturbations.believed_robot
    own = load_robot(scenario.robot)
    if file is not None:
        return own, load_robot(file)
    material = replace(
        own.cable, youngs_modulus=AS_MOUNTED * own.cable.youngs_modulus,
        retardation_time=RETARDATION,
    )  # fmt: skip
    believed = replace(own, cable=material)
    model = dynamic_model(believed)
    load = PAYLOAD_SHARE * model.mass
    place = believed.box_center() + 0.5 * believed.platform.size * random.uniform(-1.0, 1.0, 3)
    second = load * np.outer(place, place)
    spread = np.trace(second) * np.eye(3) - second
    pi = model.inertial() + np.concatenate([[load], load * place, six_of(spread)])
    mass, center, inertia = central_parameters(pi)
    cables = []
    for cable in believed.cables:
        modulus = material.youngs_modulus * (1.0 + STIFFNESS_SPREAD * random.uniform(-1.0, 1.0))
        own_material = replace(cable.material or OwnMaterial(), youngs_modulus=float(modulus))
        cables.append(replace(cable, material=own_material))
    winch = believed.winch
    if winch.friction is not None:
        share = 1.0 + FRICTION_SPREAD * random.uniform(-1.0, 1.0)
        friction = replace(
            winch.friction, coulomb=share * winch.friction.coulomb,
            static=share * winch.friction.static, viscous=share * winch.friction.viscous,
        )  # fmt: skip
        winch = replace(winch, friction=friction)
    platform = replace(believed.platform, mass=float(mass), center_of_mass=center, inertia=inertia)
    return replace(believed, platform=platform, cables=cables, winch=winch), believed


def excitation_task(scenario: TensionScenario, believed: Robot) -> ExcitationTask:
    """Limits of an excitation of a robot, about its home pose."""
    home = believed.home.transform()
    lower, upper = np.array(believed.frame.lower), np.array(believed.frame.upper)
    middle = np.array(home.translation())
    middle[2] = 0.4 * (lower[2] + upper[2])
    half = 0.5 * BOX_SHARE * (upper - lower)
    low, high = believed.tension_limits(scenario.limits())
    weight = believed.platform.mass * believed.gravity
    kept = RESERVE * min(weight, high - low)
    cables = believed.cable_set()
    return ExcitationTask(
        cables=cables if scenario.cables.pulleys else cables.without_pulleys(),
        inertial=dynamic_model(believed).inertial(), gravity=believed.gravity_vector(),
        start=RigidTransform(home.rotation(), middle), lower=middle - half, upper=middle + half,
        turn=TURN, tensions=(low + kept, high - kept),
        cable_speed=0.8 * believed.winch.rated_cable_speed(), cable_acceleration=ACCELERATION,
        shortest=SHORTEST, size=platform_size(believed),
    )  # fmt: skip


def _track(
    scenario: TensionScenario, true: Robot, believed: Robot, motion: PoseTrajectory,
    follow: Follow, what: str,
) -> tuple[Log, int]:  # fmt: skip
    """A robot follows a motion by motor torques: its true log, and steps without tensions."""
    settings = TrackingSettings(
        gains=scenario.controller.gains(),
        torque=TorqueControl(
            rate=scenario.controller.rate, method=scenario.distribution.method,
            limits=np.array(true.tension_limits(scenario.limits())),
        ),
        simulated=CableRobotSettings(
            cables=CableSettings(pulleys=scenario.cables.pulleys),
            winches=WinchSettings(kind="motor", mode="torque"),
        ),
        rule=StepRule(max_step=STEP),
    )  # fmt: skip
    loop = MotorTracking(true, believed, motion, settings)

    def told(time: float) -> bool:
        follow.doing(f"{what}, {time:.0f} s")
        return True

    return loop.run(motion.end_time + 0.2, LOG_RATE, told), loop.failures


def recorded(log: Log, random: np.random.Generator) -> dict[str, Array]:
    """What sensors record of a true log: names of their columns are those of `write_log`."""
    poses = []
    for row in log["X_WP"]:
        X = pose_from_row(row)
        turn = rotation_from_vector(SIGMA_TURN * random.standard_normal(3))
        place = X.translation() + SIGMA_PLACE * random.standard_normal(3)
        poses.append(pose_row(RigidTransform(turn @ X.rotation(), place)))

    def noisy(name: str, sigma: float) -> Array:
        return np.asarray(log[name] + sigma * random.standard_normal(log[name].shape))

    return {
        "time": log["time"],
        "X_WP": np.array(poses),
        "measured_tensions": noisy("measured_tensions", SIGMA_TENSIONS),
        "measured_lengths": noisy("unstrained_lengths", SIGMA_LENGTHS),
        "applied_torques": log["applied_torques"],
    }


def _as_read(path: Path, log: Log) -> Measurements:
    """A recorded log as it is read from a file."""
    count = len(log["time"])
    if count < 2:
        raise IdentificationError(f"{path}: found {count} rows; accepted: a motion")
    return Measurements(
        path, count, np.asarray(log["time"]), lengths=np.asarray(log["measured_lengths"]),
        tensions=np.asarray(log["measured_tensions"]),
        poses=[pose_from_row(row) for row in log["X_WP"]],
        torques=np.asarray(log["applied_torques"]),
    )  # fmt: skip


def _tracking_figure(name: str, tracking: Mapping[str, Mapping[str, float]]) -> Figure:
    """Mean and largest errors of tracking, by the robot that is believed in."""
    from cdpr_drake.analyses.frame.figures import bars, new_figure

    figure, panels = new_figure(
        1, 2, (12.0, 5.0), f"Tracking of {name}, a motion that was not fitted"
    )
    units = (("m", 1e3, "distance [mm]"), ("rad", 180.0 / np.pi, "angle [deg]"))
    for panel, (key, scale, label) in zip(panels, units, strict=True):
        heights = {
            which: [scale * row[f"{which}_{key}"] for row in tracking.values()]
            for which in ("mean", "largest")
        }
        bars(panel, list(tracking), heights)
        panel.set_yscale("log")
        panel.set(ylabel=label, xlabel="robot believed in")
    panels[0].legend()
    return figure
