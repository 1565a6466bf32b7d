"""Least squares with bounds on parameters, by the active-set method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares
from cdpr_drake.calibration.parameters import CalibrationModel, model_difference
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.stations import Point
from cdpr_drake.errors import CalibrationError

SAME = 1e-9
"""A parameter is beyond its bound where it is so by a larger share of it."""

UPHILL = 1e-6
"""Slope of the cost, over a typical size, below which rounding alone may make it rise."""

MOST_CHANGES = 10
"""Sets of bounds that are tried, in numbers of the bounds."""

Solver = Callable[[npt.NDArray[np.bool_], Point], tuple[CalibrationResult, LeastSquares]]
"""Solves for some of the parameters, shape (n,), from a point; and what it solved last."""


def solve_within(
    solve: Solver, free: npt.NDArray[np.bool_], bounds: Array, start: Point, zero: CalibrationModel
) -> tuple[CalibrationResult, dict[int, float]]:
    """The most likely parameters none of which changes by more than its bound.

    Parameters that would go beyond are held at their bounds, one after the other, and let go again
    where that lowers the cost.

    Args:
        solve: Solves without bounds.
        free: Which parameters are unknown, shape (n,).
        bounds: By how much they may change, shape (n,); infinite where there is no bound.
        start: Where the search begins.
        zero: The model from which changes count.

    Returns:
        What was found, and by how much those parameters changed that are held at a bound.

    Raises:
        CalibrationError: As `solve`, or no set of bounds is the right one.

    Source: Nocedal and Wright, Numerical Optimization, 2006, 16.5.
    """
    held: dict[int, float] = {}
    at = start
    for _ in range(MOST_CHANGES * int(np.sum(np.isfinite(bounds[free]))) + 1):
        mine = free.copy()
        mine[list(held)] = False
        result, problem = solve(mine, _put(at, held, zero))
        at = Point(result.model, result.stations, start.layout)
        change = model_difference(at.model, zero)
        beyond = np.where(mine, np.abs(change) / bounds, 0.0)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 1.0 + SAME:
            held[worst] = float(np.copysign(bounds[worst], change[worst]))
            continue
        loose = _let_go(problem, at, held)
        if loose is None:
            return result, held
        del held[loose]
    raise CalibrationError(
        f"bounds: found no end with {len(held)} parameters at their bounds; accepted: wider ones"
    )


def _put(at: Point, held: dict[int, float], zero: CalibrationModel) -> Point:
    """A point whose held parameters are at their bounds."""
    step = np.zeros(at.layout.size)
    change = model_difference(at.model, zero)
    for k, value in held.items():
        step[k] = value - change[k]
    return at.moved(step, np.zeros((at.stations.count, at.stations.width)))


def _let_go(problem: LeastSquares, at: Point, held: dict[int, float]) -> int | None:
    """The held parameter whose return into its bounds lowers the cost most; None: none does."""
    best, most = None, UPHILL
    for k, value in held.items():
        one = np.zeros(at.layout.size, dtype=bool)
        one[k] = True
        alone = replace(problem, free=one)
        r, A, _ = alone.evaluate(at)
        prior, P = alone.prior.evaluate(at, one)
        slope = float(np.sum(r * A[:, :, 0]) + prior @ P[:, 0] * at.layout.typical[k])
        if slope * np.sign(value) > most:
            best, most = k, slope * float(np.sign(value))
    return best
