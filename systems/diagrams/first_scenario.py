"""A first scenario for a robot: poses that its cables hold taut, a target that its camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.cameras.camera_settings import CameraSettings, servo_pinhole
from cdpr_drake.systems.cameras.targets import TargetSettings
from cdpr_drake.systems.diagrams.load import check_robot_motion
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.tensions.methods import exact_tensions

FACING = np.array([180.0, 0.0, 180.0])
"""Desired angles of the target in the camera: face on [deg]."""

DEPTH_SHARE = 0.2
"""Desired depth of the target, as a share of the frame's narrower horizontal side."""

IMAGE_SHARE = 0.5
"""Height of the tag in the desired image, as a share of the image's. The noise of a pose that is
measured on a smaller tag makes the servo shake the cables slack."""

SIDEWAYS = np.array([0.5, 0.35, -0.35])
"""Displacement of the start from the goal in camera axes, as a share of the depth."""

TURN_DEG = np.array([4.0, -3.0, 8.0])
"""Rotation of the start against the goal [deg]."""

STRETCHES = (1.0, 0.7, 0.5, 0.3, 0.15, 0.05)
"""Shares of that displacement and rotation that are tried, the largest first."""

RESERVE_SHARE = 0.1
"""Force that a pose must hold besides the weight, as a share of it."""

TAUT_SHARE = 0.05
"""Least tension of a taut cable above the robot's lower bound, as a share of the weight."""

ACCELERATION = 0.5
"""Acceleration of a trajectory [m/s^2], so that its inertial forces stay below a tenth of g."""


def first_scenario(robot: Robot, name: str, reference: str) -> tuple[dict[str, Any], list[str]]:
    """A scenario of a robot as keys of its file, and remarks on it.

    With a camera on the platform it is a visual servo, which starts from a pose at which all
    cables are taut. Without one the platform follows a trajectory by computed torque.

    Args:
        robot: The robot.
        name: Name of the scenario.
        reference: Name or path of the robot, as the file shall have it.

    Raises:
        RobotFileError, ScenarioError: Scenarios do not take robots of this kind, or its cables
            hold the platform at no pose that was tried.
    """
    check_robot_motion(robot, "a scenario")
    reserve = TAUT_SHARE * robot.platform.mass * robot.gravity
    low, high = robot.tension_limits()
    taut = min(max(low, _digits(low + reserve)), 0.5 * (low + high))
    goal = _goal(robot, taut)
    mounts = [mount for mount in robot.cameras if mount.parent == "platform"]
    head: dict[str, Any] = {"name": name, "robot": reference}
    if mounts:
        servo, remarks = _visual_servo(robot, goal, taut)
        return head | servo, remarks
    words = (
        f"{robot.name}: has no camera on its platform, so the platform follows a trajectory by "
        "computed torque; a visual servo needs the section cameras in the robot's file (cdpr "
        "schema robot describes it)"
    )
    return {"kind": TENSION_CONTROL} | head | _tracking(robot, goal, taut), [words]


REFUSED, HELD, RESERVE, TIGHTENED, TAUT = range(5)
"""How well cables hold a pose: not at all; at rest; also against a force of `RESERVE_SHARE` of the
weight along each axis of W; with all cables taut, if they are tightened; as a run begins."""


def _held(robot: Robot, X_WP: RigidTransform, taut: float) -> int:
    cables = robot.cable_set()
    try:
        at_start = hold_robot(robot, X_WP, cables, "elastic").tensions
    except CdprError:
        return REFUSED
    force = RESERVE_SHARE * robot.platform.mass * robot.gravity
    low, high = robot.tension_limits()
    best = HELD
    for level, limits in ((RESERVE, (low, high)), (TIGHTENED, (taut, high))):
        for push in np.vstack([np.zeros(3), force * np.eye(3), -force * np.eye(3)]):
            wrench = np.concatenate([np.zeros(3), push])
            problem = tension_problem(robot, X_WP, wrench, limits=limits, cables=cables)
            if exact_tensions(problem) is None:
                return best
        best = level
    return TAUT if np.min(at_start) >= taut else best


