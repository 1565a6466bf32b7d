"""Tension distribution as programs of Drake: with any solver, and with own terms."""

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
"""Residuals at which OSQP stops, in the scaled units of the program; its default, 1e-3, would move
tensions by a thousandth of the weight where it does not polish."""

MOVED = "tensions were moved by at most the solver's tolerance, to balance the wrench exactly"


def make_program(
    problem: TensionProblem, goal: str
) -> tuple[MathematicalProgram, np.ndarray, float]:
    """Program of a goal, its variables t / scale, shape (m,), and the scale [N].

    min goal(t) subject to W t + w = 0, lower <= t <= upper; `slack_relaxed` has row_scale times a
    slack instead of 0, and minimises it. Numbers are divided by the size of the forces, so that the
    tolerances of a solver mean the same for every robot. Costs and constraints may be added.

    Args:
        problem: The problem.
        goal: A name of `METHODS` that has a program.

    Raises:
        TensionProblemError: Unknown goal, or no reference where it needs one.

    Source: Gazebo thesis (6.24), (6.25); servoing thesis (1.24)-(1.26).
    """
    method = METHODS.get(goal)
    if method is None or method.program is None:
        accepted = ", ".join(name for name, row in METHODS.items() if row.program)
        raise TensionProblemError(f"goal: found {goal}; accepted: {accepted}")
    if method.needs_reference and problem.reference is None:
        raise TensionProblemError(f"{goal}: found no reference; accepted: tensions [N]")
    scale = max(float(np.linalg.norm(problem.wrench)), float(np.linalg.norm(problem.lower)), 1.0)
    program = MathematicalProgram()
    t = program.NewContinuousVariables(problem.W.shape[1], "t")
    if not method.relaxes:
        program.AddLinearEqualityConstraint(problem.W, -problem.wrench / scale, t)
    program.AddBoundingBoxConstraint(problem.lower / scale, problem.upper / scale, t)
    method.program(program, t, problem, scale)
    return program, t, scale


def program_tensions(
    problem: TensionProblem, goal: str, solver: SolverId | None = None
) -> Array | None:
    """Tensions by a solver (None: Drake's choice), shape (m,) [N]; None: infeasible.

    They are as exact as the solver; `distribute` is faster and checks its result.
    """
    program, t, scale = make_program(problem, goal)
    result = Solve(program) if solver is None else MakeSolver(solver).Solve(program)
    return np.asarray(result.GetSolution(t) * scale, float) if result.is_success() else None


