"""Tension distribution as mathematical programs: with any solver, and with terms of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.solvers import (
    ClarabelSolver,
    GetProgramType,
    IpoptSolver,
    MakeSolver,
    MathematicalProgram,
    OsqpSolver,
    ProgramType,
    SnoptSolver,
    Solve,
    SolverId,
    SolverOptions,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.numerics.own_terms import (
    MISSED,
    OwnTerms,
    ProgramReport,
    ProgramValues,
    chosen_names,
    is_convex,
)
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import (
    RESIDUAL_TOLERANCE,
    TensionProblem,
    TensionSolution,
    TensionStatus,
    balance,
    describe,
    refuse,
    writable,
)
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    nearest_tensions_in,
    workspace_shape,
)

PRECISE = 1e-8
"""Residuals at which OSQP stops, in the program's scaled units; its own 1e-3 would move tensions by
a thousandth of the weight where it does not polish."""

MOVED = "tensions were moved by at most the solver's tolerance, to balance the wrench exactly"


def make_program(
    problem: TensionProblem, goal: str
) -> tuple[MathematicalProgram, np.ndarray, float]:
    """The program of a goal, with its decision variables t / scale, shape (m,), and the scale [N].

    min goal(t) subject to W t + w = 0, lower <= t <= upper; `slack_relaxed` puts row_scale times a
    slack in place of 0, and makes that least. Scaled by the size of the forces, so
    that a solver's tolerances mean the same for every robot. Add to it what you like.

    Args:
        problem: The problem.
        goal: A name of `METHODS` that has a program.

    Raises:
        TensionProblemError: Unknown goal, or one that needs a reference and finds none.

    Source: Gazebo thesis (6.24), (6.25); servoing thesis (1.24)-(1.26).
    """
    add = METHODS[goal].program if goal in METHODS else None
    if add is None:
        accepted = ", ".join(name for name, method in METHODS.items() if method.program)
        raise TensionProblemError(f"goal: found {goal}; accepted: {accepted}")
    if METHODS[goal].needs_reference and problem.reference is None:
        raise TensionProblemError(f"{goal}: found no reference; accepted: tensions [N]")
    scale = max(float(np.linalg.norm(problem.wrench)), float(np.linalg.norm(problem.lower)), 1.0)
    program = MathematicalProgram()
    t = program.NewContinuousVariables(problem.W.shape[1], "t")
    if not METHODS[goal].relaxes:
        program.AddLinearEqualityConstraint(problem.W, -problem.wrench / scale, t)
    program.AddBoundingBoxConstraint(problem.lower / scale, problem.upper / scale, t)
    add(program, t, problem, scale)
    return program, t, scale


def program_tensions(
    problem: TensionProblem, goal: str, solver: SolverId | None = None
) -> Array | None:
    """Tensions by Drake's choice of solver or a given one, shape (m,) [N]; None: infeasible.

    As exact as the solver; `methods.distribute` is faster and judges what it returns.
    """
    program, t, scale = make_program(problem, goal)
    result = Solve(program) if solver is None else MakeSolver(solver).Solve(program)
    if not result.is_success():
        return None
    return np.asarray(result.GetSolution(t) * scale, float)


class TensionProgram(OwnTerms):
    """Tensions that balance a wrench within bounds, best by a goal and by terms of one's own.

    `prog()` is the program of `make_program`, with variables t over `scale`. Costs and constraints
    that are added by `AddQuadraticCost`, `AddCost`, `AddLinearConstraint` and `AddConstraint` take
    tensions in newtons; costs count beside the goal, in N where that is a sum, a largest tension or
    a margin, in N^2 where it is a 2-norm or a distance (the sum of squares).

    With nothing added `Solve` is `distribute`. With own terms Drake solves the whole program, from
    the kernel's tensions: a quadratic program by OSQP, which starts warm, another convex one by
    Clarabel, what is not convex by SNOPT to the best that is near. What a solver gives is put on
    the balance by the nearest tensions within the bounds, and judged as every method's tensions.

    Attributes:
        problem: The problem, with the wrench matrix and wrench of the last `update`.
        goal: Name of the goal, of `METHODS`.
        scale: Of the variables [N].
    """

    problem_kind = TensionProblemError

    def __init__(
        self,
        problem: TensionProblem,
        goal: str = "quadratic_program",
        names: Sequence[str] = (),
    ) -> None:
        """For a problem.

        Args:
            problem: The problem.
            goal: A name of `METHODS` that has a program.
            names: Of the cables; empty: cable 1, cable 2, ...

        Raises:
            TensionProblemError: Unknown goal, one that needs a reference and finds none, or another
                number of names.
        """
        # `update` writes into the matrix and the wrench of a copy.
        problem = replace(problem)
        self.problem, self.goal = problem, goal
        self._prog, self._t, self.scale = make_program(problem, goal)
        self._relaxes = METHODS[goal].relaxes
        count = problem.W.shape[1]
        self._names = tuple(names) or tuple(f"cable {i + 1}" for i in range(count))
        if len(self._names) != count:
            raise TensionProblemError(f"names: found {len(self._names)}; accepted: {count}")
        square = bool(self._prog.quadratic_costs())
        self.cost_unit = self.scale**2 if square else self.scale
        self._balance = self._prog.linear_equality_constraints()[0].evaluator()
        self._places = self._prog.FindDecisionVariableIndices(self._t)
        self._work = np.empty(workspace_shape(*problem.W.shape))
        self._options = SolverOptions()
        for name in ("eps_abs", "eps_rel"):
            self._options.SetOption(OsqpSolver.id(), name, PRECISE)
        self._solvers: list[Any] | None = None
        middle = 0.5 * (problem.lower + problem.upper)
        self._prog.SetInitialGuess(self._t, middle / self.scale)
        self._seal()

    def prog(self) -> MathematicalProgram:
        """The program; what is added to it counts in `Solve`."""
        return self._prog

    def tensions(self) -> np.ndarray:
        """The variables t / scale, shape (m,)."""
        return self._t

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Tensions [N], of all cables or of some by name.

        Raises:
            TensionProblemError: There is no such cable.
        """
        m = len(self._t)
        every = ProgramValues.scaled(self._t, np.full(m, self.scale), np.zeros(m), self._names)
        if of is None:
            return every
        return every.only(chosen_names(self._names, of, TensionProblemError))

    def update(self, W: Array, wrench: Array) -> None:
        """Puts another wrench matrix, shape (n, m), and wrench, shape (n,) [N m, N], into it.

        They must be finite, of the sizes of before; the bounds and the scale stay.
        """
        problem = self.problem
        writable(problem.W)[:], writable(problem.wrench)[:] = W, wrench
        rows = np.hstack([W, -np.diag(problem.scale_of_rows)]) if self._relaxes else W
        self._balance.UpdateCoefficients(rows, -wrench / self.scale)

    def step(self, start: Array) -> Array | None:
        """Tensions, shape (m,) [N], from a start, shape (m,) [N]; None: none keep everything.

        For loops: terms that are added after the first step or `Solve` are seen by `Solve` only.
        """
        if self._solvers is None:
            self._choose_solvers()
        z, _, _ = self._optimum(start)
        if z is None:
            return None
        t = self._settled(z)
        if t is None:
            return None
        x = self._with(z, t)
        for _, evaluator, places in self._own_constraints(anew=False):
            if not evaluator.CheckSatisfied(x[places], MISSED):
                return None
        return t

    def Solve(self, start: Array | None = None) -> TensionSolution:
        """The best tensions.

        A problem without any tensions is `infeasible`; one whose tensions the own constraints
        exclude is `missed`, with NaN, and its report says so.

        Args:
            start: Where the search starts, shape (m,) [N]; None: at the goal's tensions.
        """
        problem, n = self.problem, self.problem.W.shape[0]
        plain = distribute(problem, self.goal)
        if not self.has_own_terms:
            return plain
        if plain.status == TensionStatus.INFEASIBLE and not self._relaxes:
            return plain
        self._choose_solvers()
        begin = plain.tensions if start is None else np.asarray(start, float)
        z, solver, said = self._optimum(np.nan_to_num(begin))
        t = None if z is None else self._settled(z)
        missed = [] if z is None or t is None else self._missed(self._with(z, t))
        if z is None or t is None or missed:
            names = missed or [word for word, _, _ in self._own_constraints()]
            words = (
                f"no tensions within the bounds that balance the wrench keep {', '.join(names)}"
                if names
                else "the solver came to no end"
            )
            gone = refuse(problem, self.goal)
            report = ProgramReport(solver, said, float("nan"), {}, tuple(names), (words,))
            return replace(gone, status=TensionStatus.NOT_FOUND, program=report)
        arrays = [writable(a) for a in (problem.W, problem.wrench, problem.lower, problem.upper)]
        inside, residual = balance(*arrays, t)
        good = inside and residual <= RESIDUAL_TOLERANCE
        active, slack = np.empty(len(t), np.int64), np.empty(n)
        describe(*arrays, t, active, slack)
        feasible = good and plain.status != TensionStatus.INFEASIBLE
        status = TensionStatus.FEASIBLE if feasible else TensionStatus.INFEASIBLE
        lost = () if self._relaxes else (MOVED,)
        report = self._report(self._with(z, t), solver, said, lost)
        return TensionSolution(self.goal, status, t, residual, active, slack, report)

    def _optimum(self, start: Array) -> tuple[Array | None, str, str]:
        """All variables at the optimum, or None; the solver, and what it said."""
        guess = np.zeros(self._prog.num_vars())
        guess[self._places] = start / self.scale
        said, word = "no solver", ""
        for solver in self._solvers or ():
            result = solver.Solve(self._prog, guess, self._options)
            word = solver.solver_id().name()
            said = str(result.get_solution_result()).rpartition(".")[2]
            if result.is_success():
                return np.asarray(result.get_x_val(), float), word, said
        return None, word, said

    def _choose_solvers(self) -> None:
        """Solvers for the terms that there are, in the order in which they are asked."""
        kinds: tuple[Any, ...] = (SnoptSolver, IpoptSolver)
        if GetProgramType(self._prog) == ProgramType.kQP:
            kinds = (OsqpSolver, ClarabelSolver)
        elif is_convex(self._prog):
            kinds = (ClarabelSolver,)
        self._solvers = [kind() for kind in kinds if kind().available() and kind().enabled()]

    def _settled(self, z: Array) -> Array | None:
        """Tensions near a solver's, within the bounds and, unless relaxed, balanced exactly."""
        problem, near = self.problem, np.ascontiguousarray(z[self._places] * self.scale)
        if self._relaxes:
            return np.clip(near, problem.lower, problem.upper)
        t = np.empty(len(near))
        arrays = [writable(a) for a in (problem.W, problem.wrench, problem.lower, problem.upper)]
        code = nearest_tensions_in(self._work, *arrays, near, t)
        if code != FEASIBLE or np.max(np.abs(t - near)) > MISSED * self.scale * len(t):
            return None
        return np.clip(t, problem.lower, problem.upper)

    def _with(self, z: Array, t: Array) -> Array:
        """All variables with these tensions."""
        x = z.copy()
        x[self._places] = t / self.scale
        return x