def _goal(robot: Robot, taut: float) -> RigidTransform:
    """The home pose, or a pose of a coarse grid that the cables hold better."""
    home = robot.home.transform()
    best, most = home, _held(robot, home, taut)
    low, high = robot.reach()
    for shares in product((0.5, 0.35, 0.65), repeat=3) if most < TIGHTENED else ():
        X_WP = RigidTransform(home.rotation(), np.round(low + shares * (high - low), 3))
        level = _held(robot, X_WP, taut)
        if level > most:
            best, most = X_WP, level
    if most == REFUSED:
        raise ScenarioError(
            f"{robot.name}: found no pose, at home or on a grid through its frame, at which "
            f"tensions within {_bounds(robot)} N hold the platform; accepted: a robot that holds "
            "its platform (cdpr static says what is missing)"
        )
    return best


@dataclass(frozen=True)
class _Start:
    """A pose beside the goal, and the one halfway to it."""

    pose: Pose
    halfway: Pose


def _starts(robot: Robot, goal: RigidTransform, R_WC: Array, depth: float) -> list[_Start]:
    """Poses displaced from the goal that the platform can have, far and turned ones first."""

    def beside(shift: Array, turn_deg: Array) -> Pose:
        turn = Pose(position=np.zeros(3), angles_deg=turn_deg).transform().rotation()
        X_WP = RigidTransform(turn @ goal.rotation(), goal.translation() + R_WC @ shift)
        return _rounded(robot.joint().nearest(X_WP))

    found = []
    for share, turned, x, y in product(STRETCHES, (1.0, 0.0), (1.0, -1.0), (1.0, -1.0)):
        shift, turn = share * depth * SIDEWAYS * [x, y, 1.0], share * turned * TURN_DEG
        found.append(_Start(beside(shift, turn), beside(0.5 * shift, 0.5 * turn)))
    return found


def _best_start(robot: Robot, starts: Sequence[_Start], taut: float) -> tuple[Pose, int]:
    """The first start from which the way to the goal is held best, and how well."""
    best, most = None, REFUSED
    for start in starts:
        level = _held(robot, start.pose.transform(), taut)
        if level > most:  # else the pose halfway makes it no better
            level = min(level, _held(robot, start.halfway.transform(), taut))
        if level > most:
            best, most = start.pose, level
        if most == TAUT:
            break
    if best is None:
        raise ScenarioError(
            f"{robot.name}: found no pose beside the goal at which tensions within "
            f"{_bounds(robot)} N hold the platform; accepted: a robot that holds its platform in a "
            "part of its frame, not at single poses"
        )
    return best, most


