"""Tension distribution as mathematical programs: the reference for the kernels, with any solver."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import MakeSolver, MathematicalProgram, Solve, SolverId

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.tensions.problem import TensionProblem


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
