"""Motions that turn, within a box of accelerations and moments at every instant."""

import numpy as np
import pytest

from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, path_task
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.box_timing import inertial_terms, mass_of, time_within_box
from cdpr_drake.planning.path_in_sets import proven_motion
from cdpr_drake.planning.turning_bounds import turning_bounds
from cdpr_drake.trajectories.pose_path import smooth_path
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.inertial_wrenches import moment_box, turning_wrenches
from cdpr_drake.workspaces.proven_sets import PoseSets

ROUNDING = 1e-9
BOX, ANGULAR = np.array([0.5, 0.4, 0.3]), np.array([3.0, 2.0, 1.0])
START = np.array([-0.2, 0.0, 0.2, 0.0, 0.0, np.radians(-20.0)])
GOAL = np.array([0.2, 0.1, 0.3, np.radians(8.0), np.radians(-5.0), np.radians(20.0)])
MIDDLE, HALVES = 0.5 * (START + GOAL)[3:], 0.5 * np.abs(GOAL - START)[3:]


@pytest.fixture(scope="module")
def task():
    return path_task(load_robot("acrobot_large"), LimitSettings(reserve=0.0))


@pytest.fixture(scope="module")
def moments(task):
    M = task.dynamics.M_PPo_P
    return moment_box(
        M.get_mass(), M.get_com(), M.CalcRotationalInertia().CopyToFullMatrix3(), ANGULAR
    )


@pytest.fixture(scope="module")
def path():
    rows = [(p[:3], p[3:]) for p in (START, 0.5 * (START + GOAL) + [0, 0.1, 0.1, 0, 0, 0], GOAL)]
    return smooth_path([pose_from_angles(p, a) for p, a in rows], 0.1)


def sampled(motion, count=4001):
    times = np.linspace(motion.start_time, motion.end_time, count)
    return np.array([motion.motion(t) for t in times])


def test_bounds_hold_at_samples_and_are_tight(task, path, moments):
    found = time_within_box(task, path, BOX, 300, moments)
    motion, (c, inertia) = found.plan.trajectory, mass_of(task)
    bounds = turning_bounds(motion, c, inertia, task.cables.p_PB)
    rows = sampled(motion)
    values = np.abs(inertial_terms(rows, c, inertia)[1])
    for bound, limit, some in (
        (found.accelerations, BOX, values[:, :3]), (found.moments, moments, values[:, 3:]),
    ):  # fmt: skip
        most = np.max(some, axis=0)
        assert np.all(most <= bound * (1.0 + ROUNDING))
        assert np.all(bound <= limit * (1.0 + ROUNDING))
        assert np.all(most >= 0.95 * bound)
    assert max(np.max(found.accelerations / BOX), np.max(found.moments / moments)) > 0.98
    speeds = np.linalg.norm(rows[:, 10:13], axis=1)
    assert 0.98 * bounds.speed < np.max(speeds) <= bounds.speed * (1.0 + ROUNDING)
    rates = [
        np.max(np.abs(cable_jacobian(motion.pose(t), task.cables) @ row[7:13]))
        for t, row in zip(np.linspace(0.0, motion.end_time, 400), sampled(motion, 400), strict=True)
    ]
    assert 0.5 * bounds.anchor_speed < max(rates) <= bounds.anchor_speed
    assert found.slowed < 1.02


def test_bounds_hold_where_quaternions_are_far_from_unit_length():
    """A spline through poses far apart: |q| sinks, and every part of the quotients counts."""
    angles = [np.zeros(3), np.array([1.5, -0.9, 0.4]), np.array([0.2, 1.1, -2.0])]
    poses = [pose_from_angles(0.1 * np.array([k, k % 2, 0.0]), a) for k, a in enumerate(angles)]
    path = smooth_path(poses, 0.2)
    stations = np.union1d(np.linspace(0.0, path.length, 400), path.breaks)
    x = np.sin(np.linspace(0.0, np.pi, len(stations))) ** 2 + 0.01
    x[[0, -1]] = 0.0
    motion = TimedPath.make(path, stations, x)
    assert np.ptp([np.linalg.norm(_quaternion(path, s)) for s in stations]) > 0.05
    c, inertia = np.array([0.3, -0.2, 0.1]), np.diag([0.3, 0.5, 0.7])
    found = turning_bounds(motion, c, inertia, np.array([[0.2], [0.1], [0.3]]))
    values = np.abs(inertial_terms(sampled(motion, 20_001), c, inertia)[1])
    for bound, some in ((found.accelerations, values[:, :3]), (found.moments, values[:, 3:])):
        most = np.max(some, axis=0)
        assert np.all(most <= bound * (1.0 + ROUNDING))
        assert np.all(bound <= 1.05 * most)


def _quaternion(path, s):
    """As the polynomials have it, of any length."""
    piece = min(np.searchsorted(path.breaks, s, side="right") - 1, len(path.pieces) - 1)
    powers = (s - path.breaks[piece]) ** np.arange(6)
    return powers @ path.pieces[piece].reshape(6, 7)[:, :4]