def _visual_servo(
    robot: Robot, goal: RigidTransform, taut: float
) -> tuple[dict[str, Any], list[str]]:
    mount = next(mount for mount in robot.cameras if mount.parent == "platform")
    camera = load_camera(mount.model)
    X_WC = goal @ mount.pose.transform()
    depth = _depth(robot, X_WC)
    size = _digits(
        IMAGE_SHARE * 2.0 * depth * np.tan(0.5 * np.radians(camera.view_angle_vertical_deg))
    )
    desired = Pose(position=np.array([0.0, 0.0, depth]), angles_deg=FACING)
    tag = _rounded(X_WC @ desired.transform())
    target = TargetSettings(size=size, pose=tag).target()
    pinhole = servo_pinhole(CameraSettings(mount=mount.name), robot)
    seen = [
        start
        for start in _starts(robot, goal, X_WC.rotation().matrix(), depth)
        if target.in_view(
            (start.pose.transform() @ mount.pose.transform()).inverse() @ tag.transform(), pinhole
        )
    ]
    if not seen:
        raise ScenarioError(
            f"{robot.name}: cameras: found {mount.name}, which sees a target at {depth:g} m from "
            "no pose beside the goal; accepted: a camera that looks away from the platform"
        )
    start, level = _best_start(robot, seen, taut)
    remarks = []
    if level < TAUT:
        remarks.append(
            f"{robot.name}: cables may be slack at the start, below the {taut:g} N of "
            "tension_management.threshold, which then tightens them; a run starts with the least "
            f"tensions within the robot's tension_bounds, {_bounds(robot)} N: a higher lower bound "
            "in its file starts it taut"
        )
    rate = min(25.0, camera.rate_hz)
    pulleys = {"pulleys": True} if robot.cable_set().has_pulleys() else {}
    return {
        "duration": 60.0,
        "expected": {"outcome": "converged"},
        "initial_pose": _keys(start),
        "desired": _keys(desired),
        "target": {"tag_id": 0, "size": size, "pose": _keys(tag)},
        "camera": {"kind": "rendered", "mount": mount.name, "rate": rate},
        "controller": {
            "scheme": "pbvs", "rate": rate, "lambda_0": 1.0, "lambda_infinity": 0.3,
            "lambda_slope": 10.0, "sigma": 4.0, **pulleys,
        },
        "estimator": {"kind": "control_integration"},
        "tension_management": {"kind": "constant", "threshold": [taut]},
        "stop": {
            "position": _digits(depth / 300.0), "rotation_deg": 0.5, "hold": 0.5,
            "target_lost": 2.0,
        },
        **({"cables": pulleys} if pulleys else {}),
    }, remarks  # fmt: skip


def _tracking(robot: Robot, goal: RigidTransform, taut: float) -> dict[str, Any]:
    """Computed torque from a pose beside the goal to the goal and back."""
    low, high = robot.reach()
    reach = DEPTH_SHARE * float(np.min((high - low)[:2]))
    start, _ = _best_start(robot, _starts(robot, goal, np.eye(3), reach), taut)
    distance = float(np.linalg.norm(start.transform().translation() - goal.translation()))
    seconds = max(2.0, float(np.ceil(np.sqrt(6.0 * distance / ACCELERATION))))
    cables = {"cables": {"pulleys": True}} if robot.cable_set().has_pulleys() else {}
    return {
        "duration": 2.0 * seconds + 2.0,
        "expected": {"outcome": "completed"},
        "trajectory": {
            "start": _keys(start),
            "pause": 0.5,
            "stretches": [
                {"pose": _keys(_rounded(goal)), "duration": seconds},
                {"pose": _keys(start), "duration": seconds},
            ],
        },
        "controller": {"rate": 1000.0, "stiffness": 100.0, "damping": 20.0},
        "distribution": {
            "method": "quadratic_program", "limits": [float(x) for x in robot.tension_limits()],
        },
        **cables,
    }  # fmt: skip


def _depth(robot: Robot, X_WC: RigidTransform) -> float:
    """Desired depth of the target: no deeper than the floor, where the camera looks down [m]."""
    low, high = robot.reach()
    depth = DEPTH_SHARE * float(np.min((high - low)[:2]))
    down = -float(X_WC.rotation().matrix()[2, 2])
    if down > 0.5:
        above = (float(X_WC.translation()[2]) - float(robot.frame.lower[2])) / down
        depth = min(depth, above) if above > 0.1 * depth else depth
    return _digits(depth)


def _digits(value: float) -> float:
    """Two significant digits, rounded."""
    return float(f"{value:.2g}")


def _rounded(X_WP: RigidTransform) -> Pose:
    """A pose as one writes it: to 0.1 mm and 0.01 degrees."""
    angles = np.degrees(angles_from_rotation(X_WP.rotation()))
    return Pose(
        position=np.round(X_WP.translation(), 4) + 0.0, angles_deg=np.round(angles, 2) + 0.0
    )


def _keys(pose: Pose) -> dict[str, list[float]]:
    keys = {"position": pose.position.tolist(), "angles_deg": pose.angles_deg.tolist()}
    return keys if np.any(pose.angles_deg) else {"position": keys["position"]}


def _bounds(robot: Robot) -> str:
    low, high = robot.tension_limits()
    return f"{low:g} to {high:g}"
