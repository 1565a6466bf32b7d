"""What the study runs: turns and drawn starts of a free camera, approaches of ACROBOT."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential, pose_from_angles, pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.systems.controllers.feature_servo import control_step
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

TURNS, FREE, ROBOT = "turns", "free camera", "ACROBOT"
"""What is run."""

SCENARIO = "acrobot_ibvs"
"""Its camera of 640 x 480 px and its four dots, a square of 60 mm."""

VARIANTS: dict[str, tuple[str, ...]] = {
    "ibvs": ("controller.scheme=ibvs",),
    "pbvs": ("controller.scheme=pbvs",),
    "pbvs-line": ("controller.scheme=pbvs-line",),
    "2.5d": ("controller.scheme=2.5d",),
    "partitioned": ("controller.scheme=partitioned",),
    "partitioned, turned": (
        "controller.scheme=partitioned", "controller.partition={goal: turned}",
    ),
    "partitioned, field": (
        "controller.scheme=partitioned", "controller.partition={edge_distance: 40}",
    ),
    "switching": ("controller.scheme=switching",),
}  # fmt: skip
"""Schemes by name; the partition as published, with goals that turn, with a field at the edges."""

DESIRED = 0.15
"""Depth of the dots at the goal, straight ahead [m]."""

LAW = (
    "controller.lambda_0=1", "controller.lambda_infinity=1", "controller.lambda_slope=0",
    f"desired.position=[0, 0, {DESIRED}]",
)  # fmt: skip
"""The same constant gain for all: errors of different units would make adaptive ones differ."""

TURNS_DEG = (*range(15, 180, 15), 179)
"""Turns about the optical axis from the desired pose [deg]; at 180 their sense is a matter of
rounding."""

FREE_TIME, ROBOT_TIME = 15.0, 25.0
"""How long a run may take [s]."""

ARRIVED_DISTANCE, ARRIVED_ANGLE = 1e-3, 0.5
"""Within which a free camera has arrived, after which it may not leave again [m, deg]."""

TILT, TURN = 25.0, 150.0
"""Largest angle of a drawn camera across and about the axis that looks at the dots [deg]."""

NEAREST, FARTHEST = 0.15, 0.5
"""Its depth [m]."""

MIDDLE, SPREAD = (0.15, -0.10, 0.30), (0.12, 0.12, 0.08)
"""Place over the dots from which ACROBOT starts, and how far off along each axis [m]."""

ROBOT_TILT, ROBOT_YAW, TARGET_YAW = 15.0, 25.0, 40.0
"""Largest angles of its start about x and y, and about z, and of the dots [deg]."""

WRONG = (
    "perturbations.exit_points=0.01", "perturbations.anchor_points=0.005",
    "perturbations.camera_pose_shift={distance: 0.01, angle_deg: 3}",
    "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 3}",
)  # fmt: skip
"""What the servo of ACROBOT believes wrongly, in directions that depend on the run's number."""

SEED = 23

PERIOD = 0.04
"""Between two steps of a free camera [s]."""


def measure(case: Case, seed: int) -> dict[str, Any]:
    """A run of a scheme: a turn, or a start with a number.

    Returns:
        arrived; lost: whether the target left the image; time_s: how long it took; image_path_px:
        mean length of the dots' paths in the image; retreat_m: how much farther from the dots the
        camera went than start and goal are; switches, and bound_share: largest share of its bound
        that L_P or L_I reached, of a scheme that switches; room_px: least distance of a dot from
        the image's edges; of turns depths_m and dots_px by step, shape (n,) and (n, 2, 4). Times
        and paths of runs that did not arrive are NaN.
    """
    trial, scheme = case.keys["trial"], case.keys["scheme"]
    if trial == ROBOT:
        return row_of_robot(run_scenario(load_scenario(SCENARIO, robot_overrides(scheme, seed))))
    if trial == TURNS:
        return FreeCamera(scheme).run(turned(case.keys["turn_deg"]), bounded=False)
    row = FreeCamera(scheme).run(free_starts(seed + 1)[seed], bounded=True)
    return {name: value for name, value in row.items() if name not in ("depths_m", "dots_px")}


