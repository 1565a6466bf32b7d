"""Motions in boxes of poses, each for an interval of time: polynomials of time of degree 5.

A polynomial in Bernstein's form lies in the convex hull of its control points, and its derivatives
in those of theirs. So a motion whose control points lie in the box of its interval, and whose
speeds and accelerations keep their limits at control points, does so at every instant. With the
times of pieces given, all of this is a second-order cone program.

Source: Farouki, The Bernstein polynomial basis, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.set_curve import DEGREE, MARGIN, SetCurve, joined_controls
from cdpr_drake.proofs.timed_cells import BORDER

INNER = 1e-6
"""Limits of speed and acceleration are kept by this share of them more than is asked, as the solver
misses constraints by less."""

STILL = 1e-3
"""Weight of bending beside the length, so that the shortest motion is one, not many."""


@dataclass(frozen=True, eq=False)
class TimedBoxes:
    """Boxes of pieces, one after the other in time.

    Attributes:
        lower: Shape (n, d).
        upper: Shape (n, d).
        breaks: When pieces begin and the last one ends, shape (n + 1,) [s].
        sets: Numbers of the sets that they are, shape (n,).
    """

    lower: Array
    upper: Array
    breaks: Array
    sets: tuple[int, ...]

    def until(self, time: float) -> TimedBoxes:
        """The same as far as a time, at which the last piece ends."""
        count = int(np.searchsorted(self.breaks, time - 1e-9))
        breaks = np.append(self.breaks[:count], time)
        return TimedBoxes(self.lower[:count], self.upper[:count], breaks, self.sets[:count])


@dataclass(frozen=True)
class RateLimits:
    """Limits of rates.

    Attributes:
        speed: Of the first numbers, up to three, which are positions [m/s].
        acceleration: Of each number, shape (d,) [m/s^2].
    """

    speed: float
    acceleration: Array


def timed_curve(
    boxes: TimedBoxes, start: Array, goal: Array, limits: RateLimits,
    longest: float | None = None,
) -> SetCurve | None:  # fmt: skip
    """The motion from rest to rest that is shortest, or bends least among those that are short.

    Args:
        boxes: The boxes.
        start: At the first break, shape (d,).
        goal: At the last, likewise.
        limits: Kept at every instant.
        longest: The control polygon is no longer, and it bends least; None: the shortest one.

    Returns:
        Its parameter is time; None where there is no such motion, or the solver misses one.
    """
    n, d = len(boxes.sets), len(start)
    unit, h = float(np.linalg.norm(goal - start)), np.diff(boxes.breaks)
    whole = boxes.breaks[-1] - boxes.breaks[0]
    program = MathematicalProgram()
    P = program.NewContinuousVariables(n * (DEGREE + 1), d).reshape(n, DEGREE + 1, d)
    one = np.eye(d)
    for k in range(n):
        low, high = boxes.lower[k] + MARGIN, boxes.upper[k] - MARGIN
        for j in range(DEGREE + 1):
            if (k == 0 and j < 3) or (k == n - 1 and j > DEGREE - 3):
                continue
            program.AddBoundingBoxConstraint((low - start) / unit, (high - start) / unit, P[k, j])
    for j in range(3):  # at rest, without acceleration
        program.AddBoundingBoxConstraint(np.zeros(d), np.zeros(d), P[0, j])
        value = (goal - start) / unit
        program.AddBoundingBoxConstraint(value, value, P[-1, DEGREE - j])
    for k in range(n - 1):
        a, b = h[k] / max(h[k], h[k + 1]), h[k + 1] / max(h[k], h[k + 1])
        for left, right in (
            ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
            ((0.0, -b, b), (-a, a, 0.0)),
            ((b**2, -2.0 * b**2, b**2), (a**2, -2.0 * a**2, a**2)),
        ):
            rows = np.hstack([*(x * one for x in left), *(-x * one for x in right)])
            program.AddLinearEqualityConstraint(
                rows, np.zeros(d), np.concatenate([*P[k, 3:], *P[k + 1, :3]])
            )
    bent = np.hstack([one, -2.0 * one, one])
    speed = (1.0 - INNER) * limits.speed / unit
    most = (1.0 - INNER) * limits.acceleration / unit
    m = min(d, 3)
    for k in range(n):
        for j in range(DEGREE - 1):
            top = most * h[k] ** 2 / (DEGREE * (DEGREE - 1))
            program.AddLinearConstraint(bent, -top, top, np.concatenate([*P[k, j : j + 3]]))
        if np.isfinite(speed):
            for j in range(DEGREE):
                cone = np.zeros((m + 1, 2 * d))
                cone[1:, d : d + m], cone[1:, :m] = np.eye(m), -np.eye(m)
                first = np.zeros(m + 1)
                first[0] = speed * h[k] / DEGREE
                program.AddLorentzConeConstraint(
                    cone, first, np.concatenate([P[k, j], P[k, j + 1]])
                )
    _add_length(program, P, None if longest is None else longest / unit)
    for k in range(n):
        weight = (whole / h[k]) ** 3 * (STILL if longest is None else 1.0)
        for j in range(DEGREE - 1):
            program.Add2NormSquaredCost(
                np.sqrt(weight) * bent, np.zeros(d), np.concatenate([*P[k, j : j + 3]])
            )
    result = ClarabelSolver().Solve(program)
    if not result.is_success():
        return None
    controls = start + unit * np.array([result.GetSolution(one) for one in P], float)
    controls[0, :3], controls[-1, -3:] = start, goal
    found = SetCurve(boxes.sets, boxes.breaks, joined_controls(controls, h))
    return found if keeps(found, boxes, limits) else None


def _add_length(program: MathematicalProgram, P: Array, longest: float | None) -> None:
    """Minimizes the length of the control polygon, or keeps it below that."""
    n, d = P.shape[0], P.shape[2]
    steps = program.NewContinuousVariables(n * DEGREE)
    rows = np.zeros((d + 1, 2 * d + 1))
    rows[0, 0] = 1.0
    rows[1:, 1 : d + 1], rows[1:, d + 1 :] = np.eye(d), -np.eye(d)
    for number, step in enumerate(steps):
        k, j = divmod(number, DEGREE)
        program.AddLorentzConeConstraint(
            rows, np.zeros(d + 1), np.concatenate([[step], P[k, j + 1], P[k, j]])
        )
    if longest is None:
        program.AddLinearCost(np.ones(len(steps)), 0.0, steps)
    else:
        program.AddLinearConstraint(
            np.ones((1, len(steps))), np.array([-np.inf]), np.array([longest]), steps
        )


def largest_rates(curve: SetCurve) -> tuple[float, Array]:
    """Bounds of the speed of the first three numbers, and of each acceleration, by control points.

    They hold at every instant.
    """
    h = np.diff(curve.breaks)[:, np.newaxis, np.newaxis]
    first = DEGREE * np.diff(curve.controls, axis=1) / h
    second = (DEGREE - 1) * np.diff(first, axis=1) / h
    speed = float(np.max(np.linalg.norm(first[:, :, :3], axis=2)))
    return speed, np.asarray(np.max(np.abs(second), axis=(0, 1)), float)


def keeps(curve: SetCurve, boxes: TimedBoxes, limits: RateLimits) -> bool:
    """Whether control points prove that a motion stays in its boxes and keeps its limits."""
    low, high = boxes.lower[:, np.newaxis] - BORDER, boxes.upper[:, np.newaxis] + BORDER
    inside = np.all((low <= curve.controls) & (curve.controls <= high))
    speed, acceleration = largest_rates(curve)
    return bool(inside and speed <= limits.speed and np.all(acceleration <= limits.acceleration))
