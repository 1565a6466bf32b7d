"""Paths and motions in proven sets, also of time: inside at every instant, within their limits."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import (
    angles_from_rotation,
    pose_from_angles,
    pose_from_row,
    rotation_from_angles,
)
from cdpr_drake.proofs.box_timing import inertial_terms, mass_of, time_within_box
from cdpr_drake.proofs.path_in_sets import proven_motion, proven_path
from cdpr_drake.proofs.proven_sets import PoseSets
from cdpr_drake.proofs.set_curve import control_points
from cdpr_drake.proofs.set_sequences import OverlapGraph, least_ways
from cdpr_drake.proofs.timed_curve import RateLimits, TimedBoxes, keeps, timed_curve
from cdpr_drake.proofs.timed_motion import hop_times, motion_in_time, straight_time
from cdpr_drake.proofs.timed_sequences import TimedGraph
from cdpr_drake.proofs.timed_sets import TimedSets
from cdpr_drake.proofs.turning_bounds import turning_bounds
from cdpr_drake.trajectories.pose_path import smooth_path
from cdpr_drake.trajectories.timed_path import TimedPath
from cdpr_drake.workspaces.inertial_wrenches import moment_box, turning_wrenches
from tests.planning.planning_cases import SETS_BOX as BOX
from tests.planning.planning_cases import plain_acrobot, sampled, wrench_of

SOLVER = 1e-6  # what Clarabel leaves of a length, relative to it
ROUNDING = 1e-9

# Sets of poses.

START, GOAL = np.array([-0.2, 0.0, 0.2, 0, 0, 0.0]), np.array([0.2, 0.0, 0.2, 0, 0, 0.0])
WAY = 2.0 * np.hypot(0.1, 0.25) + 0.2  # from corner to corner of the wall between


def wall_sets(axes=(0, 2), accelerations=BOX, angles=0.0):
    """Three boxes round a wall of x -0.1..0.1 below z = 0.45, at y = 0."""
    boxes = np.array([[-0.3, 0.0, -0.1, 0.6], [-0.3, 0.45, 0.3, 0.6], [0.1, 0.0, 0.3, 0.6]])
    lower, upper = np.zeros((3, 6)), np.zeros((3, 6))
    lower[:, [0, 2]], upper[:, [0, 2]] = boxes[:, :2], boxes[:, 2:]
    if 5 in axes:
        lower[:, 5], upper[:, 5] = -angles, angles
    about = {"accelerations_m_s2": None if accelerations is None else list(accelerations)}
    return PoseSets(lower, upper, np.array(axes), about)


@pytest.fixture(scope="module")
def way():
    """The shortest path over the wall."""
    return proven_path(wall_sets(), START, GOAL, 0.1)


@pytest.fixture(scope="module")
def motions():
    """Over the wall, of least length and of least time."""
    return {
        cost: proven_motion(wall_sets(), START, GOAL, plain_acrobot(), 0.1, cost=cost)
        for cost in ("length", "time")
    }


def in_sets(found, slack=1e-12, count=5000):
    """True if every pose lies in the set of its stretch; and the poses, shape (count, 6)."""
    s = np.linspace(0.0, found.path.length, count)
    points = found.path.points(s)
    angles = [angles_from_rotation(pose_from_row(p[:7]).rotation()) for p in points]
    poses = np.hstack([points[:, 4:7], angles])
    ends = found.curve.breaks
    piece = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(ends) - 2)
    sets = np.array(found.curve.sets)[piece]
    low, high = found.sets.lower[sets] - slack, found.sets.upper[sets] + slack
    return bool(np.all((low <= poses) & (poses <= high))), poses


def test_the_shortest_way_over_a_wall_is_that_round_its_corners(way):
    assert way.length == pytest.approx(WAY, rel=SOLVER)
    assert way.sequence.sets == (0, 1, 2)
    np.testing.assert_allclose(way.sequence.points[1:3], [[-0.1, 0.45], [0.1, 0.45]], atol=1e-4)
    # over a corner of the wall both ways are at least that of the bend at its middle
    assert way.straight == pytest.approx(0.4)
    assert way.straight < way.lower_bound <= way.length
    assert way.curve.polygon <= 1.02 * way.length * (1.0 + SOLVER)
    assert [n for _, _, n in way.stretches()] == [0, 1, 2]
    gcs = proven_path(wall_sets(), START, GOAL, 0.1, method="gcs")
    assert gcs.length == pytest.approx(WAY, rel=1e-4)
    assert gcs.method == "gcs"


def test_the_curve_has_two_continuous_derivatives(way):
    inner = way.path.breaks[1:-1]
    before, after = way.path.points(inner - 1e-9), way.path.points(inner + 1e-9)
    np.testing.assert_allclose(before, after, atol=1e-5)
    assert np.max(np.abs(after[:, 13:])) > 0.1  # it bends, so this says something


def test_a_way_that_no_path_avoids_bounds_all_of_them():
    low, high = np.array([[-1.0, 1.0], [0.3, -1.0]]), np.array([[1.0, 2.0], [0.5, 1.0]])
    points, ways = least_ways(low, high, np.array([-1.0, 0.0]), np.array([1.0, 0.0]))
    assert ways == pytest.approx([2.0 * np.sqrt(2.0), 2.0], rel=1e-6)
    assert ways[0] <= 2.0 * np.sqrt(2.0)
    assert points[0] == pytest.approx([0.0, 1.0], abs=1e-6)
    random = np.random.default_rng(0)
    for _ in range(100):
        a, size = random.normal(size=(1, 3)), random.uniform(0.0, 1.0, (1, 3))
        s, g = random.normal(size=(2, 3))
        _, way = least_ways(a, a + size, s, g)
        inner = a + random.uniform(0.0, 1.0, (300, 3)) * size
        over = np.linalg.norm(inner - s, axis=1) + np.linalg.norm(inner - g, axis=1)
        assert way[0] <= np.min(over)


@pytest.mark.parametrize("seed", range(4))
def test_paths_through_random_boxes_stay_in_them_and_above_the_bound(seed):
    random = np.random.default_rng(seed)
    middles = np.cumsum(random.uniform(-0.4, 0.5, (9, 3)), axis=0)
    halves = random.uniform(0.3, 0.6, (9, 3))
    lower, upper, start, goal = (np.zeros(shape) for shape in ((9, 6), (9, 6), 6, 6))
    lower[:, :3], upper[:, :3] = middles - halves, middles + halves
    start[:3], goal[:3] = middles[0] - 0.9 * halves[0], middles[-1] + 0.9 * halves[-1]
    sets = PoseSets(lower, upper, np.arange(3))
    path = proven_path(sets, start, goal, 0.1)
    assert path.straight <= path.lower_bound <= path.length * (1.0 + SOLVER)
    inside, poses = in_sets(path)
    assert inside
    np.testing.assert_allclose(poses[[0, -1]], [start, goal], atol=1e-12)
    assert all(length >= path.length - ROUNDING for length, _ in path.looked_at)
    graph = OverlapGraph(lower[:, :3], upper[:, :3], sets.graph, start[:3], goal[:3])
    assert graph.bound() <= path.length * (1.0 + SOLVER)


def test_turns_stay_in_their_ranges():
    turn = np.array([0, 0, 0, 0, 0, np.radians(20.0)])
    sets = wall_sets(axes=(0, 2, 5), accelerations=None, angles=turn[5])
    found = proven_path(sets, START - turn, GOAL + turn, 0.1)
    inside, poses = in_sets(found, 1e-10)
    assert inside
    assert np.ptp(poses[:, 5]) == pytest.approx(np.radians(40.0), rel=1e-6)
    # derivatives along the path are those of the poses
    near = found.path.points(0.3 * found.path.length + np.array([-1e-6, 0.0, 1e-6]))
    np.testing.assert_allclose(near[1, 10:13], (near[2, 4:7] - near[0, 4:7]) / 2e-6, atol=1e-6)


def test_control_points_bound_a_polynomial():
    powers = np.array([[1.0], [-3.0], [2.0], [4.0]])
    points = control_points(powers)
    values = np.polynomial.polynomial.polyval(np.linspace(0, 1, 50), powers[:, 0])
    assert points[0, 0] == values[0]
    assert points[-1, 0] == pytest.approx(values[-1])
    assert np.min(points) <= np.min(values) <= np.max(values) <= np.max(points)


# Motions within a box of accelerations.


@pytest.mark.parametrize("cost", ["length", "time"])
def test_the_motion_stays_in_the_box_at_every_instant(motions, cost):
    found = motions[cost]
    _, rows = sampled(found.plan.trajectory, 5001)
    most = np.max(np.abs(rows[:, 16:19]), axis=0)
    assert np.all(most <= found.box.accelerations * (1.0 + ROUNDING))
    assert np.all(found.box.accelerations <= BOX * (1.0 + ROUNDING))
    assert np.max(most) > 0.99 * BOX[0]  # and uses it
    assert np.max(np.linalg.norm(rows[:, 10:13], axis=1)) <= found.box.speed * (1.0 + ROUNDING)
    assert found.box.slowed < 1.01
    assert 0.4 * found.plan.duration < found.time_bound() <= found.plan.duration


def test_least_time_is_not_longer_than_that_of_the_shortest_path(motions):
    assert motions["time"].plan.duration < 0.99 * motions["length"].plan.duration
    assert motions["time"].path.curve.polygon >= motions["length"].path.length


def test_a_straight_line_takes_the_time_of_full_thrust():
    goal = START + np.array([0, 0, 0.3, 0, 0, 0.0])
    found = proven_motion(wall_sets(), START, goal, plain_acrobot(), 0.1)
    assert found.plan.duration == pytest.approx(2.0 * np.sqrt(0.3 / 0.5), rel=1e-3)
    assert found.time_bound() == pytest.approx(2.0 * np.sqrt(0.3 / 0.5), rel=1e-9)


def test_against_damping_tensions_are_kept_at_samples(way):
    """The box holds no damping: with it the motion in the box asks for too much, and is slowed."""
    task = plain_acrobot()
    loose = replace(task, limits=replace(task.limits, lower=1.0, upper=60.0))
    damped = replace(loose, dynamics=replace(loose.dynamics, damping=(60.0, 0.0)))
    found, free = (time_within_box(one, way.path, BOX) for one in (damped, loose))
    assert found.slowed > 1.05
    assert found.plan.duration == pytest.approx(found.slowed / free.slowed * free.plan.duration)
    assert np.max(found.plan.samples().uses) <= 1.0 + ROUNDING
    assert np.max(replace(free.plan, task=damped).samples().uses) > 1.05


# Motions that turn.

TURNING, ANGULAR = np.array([0.5, 0.4, 0.3]), np.array([3.0, 2.0, 1.0])
FIRST = np.array([-0.2, 0.0, 0.2, 0.0, 0.0, np.radians(-20.0)])
LAST = np.array([0.2, 0.1, 0.3, np.radians(8.0), np.radians(-5.0), np.radians(20.0)])


def inertia():
    M = plain_acrobot().dynamics.M_PPo_P
    return M.get_mass(), M.get_com(), M.CalcRotationalInertia().CopyToFullMatrix3()


@pytest.fixture(scope="module")
def turning():
    """Moments that the platform may ask for, and a motion that turns within them."""
    moments = moment_box(*inertia(), ANGULAR)
    middle = 0.5 * (FIRST + LAST) + [0, 0.1, 0.1, 0, 0, 0]
    path = smooth_path([pose_from_angles(p[:3], p[3:]) for p in (FIRST, middle, LAST)], 0.1)
    return moments, path, time_within_box(plain_acrobot(), path, TURNING, 300, moments)


def test_bounds_hold_at_samples_and_are_tight(turning):
    moments, _, found = turning
    motion, cables = found.plan.trajectory, plain_acrobot().cables
    c, I_Co = mass_of(plain_acrobot())
    bounds = turning_bounds(motion, c, I_Co, cables.p_PB)
    times, rows = sampled(motion, 2001)
    most = np.max(np.abs(inertial_terms(rows, c, I_Co)[1]), axis=0)
    bound = np.concatenate([found.accelerations, found.moments])
    limit = np.concatenate([TURNING, moments])
    assert np.all(most <= bound * (1.0 + ROUNDING))
    assert np.all(bound <= limit * (1.0 + ROUNDING))
    assert np.all(most >= 0.95 * bound)
    assert np.max(bound / limit) > 0.98
    speed = np.max(np.linalg.norm(rows[:, 10:13], axis=1))
    assert 0.98 * bounds.speed < speed <= bounds.speed * (1.0 + ROUNDING)
    rates = [
        np.max(np.abs(cable_jacobian(motion.pose(t), cables) @ row[7:13]))
        for t, row in zip(times[::5], rows[::5], strict=True)
    ]
    assert 0.5 * bounds.anchor_speed < max(rates) <= bounds.anchor_speed
    assert found.slowed < 1.02


def quaternion_length(path, s):
    """As the polynomials have it."""
    piece = min(np.searchsorted(path.breaks, s, side="right") - 1, len(path.pieces) - 1)
    powers = (s - path.breaks[piece]) ** np.arange(6)
    return np.linalg.norm(powers @ path.pieces[piece].reshape(6, 7)[:, :4])


def test_bounds_hold_where_quaternions_are_far_from_unit_length():
    """A spline through poses far apart: |q| sinks, and every part of the quotients counts."""
    angles = [np.zeros(3), np.array([1.5, -0.9, 0.4]), np.array([0.2, 1.1, -2.0])]
    poses = [pose_from_angles(0.1 * np.array([k, k % 2, 0.0]), a) for k, a in enumerate(angles)]
    path = smooth_path(poses, 0.2)
    stations = np.union1d(np.linspace(0.0, path.length, 400), path.breaks)
    assert np.ptp([quaternion_length(path, s) for s in stations]) > 0.05
    x = np.sin(np.linspace(0.0, np.pi, len(stations))) ** 2 + 0.01
    x[[0, -1]] = 0.0
    motion = TimedPath.make(path, stations, x)
    c, I_Co = np.array([0.3, -0.2, 0.1]), np.diag([0.3, 0.5, 0.7])
    bounds = turning_bounds(motion, c, I_Co, np.array([[0.2], [0.1], [0.3]]))
    most = np.max(np.abs(inertial_terms(sampled(motion, 10_001)[1], c, I_Co)[1]), axis=0)
    bound = np.concatenate([bounds.accelerations, bounds.moments])
    assert np.all(most <= bound * (1.0 + ROUNDING))
    assert np.all(bound <= 1.05 * most)


def test_terms_are_those_of_differences_of_poses(turning):
    """Accelerations of Co and angular momentum by differences in time; nothing of the kernel."""
    path, (c, I_Co) = turning[1], mass_of(plain_acrobot())
    speed, step = 0.3, 1e-4  # ds/dt is constant: u = 0, x = speed^2

    def turn(t):
        return path.pose(speed * t).rotation().matrix()

    def momentum(t):
        R = turn(t)
        spin = (turn(t + step) - turn(t - step)) @ R.T / (2.0 * step)
        return R @ I_Co @ R.T @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]])

    for t in np.array([0.2, 0.5, 0.7]) * path.length / speed:
        X = [path.pose(speed * (t + d)) @ c for d in (-step, 0.0, step)]
        a = (X[0] - 2.0 * X[1] + X[2]) / step**2
        n = turn(t).T @ (momentum(t + step) - momentum(t - step)) / (2.0 * step)
        _, bends = inertial_terms(path.points(np.array([speed * t])), c, I_Co)
        np.testing.assert_allclose(speed**2 * bends[0, :3], a, atol=1e-6)
        np.testing.assert_allclose(speed**2 * bends[0, 3:], n, atol=1e-5 * np.max(I_Co))


def test_the_wrench_of_the_motion_is_among_those_that_are_proven(turning):
    """By the kernel of computed torque, in the convex hull of what sets would be proven for."""
    moments, _, found = turning
    mass, c, _ = inertia()
    dynamics, motion = plain_acrobot().dynamics, found.plan.trajectory
    middle, halves = 0.5 * (FIRST + LAST)[3:], 0.5 * np.abs(LAST - FIRST)[3:]
    # the spline leaves the range of its ends by less than 0.05 rad
    vertices = turning_wrenches(mass, c, moments, TURNING, middle, halves + 0.05).vertices
    normals = np.random.default_rng(0).normal(size=(500, 6))
    directions = np.vstack([np.eye(6), -np.eye(6), normals]) / np.max(np.abs(vertices), axis=0)
    most, largest = np.max(directions @ vertices.T, axis=1), 0.0
    for t, row in zip(*sampled(motion, 300), strict=True):
        X = motion.pose(t)
        needed = wrench_of(dynamics, X, row[7:13], row[13:19]) - wrench_of(dynamics, X)
        assert np.all(directions @ -needed <= most * (1.0 + ROUNDING))
        largest = max(largest, float(np.max(directions @ -needed / most)))
    assert largest > 0.8


def test_a_motion_in_sets_over_angles_is_proven_for_its_box(turning):
    """Two boxes of x and psi; the bounds are kept, and least time is no longer than length's."""
    moments, task = turning[0], plain_acrobot()
    lower, upper = np.zeros((2, 6)), np.zeros((2, 6))
    lower[:, [0, 2, 5]] = [[-0.3, 0.2, -0.4], [-0.1, 0.2, -0.2]]
    upper[:, [0, 2, 5]] = [[0.0, 0.4, 0.2], [0.3, 0.4, 0.4]]
    about = {
        "accelerations_m_s2": TURNING.tolist(), "angular_accelerations_rad_s2": ANGULAR.tolist(),
        "moments_n_m": moments.tolist(),
    }  # fmt: skip
    start, goal = np.array([-0.2, 0, 0.3, 0, 0, -0.35]), np.array([0.2, 0, 0.3, 0, 0, 0.35])
    sets = PoseSets(lower, upper, np.array([0, 2, 5]), about)
    short, fast = (
        proven_motion(sets, start, goal, task, 0.1, cost=cost) for cost in ("length", "time")
    )
    for found in (short, fast):
        assert found.turns
        assert np.all(found.box.moments <= moments * (1.0 + ROUNDING))
        assert np.all(found.box.accelerations <= TURNING * (1.0 + ROUNDING))
        assert found.time_bound() <= found.plan.duration
        turned = found.plan.trajectory.pose(found.plan.trajectory.end_time).rotation().matrix()
        np.testing.assert_allclose(turned, rotation_from_angles(goal[3:]).matrix(), atol=1e-9)
    assert fast.plan.duration <= short.plan.duration
    poses = PoseSets(lower, upper, np.array([0, 2, 5]), {"accelerations_m_s2": None})
    assert proven_motion(poses, start, goal, task, 0.1).box is None