def robot_overrides(scheme: str, number: int) -> list[str]:
    """What differs from the scenario in a run of ACROBOT."""
    place, angles, yaw = robot_starts(number + 1)[number]
    return [
        *VARIANTS[scheme], *LAW, *WRONG, f"seed={number}", f"duration={ROBOT_TIME}",
        f"initial_pose.position={place}", f"initial_pose.angles_deg={angles}",
        f"target.pose.position={[MIDDLE[0], MIDDLE[1], 0.0]}",
        f"target.pose.angles_deg={[0.0, 0.0, yaw]}", "camera.kind=projected", "log_rate=25",
        "integration.engine=compiled", "integration.loop=compiled",
    ]  # fmt: skip


class FreeCamera:
    """A camera without a robot, which moves as a scheme tells it, and sees without noise."""

    def __init__(self, variant: str) -> None:
        """For one of `VARIANTS`, with the law that the scenario's settings give."""
        self.scenario: Scenario = load_scenario(SCENARIO, [*VARIANTS[variant], *LAW])
        self.target, self.pinhole = seen_by(self.scenario)
        model = servo_model(self.scenario, load_robot(self.scenario.robot))
        # A platform that is its camera, whose cables are never too fast.
        believed = replace(model.believed, X_PC=RigidTransform(), cable_speed=np.inf)
        self.controller: ServoController = make_controller(
            self.scenario, believed, self.target, self.pinhole
        )
        self.X_CdO: RigidTransform = self.scenario.desired.transform()

    def run(self, X_CO: RigidTransform, bounded: bool) -> dict[str, Any]:
        """Its row, see `measure`, with depths of O and dots by step.

        Args:
            X_CO: The dots in the camera at the start [m].
            bounded: Whether a run is lost when a dot leaves the image.
        """
        servo, memory = self.controller, self.controller.fresh_memory()
        poses, modes, lost = [X_CO], [], False
        for k in range(round(FREE_TIME / PERIOD)):
            if np.min((X_CO @ self.target.points)[2]) <= 0.0 or (
                bounded and not self.target.in_view(X_CO, self.pinhole)
            ):
                lost = True
                break
            marks = self.pinhole.project(X_CO @ self.target.points).T.ravel()
            command, memory = control_step(
                servo, memory, (self.target, self.pinhole), (X_CO, marks), RigidTransform(),
                k * PERIOD,
            )  # fmt: skip
            modes.append(servo.mode(memory))
            X_CO = exponential(-PERIOD * command.V_P) @ X_CO
            poses.append(X_CO)
        there = [_is_there(X, self.X_CdO) for X in poses]
        first = len(there) - there[::-1].index(False) if False in there else 0
        arrived = not lost and there[-1]
        mode = np.array(modes) if servo.law.switching is not None else None
        row = measured(poses, self.X_CdO, self.target, self.pinhole)
        return _ended(row, arrived, lost, first * PERIOD, mode)


def _is_there(X_CO: RigidTransform, X_CdO: RigidTransform) -> bool:
    distance, angle = seen_pose_error(X_CO, X_CdO)
    return distance <= ARRIVED_DISTANCE and angle <= np.radians(ARRIVED_ANGLE)


def measured(
    poses: list[RigidTransform], X_CdO: RigidTransform, target: PointTarget, pinhole: Pinhole
) -> dict[str, Any]:
    """Path in the image, retreat, room to the edges, depths, dots; see `measure`."""
    depths = np.array([X.translation()[2] for X in poses])
    p_CK = np.array([X @ target.points for X in poses])
    in_front = np.maximum(p_CK[:, 2:], 1e-6)
    scale = np.array([[pinhole.fx], [pinhole.fy]])
    dots = scale * p_CK[:, :2] / in_front + np.array([[pinhole.cx], [pinhole.cy]])
    path = float(np.mean(np.sum(np.linalg.norm(np.diff(dots, axis=0), axis=1), axis=0)))
    away = np.array([np.linalg.norm(X.translation()) for X in poses])
    retreat = float(np.max(away) - max(away[0], np.linalg.norm(X_CdO.translation())))
    size = np.array([[pinhole.width], [pinhole.height]])
    room = float(np.min([dots + 0.5, size - 0.5 - dots]))
    return {
        "image_path_px": path, "retreat_m": retreat, "room_px": room, "depths_m": depths,
        "dots_px": dots,
    }  # fmt: skip


def _ended(
    row: dict[str, Any], arrived: bool, lost: bool, time: float, mode: Array | None
) -> dict[str, Any]:
    """A row with how its run ended; without times and paths of one that did not arrive."""
    switches, share = _of_mode(mode)
    if not arrived:
        time = row["image_path_px"] = np.nan
    return {
        "arrived": arrived, "lost": lost, "time_s": time, "switches": switches,
        "bound_share": share, **row,
    }  # fmt: skip


