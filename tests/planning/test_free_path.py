"""Motions whose path is free: gradients, first principles, obstacles, view, and what they cost."""

from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.robot_path_task import make_path
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.free_path import FreePathProgram
from cdpr_drake.planning.free_path_checks import Refinement
from cdpr_drake.planning.free_path_pieces import between, link, samples
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.trajectories.pose_path import straight_path
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances
from tests.planning.planning_cases import MARK, slopes, task_of

START, GOAL = RigidTransform([-0.2, 0.0, 0.35]), RigidTransform([0.2, 0.0, 0.35])
DURATION = 0.9  # [s]
BETWEEN = 0.02  # of a limit: between knots the motion keeps it about
SLOPES = (0.65, 0.5)
MIDDLE, RADIUS = np.array([0.0, 0.02, 0.3]), 0.06
ROUND = 0.12  # radius of the ball around the platform [m]
CLEARANCE, APART = 0.02, 0.01  # of obstacles and of cables [m]
NEAREST = 0.3  # depth of the mark in the camera [m]
POST = ConvexShape.box_at(np.array([0.0, 0.1, 0.3]), np.array([0.02, 0.1, 0.1]))


@cache
def robot_task(com=None):
    """ACROBOT, with its file's centre of mass or this height of it above Po [m]."""
    robot = load_robot("acrobot_large")
    if com is not None:
        robot.platform.center_of_mass = np.array([0.0, 0.0, com])
    return robot, task_of(robot, cables=robot.cable_set().without_pulleys())


def body_of(robot):
    return ConvexShape.box_at(robot.box_center(), robot.platform.size)


@cache
def solved(obstacle=False, view=False):
    robot, task = robot_task()
    program = FreePathProgram(task, START, GOAL, 8, (DURATION, DURATION))
    program.AddTensionCost()
    if obstacle:
        ball = ConvexShape.sphere(MIDDLE, RADIUS)
        around = ConvexShape.sphere(robot.box_center(), ROUND)
        program.AddObstacles([ball], CLEARANCE, [around])
    if view:
        mount = robot.camera_mount("onboard").pose.transform()
        program.AddFieldOfView(mount, SLOPES, MARK, NEAREST)
        program.AddCableClearance(APART)
    return program.Solve(DURATION)


def poses(solution, count=91):
    motion = solution.motion()
    return [motion.pose(t) for t in np.linspace(0.0, motion.end_time, count)]


def measured(solution):
    """Clearances by the room of workspaces; the obstacle is the box in the ball."""
    box = box_row(MIDDLE, np.full(3, 2.0 * RADIUS / np.sqrt(3.0)))[np.newaxis]
    around = Surroundings(robot_task()[1].cables, np.zeros(8), obstacles=box)
    X = poses(solution, 31)
    positions = np.array([one.translation() for one in X])
    return clearances(around, positions, np.array([one.rotation().matrix() for one in X]))


def test_a_solution_is_a_motion_that_keeps_the_limits():
    solution = solved()
    assert solution.success
    assert max(solution.violations.values()) < 1e-6
    assert set(solution.multipliers) == set(solution.violations)
    assert np.any(np.abs(solution.multipliers["dynamics"]) > 0.0)
    motion = solution.motion()
    assert motion.end_time == pytest.approx(DURATION)
    assert max(pose_error(motion.pose(0.0), START)) < 1e-9
    assert max(pose_error(motion.pose(DURATION), GOAL)) < 1e-6
    np.testing.assert_allclose(motion.velocity(DURATION - 1e-9), 0.0, atol=1e-5)
    assert np.max(solution.samples(200.0).uses) <= 1.0 + BETWEEN


def test_obstacles_are_passed_with_the_clearance():
    solution, center = solved(obstacle=True), robot_task()[0].box_center()
    assert solution.success
    assert solution.cost > solved().cost
    gaps, free = (
        min(np.linalg.norm(X @ center - MIDDLE) for X in poses(one)) - RADIUS - ROUND
        for one in (solution, solved())
    )
    assert CLEARANCE - 3e-3 < gaps < CLEARANCE + 5e-3  # between knots
    assert free < 0.0
    assert np.min(measured(solution)[:, 3]) > CLEARANCE - 3e-3


