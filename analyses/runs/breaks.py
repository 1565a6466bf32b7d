"""What becomes of a platform after a cable broke: how far it goes, how fast, and until when.

And the reactions that are compared by that:

* none: nobody knows;
* stop: brakes of all winches close, `BRAKE` after they are told;
* redistribute: the cables that are left are asked to hold the platform where it is;
* found: the same, when lengths and tensions have told;
* continue: the same, but on to the goal;
* brake: only motion is to end, with least kinetic energy;
* retreat: to the nearest pose that the cables left hold;
* descend: straight down to the ground.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.analyses.runs.log import Log
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import wrench_balance
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus

BRAKE = 0.03
"""Time that brakes take to close [s]."""

NONE, STOP, REDISTRIBUTE, FOUND = "none", "stop", "redistribute", "found"
CONTINUE, BRAKING, RETREAT, DESCEND = "continue", "brake", "retreat", "descend"

SAVING = (STOP, REDISTRIBUTE, BRAKING, RETREAT, DESCEND)
"""Those that need neither a detector nor a goal of a servo, see `workspaces.break_survival`."""

DEFAULT_SAVING = SAVING[:4]
"""Those of them that do not go to the ground."""

RESTS = (0.005, 0.05)
"""Speeds below which the platform is at rest [m/s, rad/s]."""


def after_break(
    log: Log, robot: Robot, cable: int, time: float, pulleys: bool = True
) -> dict[str, Any]:
    """What a run did after a break.

    Args:
        log: Of the run; rows at one rate.
        robot: Its robot.
        cable: Which broke.
        time: When [s].
        pulleys: Whether the cables of the run were over the robot's pulleys.

    Returns:
        speed_m_s, that of the platform when the cable broke; excursion_m and turn_rad, the largest
        from its pose then; largest_speed_m_s; leaves, whether an anchor point left the frame or
        went into the ground, and impact_m_s, the speed then, 0 without; tension_n, the largest;
        slack_s, seconds that cables which are left were slack; rest_s, time until at rest, or until
        the run ended; holds, whether tensions that only pull hold the pose without the cable.
    """
    # A row holds what stood there before its instant.
    since = log["time"] >= time - 0.5 * float(log["time"][1] - log["time"][0])
    X_WP, times = log["X_WP"][since], log["time"][since]
    distance, angle = pose_rows_distance(X_WP, np.broadcast_to(X_WP[0], X_WP.shape))
    speed, turning = speeds(X_WP, times)
    out = np.flatnonzero(leaves(robot, X_WP))
    left = np.arange(len(robot.cables)) != cable
    slack = log["slack"][since][:, left]
    return {
        "speed_m_s": float(speed[0]),
        "excursion_m": float(np.max(distance)),
        "turn_rad": float(np.max(angle)),
        "largest_speed_m_s": float(np.max(speed)),
        "leaves": bool(len(out)),
        "impact_m_s": float(speed[out[0]]) if len(out) else 0.0,
        "tension_n": float(np.max(log["tensions"][since])),
        "slack_s": float(np.sum(slack[:-1] * np.diff(times)[:, np.newaxis])),
        "rest_s": rest_time(times - times[0], speed, turning),
        "holds": holds_without(robot, X_WP[0], cable, pulleys),
    }


def speeds(X_WP: Array, times: Array) -> tuple[Array, Array]:
    """Speeds of Po [m/s] and of turning [rad/s] over rows of poses, shape (n, 7), at times [s]."""
    speed = np.linalg.norm(np.gradient(X_WP[:, 4:], times, axis=0), axis=1)
    _, angles = pose_rows_distance(X_WP[1:], X_WP[:-1])
    turning = angles / np.diff(times)
    return speed, np.append(turning, turning[-1])


def leaves(robot: Robot, X_WP: Array) -> np.ndarray:
    """Whether an anchor point is outside the frame or in the ground, of rows of poses."""
    p_PB = robot.cable_set().p_PB
    low, high = robot.frame.bounds()
    found = []
    for row in X_WP:
        p_WB = pose_from_row(row) @ p_PB
        found.append(bool(np.any(p_WB < low[:, np.newaxis]) or np.any(p_WB > high[:, np.newaxis])))
    return np.array(found)


def rest_time(times: Array, speed: Array, turning: Array) -> float:
    """When the platform comes to rest for good [s]; the last time where it does not."""
    moves = np.flatnonzero((speed > RESTS[0]) | (turning > RESTS[1]))
    last = int(moves[-1]) + 1 if len(moves) else 0
    return float(times[min(last, len(times) - 1)])


def holds_without(robot: Robot, row: Array, cable: int, pulleys: bool = True) -> bool:
    """Whether tensions from zero to the upper limit hold a pose without a cable."""
    balance = wrench_balance(robot, pose_from_row(row), cables=robot.cable_set(pulleys))
    lower, upper = np.zeros_like(balance.upper), balance.upper.copy()
    upper[cable] = 0.0
    problem = TensionProblem(balance.W, balance.wrench, lower, upper, None, balance.row_scale)
    return distribute(problem).status == TensionStatus.FEASIBLE
