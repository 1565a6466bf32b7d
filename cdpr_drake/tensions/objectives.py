"""What tension distributions optimise, as additions to Drake's programs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.solvers import MathematicalProgram as Program

from cdpr_drake.tensions.problem import TensionProblem

Addition = Callable[[Program, np.ndarray, TensionProblem, float], None]
"""Takes a program, its variables t / scale, shape (m,), the problem and the scale [N]."""


def one_norm(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Least sum."""
    program.AddLinearCost(np.ones(len(t)), 0.0, t)


def two_norm(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Least 2-norm."""
    program.AddQuadraticCost(2.0 * np.eye(len(t)), np.zeros(len(t)), t, is_convex=True)


def nearest_reference(
    program: Program, t: np.ndarray, problem: TensionProblem, scale: float
) -> None:
    """Least distance from the reference."""
    assert problem.reference is not None
    wanted = problem.reference / scale
    far = float(wanted @ wanted)
    program.AddQuadraticCost(2.0 * np.eye(len(t)), -2.0 * wanted, far, t, is_convex=True)


def nearest_middle(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Least distance from the middle of the bounds."""
    middle = (problem.lower + problem.upper) / (2.0 * scale)
    far = float(middle @ middle)
    program.AddQuadraticCost(2.0 * np.eye(len(t)), -2.0 * middle, far, t, is_convex=True)


def infinity_norm(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Least largest tension."""
    largest = program.NewContinuousVariables(1, "largest")
    m = len(t)
    rows = np.hstack([np.eye(m), -np.ones((m, 1))])
    unbounded = np.full(m, -np.inf)
    program.AddLinearConstraint(rows, unbounded, np.zeros(m), np.concatenate([t, largest]))
    program.AddLinearCost(np.ones(1), 0.0, largest)


def largest_margin(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Largest margin to all bounds."""
    margin = program.NewContinuousVariables(1, "margin")
    m = len(t)
    both = np.concatenate([t, margin])
    infinite = np.full(m, np.inf)
    above = np.hstack([np.eye(m), -np.ones((m, 1))])
    below = np.hstack([np.eye(m), np.ones((m, 1))])
    program.AddLinearConstraint(above, problem.lower / scale, infinite, both)
    program.AddLinearConstraint(below, -infinite, problem.upper / scale, both)
    program.AddLinearCost(-np.ones(1), 0.0, margin)


def least_slack(program: Program, t: np.ndarray, problem: TensionProblem, scale: float) -> None:
    """Least unbalanced wrench in units of row_scale, in place of balance."""
    n = len(problem.wrench)
    row_scale = np.ones(n) if problem.row_scale is None else problem.row_scale
    slack = program.NewContinuousVariables(n, "slack")
    rows = np.hstack([problem.W, -np.diag(row_scale)])
    right = -problem.wrench / scale
    program.AddLinearEqualityConstraint(rows, right, np.concatenate([t, slack]))
    program.AddQuadraticCost(2.0 * np.eye(n), np.zeros(n), slack, is_convex=True)
