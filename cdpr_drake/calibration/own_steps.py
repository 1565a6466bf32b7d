"""Least squares with own terms of the parameters: poses are eliminated, a program takes each step.

Half the sum of squares is, with every pose at its best, near a quadratic of the parameters: what
Gauss and Newton take it for. Beside it the own terms stand as they are, so each step is a small
program of the parameters alone, and steps end where the whole cost does not fall any more.

Source: see `elimination`; Nocedal and Wright, Numerical Optimization, 18, for such steps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import MOST_STEPS, SETTLED, LeastSquares, Minimum
from cdpr_drake.calibration.parameters import model_difference, moved_model
from cdpr_drake.calibration.program_costs import step_slopes
from cdpr_drake.calibration.stations import Point
from cdpr_drake.errors import CableModelError

LEAST_DAMPING, LARGEST_DAMPING = 1e-8, 1e8
"""Of steps, in typical sizes: the least keeps still what nothing tells."""

Solve = Callable[[Array, Array, Array], Array]
"""From H, g and x to the least y of (y - x)' H (y - x) / 2 - g' (y - x) with the own terms."""


def minimize_with(
    problem: LeastSquares, at: Point, start: Point, solve: Solve, *, own: Callable[[Array], float]
) -> tuple[Minimum, Array]:
    """The minimum of half the squares and own terms near a point.

    Args:
        problem: The squares; without linear loss.
        at: Where steps begin.
        start: Model from which steps x of the unknown parameters count, in typical sizes.
        solve: What takes a step.
        own: The own costs at steps x.

    Returns:
        The minimum, whose cost is that of the squares, and x there, shape (f,).

    Raises:
        CalibrationError: As `LeastSquares.normal_equations`, or as `solve` does.
    """
    free, typical = problem.free, start.layout.typical
    x = (model_difference(at.model, start.model) / typical)[free]
    damping, kept = LEAST_DAMPING, False
    cost = problem.cost(at)
    for number in range(1, MOST_STEPS + 1):
        step = np.zeros(start.layout.size)
        step[free] = x * typical[free]
        J, _ = step_slopes(problem, at, step, np.zeros(at.stations.width))
        equations = problem.normal_equations(at, 0.0)
        H = J.T @ equations.S @ J + damping * np.eye(len(x))
        new = solve(0.5 * (H + H.T), J.T @ equations.rhs, x)
        told = J @ (new - x)
        alone = -(equations.alone + equations.back @ told) * problem.station_scale(at)
        moves = problem.freedom.widen(alone, at.stations.R, at.stations.width)
        step[free] = new * typical[free]
        small = 0.5 * float(told @ equations.S @ told) <= SETTLED * (1.0 + 1e-6 * cost)
        try:
            model = moved_model(start.model, step, start.layout)
            tried = Point(model, at.stations.moved(moves), start.layout)
            there = problem.cost(tried)
        except CableModelError:  # a radius below zero
            tried, there = at, np.inf
        # The first point need not keep the own constraints: no step from it can be worse.
        rounding = SETTLED * (1.0 + 1e-6 * cost)
        better = not kept or there + own(new) <= cost + own(x) + rounding
        if better and np.isfinite(there):
            at, x, cost, kept = tried, new, there, True
            damping = max(damping / 10.0, LEAST_DAMPING)
            if small:
                return Minimum(at, cost, number, True), x
            continue
        if small and kept:
            return Minimum(at, cost, number, True), x
        damping *= 10.0
        if damping > LARGEST_DAMPING:
            break
    return Minimum(at, cost, MOST_STEPS, False), x
