"""The fastest law of time along a path as one convex program: a check of the planner's passes.

`PathTimingProgram` is the program; what it is given here shares nothing with the passes:
derivatives of the path by differences of poses, statics from `geometry` and `statics`, limits at
the middle between nodes.

Source: Verscheure, Demeulenaere, Swevers, De Schutter, Diehl, Time-optimal path tracking for
robots: a convex optimization approach, 2009.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.solvers import ClarabelSolver

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.path_timing_program import Asks, PathAsks, PathTimingProgram
from cdpr_drake.trajectories.pose_path import PosePath

STEP = 1e-4
"""Of differences along the path, relative to its length."""


def convex_time(robot: Robot, task: PathTask, path: PosePath, count: int) -> float:
    """Time of the fastest motion from rest to rest along a path without inner rests [s].

    Args:
        robot: The robot.
        task: The same with its limits.
        path: The path.
        count: Intervals.

    Raises:
        PlanningError: The program was not solved.
    """
    made = PathTimingProgram(task, path, at=(0.5,), asks=difference_asks(robot, task), even=count)
    result = ClarabelSolver().Solve(made.prog())
    if not result.is_success():
        raise PlanningError(f"convex program: {result.get_solution_result()}; accepted: solved")
    return float(result.get_optimal_cost())


def robot_rows(robot: Robot) -> tuple[int, ...]:
    """Components of a wrench that the robot's platform feels."""
    return robot.servo_rows("the convex program")


def _twist(path: PosePath, s: float, step: float) -> Array:
    """X' by central differences of poses, shape (6,)."""
    a, b = path.pose(s - step), path.pose(s + step)
    turn = rotation_vector(b.rotation() @ a.rotation().inverse())
    return np.concatenate([turn, b.translation() - a.translation()]) / (2.0 * step)


def difference_asks(robot: Robot, task: PathTask) -> Asks:
    """What a path asks, by differences of its poses."""
    rows, platform = list(robot_rows(robot)), rigid_platform(robot)

    def at(path: PosePath, s: float) -> tuple[Any, ...]:
        h = STEP * path.length
        X: RigidTransform = path.pose(s)
        twist = _twist(path, s, h)
        bend = (_twist(path, s + h, h) - _twist(path, s - h, h)) / (2.0 * h)
        J = cable_jacobian(X, task.cables)
        before, after = (
            cable_jacobian(path.pose(s + d), task.cables) @ _twist(path, s + d, h) for d in (-h, h)
        )
        M = platform.mass_matrix(X)
        w = twist[:3]
        c = X.rotation().matrix() @ platform.p_PCo
        inertia = X.rotation().matrix() @ platform.I_PPo @ X.rotation().matrix().T
        gyration = np.concatenate(
            [np.cross(w, inertia @ w), platform.mass * np.cross(w, np.cross(w, c))]
        )
        by_move, by_turn = task.dynamics.damping
        return (
            -J.T[rows], (M @ twist)[rows], (M @ bend + gyration)[rows],
            (np.repeat([by_turn, by_move], 3) * twist)[rows], -platform.weight_wrench(X)[rows],
            J @ twist, (after - before) / (2.0 * h), np.linalg.norm(twist[3:]),
        )  # fmt: skip

    def asks(path: PosePath, places: Array) -> PathAsks:
        return PathAsks(*map(np.array, zip(*(at(path, float(s)) for s in places), strict=True)))

    return asks
