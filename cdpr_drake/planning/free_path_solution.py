"""Solves programs of free paths with what is installed, and holds what they found."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import (
    Binding,
    IpoptSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    NloptSolver,
    SnoptSolver,
    SolverOptions,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.planning.free_path_checks import BetweenKnots
from cdpr_drake.planning.path_task import MotionSamples, PathTask, sample_motion
from cdpr_drake.trajectories.timed_path import TimedPath

SOLVERS = (SnoptSolver, IpoptSolver, NloptSolver)
"""In the order in which they are taken."""

FEASIBILITY, OPTIMALITY = 1e-7, 1e-5
"""What solvers may miss, of the scaled constraints and of optimality."""

MOST_STEPS = 1000
"""Major iterations."""


@dataclass(frozen=True, eq=False)
class FreePathSolution:
    """What a program of a free path found.

    Attributes:
        task: The robot and its limits.
        success: Whether the solver says that it found an optimum, a local one, and its refinement
            left nothing missed between knots. Tensions and torques, and without rounds of
            refinement everything, are asked at knots only: `between` and `samples` say the rest.
        status: In the solver's words, and what is missed between knots.
        solver: Which one.
        solve_time: Time that it took [s].
        cost: The cost.
        duration: From start to goal [s].
        violations: By name of what was added: by how much its worst constraint is missed, in its
            own unit; 0 where none is.
        between: What is asked at the knots, by how much it is missed between them, by name; empty
            without a motion. Tensions, in newtons, are those of the best distribution.
        worst: What is missed most, where on the way and by what, in words; empty where nothing is.
        multipliers: By the same names, where the solver gives them: which constraints the cost
            rests on, flat, in the order in which they were added.
        times: Of the knots, shape (k,) [s].
        tensions: At the knots, shape (k, m) [N].
        trajectory: The motion; None where the solver found none. It holds at the knots what the
            program says, and between them what `between` says; `samples` says more.
    """

    task: PathTask
    success: bool
    status: str
    solver: str
    solve_time: float
    cost: float
    duration: float
    violations: Mapping[str, float]
    between: Mapping[str, BetweenKnots]
    worst: str
    multipliers: Mapping[str, Array]
    times: Array
    tensions: Array
    trajectory: TimedPath | None

    def motion(self) -> TimedPath:
        """The trajectory.

        Raises:
            PlanningError: There is none.
        """
        if self.trajectory is None:
            raise PlanningError(
                f"free path: {self.solver}: {self.status}; missed: {self.worst or 'nothing'}; "
                "accepted: a start and a goal that some motion connects, or more knots"
            )
        return self.trajectory

    def samples(self, rate: float = 1000.0) -> MotionSamples:
        """What the motion asks between the knots too, so many times a second [Hz].

        Raises:
            PlanningError: There is no motion.
        """
        motion = self.motion()
        return sample_motion(self.task, motion, np.arange(int(motion.end_time * rate) + 1) / rate)


def solve(
    program: MathematicalProgram, guess: Array | None = None
) -> tuple[MathematicalProgramResult, str, str, float]:
    """Solves with the first of `SOLVERS` that is there, from a guess or the program's own.

    Returns:
        The result, the solver's name, what it says, and the time that it took [s].

    Raises:
        PlanningError: None is there.
    """
    for kind in SOLVERS:
        solver = kind()
        if not (solver.available() and solver.enabled()):
            continue
        options = SolverOptions()
        if kind is SnoptSolver:
            options.SetOption(solver.id(), "Major feasibility tolerance", FEASIBILITY)
            options.SetOption(solver.id(), "Major optimality tolerance", OPTIMALITY)
            options.SetOption(solver.id(), "Major iterations limit", MOST_STEPS)
        elif kind is IpoptSolver:
            options.SetOption(solver.id(), "constr_viol_tol", FEASIBILITY)
            options.SetOption(solver.id(), "tol", OPTIMALITY)
            options.SetOption(solver.id(), "max_iter", MOST_STEPS)
        begin = time.perf_counter()
        result = solver.Solve(program, program.initial_guess() if guess is None else guess, options)
        took = time.perf_counter() - begin
        words = result.get_solution_result().name
        return result, solver.SolverName(), words, took
    raise PlanningError("free path: found no solver; accepted: SNOPT, IPOPT or NLopt in Drake")


def violation(
    result: MathematicalProgramResult, bindings: Sequence[Binding]
) -> tuple[float, int, int]:
    """By how much the worst of some constraints is missed, its number and its row."""
    worst = 0.0, 0, 0
    for number, binding in enumerate(bindings):
        values = result.EvalBinding(binding)
        evaluator = binding.evaluator()
        gaps = np.maximum(evaluator.lower_bound() - values, values - evaluator.upper_bound())
        gaps = np.where(np.isfinite(gaps), gaps, np.inf) if np.any(np.isnan(gaps)) else gaps
        row = int(np.argmax(gaps))
        worst = max(worst, (float(gaps[row]), number, row))
    return worst


def multipliers(result: MathematicalProgramResult, bindings: Sequence[Binding]) -> Array:
    """Multipliers of some constraints, one after the other; NaN where the solver gives none."""
    found = []
    for binding in bindings:
        try:
            found.append(np.atleast_1d(np.asarray(result.GetDualSolution(binding), float)).ravel())
        except (RuntimeError, ValueError):
            found.append(np.full(binding.evaluator().num_constraints(), np.nan))
    return np.concatenate(found) if found else np.empty(0)
