"""How much of a grid of poses each tension method solves, and how long it takes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.timing import interleaved, seconds_each, seconds_per_call
from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.analyses.studies.framework.runs import Run
from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute, distribute_batch
from cdpr_drake.tensions.problem import TensionProblem, TensionStatus

TURNS_DEG = ((0.0, 0.0, 0.0), (5.0, -5.0, 10.0))
"""Angles of the platform at every position of the grid [deg]."""

TIMED = 50
"""Feasible poses over which a method is timed."""

TRUTH = "linear_program"
"""The method whose verdict counts."""


def grid_problems(robot_name: str, counts: tuple[int, int, int]) -> list[TensionProblem]:
    """The problems of holding still at the poses of a grid that fills the robot's frame.

    A planar robot keeps to its plane, and turns about z only.

    Args:
        robot_name: Name of the robot.
        counts: Positions along x, y and z.
    """
    robot = load_robot(robot_name)
    # Cells' middles, so that no position lies on the frame.
    axes = [
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in zip(robot.frame.lower, robot.frame.upper, counts, strict=True)
    ]
    turns, cables = np.radians(TURNS_DEG), robot.cable_set(pulleys=False)
    if robot.is_planar():
        axes[2] = robot.home.transform().translation()[2:]
        turns[:, :2] = 0.0
    problems = []
    for turn in turns:
        for place in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3):
            try:
                X_WP = pose_from_angles(place, turn)
                problems.append(tension_problem(robot, X_WP, cables=cables))
            except TensionProblemError:  # W is singular
                continue
    return problems


def cover(
    robot_name: str, counts: tuple[int, int, int], only: Sequence[str] | None = None
) -> list[Run]:
    """Methods on a grid.

    Args:
        robot_name: Name of the robot.
        counts: Positions along x, y and z.
        only: Names of the methods; None: every applicable one.

    Returns:
        Of each method, with robot and method as keys, poses of the grid; feasible: that can be
        held, by the linear program; solved: of these by the method, and their share; wrong: poses
        where the method's verdict on existence contradicts the linear program;
        mean_largest_tension_n: over the solved poses; call_us: one call of `distribute` with its
        checks, on feasible poses, the median; kernel_us: one pose of the batch form on one core.
    """
    problems = grid_problems(robot_name, counts)
    truth = np.array([distribute(p, TRUTH).status == TensionStatus.FEASIBLE for p in problems])
    feasible = [p for p, good in zip(problems, truth, strict=True) if good]
    methods = applicable_methods(problems[0]) if only is None and problems else only or ()
    return [
        Run(
            f"{robot_name}, {method}", None, {"robot": robot_name, "method": method},
            _method_row(method, problems, truth) | _times(method, feasible[:TIMED]),
        )
        for method in methods
    ]  # fmt: skip


def _method_row(method: str, problems: Sequence[TensionProblem], truth: Array) -> dict[str, Any]:
    solutions = [distribute(p, method) for p in problems]
    solved = np.array([s.status == TensionStatus.FEASIBLE for s in solutions])
    said = np.array([s.status != TensionStatus.INFEASIBLE for s in solutions])
    largest = [float(np.max(s.tensions)) for s, good in zip(solutions, solved, strict=True) if good]
    feasible, found = int(np.sum(truth)), int(np.sum(solved & truth))
    return {
        "poses": len(problems), "feasible": feasible, "solved": found,
        "share": found / max(feasible, 1), "wrong": int(np.sum(said != truth)),
        "mean_largest_tension_n": float(np.mean(largest)) if largest else None,
    }  # fmt: skip


def _times(method: str, problems: list[TensionProblem]) -> dict[str, Any]:
    """Times of one call of `distribute`, and of one pose of the batch form."""
    if not problems:
        return {"call_us": None, "kernel_us": None}
    W = np.array([p.W for p in problems])
    w = np.array([p.wrench for p in problems])
    low, high = problems[0].lower, problems[0].upper
    works: list[Callable[[], float]] = [
        lambda: seconds_each(problems, lambda p: distribute(p, method)),
        lambda: seconds_per_call(lambda: distribute_batch(W, w, low, high, method, threads=1), 5),
    ]
    # A method that needs long has no use for many repeats.
    single, batch = interleaved(works, 1 if works[0]() * len(problems) > 0.3 else 5)
    return {"call_us": 1e6 * single, "kernel_us": 1e6 * batch / len(problems)}
