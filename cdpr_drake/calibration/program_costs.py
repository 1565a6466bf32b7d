"""Costs of `CalibrationProgram.prog()` with analytic gradients, as Drake evaluates them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares
from cdpr_drake.calibration.stations import Point, turn_slope
from cdpr_drake.numerics.program_functions import ProgramCost


class StationCost(ProgramCost):
    """Half the squared residuals of one pose, by steps from a start."""

    def __init__(self, problem: LeastSquares, start: Point) -> None:
        self._problem, self._start = problem, start

    def drop(self, rows: Sequence[npt.NDArray[np.bool_]] | None, k: int) -> None:
        """Leaves out rows of each term at this pose, number k, given for all poses; None: none."""
        gone = None if rows is None else [one[k : k + 1] for one in rows]
        self._problem = replace(self._problem, dropped=gone)

    def value(self, x: Array) -> tuple[float, Array]:
        """Cost and gradient."""
        problem, start = self._problem, self._start
        count = int(np.sum(problem.free))
        step, steps = unpack_step(problem, start, x)
        at = start.moved(step, steps)
        r, A, B = problem.evaluate(at)
        by_step, by_steps = step_slopes(problem, at, step, steps[0])
        gradient = np.concatenate([r[0] @ A[0] @ by_step, r[0] @ B[0] @ by_steps])
        assert len(gradient) == count + problem.freedom.count(at.stations.width)
        return 0.5 * float(r[0] @ r[0]), gradient


class PriorCost(ProgramCost):
    """Half the squared distances from what is known beforehand."""

    def __init__(self, problem: LeastSquares, start: Point) -> None:
        self._problem, self._start = problem, start

    def value(self, x: Array) -> tuple[float, Array]:
        """Cost and gradient."""
        problem, start = self._problem, self._start
        at = start.moved(*unpack_step(problem, start, x))
        step, steps = unpack_step(problem, start, x)
        r, P = problem.prior.evaluate(at, problem.free)
        slopes, _ = step_slopes(problem, at, step, steps[0])
        typical = at.layout.typical[problem.free]
        return 0.5 * float(r @ r), (r @ (P * typical)) @ slopes


def unpack_step(problem: LeastSquares, start: Point, x: Array) -> tuple[Array, Array]:
    """Steps of all parameters and of the poses, from variables in typical sizes."""
    free = problem.free
    count = int(np.sum(free))
    step = np.zeros(start.layout.size)
    step[free] = x[:count] * start.layout.typical[free]
    stations = start.stations
    steps = np.zeros((stations.count, stations.width))
    if len(x) > count:
        own = x[None, count:] * problem.station_scale(start)
        steps[:1] = problem.freedom.widen(own, stations.R[:1], stations.width)
    return step, steps


def step_slopes(problem: LeastSquares, at: Point, step: Array, steps: Array) -> tuple[Array, Array]:
    """How steps at a point grow with the whole step to it: turns do not add up, all else does."""
    whole = np.eye(len(step))
    for begin in at.layout.pose_starts():
        turn = slice(begin, begin + 3)
        whole[turn, turn] = turn_slope(step[turn])
    typical = at.layout.typical
    whole = whole * typical / typical[:, None]
    own = np.eye(len(steps))
    own[:3, :3] = turn_slope(steps[:3])
    free, columns = problem.free, problem.freedom.columns(len(steps))
    if columns is None:
        # A turn about one axis adds up; that of a beam is refused, see `CalibrationProgram.prog`.
        return whole[np.ix_(free, free)], np.eye(problem.freedom.count(len(steps)))
    return whole[np.ix_(free, free)], own[np.ix_(columns, columns)]