class TensionProgram(OwnTerms):
    """Tensions that balance a wrench within bounds, optimal for a goal and own terms.

    `prog()` is the program of `make_program`, with variables t over `scale`. Costs and constraints
    that are added by `AddQuadraticCost`, `AddCost`, `AddLinearConstraint` and `AddConstraint` take
    tensions in newtons. Costs are in the unit of the goal: N for a sum, a largest tension or a
    margin, N^2 for a 2-norm or a distance (the sum of squares).

    Without own terms `Solve` is `distribute`. With own terms Drake solves the whole program from
    the tensions of the kernel: a quadratic program by OSQP with a warm start, another convex one by
    Clarabel, others by SNOPT to a local optimum. The result is replaced by the nearest tensions
    that balance the wrench within the bounds, and checked like that of every method.

    Attributes:
        problem: The problem, with the wrench matrix and wrench of the last `update`.
        goal: Name of the goal, of `METHODS`.
        scale: Scale of the variables [N].
    """

    problem_kind = TensionProblemError

    def __init__(
        self,
        problem: TensionProblem,
        goal: str = "quadratic_program",
        names: Sequence[str] = (),
    ) -> None:
        """Makes the program of a problem.

        Args:
            problem: The problem.
            goal: A name of `METHODS` that has a program.
            names: Names of the cables; empty: cable 1, cable 2, ...

        Raises:
            TensionProblemError: As `make_program`, or another number of names.
        """
        # `update` writes into the matrix and the wrench of a copy.
        problem = replace(problem)
        self.problem, self.goal = problem, goal
        self._prog, self._t, self.scale = make_program(problem, goal)
        self._relaxes = METHODS[goal].relaxes
        m = problem.W.shape[1]
        self._names = tuple(names) or tuple(f"cable {i + 1}" for i in range(m))
        if len(self._names) != m:
            raise TensionProblemError(f"names: found {len(self._names)}; accepted: {m}")
        self.cost_unit = self.scale ** (2 if self._prog.quadratic_costs() else 1)
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
        """The program; terms that are added to it count in `Solve`."""
        return self._prog

    def tensions(self) -> np.ndarray:
        """The variables t / scale, shape (m,)."""
        return self._t

    def values(self, of: str | Sequence[str] | None = None) -> ProgramValues:
        """Tensions [N] of all cables, or of those with some names.

        Raises:
            TensionProblemError: There is no such cable.
        """
        m = len(self._t)
        values = ProgramValues.scaled(self._t, np.full(m, self.scale), np.zeros(m), self._names)
        if of is None:
            return values
        return values.only(chosen_names(self._names, of, TensionProblemError))

    def update(self, W: Array, wrench: Array) -> None:
        """Replaces wrench matrix, shape (n, m), and wrench, shape (n,) [N m, N].

        They must be finite and of the same sizes; bounds and scale stay.
        """
        problem = self.problem
        writable(problem.W)[:], writable(problem.wrench)[:] = W, wrench
        rows = np.hstack([W, -np.diag(problem.scale_of_rows)]) if self._relaxes else W
        self._balance.UpdateCoefficients(rows, -wrench / self.scale)

    def step(self, start: Array) -> Array | None:
        """Tensions from a start, shape (m,) [N]; None: none keep all constraints.

        For loops: terms that are added after the first step or `Solve` count in `Solve` only.
        """
        if self._solvers is None:
            self._choose_solvers()
        z, _, _ = self._optimum(start)
        t = None if z is None else self._settled(z)
        if z is None or t is None:
            return None
        x = self._with(z, t)
        for _, evaluator, places in self._own_constraints(anew=False):
            if not evaluator.CheckSatisfied(x[places], MISSED):
                return None
        return t

    def Solve(self, start: Array | None = None) -> TensionSolution:
        """The optimal tensions.

        A problem without any tensions is `infeasible`; if the own constraints exclude all of its
        tensions, it is `missed`, with NaN and a report that says so.

        Args:
            start: Start of the search, shape (m,) [N]; None: the tensions of the goal alone.
        """
        problem = self.problem
        plain = distribute(problem, self.goal)
        if not self.has_own_terms:
            return plain
        if plain.status == TensionStatus.INFEASIBLE and not self._relaxes:
            return plain
        self._choose_solvers()
        z, solver, outcome = self._optimum(
            np.nan_to_num(plain.tensions if start is None else np.asarray(start, float))
        )
        t = None if z is None else self._settled(z)
        missed = [] if z is None or t is None else self._missed(self._with(z, t))
        if z is None or t is None or missed:
            names = missed or [name for name, _, _ in self._own_constraints()]
            words = (
                f"no tensions within the bounds that balance the wrench keep {', '.join(names)}"
                if names
                else "the solver came to no end"
            )
            report = ProgramReport(solver, outcome, float("nan"), {}, tuple(names), (words,))
            return replace(
                refuse(problem, self.goal), status=TensionStatus.NOT_FOUND, program=report
            )
        arrays = [writable(a) for a in (problem.W, problem.wrench, problem.lower, problem.upper)]
        inside, residual = balance(*arrays, t)
        active, slack = np.empty(len(t), np.int64), np.empty(len(problem.wrench))
        describe(*arrays, t, active, slack)
        balanced = inside and residual <= RESIDUAL_TOLERANCE
        feasible = balanced and plain.status != TensionStatus.INFEASIBLE
        status = TensionStatus.FEASIBLE if feasible else TensionStatus.INFEASIBLE
        lost = () if self._relaxes else (MOVED,)
        report = self._report(self._with(z, t), solver, outcome, lost)
        return TensionSolution(self.goal, status, t, residual, active, slack, report)

    def _optimum(self, start: Array) -> tuple[Array | None, str, str]:
        """All variables at the optimum, or None; the solver, and its outcome in words."""
        guess = np.zeros(self._prog.num_vars())
        guess[self._places] = start / self.scale
        outcome, name = "no solver", ""
        for solver in self._solvers or ():
            result = solver.Solve(self._prog, guess, self._options)
            name = solver.solver_id().name()
            outcome = str(result.get_solution_result()).rpartition(".")[2]
            if result.is_success():
                return np.asarray(result.get_x_val(), float), name, outcome
        return None, name, outcome

    def _choose_solvers(self) -> None:
        """Solvers for the present terms, in the order of trial."""
        kinds: tuple[Any, ...] = (SnoptSolver, IpoptSolver)
        if GetProgramType(self._prog) == ProgramType.kQP:
            kinds = (OsqpSolver, ClarabelSolver)
        elif is_convex(self._prog):
            kinds = (ClarabelSolver,)
        self._solvers = [kind() for kind in kinds if kind().available() and kind().enabled()]

    def _settled(self, z: Array) -> Array | None:
        """Tensions near those of a solver, within the bounds and, unless relaxed, in balance."""
        problem, point = self.problem, np.ascontiguousarray(z[self._places] * self.scale)
        if self._relaxes:
            return np.clip(point, problem.lower, problem.upper)
        t = np.empty(len(point))
        arrays = [writable(a) for a in (problem.W, problem.wrench, problem.lower, problem.upper)]
        code = nearest_tensions_in(self._work, *arrays, point, t)
        if code != FEASIBLE or np.max(np.abs(t - point)) > MISSED * self.scale * len(t):
            return None
        return np.clip(t, problem.lower, problem.upper)

    def _with(self, z: Array, t: Array) -> Array:
        """All variables z with the tensions t."""
        x = z.copy()
        x[self._places] = t / self.scale
        return x
