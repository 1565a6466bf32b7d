"""What the compiled motion of a robot is made of: rule, memory, state at rest, what went wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics import (
    IDEAL,
    LOST,
    METHODS,
    MOTORS,
    Drive,
    reach_explicitly,
    reach_semi_implicitly,
)
from cdpr_drake.errors import CableGeometryError, CdprError, DivergedError
from cdpr_drake.geometry import CableSet, cable_paths, impossible_cable
from cdpr_drake.models import Robot, pose_from_state
from cdpr_drake.spatial import pose_row
from cdpr_drake.winches import MODES, resting_motors


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """How a compiled robot is integrated.

    Attributes:
        method: A name of `dynamics.METHODS`.
        max_step: Largest step [s].
        accuracy: Largest estimated error of a step in position [m] and rotation [rad]; steps are
            halved to keep it. None: steps are as long as `max_step` whatever their error.
    """

    method: str = "runge_kutta3"
    max_step: float = 1e-4
    accuracy: float | None = None


class PackedRule:
    """A `StepRule` as the kernels take it.

    Attributes:
        rule: The rule.
        reach: The kernel that goes by its method.
        numbers: Its numbers for that.
    """

    def __init__(self, rule: StepRule) -> None:
        self.rule = rule
        self.reach = reach_semi_implicitly if rule.method == "semi_implicit" else reach_explicitly
        bound = np.inf if rule.accuracy is None else rule.accuracy
        self.numbers = np.array([float(METHODS[rule.method]), rule.max_step, bound])


def packed_rule(rule: StepRule, drive: Drive) -> PackedRule:
    """A rule as the kernels take it, for what drives the cables.

    Raises:
        CdprError: Motors with several cables each by the semi-implicit method, whose matrix takes
            each motor to answer to one cable.
    """
    shared = drive.kind == MOTORS and drive.groups is not None and drive.groups.are_shared()
    if shared and rule.method == "semi_implicit":
        raise CdprError(
            "integrator: found semi_implicit for motors with several cables on one winch; "
            "accepted: runge_kutta3, runge_kutta2, or ideal winches"
        )
    return PackedRule(rule)


def resting_state(
    robot: Robot,
    drive: Drive,
    X_WP: RigidTransform,
    lengths: Array,
    tensions: Array,
    *,
    home: Array,
) -> Array:
    """State of platform and winches at rest, shape (n,).

    Args:
        robot: The robot; a planar one takes x, y and the turn about z.
        drive: What drives its cables.
        X_WP: Pose of the platform [m].
        lengths: Unstrained lengths, shape (m,) [m]; not read where tensions are commanded.
        tensions: At the drums, which motors hold, shape (m,) [N]; read with motors only.
        home: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
    """
    if robot.is_planar():
        R, p = X_WP.rotation().matrix(), X_WP.translation()
        platform = np.array([p[0], p[1], np.arctan2(R[1, 0], R[0, 0]), 0.0, 0.0, 0.0])
    else:
        platform = np.concatenate([pose_row(X_WP), np.zeros(6)])
    winch: Any = np.zeros(0)
    if drive.kind == IDEAL:
        winch = lengths
    elif drive.kind == MOTORS:
        assert drive.law is not None
        winch = resting_motors(drive.law, MODES[drive.mode], home, lengths, tensions)
    return np.concatenate([platform, winch])


def motion_problem(
    robot: Robot, cables: CableSet, rule: StepRule, bad: int, state: Array, *, time: float
) -> Exception:
    """What to raise after a step that failed.

    Args:
        robot: The robot.
        cables: Its cables.
        rule: How it was integrated.
        bad: What `dynamics.advance_robot` returned.
        state: The last good state, shape (n,).
        time: To when it was to be advanced [s].
    """
    if bad == LOST:
        return DivergedError(
            f"before {time:g} s: the motion is not finite any more, by {rule.method} with "
            f"steps of {rule.max_step:g} s; shorter ones may help"
        )
    X_WP = pose_from_state(robot, state)
    try:
        cable_paths(X_WP, cables)
        cause = impossible_cable(X_WP, cables)
    except CableGeometryError as problem:
        cause = str(problem)
    return CableGeometryError(f"before {time:g} s: {cause}")
