"""Robots, tasks, paths and oracles that tests of planning share."""

from functools import cache

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

BETWEEN = 2e-3  # of a limit, by which a plan may miss it between two of 500 stations

SETS_BOX = np.array([0.5, 0.5, 0.5])  # accelerations of motions in sets [m/s^2]
MARK = np.array([[-0.063], [0.0], [0.02]])  # what ACROBOT's camera looks at [m]


def pose(*numbers):
    """Of a position [m] and perhaps angles [deg]."""
    return pose_from_angles(np.array(numbers[:3], float), np.radians(numbers[3:] or (0, 0, 0)))


PATHS = {
    "planar": (
        (1.0, 60.0),
        [pose(-0.1, 0.1, 0.3), pose(0.15, -0.1, 0.3, 0, 0, 10), pose(0.2, 0.1, 0.3)],
        SpatialSet(box=np.array([0.0, 0.0, 0.2, 10.0, 6.0, 0.0])),
    ),
    "acrobot_large": (
        (1.0, 60.0),
        [pose(0, 0, 0.2), pose(0.15, -0.1, 0.4, 4, -3, 6), pose(-0.1, 0.1, 0.3)],
        SpatialSet(box=np.array([0.02, 0.02, 0.02, 2.0, 2.0, 1.0])),
    ),
    "caroca": (
        (30.0, 1e4),
        [pose(0, 0, 1.0), pose(0.5, 0.8, 1.4, 4, -3, 6), pose(-0.3, 0.5, 1.2)],
        SpatialSet(
            vertices=np.array([[0, 0, 0, 120.0, 0, 0], [5.0, 0, 0, -80.0, 0, 60.0]]),
            box=np.array([0, 0, 2.0, 0, 30.0, 0]),
        ),
    ),
}
"""Limits of tensions [N], poses of a path, and wrenches to resist on it."""


def task_of(robot, tensions=(1.0, 60.0), *, cables=None, resist=None, reserve=RESERVE, **limits):
    """A robot for planning, with the usual reserve."""
    limits = robot_limits(robot, tensions, **limits)
    return path_task(robot, limits, cables, reserve=reserve, resist=resist)


@cache
def case(name, corners="smooth", resist=False):
    """Robot, task and path; nobody changes them."""
    robot = load_robot(name)
    tensions, poses, wrenches = PATHS[name]
    task = task_of(robot, tensions, resist=wrenches if resist else None)
    return robot, task, make_path(robot, poses, corners)


@cache
def planned(name, corners="smooth", resist=False):
    _, task, path = case(name, corners, resist)
    return plan_along_path(task, path)


@cache
def damped_acrobot(pulleys=False):
    """Robot and task, with tensions of 1 N to 60 N and no reserve."""
    robot = load_robot("acrobot_large")
    robot.damping = PlatformDamping(translation=7.0, rotation=0.9)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    return robot, path_task(robot, robot_limits(robot, (1.0, 60.0)), cables)


@cache
def plain_acrobot():
    return path_task(load_robot("acrobot_large"))


def wrench_of(dynamics, X, V=None, A=None):
    """What cables must give for a motion at a pose, by the kernel of computed torque."""
    V, A = (np.zeros(6) if part is None else part for part in (V, A))
    return computed_torque(X, V, X, V, A, dynamics=dynamics, gains=TaskGains(0.0, 0.0))


def slopes(function, x, step=2e-5):
    """Central differences of sixth order, shape (outputs, inputs)."""

    def rate(k, e):
        return (function(x + k * step * e) - function(x - k * step * e)) / (2.0 * k * step)

    return np.array([
        1.5 * rate(1, e) - 0.6 * rate(2, e) + 0.1 * rate(3, e) for e in np.eye(len(x))
    ]).T  # fmt: skip


def largest_margin(W, wrench, low, high):
    """Largest s with W t = wrench and low + s <= t <= high - s, by HiGHS [N]."""
    m = W.shape[1]
    one = np.ones((m, 1))
    best = linprog(
        [*np.zeros(m), -1.0], A_eq=np.hstack([W, np.zeros((len(W), 1))]), b_eq=wrench,
        A_ub=np.vstack([np.hstack([-np.eye(m), one]), np.hstack([np.eye(m), one])]),
        b_ub=[*np.full(m, -low), *np.full(m, high)], bounds=(None, None),
    )  # fmt: skip
    return best.x[m]


def sampled(motion, count):
    """Times, and rows of pose, velocity and acceleration."""
    times = np.linspace(motion.start_time, motion.end_time, count)
    return times, np.array([motion.motion(t) for t in times])
