"""A calibration as a program that grows by what was measured, as Drake's InverseKinematics does."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.bounded_search import solve_within
from cdpr_drake.calibration.elimination import LeastSquares, Minimum, minimize
from cdpr_drake.calibration.identifiability import Identifiability, identifiability
from cdpr_drake.calibration.measured_program import MeasuredCalibration
from cdpr_drake.calibration.own_steps import minimize_with
from cdpr_drake.calibration.parameters import (
    model_difference,
)
from cdpr_drake.calibration.pose_search import HUBER
from cdpr_drake.calibration.program_costs import PriorCost, StationCost
from cdpr_drake.calibration.result import CalibrationResult, make_result, outlying_rows, robust_cost
from cdpr_drake.calibration.stations import Point, turn_vectors
from cdpr_drake.errors import CalibrationError
from cdpr_drake.numerics.own_terms import ProgramValues

NO_WORSE = 1e-6
"""Share of a cost by which rounding may make an end worse than its start."""

AT_BOUND = 1e-4
"""Share of a bound within which a parameter is told to be at it, where interior points stop."""

MOST_ROUNDS = 10
"""Times that outliers are dropped and the rest is solved again."""

BY_LIKELIHOOD = (
    "standard deviations, covariance and chi-square are those of measurements and priors alone; "
    "own terms are not in them"
)
WITHOUT_LOSS = "the loss for outliers is not in the program: those beyond four sigmas are dropped"


class CalibrationProgram(MeasuredCalibration):
    """Finds unknown constants of a robot from what was measured at some poses.

    The poses themselves are unknown, too. `Add...` methods add measurements and priors; `Solve`
    finds the most likely parameters by Gauss-Newton with the poses eliminated, since general
    solvers of `prog()` do not know that poses meet in the parameters alone.

    `prog()` is the same problem as a MathematicalProgram, with variables by name, once everything
    measured was added. `AddQuadraticCost`, `AddCost`, `AddLinearConstraint` and `AddConstraint` add
    terms of one's own to it. They are of `values`: by how much unknown parameters differ from the
    model that is believed, in their units, as `CalibrationResult.values`. A cost counts beside half
    the sum of squared residuals over sigma, so that 0.5 ((v - a) / s)^2 says as much as a
    measurement of a with the standard deviation s. With own terms of parameters, each step of
    Gauss-Newton becomes a program with them; with terms of poses, SNOPT solves the whole program.

    Attributes:
        model: The robot as it is believed.
        layout: Its parameters.
        free: Which of them are unknown, shape (n,).
        stations: The poses from which the search starts.
    """

    def FindIdentifiability(self) -> Identifiability:
        """What these measurements and priors can tell, at the start."""
        return _told(self.least_squares(), self.at())

    def Approach(self, steps: int, start: Point | None = None) -> Minimum:
        """Where some steps with linear loss for outliers lead: to tell starts apart cheaply.

        Args:
            steps: Steps at most.
            start: Model and poses from which they go; None: as the program has them.

        Raises:
            CalibrationError: The start is impossible.
        """
        return minimize(self.least_squares(HUBER), self.at() if start is None else start, steps)

    def Solve(
        self, outliers: bool = True, start: Point | None = None, *, straight: bool = False
    ) -> CalibrationResult:
        """The most likely parameters and poses.

        With outliers, residuals beyond three sigmas count linearly at first; then those beyond four
        are dropped, until no others are. Where that ends worse than it began, by a cost in which
        a measurement counts its square over sigma, or 16 as an outlier, those beyond four are
        dropped from the start on, which lowers that cost in every step.

        Args:
            outliers: Whether outliers are sought.
            start: Model and poses where the search begins; None: as the program has them.
            straight: Whether outliers are dropped from there on, without linear loss before.

        Raises:
            CalibrationError: A parameter cannot be told and has no prior: names which from which;
                a pose is not determined; the start is impossible; or the end is worse.
        """
        at = self.at() if start is None else start
        if np.isinf(self._largest[self.free]).all() or self.has_own_terms:
            return self._solve(self.free, at, outliers, straight)[0]
        found, held = solve_within(
            lambda free, begin: self._solve(free, begin, outliers, straight),
            self.free, self._largest, at, self.model,
        )  # fmt: skip
        return replace(found, at_bounds={self.layout.names[k]: v for k, v in held.items()})

    def SolvedProblem(self, result: CalibrationResult, outliers: bool = True) -> LeastSquares:
        """The problem of which a result is the minimum, without what it dropped.

        Args:
            result: Of `Solve`; parameters that it holds at bounds are not unknown in it.
            outliers: Whether outliers were sought.
        """
        unknown = set(result.names)
        free = np.array([name in unknown for name in self.layout.names])
        at = Point(result.model, result.stations, self.layout)
        problem = replace(self.least_squares(), free=free)
        return replace(problem, dropped=outlying_rows(problem, at)) if outliers else problem

    def _solve(
        self, free: npt.NDArray[np.bool_], at: Point, outliers: bool, straight: bool
    ) -> tuple[CalibrationResult, LeastSquares]:
        """As `Solve`, for some of the parameters and without bounds; and the last problem."""
        began = time.perf_counter()
        plain = replace(self.least_squares(), free=free)
        self._require_told(_told(plain, self.at()))
        problem, found = self._by_gauss_newton(plain, at, outliers, straight)
        if self.has_own_terms:
            return self._with_own_terms(problem, found, outliers, began), problem
        return make_result(problem, found, self.model, time.perf_counter() - began), problem

    def _by_gauss_newton(
        self, plain: LeastSquares, at: Point, outliers: bool, straight: bool
    ) -> tuple[LeastSquares, Minimum]:
        """What was solved last, and its minimum, as `Solve` without own terms and bounds."""
        if not outliers:
            return plain, minimize(plain, at)
        before, steps = robust_cost(plain, at), 0
        if not straight:
            bent = minimize(replace(plain, huber=HUBER), at)
            problem, found = _dropping(plain, bent.at)
            steps = bent.steps + found.steps
        if straight or robust_cost(plain, found.at) > before * (1.0 + NO_WORSE):
            problem, found = _dropping(plain, at)
            steps += found.steps
        after = robust_cost(plain, found.at)
        if not after <= before * (1.0 + NO_WORSE) + NO_WORSE:
            raise CalibrationError(
                f"search: found an end with cost {after:.6g} after a start with {before:.6g}; "
                "accepted: one that is no worse, so from another first pose or with other sigmas"
            )
        return problem, replace(found, steps=steps)

    def _with_own_terms(
        self, problem: LeastSquares, found: Minimum, outliers: bool, began: float
    ) -> CalibrationResult:
        """The minimum of the whole program, from one without own terms."""
        steps = found.steps
        for _ in range(MOST_ROUNDS):
            found, solver, said = self._step_on(problem, found)
            steps += found.steps
            gone = outlying_rows(problem, found.at) if outliers else None
            if gone is None or problem.dropped is None or all(
                np.array_equal(a, b) for a, b in zip(gone, problem.dropped, strict=True)
            ):  # fmt: skip
                break
            problem = replace(problem, dropped=gone)
        self._leave_out(problem)
        lost = (BY_LIKELIHOOD, WITHOUT_LOSS) if outliers else (BY_LIKELIHOOD,)
        report = self._report(self._steps_to(found.at), solver, said, lost)
        end = replace(found, steps=steps)
        result = make_result(problem, end, self.model, time.perf_counter() - began)
        return replace(result, program=report, at_bounds=self._bounds_met(found.at))

    def _bounds_met(self, at: Point) -> dict[str, float]:
        """Parameters at their bounds, by name, and by how much they changed."""
        step = model_difference(at.model, self.model)
        met = self.free & (np.abs(step) >= (1.0 - AT_BOUND) * self._largest)
        return {self.layout.names[k]: float(step[k]) for k in np.flatnonzero(met)}

    def _step_on(self, problem: LeastSquares, found: Minimum) -> tuple[Minimum, str, str]:
        """The minimum with own terms, what solved its programs and what that said last.

        Where all of them are of parameters, poses are eliminated; else the whole program is solved.
        """
        program, start, what = self.prog(), self.at(), "a robot that the measurements fit"
        mine = {v.get_id() for v in self._theta}
        costs, constraints = self._own()
        if not all(v.get_id() in mine for b in (*costs, *constraints) for v in b.variables()):
            self._leave_out(problem)
            x, solver, said = self._solve_whole(self._steps_to(found.at), what)
            at = self._point(x, start)
            return Minimum(at, problem.cost(at), 1, True), solver, said
        heard, most = ["", ""], self._largest[self.free] / self.layout.typical[self.free]

        def solve(H: Array, g: Array, x: Array) -> Array:
            step = MathematicalProgram()
            step.AddDecisionVariables(self._theta)
            step.AddQuadraticCost(H, -g - H @ x, self._theta, is_convex=True)
            if np.isfinite(most).any():
                step.AddBoundingBoxConstraint(-most, most, self._theta)
            for binding in costs:
                step.AddCost(binding)
            for binding in constraints:
                step.AddConstraint(binding)
            y, *heard[:] = self._solve_whole(x, what, step)
            return y

        def own(x: Array) -> float:
            whole = np.zeros(program.num_vars())
            whole[program.FindDecisionVariableIndices(self._theta)] = x
            return sum(float(program.EvalBinding(b, whole)[0]) for b in costs)

        end, _ = minimize_with(problem, found.at, start, solve, own=own)
        return end, heard[0], heard[1]

    def _leave_out(self, problem: LeastSquares) -> None:
        """Drops in the program what is dropped in a problem."""
        for k, cost in enumerate(self._costs):
            cost.drop(problem.dropped, k)

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

    def _require_told(self, found: Identifiability) -> None:
        if found.untold:
            more = f" (and {len(found.untold) - 2} more such)" if len(found.untold) > 2 else ""
            raise CalibrationError(
                f"unknown: {'; '.join(found.untold[:2])}{more}; accepted: fewer unknowns, a prior "
                "for them, or measurements at other poses"
            )


def _told(problem: LeastSquares, at: Point) -> Identifiability:
    S = problem.normal_equations(at, 0.0).S
    return identifiability(S, at, problem.free, problem.used(at))


def _variables(names: Sequence[str]) -> npt.NDArray[np.object_]:
    return np.array([Variable(name) for name in names], dtype=object)


def _dropping(problem: LeastSquares, at: Point) -> tuple[LeastSquares, Minimum]:
    """The minimum without outliers of its own, and the problem without them."""
    steps, gone = 0, outlying_rows(problem, at)
    for _ in range(MOST_ROUNDS):
        problem = replace(problem, dropped=gone)
        found = minimize(problem, at)
        at, steps, now = found.at, steps + found.steps, outlying_rows(problem, found.at)
        if all(np.array_equal(a, b) for a, b in zip(now, gone, strict=True)):
            break
        gone = now
    return problem, replace(found, steps=steps)