def test_terms_are_those_of_differences_of_poses(task, path):
    """Accelerations of Co and angular momentum by differences in time; nothing of the kernel."""
    c, inertia = mass_of(task)
    speed, step = 0.3, 1e-4  # ds/dt is constant: u = 0, x = speed^2

    def momentum(t):
        R = path.pose(speed * t).rotation().matrix()
        before, after = (path.pose(speed * (t + d)).rotation().matrix() for d in (-step, step))
        spin = (after - before) @ R.T / (2.0 * step)
        w = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        return R @ inertia @ R.T @ w

    for t in np.array([0.2, 0.5, 0.7]) * path.length / speed:
        X = [path.pose(speed * (t + d)) @ c for d in (-step, 0.0, step)]
        a = (X[0] - 2.0 * X[1] + X[2]) / step**2
        R = path.pose(speed * t).rotation().matrix()
        n = R.T @ (momentum(t + step) - momentum(t - step)) / (2.0 * step)
        _, bends = inertial_terms(path.points(np.array([speed * t])), c, inertia)
        np.testing.assert_allclose(speed**2 * bends[0, :3], a, atol=1e-6)
        np.testing.assert_allclose(speed**2 * bends[0, 3:], n, atol=1e-5 * np.max(inertia))


def test_the_wrench_of_the_motion_is_among_those_that_are_proven(task, path, moments):
    """By the kernel of computed torque, in the convex hull of what sets would be proven for."""
    found = time_within_box(task, path, BOX, 300, moments)
    M, motion = task.dynamics.M_PPo_P, found.plan.trajectory
    vertices = turning_wrenches(
        M.get_mass(), M.get_com(), moments, BOX, MIDDLE, HALVES + 0.05
    ).vertices  # the spline leaves the range of its ends by less
    random = np.random.default_rng(0)
    scale = 1.0 / np.max(np.abs(vertices), axis=0)
    directions = np.concatenate([np.eye(6), -np.eye(6), random.normal(size=(500, 6))]) * scale
    most = np.max(directions @ vertices.T, axis=1)
    largest = 0.0
    for t in np.linspace(0.0, motion.end_time, 500):
        row, X = motion.motion(t), motion.pose(t)
        V, A = row[7:13], row[13:19]
        asked = computed_torque(
            X, V, X, V, A, dynamics=task.dynamics, gains=TaskGains(0.0, 0.0)
        ) - computed_torque(
            X, np.zeros(6), X, np.zeros(6), np.zeros(6), dynamics=task.dynamics,
            gains=TaskGains(0.0, 0.0),
        )  # fmt: skip
        assert np.all(directions @ -asked <= most * (1.0 + ROUNDING))
        largest = max(largest, float(np.max(directions @ -asked / most)))
    assert largest > 0.8


def test_a_motion_in_sets_over_angles_is_proven_for_its_box(task, moments):
    """Two boxes of x and psi; the bounds are kept, and least time is no longer than length's."""
    lower, upper = np.zeros((2, 6)), np.zeros((2, 6))
    lower[:, [0, 2, 5]] = [[-0.3, 0.2, -0.4], [-0.1, 0.2, -0.2]]
    upper[:, [0, 2, 5]] = [[0.0, 0.4, 0.2], [0.3, 0.4, 0.4]]
    about = {
        "accelerations_m_s2": BOX.tolist(), "angular_accelerations_rad_s2": ANGULAR.tolist(),
        "moments_n_m": moments.tolist(),
    }  # fmt: skip
    sets = PoseSets(lower, upper, np.array([0, 2, 5]), about)
    start, goal = np.array([-0.2, 0, 0.3, 0, 0, -0.35]), np.array([0.2, 0, 0.3, 0, 0, 0.35])
    short = proven_motion(sets, start, goal, task, 0.1)
    fast = proven_motion(sets, start, goal, task, 0.1, cost="time")
    for found in (short, fast):
        assert found.turns
        assert np.all(found.box.moments <= moments * (1.0 + ROUNDING))
        assert np.all(found.box.accelerations <= BOX * (1.0 + ROUNDING))
        assert found.time_bound() <= found.plan.duration
        turned = found.plan.trajectory.pose(found.plan.trajectory.end_time).rotation().matrix()
        np.testing.assert_allclose(turned, rotation_from_angles(goal[3:]).matrix(), atol=1e-9)
    assert fast.plan.duration <= short.plan.duration
    poses = PoseSets(lower, upper, np.array([0, 2, 5]), {"accelerations_m_s2": None})
    assert proven_motion(poses, start, goal, task, 0.1).box is None


def test_what_cannot_be_timed_is_refused(task, path):
    with pytest.raises(PlanningError, match="moments: accepted: three half widths above 0"):
        time_within_box(task, path, BOX, 100, np.zeros(3))
    with pytest.raises(PlanningError, match="found a path that turns"):
        time_within_box(task, path, BOX, 100)
