"""Moves the ends of a straight path inside by the least amount, until all of it can be held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import exact_tensions

STEPS = 1000
"""Poses of a straight path that are tried, beside its end."""

FINE = 1e-6
"""How closely the least shift is found [m]."""


@dataclass(frozen=True)
class HeldPath:
    """A straight path of Po that the robot holds everywhere, and what was changed for it.

    Attributes:
        start: Where it starts, shape (3,) [m].
        end: Where it ends, shape (3,) [m].
        start_limit: Least distance by which the start had to move towards the inside [m].
        end_limit: The same of the end [m].
        start_shift: Distance by which the start moved, its limit and the margin [m].
        end_shift: The same of the end [m].
    """

    start: Array
    end: Array
    start_limit: float
    end_limit: float
    start_shift: float
    end_shift: float


def can_hold(robot: Robot, position: Array, limits: tuple[float, float] | None = None) -> bool:
    """Whether tensions hold the unturned platform at rest with Po at a position [m]; exact."""
    X_WP = pose_from_angles(position, np.zeros(3))
    cables = robot.cable_set(pulleys=False)  # as in the theses
    return exact_tensions(tension_problem(robot, X_WP, limits=limits, cables=cables)) is not None


def held_path(
    robot: Robot,
    start: Array,
    end: Array,
    inside: Array,
    margin: float = 0.01,
    limits: tuple[float, float] | None = None,
) -> HeldPath:
    """Moves each end straight towards the inside until it and then the path between can be held.

    Args:
        robot: The robot.
        start: Wanted start of Po, unturned platform, shape (3,) [m].
        end: Wanted end, shape (3,) [m].
        inside: A position that can be held, shape (3,) [m].
        margin: What an end moves beyond its limit, if it has to move at all: at the limit itself
            no tensions are left to control with [m].
        limits: Smallest and largest tension [N]; None: the robot's.

    Raises:
        InfeasibleTensionError: The inside cannot be held, or no such path was found.
    """
    start, end, inside = (np.asarray(p, float) for p in (start, end, inside))
    if not can_hold(robot, inside, limits):
        raise InfeasibleTensionError(f"{robot.name}: no tensions hold the platform at {inside}")
    bounds = [_least_shift(robot, p, inside, limits) for p in (start, end)]
    shifts = [bound + margin if bound > 0.0 else 0.0 for bound in bounds]
    while True:
        ends = [_towards(p, inside, shift) for p, shift in zip((start, end), shifts, strict=True)]
        shares = np.linspace(0.0, 1.0, STEPS + 1)
        bad = [s for s in shares if not can_hold(robot, ends[0] + s * (ends[1] - ends[0]), limits)]
        if not bad:
            return HeldPath(ends[0], ends[1], bounds[0], bounds[1], shifts[0], shifts[1])
        nearer = 0 if np.mean(bad) <= 0.5 else 1  # the end next to what cannot be held
        shifts[nearer] += margin
        if margin <= 0.0 or shifts[nearer] > float(np.linalg.norm((start, end)[nearer] - inside)):
            raise InfeasibleTensionError(f"{robot.name}: found no path that can be held throughout")


def _towards(position: Array, inside: Array, shift: float) -> Array:
    way = inside - position
    length = float(np.linalg.norm(way))
    return position + way * (min(shift / length, 1.0) if length > 0.0 else 0.0)


def _least_shift(
    robot: Robot, position: Array, inside: Array, limits: tuple[float, float] | None
) -> float:
    """Least distance towards the inside from which on the platform is held, by bisection [m]."""
    if can_hold(robot, position, limits):
        return 0.0
    bad, good = 0.0, float(np.linalg.norm(inside - position))
    while good - bad > FINE:
        middle = (bad + good) / 2.0
        if can_hold(robot, _towards(position, inside, middle), limits):
            good = middle
        else:
            bad = middle
    return good
