"""A simulated campaign: an excitation is made, gone through and recorded, and the robot identified.

The robot of a scenario carries a payload that its controller does not know, on cables and winches
that are not quite those of its file, or it is believed to be another one, as the scenario says. It
follows the excitation by motor torques on elastic cables; tracker and tension sensors are noisy.
What is found is validated on the scenario's own motion, recorded in the same way, and that motion
is followed again with what was found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.identification_task import (
    Identification,
    IdentificationTask,
    identify,
)
from cdpr_drake.analyses.calibration.identified_robots import (
    dynamic_model,
    identified_robot,
    platform_size,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.runs.log import Log
from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.poses import (
    pose_from_row,
    pose_row,
    pose_rows_distance,
    rotation_from_vector,
)
from cdpr_drake.identification.excitation import Excitation, ExcitationTask, design_excitation
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.regressor import central_parameters
from cdpr_drake.models.materials import OwnMaterial
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.loops.motor_tracking import MotorTracking, TrackingSettings
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

CAMPAIGN_UNKNOWN = ("mass", "center_of_mass", "inertia", "stiffness", "friction", "static_friction")
"""What a campaign seeks where nobody says."""

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


@dataclass(frozen=True, eq=False)
class DynamicCampaign:
    """What a campaign made, recorded and found.

    Attributes:
        scenario: Whose robot was identified, and whose motion validates.
        true: The robot as it is.
        believed: As it was believed.
        found: As it is believed now.
        excitation: The motion that was fitted.
        identification: What was found.
        truth: Dynamics of the true robot.
        logs: What was recorded, as `write_log` takes it, of "excitation" and "validation".
        tracking: Largest and mean distance [m] and angle [rad] from the desired pose on the
            validation motion, by what was believed in.
    """

    scenario: TensionScenario
    true: Robot
    believed: Robot
    found: Robot
    excitation: Excitation
    identification: Identification
    truth: DynamicModel
    logs: dict[str, Log]
    tracking: dict[str, dict[str, float]]

    def as_dict(self) -> dict[str, object]:
        """For JSON, beside what `identification_dict` says."""
        best = self.excitation
        return {
            "campaign": {
                "scenario": self.scenario.name,
                "seed": self.scenario.seed,
                "excitation": {
                    "poses": len(best.trajectory.poses) - 1,
                    "duration_s": best.trajectory.end_time,
                    "log_det_per_time": best.score,
                    "log_det_per_time_of_random_poses": best.first_score,
                    "condition": best.condition,
                },
                "tracking": self.tracking,
            }
        }


def run_dynamic_campaign(
    scenario: TensionScenario,
    unknown: tuple[str, ...] = CAMPAIGN_UNKNOWN,
    say: Callable[[str], None] = lambda words: None,
) -> DynamicCampaign:
    """Makes an excitation, records it, identifies, validates, and tracks again.

    Args:
        scenario: Dynamic control of a robot whose winches have motors.
        unknown: Groups of parameters.
        say: Told what is done now.

    Raises:
        IdentificationError: The robot is of no such kind.
        RobotFileError: Its file does not say enough of the motors.
    """
    random = np.random.default_rng([scenario.seed, 23])
    true, believed = campaign_robots(scenario, random)
    pulleys = scenario.cables.pulleys
    say("Choosing the excitation")
    excitation = design_excitation(excitation_task(scenario, believed), POSES, random, say=say)
    motions = {
        "excitation": excitation.trajectory, "validation": scenario.trajectory.trajectory(),
    }  # fmt: skip
    logs: dict[str, Log] = {}
    for name, motion in motions.items():
        log, _ = follow(scenario, true, believed, motion, _teller(say, name))
        logs[name] = recorded(log, random)
    task = IdentificationTask(
        robot=believed, unknown=unknown, bandwidth=BANDWIDTH, pulleys=pulleys,
        sigma_lengths=SIGMA_LENGTHS,
    )  # fmt: skip
    read = {name: as_read(Path(f"{name}.csv"), log) for name, log in logs.items()}
    identification = identify(task, read["excitation"], read["validation"], say)
    found, _ = identified_robot(believed, identification.result)
    tracking = {}
    for who, robot in (("believed before", believed), ("identified", found), ("true", true)):
        log, failures = follow(
            scenario, true, robot, motions["validation"],
            _teller(say, f"tracking, {who}"),
        )  # fmt: skip
        distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_desired"])
        tracking[who] = {
            "largest_m": float(np.max(distance)), "mean_m": float(np.mean(distance)),
            "largest_rad": float(np.max(angle)), "mean_rad": float(np.mean(angle)),
            "infeasible_steps": float(failures),
        }  # fmt: skip
    return DynamicCampaign(
        scenario, true, believed, found, excitation, identification, dynamic_model(true), logs,
        tracking,
    )  # fmt: skip


def _teller(say: Callable[[str], None], what: str) -> Callable[[float], None]:
    """Says how far a motion is."""
    return lambda time: say(f"{what}, {time:.0f} s")


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
    point = np.outer(np.append(place, 1.0), np.append(place, 1.0))
    second = load * point[:3, :3]
    spread = np.trace(second) * np.eye(3) - second
    pi = model.inertial() + np.concatenate(
        [[load], load * place, np.diag(spread), [spread[0, 1], spread[0, 2], spread[1, 2]]]
    )
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


def follow(
    scenario: TensionScenario,
    true: Robot,
    believed: Robot,
    motion: PoseTrajectory,
    tell: Callable[[float], None] = lambda time: None,
) -> tuple[Log, int]:
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
        tell(time)
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


def as_read(path: Path, log: Log) -> Measurements:
    """A recorded log as `read_log` gives it from a file."""
    count = len(log["time"])
    if count < 2:
        raise IdentificationError(f"{path}: found {count} rows; accepted: a motion")
    return Measurements(
        path, count, np.asarray(log["time"]), lengths=np.asarray(log["measured_lengths"]),
        tensions=np.asarray(log["measured_tensions"]),
        poses=[pose_from_row(row) for row in log["X_WP"]],
        torques=np.asarray(log["applied_torques"]),
    )  # fmt: skip
