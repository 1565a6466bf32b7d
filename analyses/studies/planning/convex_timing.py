"""The fastest law of time along a path as one convex program: a check of the planner's passes.

It shares nothing with them: derivatives of the path by differences of poses, statics from
`geometry` and `statics`, limits at the middle between nodes, all speeds and tensions at once.

Source: Verscheure, Demeulenaere, Swevers, De Schutter, Diehl, Time-optimal path tracking for
robots: a convex optimization approach, 2009.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.trajectories.pose_path import PosePath

STEP = 1e-4
"""Of differences along the path, relative to its length."""


def convex_time(robot: Robot, task: PathTask, path: PosePath, count: int) -> float:
    """Time of the fastest motion from rest to rest along a path without inner rests [s].

    With u = d2s/dt2 and x = (ds/dt)^2, the time is the sum of 2 D / (sqrt x_i + sqrt x_i+1) over
    the intervals, which a second-order cone program minimises.

    Args:
        robot: The robot.
        task: The same with its limits.
        path: The path.
        count: Intervals.

    Raises:
        PlanningError: The program was not solved.
    """
    lim, m = task.limits, task.cables.count
    nodes = np.linspace(0.0, path.length, count + 1)
    way = path.length / count
    scale = 1.0 / max(lim.upper - lim.lower, 1.0)
    program = MathematicalProgram()
    x = program.NewContinuousVariables(count + 1, "x")
    root = program.NewContinuousVariables(count + 1, "root")
    inverse = program.NewContinuousVariables(count, "inverse")
    tensions = program.NewContinuousVariables(count, m, "tensions")  # in shares of their range
    program.AddBoundingBoxConstraint(0.0, 0.0, [x[0], x[-1]])
    caps = np.array([_largest(task, path, s) for s in nodes[1:-1]])
    program.AddBoundingBoxConstraint(np.zeros(count - 1), caps, x[1:-1])
    for i in range(count + 1):  # root_i^2 <= x_i
        program.AddRotatedLorentzConeConstraint(np.array([x[i], 1.0, root[i]]))
    rows = list(robot_rows(robot))
    for i in range(count):  # inverse_i (root_i + root_i+1) >= 1
        program.AddRotatedLorentzConeConstraint(np.array([inverse[i], root[i] + root[i + 1], 1.0]))
        J, rates, bends, by_u, by_x, rest = _needs(
            robot, task, path, 0.5 * (nodes[i] + nodes[i + 1])
        )
        # u = (x_i+1 - x_i) / (2 D) and x = (x_i + x_i+1) / 2, as columns for (x_i, x_i+1).
        u, mean = np.array([-1.0, 1.0]) / (2.0 * way), np.array([0.5, 0.5])
        needed = np.outer(by_u, u) + np.outer(by_x, mean)
        A = np.hstack([-J.T[rows] / scale, -needed[rows]])
        unknown = np.concatenate([tensions[i], x[i : i + 2]])
        program.AddLinearEqualityConstraint(A, rest[rows], unknown)
        low, high = np.full(m, lim.lower * scale), np.full(m, lim.upper * scale)
        program.AddBoundingBoxConstraint(low, high, tensions[i])
        bent = np.outer(rates, u) + np.outer(bends, mean)
        if np.isfinite(lim.cable_acceleration):
            most = np.full(m, lim.cable_acceleration)
            program.AddLinearConstraint(bent, -most, most, x[i : i + 2])
        if np.isfinite(lim.torque):
            T = np.hstack([-lim.ratio * np.eye(m) / scale, lim.inertia / lim.ratio * bent])
            most = np.full(m, lim.torque)
            program.AddLinearConstraint(T, -most, most, unknown)
    program.AddLinearCost(np.full(count, 2.0 * way), 0.0, inverse)
    result = ClarabelSolver().Solve(program)
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


def _largest(task: PathTask, path: PosePath, s: float) -> float:
    """Largest (ds/dt)^2 by the speeds of cables and Po [m^2/s^2]."""
    twist = _twist(path, s, STEP * path.length)
    rates = np.max(np.abs(cable_jacobian(path.pose(s), task.cables) @ twist))
    speed = min(task.limits.cable_speed / rates, task.limits.speed / np.linalg.norm(twist[3:]))
    return float(speed**2)


def _needs(robot: Robot, task: PathTask, path: PosePath, s: float) -> tuple[Array, ...]:
    """J, l', l'', and the wrench that the cables must give as by_u u + by_x x + rest."""
    h = STEP * path.length
    X: RigidTransform = path.pose(s)
    twist = _twist(path, s, h)
    bend = (_twist(path, s + h, h) - _twist(path, s - h, h)) / (2.0 * h)
    J = cable_jacobian(X, task.cables)
    before, after = (
        cable_jacobian(path.pose(s + d), task.cables) @ _twist(path, s + d, h) for d in (-h, h)
    )
    platform = rigid_platform(robot)
    M = platform.mass_matrix(X)
    w = twist[:3]
    c = X.rotation().matrix() @ platform.p_PCo
    inertia = X.rotation().matrix() @ platform.I_PPo @ X.rotation().matrix().T
    gyration = np.concatenate(
        [np.cross(w, inertia @ w), platform.mass * np.cross(w, np.cross(w, c))]
    )
    return (
        J, J @ twist, (after - before) / (2.0 * h), M @ twist, M @ bend + gyration,
        -platform.weight_wrench(X),
    )  # fmt: skip