def seen(solution):
    camera = robot_task()[0].camera_mount("onboard").pose.transform()
    return np.array([(X @ camera).inverse() @ MARK[:, 0] for X in poses(solution)])


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
    task = task_of(robot, None, cables=robot.cable_set().without_pulleys())
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


def test_what_cannot_be_done_is_no_success_and_no_motion():
    program = FreePathProgram(robot_task()[1], START, GOAL, 5, (0.05, 0.06))  # 40 cm in 60 ms
    solution = program.Solve(0.05)
    assert not solution.success
    with pytest.raises(PlanningError, match=r"missed: .* by"):
        solution.motion()


@pytest.mark.parametrize(
    ("function", "size"),
    [
        (lambda x: between(x, 5, 0.3), 13),
        (lambda x: between(x, 5, 0.3, 0), 13),
        (lambda x: link(x, 5), 19),
    ],
    ids=["between", "positions", "link"],
)
def test_jacobians_of_pieces_are_those_of_differences(function, size):
    x = np.random.default_rng(0).uniform(0.5, 1.5, size)
    expected = slopes(lambda z: function(z)[0], x, 1e-5)
    np.testing.assert_allclose(function(x)[1], expected, atol=1e-9)


def test_pieces_are_cubic():
    q, v, a = np.random.default_rng(0).normal(size=(3, 2, 3))
    x = np.concatenate([q[0], v[0], a[0], a[1], [0.7]])
    end = between(x, 1, 1.0)[0]
    linked = np.concatenate([q[0], v[0], a[0], end[:6], a[1], [0.7]])
    np.testing.assert_allclose(link(linked, 1)[0], 0.0, atol=1e-15)
    every = samples(q, v, a, 0.7, 10)[0]
    np.testing.assert_allclose(every[3], between(x, 1, 0.3)[0], atol=1e-14)


@cache
def past_the_post(rounds):
    """Past a box whose corner a motion cuts between knots, with the platform's own box.

    The mass is in the middle of the platform's box. With it at the bottom, where the file has it,
    refinement is slower: four rounds leave 0.8 mm, six 0.02 mm, eight 0.001 mm.
    """
    robot, task = robot_task(com=0.035)
    program = FreePathProgram(task, START, GOAL, 6, (DURATION, DURATION))
    program.AddTensionCost()
    program.AddObstacles([POST], CLEARANCE, [body_of(robot)])
    return program.Solve(DURATION, refine=Refinement(rounds=rounds))


@pytest.mark.parametrize(("rounds", "kept"), [(0, False), (1, False), (4, True)])
def test_what_is_missed_between_knots_is_asked_for_there_or_is_no_success(rounds, kept):
    """By distances of Drake's shapes, not by those of the program; without rounds none is asked."""
    solution, body = past_the_post(rounds), body_of(robot_task()[0])
    left = solution.between["obstacles"]
    gap = min(body.moved(X).distance(POST)[0] for X in poses(solution, 301))
    assert left.kept == kept
    assert (left.missed < 1e-5) == kept
    assert (left.missed > 1e-4) >= (rounds == 0)
    assert left.missed > CLEARANCE - gap - 1e-6
    assert gap > CLEARANCE - left.bound
    assert left.missed <= left.bound < left.missed + 0.03  # half the way between instants
    assert solution.success == (kept or rounds == 0)
    words = f"missed between knots after {rounds} rounds: obstacles by {left.missed:.3g}"
    assert (words in solution.status) == (not solution.success)
    assert solution.motion().end_time == pytest.approx(DURATION)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_guess_decides_on_which_side_an_obstacle_is_passed(side):
    robot, task = robot_task()
    ends = [RigidTransform([-0.3, 0.0, 0.35]), RigidTransform([0.3, 0.0, 0.35])]
    program = FreePathProgram(task, *ends, 6, (2.0, 2.0))
    program.AddPlaceBounds(robot.frame.lower, robot.frame.upper)
    ball = ConvexShape.sphere(np.array([0.0, 0.0, 0.35]), 0.04)
    program.AddObstacles([ball], CLEARANCE, [body_of(robot)])
    way = straight_path([ends[0], RigidTransform([0.0, 0.2 * side, 0.35]), ends[1]], 0.2)
    motion = program.Solve(2.0, way, Refinement(rounds=0)).motion()
    assert side * motion.pose(1.0).translation()[1] > 0.05