# Sets of poses and time.

LEFT, RIGHT = np.array([-0.2, 0.0, 0.3, 0, 0, 0.0]), np.array([0.2, 0.0, 0.3, 0, 0, 0.0])
OPENS, HORIZON = 9.0, 20.0  # when the gate between left and right opens, and the end [s]


def timed(rows):
    low, high, times = (np.array([row[k] for row in rows], float) for k in range(3))
    about = {"accelerations_m_s2": BOX.tolist()}
    return TimedSets(low, high, times, np.arange(3), np.zeros(6), HORIZON, about)


def gate(detour=False, apart=0.0, opens=(OPENS, HORIZON), right=((0.0, HORIZON),)):
    """Left and right, and between them a gate that opens late; perhaps a detour that is free."""
    rows = [
        ([-0.3, -0.1, 0.2], [-apart, 0.1, 0.4], [0.0, HORIZON]),
        ([-0.3, -0.1, 0.2], [0.3, 0.1, 0.4], opens),
        *(([apart, -0.1, 0.2], [0.3, 0.1, 0.4], times) for times in right),
    ]
    if detour:
        rows.append(([-0.3, 0.05, 0.2], [-0.1, 0.5, 0.4], [0.0, HORIZON]))
        rows.append(([-0.3, 0.4, 0.2], [0.3, 0.5, 0.4], [0.0, HORIZON]))
        rows.append(([0.1, 0.05, 0.2], [0.3, 0.5, 0.4], [0.0, HORIZON]))
    return timed(rows)


