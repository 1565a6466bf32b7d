"""Motions whose path is free: gradients, first principles, obstacles, view, and what they cost."""

from functools import cache

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
)
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.free_path import FreePathProgram
from cdpr_drake.planning.free_path_checks import Refinement
from cdpr_drake.planning.free_path_pieces import between, link, samples
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.trajectories.pose_path import straight_path
from cdpr_drake.workspaces.cable_interference import Surroundings, box_row, clearances

BETWEEN = 0.02  # of a limit: between knots the motion keeps it about
START, GOAL = RigidTransform([-0.2, 0.0, 0.35]), RigidTransform([0.2, 0.0, 0.35])
MARK = np.array([-0.063, 0.0, 0.02])
SLOPES = (0.65, 0.5)
MIDDLE, RADIUS = np.array([0.0, 0.02, 0.3]), 0.06
BALL = ConvexShape.sphere(MIDDLE, RADIUS)
ROUND = 0.12  # radius of the ball around the platform [m]
CLEARANCE = 0.02
NEAREST = 0.3  # depth of the mark in the camera [m]
APART = 0.01  # of cables [m]
MIDDLE_OF_BOX = 0.035  # of ACROBOT's platform, above Po [m]


@cache
def robot_task(com=None):
    """ACROBOT, with its file's centre of mass or this height of it above Po [m]."""
    robot = load_robot("acrobot_large")
    if com is not None:
        robot.platform.center_of_mass = np.array([0.0, 0.0, com])
    cables = robot.cable_set().without_pulleys()
    return robot, path_task(robot, LimitSettings(tensions=(1.0, 60.0), reserve=RESERVE), cables)


@cache
def solved(obstacle=False, view=False):
    robot, task = robot_task()
    program = FreePathProgram(task, START, GOAL, 8, (0.9, 0.9))
    program.AddTensionCost()
    if obstacle:
        around = ConvexShape.sphere(robot.box_center(), ROUND)
        program.AddObstacles([BALL], CLEARANCE, [around])
    if view:
        mount = robot.camera_mount("onboard").pose.transform()
        program.AddFieldOfView(mount, SLOPES, MARK[:, np.newaxis], NEAREST)
        program.AddCableClearance(APART)
    return program.Solve(0.9)


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
    gaps = np.linalg.norm(middles - MIDDLE, axis=1) - RADIUS - ROUND
    assert np.min(gaps) > CLEARANCE - 3e-3  # between knots
    assert np.min(gaps) < CLEARANCE + 5e-3
    straight = solved().motion()
    middles = np.array([straight.pose(t) @ robot.box_center() for t in np.linspace(0.0, 0.9, 91)])
    assert np.min(np.linalg.norm(middles - MIDDLE, axis=1)) < RADIUS + ROUND
    assert np.min(measured(solution)[:, 3]) > CLEARANCE - 3e-3


def measured(solution):
    """Clearances by the room of workspaces; the obstacle is the box in the ball."""
    _, task = robot_task()
    box = box_row(MIDDLE, np.full(3, 2.0 * RADIUS / np.sqrt(3.0)))[np.newaxis]
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
    task = path_task(robot, LimitSettings(reserve=RESERVE), robot.cable_set().without_pulleys())
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


def test_pieces_are_cubic_and_their_jacobians_those_of_differences():
    random = np.random.default_rng(0)
    step = 1e-5
    for function, size in (
        (lambda x: between(x, 5, 0.3), 13),
        (lambda x: between(x, 5, 0.3, 0), 13),
        (lambda x: link(x, 5), 19),
    ):
        x = random.uniform(0.5, 1.5, size)
        found = function(x)[1]
        rates = [
            (function(x + step * e)[0] - function(x - step * e)[0]) / (2.0 * step)
            for e in np.eye(size)
        ]
        np.testing.assert_allclose(found, np.array(rates).T, atol=1e-9)
    q, v, a = random.normal(size=(3, 2, 3))
    x = np.concatenate([q[0], v[0], a[0], a[1], [0.7]])
    end = between(x, 1, 1.0)[0]
    linked = np.concatenate([q[0], v[0], a[0], end[:6], a[1], [0.7]])
    np.testing.assert_allclose(link(linked, 1)[0], 0.0, atol=1e-15)
    every = samples(q, v, a, 0.7, 10)[0]
    np.testing.assert_allclose(every[3], between(x, 1, 0.3)[0], atol=1e-14)


