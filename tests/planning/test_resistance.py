"""A path on which wrenches must be resisted: programs of scipy, samples between stations."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
)
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import PlanningError, WrenchSetError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_from_angles, pose_from_row, pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.failures import check_held, stuck
from cdpr_drake.planning.path_task import sample_motion, samples_at
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.planning.resistance import (
    resistance_bounds,
    resisted,
    resisted_along,
    row_count,
)
from cdpr_drake.trajectories.pose_path import POINT_SIZE
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

BETWEEN = 2e-3  # of half the range, by which a limit may be missed between two of 500 stations
NEAR = 1e-9  # of half the range: verdicts of two solvers may differ where the margin is smaller
EXACT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
AGREEMENT = 1e-9  # of half the range, of margins by two solvers; HiGHS's tolerances over limits
SLACK = 1e-9  # relative to the time: rounding of the same plan


def pose(*numbers):
    return pose_from_angles(np.array(numbers[:3]), np.radians(numbers[3:] or (0.0, 0.0, 0.0)))


CASES = {
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


def path_of(name):
    limits, poses, wrenches = CASES[name]
    robot = load_robot(name)
    task = path_task(robot, LimitSettings(tensions=limits, reserve=RESERVE), resist=wrenches)
    return task, make_path(robot, poses, "smooth")


@cache
def planned(name):
    task, path = path_of(name)
    return plan_along_path(task, path)


def least_miss(task, point, u, x, corner):
    """Largest d with tensions d half ranges within all limits, by HiGHS on W t + w = 0 itself."""
    X = pose_from_row(point[:7])
    V, A = point[7:13] * np.sqrt(x), point[7:13] * u + point[13:19] * x
    gains = TaskGains(stiffness=0.0, damping=0.0)
    wanted = computed_torque(X, V, X, V, A, dynamics=task.dynamics, gains=gains)
    rows, lim, m = list(task.dynamics.motions), task.limits, task.cables.count
    W = -cable_jacobian(X, task.cables).T[rows]
    half = 0.5 * (lim.upper - lim.lower)
    stations, _ = task.stations(point[np.newaxis])
    growth = stations[0, 3] * u + stations[0, 4] * x
    mass, span = lim.inertia / lim.ratio**2, lim.torque / lim.ratio
    eye, one = np.eye(m), np.ones((m, 1))
    A_ub = [np.hstack([eye, half * one]), np.hstack([-eye, half * one])]
    b_ub = [np.full(m, lim.upper), np.full(m, -lim.lower)]
    if np.isfinite(span):
        A_ub += [np.hstack([eye, span * one]), np.hstack([-eye, span * one])]
        b_ub += [span + mass * growth, span - mass * growth]
    found = linprog(
        np.append(np.zeros(m), -1.0),
        np.vstack(A_ub), np.concatenate(b_ub),
        np.hstack([W, np.zeros((len(rows), 1))]), wanted[rows] - corner[rows],
        bounds=[(None, None)] * m + [(None, 1.0)], options=EXACT,
    )  # fmt: skip
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize(
    ("name", "count", "faster", "harder"),
    [("planar", 400, 8.0, 6.0), ("acrobot_large", 300, 0.3, 2.0), ("caroca", 300, 0.15, 8.0)],
)
def test_bounds_give_the_verdicts_of_linear_programs(name, count, faster, harder):
    """1000 random poses, accelerations, speeds and corners, near the limits and beyond them."""
    rng = np.random.default_rng(5)
    task, path = path_of(name)
    points = path.points(rng.uniform(0.0, path.length, count))
    u, x = 6.0 * faster * rng.standard_normal(count), 2.0 * faster * rng.uniform(size=count) ** 3
    inside = outside = 0
    for k in range(count):
        point = points[k : k + 1]
        corner = task.resist[rng.integers(len(task.resist))] * rng.uniform(0.0, harder)
        one = replace(task, resist=corner[np.newaxis])
        uses = samples_at(one, point, np.zeros(1), np.zeros(1), u[k : k + 1], np.sqrt(x[k : k + 1]))
        d = least_miss(task, point[0], u[k], x[k], corner)
        alone = least_miss(task, point[0], u[k], x[k], np.zeros(6))
        found = resisted(one, point, np.zeros(1), u[k : k + 1], x[k : k + 1])
        np.testing.assert_allclose(found.margins[0], d, atol=AGREEMENT)
        if abs(d) > NEAR and (alone > NEAR or np.isinf(task.limits.torque)):
            assert (uses.resisted[0] <= 1.0) == (d >= 0.0)
            inside, outside = inside + (d >= 0.0), outside + (d < 0.0)
    assert min(inside, outside) > 0.08 * count


@pytest.mark.parametrize("name", CASES)
def test_a_plan_resists_between_its_stations_and_is_not_faster(name):
    plan = planned(name)
    without = plan_along_path(replace(plan.task, resist=np.empty((0, 6))), plan.path)
    assert plan.duration >= without.duration * (1.0 - SLACK)
    times = np.random.default_rng(1).uniform(0.0, plan.duration, 10_000)
    samples = sample_motion(plan.task, plan.trajectory, times)
    assert np.max(samples.resisted) <= 1.0 + BETWEEN
    missed = sample_motion(plan.task, without.trajectory, times)
    assert np.max(missed.resisted) > 1.0 + 3 * BETWEEN  # what a plan without it would do


def test_the_margins_of_corners_are_told_and_the_least_is_zero():
    plan = planned("acrobot_large")
    found = resisted_along(plan.task, plan.trajectory)
    assert len(found.margins) == 64
    np.testing.assert_allclose(np.min(found.margins), 0.0, atol=1e-6)
    samples = plan.samples()
    assert np.mean(samples.active()["wrench to resist"]) > 0.9
    # A convex combination of corners is resisted, too.
    rng = np.random.default_rng(2)
    inner = rng.dirichlet(np.ones(64), 20) @ plan.task.resist
    more = resisted_along(replace(plan.task, resist=inner), plan.trajectory)
    assert np.min(more.margins) >= -1e-9


def test_the_largest_speeds_of_stations_are_never_larger():
    plan = planned("acrobot_large")
    without = plan_along_path(replace(plan.task, resist=np.empty((0, 6))), plan.path)
    assert np.all(plan.largest <= without.largest * (1.0 + 1e-9))
    assert np.any(plan.largest < 0.9 * without.largest)


def test_where_it_fails_the_message_names_wrench_and_cables():
    robot = load_robot("acrobot_large")
    poses = CASES["acrobot_large"][1]
    wrenches = SpatialSet(box=np.array([0.0, 0, 0, 9.0, 0, 0]))
    task = path_task(robot, LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE), resist=wrenches)
    with pytest.raises(
        PlanningError,
        match=r"at s = 0 m .*pose \(0, 0, 0.2\).* under the wrench \(0, 0, 0\) N m, "
        r"\(-?9, 0, 0\) N to resist; .*C\d",
    ):
        plan_along_path(task, make_path(robot, poses, "smooth"))
    with pytest.raises(PlanningError, match=r"start: pose .* under the wrench"):
        check_held(task, poses[0], "start")
    check_held(replace(task, resist=0.1 * task.resist), poses[0], "start")


def test_of_stations_that_no_speed_joins_the_cables_are_named():
    task, _ = path_of("acrobot_large")
    points = np.zeros((2, POINT_SIZE))
    points[:, :7] = pose_row(pose(0.1, 0.0, 0.3))
    points[:, 10] = 1.0
    stations, _ = task.stations(points)
    words = stuck(task, points, stations, np.array([0.0, 1e-3]), 1.0, 0.01, np.array([0.5, 0.6]))
    assert "cannot resist the wrenches together" in words


def test_the_number_of_bounds_and_what_is_refused():
    task, path = path_of("caroca")
    assert row_count(task) == 896
    bounds = resistance_bounds(
        task, path.points(np.zeros(1)), task.stations(path.points(np.zeros(1)))[0]
    )
    assert bounds.shape == (1, 896, 4)
    assert row_count(path_of("planar")[0]) == 12
    robot = load_robot("planar")
    with pytest.raises(WrenchSetError, match="ellipsoid: found one"):
        path_task(
            robot,
            LimitSettings(reserve=RESERVE),
            resist=SpatialSet(ellipsoid=np.array([0, 0, 0, 1.0, 1, 0])),
        )
    with pytest.raises(PlanningError, match="wrenches to resist: found shape"):
        replace(task, resist=np.zeros((2, 3)))