def in_time(sets, cost="length"):
    """A motion whose samples lie in sets at their time, within limits; its times and rows."""
    found = motion_in_time(sets, LEFT, RIGHT, plain_acrobot(), BOX, cost=cost)
    times, rows = sampled(found.plan.trajectory, 5000)
    held = np.zeros(len(times), bool)
    for low, high, (a, b) in zip(sets.lower, sets.upper, sets.times, strict=True):
        place = rows[:, 4:7]
        inside = np.all((low - ROUNDING <= place) & (place <= high + ROUNDING), axis=1)
        held |= inside & (a <= times) & (times <= b)
    assert np.all(held)
    assert np.max(np.linalg.norm(rows[:, 10:13], axis=1)) <= found.speed + ROUNDING
    assert np.all(np.max(np.abs(rows[:, 16:]), axis=0) <= found.accelerations + ROUNDING)
    assert np.all(found.accelerations <= BOX + ROUNDING)
    np.testing.assert_allclose(rows[[0, -1], 4:7], [LEFT[:3], RIGHT[:3]], atol=1e-12)
    np.testing.assert_allclose(rows[[0, -1], 7:], 0.0, atol=1e-6)
    assert found.curve.breaks[0] == 0.0
    assert np.all(np.diff(found.curve.breaks) > 0.0)
    return found, times, rows


