"""A calibration as a MathematicalProgram of Drake, its costs with analytic gradients."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares
from cdpr_drake.calibration.parameters import CalibrationModel, ParameterLayout, model_difference
from cdpr_drake.calibration.pose_freedom import PoseFreedom
from cdpr_drake.calibration.stations import Point, Stations, turn_slope, turn_vectors
from cdpr_drake.calibration.terms import Term
from cdpr_drake.errors import CalibrationError
from cdpr_drake.numerics.own_terms import OwnTerms, ProgramValues
from cdpr_drake.numerics.program_functions import ProgramCost

AT_BOUND = 1e-4
"""Share of a bound within which a parameter is told to be at it, where interior points stop."""


class WholeProgram(OwnTerms):
    """A calibration as one MathematicalProgram of parameters and poses, with terms of one's own.

    Attributes:
        model: The robot as it is believed.
        layout: Its parameters.
        free: Which of them are unknown, shape (n,).
        stations: The poses from which the search starts.
        terms: What was measured.
    """

    problem_kind = CalibrationError
    model: CalibrationModel
    layout: ParameterLayout
    free: npt.NDArray[np.bool_]
    stations: Stations
    terms: list[Term]

    def __init__(self, freedom: PoseFreedom) -> None:
        self._freedom = freedom
        self._std = np.full(self.layout.size, np.inf)
        self._prog: MathematicalProgram | None = None
        self._theta = np.empty(0, object)
        self._own_poses: list[npt.NDArray[np.object_]] = []
        self._costs: list[StationCost] = []
        self._largest = np.full(self.layout.size, np.inf)

    @abstractmethod
    def at(self, stations: Stations | None = None) -> Point:
        """The start, or the believed model at other poses."""

    @abstractmethod
    def least_squares(self, huber: float = np.inf) -> LeastSquares:
        """The problem as it is now."""

    def prog(self) -> MathematicalProgram:
        """The same problem for Drake's solvers, without loss for outliers; one object.

        Variables are steps from the start: one for each unknown parameter, by its name, in its
        typical size, and for each pose k turn0_k.., place0_k.., in hundredths of a radian and of a
        metre, and its tensions in newtons. Gradients are analytic. Measurements and priors come
        before it; what is added to it counts in `Solve`.

        Raises:
            CalibrationError: Nothing was measured, or the platform is a beam, whose turns do not
                add up to one that it has.
        """
        if self._prog is None:
            self._make()
        assert self._prog is not None
        return self._prog

    def parameters(self, of: str | Sequence[str] | None = None) -> npt.NDArray[np.object_]:
        """Variables of unknown parameters over their typical sizes, as `values` chooses them."""
        return self.values(of).variables

    def pose(self, k: int) -> npt.NDArray[np.object_]:
        """Variables of pose k, from 0: turn, place and, where they are unknown, tensions."""
        self.prog()
        if not 0 <= k < len(self._own_poses):
            raise CalibrationError(f"pose: found {k}; accepted: 0 to {len(self._own_poses) - 1}")
        return self._own_poses[k]

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """By how much unknown parameters differ from the believed model, in their units.

        Args:
            of: Groups and names as `ParameterLayout.select` takes them, in the layout's order;
                None: all that are unknown.

        Raises:
            CalibrationError: A parameter is not there, or none of a pattern is unknown.
        """
        self.prog()
        names, typical = self.names(), self.layout.typical[self.free]
        every = ProgramValues.scaled(self._theta, typical, np.zeros(len(names)), names)
        if of is None:
            return every
        asked = [of] if isinstance(of, str) else list(of)
        for one in asked:
            if not np.any(self.layout.select([one]) & self.free):
                raise CalibrationError(
                    f"of: found {one!r}, which is not unknown; accepted: {', '.join(names[:6])} "
                    "and the other unknown ones"
                )
        return every.only(np.flatnonzero(self.layout.select(asked)[self.free]))

    def names(self) -> tuple[str, ...]:
        """Names of the unknown parameters."""
        return tuple(np.array(self.layout.names)[self.free])

    def _make(self) -> None:
        if self._freedom.motion.num_turns == 2:
            raise CalibrationError("motion: found 2R3T; accepted by prog(): another, or Solve")
        problem, start = self.least_squares(), self.at()
        program = MathematicalProgram()
        self._theta = theta = _variables(self.names())
        program.AddDecisionVariables(theta)
        most = self._largest[self.free] / self.layout.typical[self.free]
        if np.isfinite(most).any():
            program.AddBoundingBoxConstraint(-most, most, theta)
        labels = problem.freedom.labels(start.stations.width)
        for k in range(start.stations.count):
            own = _variables([f"{label}_{k}" for label in labels])
            program.AddDecisionVariables(own)
            one = replace(problem, terms=tuple(t.only(slice(k, k + 1)) for t in self.terms))
            cost = StationCost(one, self.at(self.stations.only(slice(k, k + 1))))
            program.AddCost(cost, vars=np.concatenate([theta, own]))
            self._costs.append(cost)
            self._own_poses.append(own)
        if np.isfinite(self._std[self.free]).any():
            program.AddCost(PriorCost(problem, start), vars=theta)
        self._prog = program
        self._seal()

    def _steps_to(self, at: Point) -> Array:
        """The program's variables at a point."""
        problem, start, program = self.least_squares(), self.at(), self.prog()
        step = model_difference(at.model, start.model) / start.layout.typical
        x = np.zeros(program.num_vars())
        x[program.FindDecisionVariableIndices(self._theta)] = step[self.free]
        R = at.stations.R @ np.swapaxes(start.stations.R, 1, 2)
        steps = [turn_vectors(R), at.stations.p - start.stations.p]
        if at.stations.tensions is not None and start.stations.tensions is not None:
            steps.append(at.stations.tensions - start.stations.tensions)
        own_steps = problem.freedom.coordinates(np.hstack(steps), start.stations.R)
        rows = own_steps / problem.station_scale(start)
        for own, row in zip(self._own_poses, rows, strict=True):
            x[program.FindDecisionVariableIndices(own)] = row
        return x

    def _point(self, x: Array, start: Point) -> Point:
        """The model and poses of the program's variables."""
        problem, program = self.least_squares(), self.prog()
        step = np.zeros(start.layout.size)
        theta = x[program.FindDecisionVariableIndices(self._theta)]
        step[self.free] = theta * start.layout.typical[self.free]
        rows = np.array([x[program.FindDecisionVariableIndices(own)] for own in self._own_poses])
        rows = rows * problem.station_scale(start)
        steps = problem.freedom.widen(rows, start.stations.R, start.stations.width)
        return start.moved(step, steps)

    def _leave_out(self, problem: LeastSquares) -> None:
        """Drops in the program what is dropped in a problem."""
        for k, cost in enumerate(self._costs):
            cost.drop(problem.dropped, k)

    def _bounds_met(self, at: Point) -> dict[str, float]:
        """Parameters at their bounds, by name, and by how much they changed."""
        step = model_difference(at.model, self.model)
        met = self.free & (np.abs(step) >= (1.0 - AT_BOUND) * self._largest)
        return {self.layout.names[k]: float(step[k]) for k in np.flatnonzero(met)}


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
        # A turn about one axis adds up; that of a beam is refused, see `WholeProgram.prog`.
        return whole[np.ix_(free, free)], np.eye(problem.freedom.count(len(steps)))
    return whole[np.ix_(free, free)], own[np.ix_(columns, columns)]


def _variables(names: Sequence[str]) -> npt.NDArray[np.object_]:
    return np.array([Variable(name) for name in names], dtype=object)