def _of_mode(mode: Array | None) -> tuple[float, float]:
    """Switches, and largest share of a bound; NaN of a scheme that does not switch."""
    if mode is None or not len(mode):
        return np.nan, np.nan
    acting = mode[mode[:, 4] > 0.0]
    share = float(np.max(acting[:, 2:4] / acting[:, 4:])) if len(acting) else np.nan
    return float(mode[-1, 1]), share


def row_of_robot(run: RunResult) -> dict[str, Any]:
    """The row of a run of ACROBOT, see `measure`."""
    log, servo = run.log, run.servo
    poses = [
        servo.X_CO(pose_from_row(row), time)
        for row, time in zip(log["X_WP"], log["time"], strict=True)
    ]
    target, pinhole = servo.target, servo.pinhole
    assert isinstance(target, PointTarget)
    row = measured(poses, servo.X_CdO, target, pinhole)
    del row["depths_m"], row["dots_px"]
    return _ended(
        row, run.outcome == Outcome.CONVERGED, run.outcome == Outcome.TARGET_LOST, run.sim_time,
        log.get("servo_mode"),
    )  # fmt: skip


def turned(angle: float) -> RigidTransform:
    """The dots in a camera that is turned about its axis from the desired pose [deg]."""
    X_CdO = load_scenario(SCENARIO, list(LAW)).desired.transform()
    return pose_from_angles(np.zeros(3), np.radians([0.0, 0.0, angle])) @ X_CdO


def seen_by(scenario: Scenario) -> tuple[PointTarget, Pinhole]:
    """Target and camera of a scenario."""
    target = scenario.target.target()
    assert isinstance(target, PointTarget)
    return target, servo_model(scenario, load_robot(scenario.robot)).pinhole


@cache
def free_starts(count: int) -> tuple[RigidTransform, ...]:
    """The first starts of a free camera, which see all dots; the same for all schemes."""
    scenario = load_scenario(SCENARIO, list(LAW))
    target, pinhole = seen_by(scenario)
    goal, random = scenario.desired.transform().rotation(), np.random.default_rng(SEED)
    found: list[RigidTransform] = []
    half = np.array([0.5 * pinhole.width / pinhole.fx, 0.5 * pinhole.height / pinhole.fy])
    while len(found) < count:
        depth = random.uniform(NEAREST, FARTHEST)
        x, y = depth * half * random.uniform(-1.0, 1.0, 2)
        tilt = random.uniform(-TILT, TILT, 2)
        turn = pose_from_angles(np.zeros(3), np.radians([*tilt, random.uniform(-TURN, TURN)]))
        X_CO = RigidTransform(turn.rotation() @ goal, [x, y, depth])
        if target.in_view(X_CO, pinhole):
            found.append(X_CO)
    return tuple(found)


@cache
def robot_starts(count: int) -> tuple[tuple[list[float], list[float], float], ...]:
    """The first starts of ACROBOT, position [m], angles [deg], and the dots' yaw [deg], from which
    the camera would see all dots; the same for all schemes."""
    scenario = load_scenario(SCENARIO, list(LAW))
    target, pinhole = seen_by(scenario)
    X_PC = load_robot(scenario.robot).camera_mount(scenario.camera.mount).pose.transform()
    random = np.random.default_rng(SEED + 1)
    found: list[tuple[list[float], list[float], float]] = []
    while len(found) < count:
        place = np.round(np.array(MIDDLE) + np.array(SPREAD) * random.uniform(-1.0, 1.0, 3), 4)
        limits = np.array([ROBOT_TILT, ROBOT_TILT, ROBOT_YAW])
        angles = np.round(limits * random.uniform(-1.0, 1.0, 3), 2)
        yaw = float(np.round(random.uniform(-TARGET_YAW, TARGET_YAW), 1))
        X_WO = pose_from_angles(np.array([*MIDDLE[:2], 0.0]), np.radians([0.0, 0.0, yaw]))
        X_WP = Pose(position=place, angles_deg=angles).transform()
        if target.in_view((X_WP @ X_PC).inverse() @ X_WO, pinhole):
            found.append((place.tolist(), angles.tolist(), yaw))
    return tuple(found)