def test_it_waits_until_the_gate_opens():
    found, times, rows = in_time(gate())
    assert times[np.argmax(rows[:, 4] > 0.0)] >= OPENS - ROUNDING
    assert found.length == pytest.approx(0.4, rel=0.021)  # straight, and waiting
    assert found.plan.duration <= OPENS + 0.5 * straight_time(plain_acrobot(), LEFT, RIGHT, BOX)


def test_least_time_takes_a_detour_that_is_quicker_than_waiting():
    shortest, quickest = (in_time(gate(True), cost)[0] for cost in ("length", "time"))
    assert shortest.length == pytest.approx(0.4, rel=0.021)
    assert quickest.plan.duration < OPENS < shortest.plan.duration
    assert quickest.length > 0.8  # up, over and down


def test_a_gate_that_is_shut_too_early_is_no_way():
    """Two rooms 0.1 m apart, with a passage for 0.3 s: no motion gets through in that."""
    shut = gate(apart=0.05, opens=(OPENS, OPENS + 0.3))
    with pytest.raises(PlanningError, match=r"no motion within the limits|no way in time"):
        motion_in_time(shut, LEFT, RIGHT, plain_acrobot(), BOX)


def test_the_goal_is_entered_when_it_is_clear_until_the_end():
    right = ([0.0, 12.0], [12.5, HORIZON])
    late = gate(opens=(OPENS, 13.0), right=right)
    assert late.clear_from(RIGHT) == 0.0  # sets 2, 1 and 3 hold it one after the other
    assert gate(opens=(OPENS, 12.2), right=right).clear_from(RIGHT) == 12.5
    assert gate().clear_from(np.array([0.0, 0.9, 0.3, 0, 0, 0])) == np.inf
    in_time(late)