@cache
def box_program(rounds):
    """Past a box whose corner a motion cuts between knots, with the platform's own box.

    The mass is in the middle of the platform's box. With it at the bottom, where the file has it,
    refinement is slower: four rounds leave 0.8 mm, six 0.02 mm, eight 0.001 mm.
    """
    robot, task = robot_task(com=MIDDLE_OF_BOX)
    program = FreePathProgram(task, START, GOAL, 6, (0.9, 0.9))
    program.AddTensionCost()
    post = ConvexShape.box_at(np.array([0.0, 0.1, 0.3]), np.array([0.02, 0.1, 0.1]))
    body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
    program.AddObstacles([post], CLEARANCE, [body])
    return program.Solve(0.9, refine=Refinement(rounds=rounds))


def test_what_is_missed_between_knots_is_asked_for_there():
    """By distances of Drake's shapes, not by those of the program."""
    rough, fine = box_program(0), box_program(4)
    assert rough.success
    assert fine.success
    robot, _ = robot_task()
    gaps = []
    for solution in (rough, fine):
        motion = solution.motion()
        poses = [motion.pose(t) for t in np.linspace(0.0, 0.9, 301)]
        body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
        post = ConvexShape.box_at(np.array([0.0, 0.1, 0.3]), np.array([0.02, 0.1, 0.1]))
        gaps.append(min(body.moved(X).distance(post)[0] for X in poses))
    missed = [solution.between["obstacles"] for solution in (rough, fine)]
    assert missed[0].missed > 1e-4
    assert missed[0].missed > CLEARANCE - gaps[0] - 1e-6
    assert missed[1].missed < 1e-5
    assert gaps[1] > CLEARANCE - missed[1].bound
    for one in missed:
        assert one.missed <= one.bound < one.missed + 0.03  # half the way between instants


@pytest.mark.parametrize(("rounds", "kept"), [(0, False), (1, False), (4, True)])
def test_what_rounds_leave_missed_between_knots_is_no_success(rounds, kept):
    """Without rounds nothing between knots was asked."""
    solution = box_program(rounds)
    left = solution.between["obstacles"]
    assert left.kept == kept
    assert (left.missed > 1e-5) != kept
    assert solution.success == (kept or rounds == 0)
    words = f"missed between knots after {rounds} rounds: obstacles by {left.missed:.3g}"
    assert (words in solution.status) == (not solution.success)
    assert solution.motion().end_time == pytest.approx(0.9)


def test_a_guess_decides_on_which_side_an_obstacle_is_passed():
    robot, task = robot_task()
    body = ConvexShape.box_at(robot.box_center(), robot.platform.size)
    ball = ConvexShape.sphere(np.array([0.0, 0.0, 0.35]), 0.04)
    ends = [RigidTransform([-0.3, 0.0, 0.35]), RigidTransform([0.3, 0.0, 0.35])]
    for side in (-1.0, 1.0):
        program = FreePathProgram(task, *ends, 6, (2.0, 2.0))
        program.AddPlaceBounds(robot.frame.lower, robot.frame.upper)
        program.AddObstacles([ball], CLEARANCE, [body])
        corner = RigidTransform([0.0, 0.2 * side, 0.35])
        way = straight_path([ends[0], corner, ends[1]], 0.2)
        motion = program.Solve(2.0, way, Refinement(rounds=0)).motion()
        assert side * motion.pose(1.0).translation()[1] > 0.05
