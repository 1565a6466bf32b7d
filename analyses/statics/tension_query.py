"""Tensions of a robot at one pose, by one method or all: numbers and a picture of the polygon."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import WrenchBalance
from cdpr_drake.tensions.methods import METHODS, distribute, feasible_polygon, solution_space
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus


def applicable_methods(problem: TensionProblem) -> list[str]:
    """Names of the methods that take this redundancy, and a reference if they need one."""
    return [
        name
        for name, method in METHODS.items()
        if method.takes(problem.redundancy)
        and (problem.reference is not None or not method.needs_reference)
    ]


def solve_all(problem: TensionProblem) -> list[TensionSolution]:
    """The answer of every applicable method, in the order of `METHODS`."""
    return [distribute(problem, name) for name in applicable_methods(problem)]


def polygon_tensions(problem: TensionProblem) -> list[list[float]]:
    """Tensions at the corners of the feasible polygon, one list of m [N] per corner."""
    t, N = solution_space(problem)
    return (t[:, np.newaxis] + N @ feasible_polygon(problem)).T.tolist()


def underactuated_answer(robot: Robot, balance: WrenchBalance) -> dict[str, Any]:
    """What fewer cables than degrees of freedom can do at a pose, for JSON.

    `uncontrolled` has, for each twist that changes no length, its components, the combination of
    the wrench's components that no tensions change in words, and what of it nothing balances, in
    N, or N m where it names moments. `infeasible_by` is about the rest of the wrench: how far
    tensions must leave their bounds to balance what the cables do control.
    """
    from cdpr_drake.statics.controlled_wrenches import combination_words

    control, words = balance.control(), robot.motion_type().words()
    free, short = control.free.T, control.shortfall()
    cables = [cable.name for cable in robot.cables]
    return {
        "robot": robot.name,
        "method": "quadratic_program",
        "redundancy": balance.W.shape[1] - balance.W.shape[0],
        "degrees_of_freedom": len(words),
        "rank": control.rank,
        "status": str(
            TensionStatus.INFEASIBLE if control.tensions is None else TensionStatus.FEASIBLE
        ),
        "tensions_n": None if control.tensions is None else control.tensions.tolist(),
        "rows": list(words),
        "wrench_n_m_n": balance.wrench.tolist(),
        "infeasible_by": None if short is None else short.as_dict(cables),
        "uncontrolled": [
            {
                "combination": combination_words(twist, words),
                "components": dict(zip(words, twist.tolist(), strict=True)),
                "unbalanced": float(off),
            }
            for twist, off in zip(free, control.unbalanced, strict=True)
        ],
    }