@pytest.mark.parametrize("seed", range(2))
def test_motions_through_random_sets_stay_in_them(seed):
    random, count = np.random.default_rng(seed), 8
    middles = np.linspace(LEFT[:3], RIGHT[:3], count) + random.uniform(-0.03, 0.03, (count, 3))
    halves = random.uniform(0.08, 0.14, (count, 3))
    opens = np.sort(random.uniform(0.0, 10.0, count))
    opens[0] = 0.0
    halves[[0, -1]] += 0.05
    times = np.column_stack([opens, np.minimum(opens + random.uniform(6.0, 9.0, count), 20.0)])
    times[-1, 1] = HORIZON
    sets = timed(list(zip(middles - halves, middles + halves, times, strict=True)))
    for cost in ("length", "time"):
        found = in_time(sets, cost)[0]
        assert found.length >= 0.4 - ROUNDING
        assert found.plan.duration >= sets.clear_from(RIGHT)


@pytest.mark.parametrize("by_time", [False, True])
def test_labels_only_go_forward_and_rest_to_rest_sequences_are_motions(by_time):
    sets = gate(True)
    graph = TimedGraph(sets, LEFT[:3], RIGHT[:3], 0.0)
    sequences = list(graph.sequences(hop_times(graph, RateLimits(0.4, BOX), 1.0), by_time))
    assert sequences
    for found in sequences:
        assert np.all(np.diff(found.times) >= 0.0)
        assert found.times[-1] <= HORIZON
        for k, number in enumerate(found.sets):
            a, b = sets.times[number]
            assert a - ROUNDING <= found.times[k] <= found.times[k + 1] <= b + ROUNDING
            for corner in found.points[k : k + 2]:
                assert sets.holding(corner)[number]


def test_a_motion_that_leaves_its_box_or_limits_is_not_kept():
    low, high, limits = [[-0.3, -0.1, 0.2]], [[0.3, 0.1, 0.4]], RateLimits(0.4, BOX)
    boxes = TimedBoxes(np.array(low), np.array(high), np.array([0.0, 6.0]), (0,))
    curve = timed_curve(boxes, LEFT[:3], RIGHT[:3], limits)
    assert curve is not None
    assert keeps(curve, boxes, limits)
    assert not keeps(curve, boxes, RateLimits(0.1, BOX))
    assert not keeps(curve, boxes, RateLimits(0.4, 0.05 * BOX))
    narrow = TimedBoxes(boxes.lower, boxes.upper - [0.2, 0, 0], boxes.breaks, (0,))
    assert not keeps(curve, narrow, limits)
    quick = TimedBoxes(boxes.lower, boxes.upper, np.array([0.0, 1.0]), (0,))
    assert timed_curve(quick, LEFT[:3], RIGHT[:3], limits) is None
