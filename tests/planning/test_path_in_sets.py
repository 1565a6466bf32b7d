"""Paths in sets: shortest by hand, inside at every instant, timed within a box of accelerations."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, path_task
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.box_timing import time_within_box
from cdpr_drake.planning.path_in_sets import proven_motion, proven_path
from cdpr_drake.planning.set_curve import control_points
from cdpr_drake.planning.set_sequences import OverlapGraph, least_ways
from cdpr_drake.trajectories.pose_path import smooth_path
from cdpr_drake.workspaces.proven_sets import PoseSets

SOLVER = 1e-6  # what Clarabel leaves of a length, relative to it
ROUNDING = 1e-9

LEFT, TOP, RIGHT = [-0.3, 0.0, 0.1, 0.6], [-0.3, 0.45, 0.3, 0.6], [0.1, 0.0, 0.3, 0.6]
LEFT = [-0.3, 0.0, -0.1, 0.6]
START, GOAL = np.array([-0.2, 0.0, 0.2, 0, 0, 0.0]), np.array([0.2, 0.0, 0.2, 0, 0, 0.0])
WAY = 2.0 * np.hypot(0.1, 0.25) + 0.2  # from corner to corner of the wall between
BOX = np.array([0.5, 0.5, 0.5])


def wall_sets(axes=(0, 2), accelerations=BOX, angles=0.0):
    """Three boxes round a wall of x -0.1..0.1 below z = 0.45, at y = 0."""
    boxes = np.array([LEFT, TOP, RIGHT])
    lower, upper = np.zeros((3, 6)), np.zeros((3, 6))
    lower[:, [0, 2]], upper[:, [0, 2]] = boxes[:, :2], boxes[:, 2:]
    if 5 in axes:
        lower[:, 5], upper[:, 5] = -angles, angles
    about = {"accelerations_m_s2": None if accelerations is None else list(accelerations)}
    return PoseSets(lower, upper, np.array(axes), about)


@pytest.fixture(scope="module")
def task():
    return path_task(load_robot("acrobot_large"), LimitSettings(reserve=0.0))


def in_sets(found, poses, slack=1e-12):
    """Which poses lie in the set of their stretch, shape (n,)."""
    s = np.linspace(0.0, found.path.length, len(poses))
    ends = found.curve.breaks
    piece = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(ends) - 2)
    sets = np.array(found.curve.sets)[piece]
    low, high = found.sets.lower[sets] - slack, found.sets.upper[sets] + slack
    return np.all((low <= poses) & (poses <= high), axis=1)


def test_the_shortest_way_over_a_wall_is_that_round_its_corners():
    found = proven_path(wall_sets(), START, GOAL, 0.1)
    assert found.length == pytest.approx(WAY, rel=SOLVER)
    assert found.sequence.sets == (0, 1, 2)
    np.testing.assert_allclose(found.sequence.points[1:3], [[-0.1, 0.45], [0.1, 0.45]], atol=1e-4)
    # over a corner of the wall both ways are at least that of the bend at its middle
    assert found.straight == pytest.approx(0.4)
    assert found.straight < found.lower_bound <= found.length
    assert found.curve.polygon <= 1.02 * found.length * (1.0 + SOLVER)
    assert [n for _, _, n in found.stretches()] == [0, 1, 2]


def test_a_way_that_no_path_avoids_bounds_all_of_them():
    low, high = np.array([[-1.0, 1.0], [0.3, -1.0]]), np.array([[1.0, 2.0], [0.5, 1.0]])
    start, goal = np.array([-1.0, 0.0]), np.array([1.0, 0.0])
    points, ways = least_ways(low, high, start, goal)
    assert ways[0] == pytest.approx(2.0 * np.sqrt(2.0), rel=1e-6)
    assert ways[0] <= 2.0 * np.sqrt(2.0)
    assert ways[1] == pytest.approx(2.0, rel=1e-6)
    assert points[0] == pytest.approx([0.0, 1.0], abs=1e-6)
    random = np.random.default_rng(0)
    for _ in range(200):
        a = random.normal(size=(1, 3))
        b = a + random.uniform(0.0, 1.0, (1, 3))
        s, g = random.normal(size=(2, 3))
        _, way = least_ways(a, b, s, g)
        inner = a + random.uniform(0.0, 1.0, (300, 3)) * (b - a)
        over = np.linalg.norm(inner - s, axis=1) + np.linalg.norm(inner - g, axis=1)
        assert way[0] <= np.min(over)


@pytest.mark.parametrize("seed", range(6))
def test_paths_through_random_boxes_stay_in_them_and_above_the_bound(seed):
    random = np.random.default_rng(seed)
    middles = np.cumsum(random.uniform(-0.4, 0.5, (9, 3)), axis=0)
    halves = random.uniform(0.3, 0.6, (9, 3))
    lower, upper = np.zeros((9, 6)), np.zeros((9, 6))
    lower[:, :3], upper[:, :3] = middles - halves, middles + halves
    sets = PoseSets(lower, upper, np.arange(3))
    start, goal = np.zeros(6), np.zeros(6)
    start[:3], goal[:3] = middles[0] - 0.9 * halves[0], middles[-1] + 0.9 * halves[-1]
    found = proven_path(sets, start, goal, 0.1)
    assert found.straight <= found.lower_bound <= found.length * (1.0 + SOLVER)
    points = found.path.points(np.linspace(0.0, found.path.length, 20_000))
    poses = np.zeros((len(points), 6))
    poses[:, :3] = points[:, 4:7]
    assert np.all(in_sets(found, poses))
    assert all(length >= found.length - ROUNDING for length, _ in found.looked_at)
    ends = found.path.points(np.array([0.0, found.path.length]))[:, 4:7]
    np.testing.assert_allclose(ends, [start[:3], goal[:3]], atol=1e-12)
    graph = OverlapGraph(lower[:, :3], upper[:, :3], sets.graph, start[:3], goal[:3])
    assert graph.bound() <= found.length * (1.0 + SOLVER)


def test_the_curve_has_two_continuous_derivatives():
    path = proven_path(wall_sets(), START, GOAL, 0.1).path
    before = path.points(path.breaks[1:-1] - 1e-9)
    after = path.points(path.breaks[1:-1] + 1e-9)
    np.testing.assert_allclose(before, after, atol=1e-5)
    assert np.max(np.abs(after[:, 13:])) > 0.1  # it bends, so this says something


def test_gcs_finds_the_same_way_where_it_is_easy():
    found = proven_path(wall_sets(), START, GOAL, 0.1, method="gcs")
    assert found.length == pytest.approx(WAY, rel=1e-4)
    assert found.method == "gcs"


def test_turns_stay_in_their_ranges(task):
    sets = wall_sets(axes=(0, 2, 5), accelerations=None, angles=np.radians(20.0))
    goal = GOAL.copy()
    goal[5] = np.radians(20.0)
    start = START.copy()
    start[5] = np.radians(-20.0)
    found = proven_path(sets, start, goal, 0.1)
    points = found.path.points(np.linspace(0.0, found.path.length, 3000))
    poses = np.zeros((len(points), 6))
    poses[:, :3] = points[:, 4:7]
    from cdpr_drake.geometry.poses import pose_from_row

    poses[:, 3:] = [angles_from_rotation(pose_from_row(p[:7]).rotation()) for p in points]
    assert np.all(in_sets(found, poses, 1e-10))
    assert np.ptp(poses[:, 5]) == pytest.approx(np.radians(40.0), rel=1e-6)
    # derivatives along the path are those of the poses
    step = 1e-6
    near = found.path.points(np.array([0.3 * found.path.length + k * step for k in (-1, 0, 1)]))
    rate = (near[2, 4:7] - near[0, 4:7]) / (2.0 * step)
    np.testing.assert_allclose(near[1, 10:13], rate, atol=1e-6)


@pytest.mark.parametrize("cost", ["length", "time"])
def test_the_motion_stays_in_the_box_at_every_instant(task, cost):
    found = proven_motion(wall_sets(), START, GOAL, task, 0.1, cost=cost)
    motion = found.plan.trajectory
    rows = np.array([motion.motion(t) for t in np.linspace(0.0, motion.end_time, 20_001)])
    most = np.max(np.abs(rows[:, 16:19]), axis=0)
    assert np.all(most <= found.box.accelerations * (1.0 + ROUNDING))
    assert np.all(found.box.accelerations <= BOX * (1.0 + ROUNDING))
    assert np.max(most) > 0.99 * BOX[0]  # and uses it
    assert np.max(np.linalg.norm(rows[:, 10:13], axis=1)) <= found.box.speed * (1.0 + ROUNDING)
    assert found.box.slowed < 1.01
    assert found.time_bound() <= found.plan.duration
    assert found.time_bound() > 0.4 * found.plan.duration


def test_least_time_is_not_longer_than_that_of_the_shortest_path(task):
    short = proven_motion(wall_sets(), START, GOAL, task, 0.1)
    fast = proven_motion(wall_sets(), START, GOAL, task, 0.1, cost="time")
    assert fast.plan.duration < 0.99 * short.plan.duration
    assert fast.path.curve.polygon >= short.path.length


def test_a_straight_line_takes_the_time_of_full_thrust(task):
    goal = START + np.array([0, 0, 0.3, 0, 0, 0.0])
    found = proven_motion(wall_sets(), START, goal, task, 0.1)
    assert found.plan.duration == pytest.approx(2.0 * np.sqrt(0.3 / 0.5), rel=1e-3)
    assert found.time_bound() == pytest.approx(2.0 * np.sqrt(0.3 / 0.5), rel=1e-9)


def test_against_damping_tensions_are_kept_at_samples(task):
    """The box holds no damping: with it the motion in the box asks for too much, and is slowed."""
    loose = replace(task, limits=replace(task.limits, lower=1.0, upper=60.0))
    damped = replace(loose, dynamics=replace(loose.dynamics, damping=(60.0, 0.0)))
    path = proven_path(wall_sets(), START, GOAL, 0.1).path
    found = time_within_box(damped, path, BOX)
    in_box = time_within_box(loose, path, BOX)
    assert found.slowed > 1.05
    assert found.plan.duration == pytest.approx(found.slowed / in_box.slowed * in_box.plan.duration)
    assert np.max(found.plan.samples().uses) <= 1.0 + ROUNDING
    assert np.max(replace(in_box.plan, task=damped).samples().uses) > 1.05


def test_control_points_bound_a_polynomial():
    powers = np.array([[1.0], [-3.0], [2.0], [4.0]])
    points = control_points(powers)
    values = np.polynomial.polynomial.polyval(np.linspace(0, 1, 50), powers[:, 0])
    assert points[0, 0] == values[0]
    assert points[-1, 0] == pytest.approx(values[-1])
    assert np.min(points) <= np.min(values) <= np.max(values) <= np.max(points)


def test_what_cannot_be_planned_is_refused(task):
    sets = wall_sets()
    with pytest.raises(PlanningError, match="from: found a pose in none of 3 proven sets"):
        proven_path(sets, START + 1.0, GOAL, 0.1)
    with pytest.raises(PlanningError, match="to: found the pose of the start"):
        proven_path(sets, START, START, 0.1)
    with pytest.raises(PlanningError, match="method: found 'x'; accepted: sequences, gcs"):
        proven_path(sets, START, GOAL, 0.1, method="x")
    with pytest.raises(PlanningError, match="cost: found 'x'; accepted: length, time"):
        proven_motion(sets, START, GOAL, task, 0.1, cost="x")
    two = PoseSets(sets.lower[[0, 2]], sets.upper[[0, 2]], sets.axes, sets.about)
    with pytest.raises(PlanningError, match="that 2 proven sets do not connect; accepted: sets of"):
        proven_path(two, START, GOAL, 0.1)
    turned = [pose_from_angles(np.array(p), np.array(a)) for p, a in (
        ([0, 0, 0.3], [0, 0, 0]), ([0.1, 0, 0.3], [0, 0, 0.1]))]  # fmt: skip
    with pytest.raises(PlanningError, match="found a path that turns"):
        time_within_box(task, smooth_path(turned, 0.1), BOX)
    with pytest.raises(PlanningError, match="accelerations: accepted: three"):
        time_within_box(task, proven_path(sets, START, GOAL, 0.1).path, np.zeros(3))
