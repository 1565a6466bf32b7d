"""Motions whose path is free: gradients, first principles, obstacles, view, and what they cost."""

from functools import cache

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, make_path, path_task
from cdpr_drake.control.task_space import TaskGains, computed_torque
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import pose_error, pose_from_angles, pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.free_path import FreePathProgram
from cdpr_drake.planning.free_path_terms import Capsule
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances

BETWEEN = 0.02  # of a limit: between knots the motion keeps it about
START, GOAL = RigidTransform([-0.2, 0.0, 0.35]), RigidTransform([0.2, 0.0, 0.35])
MARK = np.array([-0.063, 0.0, 0.02])
SLOPES = (0.65, 0.5)
BALL = Capsule(np.array([0.0, 0.02, 0.3]), np.array([0.0, 0.02, 0.3]), 0.06)
ROUND = 0.12  # radius of the ball around the platform [m]
CLEARANCE = 0.02
NEAREST = 0.3  # depth of the mark in the camera [m]
APART = 0.01  # of cables [m]


@cache
def robot_task():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    return robot, path_task(robot, LimitSettings(tensions=(1.0, 60.0)), cables)


@cache
def solved(obstacle=False, view=False):
    robot, task = robot_task()
    program = FreePathProgram(task, START, GOAL, 8, (0.9, 0.9))
    program.AddTensionCost()
    if obstacle:
        program.AddObstacles([BALL], CLEARANCE, (robot.box_center(), ROUND))
    if view:
        mount = robot.camera_mount("onboard").pose.transform()
        program.AddFieldOfView(mount, SLOPES, MARK[:, np.newaxis], NEAREST)
        program.AddCableClearance(APART)
    return program.Solve(0.9)


@pytest.mark.parametrize("pulleys", [False, True])
def test_gradients_are_those_of_differences_and_wrenches_those_of_the_robot(pulleys):
    robot = load_robot("acrobot_large")
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    task = path_task(robot, LimitSettings(), cables)
    start = pose_from_angles(np.array([0.05, 0.0, 0.3]), np.radians([5.0, -4.0, 10.0]))
    terms = FreePathProgram(task, start, GOAL).terms
    random = np.random.default_rng(0)
    x = np.concatenate([random.normal(size=18) * 0.1, random.uniform(2.0, 20.0, 8)])

    def function(z):
        return terms.unbalanced(terms.point(z[:6], z[6:12], z[12:18]), z[18:])

    found = ExtractGradient(function(InitializeAutoDiff(x).ravel()))
    step = 1e-6
    differences = np.array([
        (function(x + step * e) - function(x - step * e)) / (2.0 * step) for e in np.eye(len(x))
    ]).T  # fmt: skip
    np.testing.assert_allclose(found, differences, atol=1e-6 * np.max(np.abs(found)))
    point = terms.point(x[:6], x[6:12], x[12:18])
    X = pose_of(point)
    wanted = computed_torque(
        X, point[7:13], X, point[7:13], point[13:], dynamics=task.dynamics,
        gains=TaskGains(stiffness=0.0, damping=0.0),
    )  # fmt: skip
    J = cable_jacobian(X, cables)
    np.testing.assert_allclose(function(x), -J.T @ x[18:] - wanted, atol=1e-9)
    np.testing.assert_allclose(terms.cable_speeds(point), J @ point[7:13], atol=1e-12)
    np.testing.assert_allclose(terms.coordinates(X), x[:6], atol=1e-12)


def pose_of(point):
    return pose_from_row(np.asarray(point[:7], float))


def test_a_solution_is_a_motion_that_keeps_the_limits():
    solution = solved()
    assert solution.success
    assert max(solution.violations.values()) < 1e-6
    assert set(solution.multipliers) == set(solution.violations)
    assert np.any(np.abs(solution.multipliers["dynamics"]) > 0.0)
    motion = solution.motion()
    assert motion.end_time == pytest.approx(0.9)
    assert max(pose_error(motion.pose(0.0), START)) < 1e-9
    assert max(pose_error(motion.pose(0.9), GOAL)) < 1e-6
    np.testing.assert_allclose(motion.velocity(0.9 - 1e-9), 0.0, atol=1e-5)
    assert np.max(solution.samples(200.0).uses) <= 1.0 + BETWEEN


