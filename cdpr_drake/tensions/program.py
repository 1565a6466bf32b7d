"""Tension distribution as mathematical programs: the reference for the kernels, with any solver."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.solvers import MakeSolver, MathematicalProgram, Solve, SolverId

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.tensions.problem import TensionProblem

Addition = Callable[[MathematicalProgram, np.ndarray, TensionProblem, float], None]


def _one_norm(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    program.AddLinearCost(np.ones(len(t)), 0.0, t)


def _two_norm(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    program.AddQuadraticCost(2.0 * np.eye(len(t)), np.zeros(len(t)), t, is_convex=True)


def _reference(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    assert problem.reference is not None
    wanted = problem.reference / scale
    program.AddQuadraticCost(2.0 * np.eye(len(t)), -2.0 * wanted, t, is_convex=True)


def _infinity_norm(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    largest = program.NewContinuousVariables(1, "largest")
    m = len(t)
    rows = np.hstack([np.eye(m), -np.ones((m, 1))])
    unbounded = np.full(m, -np.inf)
    program.AddLinearConstraint(rows, unbounded, np.zeros(m), np.concatenate([t, largest]))
    program.AddLinearCost(np.ones(1), 0.0, largest)


def _margin(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    margin = program.NewContinuousVariables(1, "margin")
    m = len(t)
    both = np.concatenate([t, margin])
    infinite = np.full(m, np.inf)
    above = np.hstack([np.eye(m), -np.ones((m, 1))])
    below = np.hstack([np.eye(m), np.ones((m, 1))])
    program.AddLinearConstraint(above, problem.lower / scale, infinite, both)
    program.AddLinearConstraint(below, -infinite, problem.upper / scale, both)
    program.AddLinearCost(-np.ones(1), 0.0, margin)


def _least_slack(
    program: MathematicalProgram, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    n = len(problem.wrench)
    row_scale = np.ones(n) if problem.row_scale is None else problem.row_scale
    slack = program.NewContinuousVariables(n, "slack")
    rows = np.hstack([problem.W, -np.diag(row_scale)])
    right = -problem.wrench / scale
    program.AddLinearEqualityConstraint(rows, right, np.concatenate([t, slack]))
    program.AddQuadraticCost(2.0 * np.eye(n), np.zeros(n), slack, is_convex=True)


GOALS: dict[str, Addition] = {
    "linear_program": _one_norm,
    "quadratic_program": _two_norm,
    "reference_program": _reference,
    "infinity_norm": _infinity_norm,
    "optimally_safe": _margin,
    "slack_relaxed": _least_slack,
}
"""What can be optimised, by the name of the method in `methods.METHODS`."""


def make_program(
    problem: TensionProblem, goal: str
) -> tuple[MathematicalProgram, np.ndarray, float]:
    """The program of a goal, with its decision variables t / scale, shape (m,), and the scale [N].

    min goal(t) subject to W t + w = 0, lower <= t <= upper; `slack_relaxed` puts row_scale times a
    slack in the place of 0, and makes that least. Scaled by the size of the forces, so
    that a solver's tolerances mean the same for every robot. Add to it what you like.

    Args:
        problem: The problem.
        goal: A name of `GOALS`.

    Raises:
        TensionProblemError: Unknown goal, or one that needs a reference and finds none.

    Source: Gazebo thesis (6.24), (6.25); servoing thesis (1.24)-(1.26).
    """
    if goal not in GOALS:
        raise TensionProblemError(f"goal: found {goal}; accepted: {', '.join(GOALS)}")
    if goal == "reference_program" and problem.reference is None:
        raise TensionProblemError(f"{goal}: found no reference; accepted: tensions [N]")
    scale = max(float(np.linalg.norm(problem.wrench)), float(np.linalg.norm(problem.lower)), 1.0)
    program = MathematicalProgram()
    t = program.NewContinuousVariables(problem.W.shape[1], "t")
    if goal != "slack_relaxed":
        program.AddLinearEqualityConstraint(problem.W, -problem.wrench / scale, t)
    program.AddBoundingBoxConstraint(problem.lower / scale, problem.upper / scale, t)
    GOALS[goal](program, t, problem, scale)
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