def test_obstacles_are_passed_with_the_clearance():
    solution = solved(obstacle=True)
    assert solution.success
    assert solution.cost > solved().cost
    motion = solution.motion()
    robot, _ = robot_task()
    middles = np.array([motion.pose(t) @ robot.box_center() for t in np.linspace(0.0, 0.9, 91)])
    gaps = np.linalg.norm(middles - BALL.start, axis=1) - BALL.radius - ROUND
    assert np.min(gaps) > CLEARANCE - 3e-3  # between knots
    assert np.min(gaps) < CLEARANCE + 5e-3
    straight = solved().motion()
    middles = np.array([straight.pose(t) @ robot.box_center() for t in np.linspace(0.0, 0.9, 91)])
    assert np.min(np.linalg.norm(middles - BALL.start, axis=1)) < BALL.radius + ROUND
    assert np.min(measured(solution)[:, 3]) > CLEARANCE - 3e-3


def measured(solution):
    """Clearances by the room of workspaces; the obstacle is the box in the ball."""
    _, task = robot_task()
    box = box_row(BALL.start, np.full(3, 2.0 * BALL.radius / np.sqrt(3.0)))[np.newaxis]
    around = Surroundings(task.cables, np.zeros(8), obstacles=box)
    poses = [solution.motion().pose(t) for t in np.linspace(0.0, 0.9, 31)]
    return clearances(
        around,
        np.array([X.translation() for X in poses]),
        np.array([X.rotation().matrix() for X in poses]),
    )


def seen(solution):
    robot, _ = robot_task()
    camera = robot.camera_mount("onboard").pose.transform()
    motion = solution.motion()
    times = np.linspace(0.0, 0.9, 91)
    return np.array([(motion.pose(t) @ camera).inverse() @ MARK for t in times])


def test_the_target_stays_in_view_all_along():
    """Without the constraint the platform dips so far that the target is too near."""
    assert np.min(seen(solved())[:, 2]) < NEAREST - 0.05
    solution = solved(view=True)
    assert solution.success
    places = seen(solution)
    assert np.min(places[:, 2]) > NEAREST - 2e-3
    assert np.max(np.abs(places[:, 0] / places[:, 2])) < SLOPES[0] + 1e-3
    assert solution.cost > solved().cost
    assert np.min(measured(solution)[:, 0]) > APART - 1e-3


def test_least_time_is_that_of_the_best_path_or_more():
    """A planar robot along a line that symmetry makes the best path."""
    robot = load_robot("planar")
    task = path_task(robot, LimitSettings(), robot.cable_set().without_pulleys())
    ends = RigidTransform([-0.15, 0.0, 0.3]), RigidTransform([0.15, 0.0, 0.3])
    program = FreePathProgram(task, *ends, 8)
    program.AddLeastTime()
    program.AddCableSpeedLimits()
    program.AddPlaceBounds([-0.2, -0.1, 0.0], [0.2, 0.1, 0.4], 0.01)
    solution = program.Solve(0.6)
    line = plan_along_path(task, make_path(robot, list(ends), "smooth"))
    assert solution.success
    # Its accelerations are linear between knots, and cannot jump: it is somewhat slower.
    assert line.duration * 0.97 < solution.duration < 1.15 * line.duration
    assert np.max(solution.samples().uses) <= 1.0 + 2.0 * BETWEEN


def test_what_cannot_be_done_is_said():
    _, task = robot_task()
    program = FreePathProgram(task, START, GOAL, 5, (0.05, 0.06))  # 40 cm in 60 ms
    solution = program.Solve(0.05)
    assert not solution.success
    with pytest.raises(PlanningError, match=r"missed: .* by"):
        solution.motion()
    with pytest.raises(PlanningError, match="knots: found 2"):
        FreePathProgram(task, START, GOAL, 2)
    with pytest.raises(PlanningError, match="duration"):
        FreePathProgram(task, START, GOAL, 8, (1.0, 0.5))
    with pytest.raises(PlanningError, match="box: found"):
        program.AddPlaceBounds(np.zeros(3), np.ones(3), 0.6)
    turned = pose_from_angles(np.zeros(3), np.radians([0.0, 0.0, 178.0]))
    with pytest.raises(PlanningError, match="178 deg"):
        FreePathProgram(task, START, turned)


def test_a_capsule_around_a_box_holds_its_corners():
    box = box_row(np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.4, 0.2]))
    capsule = Capsule.around(box)
    np.testing.assert_allclose(capsule.end - capsule.start, [0.0, 0.4, 0.0])
    assert capsule.radius == pytest.approx(np.hypot(0.05, 0.1))
