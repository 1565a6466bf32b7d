"""Paths of poses by differences and closed forms: smooth, straight, of arcs, and in time."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial import cKDTree

from cdpr_drake.geometry.poses import pose_error, pose_from_angles, rotation_vector
from cdpr_drake.trajectories.curved_path import (
    ARC_ERROR,
    STRAIGHT,
    Arc,
    Move,
    curved_path,
    points_on_arcs,
)
from cdpr_drake.trajectories.pose_path import POINT_SIZE, path_point, smooth_path, straight_path
from cdpr_drake.trajectories.timed_path import TimedPath

STEP = 1e-5
DERIVATIVE = 2e-5  # of central differences of second order at STEP, relative to what they are of
ROUNDING = 1e-9  # of lengths of about a metre through polynomials of degree 5
CURVATURE = 1e-5  # of second derivatives at breaks, which divide rounding by lengths squared


def pose(*numbers):
    """Of a position [m] and perhaps angles [deg]."""
    return pose_from_angles(np.array(numbers[:3], float), np.radians(numbers[3:] or (0, 0, 0)))


def places(*positions):
    return [RigidTransform(np.array(p, float)) for p in positions]


# Smooth and straight.

SCALE = 0.1
POSES = [
    RigidTransform(RollPitchYaw(turn), place)
    for place, turn in (
        ([0.0, 0.0, 0.3], [0.0, 0.0, 0.0]),
        ([0.2, 0.0, 0.3], [0.2, -0.1, 0.3]),
        ([0.2, 0.25, 0.4], [0.0, 0.3, 0.6]),
        ([0.0, 0.1, 0.2], [-0.2, 0.0, 0.1]),
    )
]
PATHS = {
    "smooth": smooth_path(POSES, SCALE),
    "blended": straight_path(POSES, SCALE, 0.01),
    "line": straight_path(POSES[:2], SCALE),
}


def derivatives(path, s):
    """X' and X'' by differences of poses."""
    before, here, after = (path.pose(s + d) for d in (-STEP, 0.0, STEP))

    def rate(a, b):
        turn = rotation_vector(b.rotation() @ a.rotation().inverse())
        return np.concatenate([turn, b.translation() - a.translation()]) / STEP

    first, second = rate(before, here), rate(here, after)
    return (first + second) / 2.0, (second - first) / STEP


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_derivatives_are_those_of_the_poses_and_have_no_kink(path):
    for s in path.length * np.array([0.11, 0.38, 0.52, 0.83]):
        point = path.points(np.array([s]))[0]
        first, second = derivatives(path, s)
        np.testing.assert_allclose(point[7:13], first, atol=DERIVATIVE * np.max(np.abs(first)))
        np.testing.assert_allclose(point[13:], second, atol=2e-3 * (1.0 + np.max(np.abs(second))))
    inner = path.breaks[1:-1]
    before, after = path.points(inner - 1e-9), path.points(inner + 1e-9)
    np.testing.assert_allclose(before, after, atol=1e-5)


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_a_parameter_is_in_the_piece_that_numpy_finds(path):
    breaks, last = path.breaks, len(path.pieces) - 1
    every = np.concatenate([breaks, breaks[:-1] + 0.3 * np.diff(breaks), [-1.0, path.length + 1.0]])
    for s, point in zip(every, path.points(every), strict=True):
        inside = np.clip(s, breaks[0], breaks[-1])
        piece = int(np.clip(np.searchsorted(breaks, inside, side="right") - 1, 0, last))
        expected = np.empty(POINT_SIZE)
        path_point(path.pieces[piece], inside - breaks[piece], expected)
        np.testing.assert_array_equal(point, expected)


def test_a_smooth_path_meets_its_poses():
    path = PATHS["smooth"]
    for s, X in zip(path.breaks, POSES, strict=True):
        assert max(pose_error(path.pose(s), X)) < 1e-12


def test_a_line_turns_and_moves_at_one_rate():
    path, (start, end) = PATHS["line"], POSES[:2]
    turn = rotation_vector(end.rotation() @ start.rotation().inverse())
    way = end.translation() - start.translation()
    length = np.hypot(np.linalg.norm(way), SCALE * np.linalg.norm(turn))
    np.testing.assert_allclose(path.length, length)
    points = path.points(np.linspace(0.0, path.length, 23))
    rates = np.tile(np.concatenate([turn, way]) / length, (23, 1))
    np.testing.assert_allclose(points[:, 7:13], rates, atol=1e-8)
    np.testing.assert_allclose(points[:, 13:], 0.0, atol=1e-6)


def test_a_blended_corner_passes_at_its_tolerance_and_without_it_rests_in_corners_only():
    blended = straight_path(places([0, 0, 0], [1, 0, 0], [1, 1, 0]), SCALE, 0.02)
    points = blended.points(np.linspace(0.0, blended.length, 4001))
    apart = np.linalg.norm(points[:, 4:7] - [1, 0, 0], axis=1)
    np.testing.assert_allclose(np.min(apart), 0.02, rtol=1e-5)
    assert blended.rests == ()
    sharp = straight_path(places([0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0]), SCALE)
    assert [float(sharp.breaks[i]) for i in sharp.rests] == [2.0]
    assert [leg.length for leg in sharp.legs()] == [2.0, 3.0]


def test_a_timed_path_moves_as_its_speeds_say():
    path = PATHS["smooth"]
    stations = np.unique(np.concatenate([path.breaks, np.linspace(0.0, path.length, 41)]))
    x = 0.3 * np.sin(np.pi * stations / path.length)
    x[-1] = 0.0
    motion = TimedPath.make(path, stations, x, start_time=0.5)
    times = motion.times()
    np.testing.assert_allclose(times[0], 0.5)
    for k in (1, 17, len(stations) - 2):
        assert max(pose_error(motion.pose(times[k]), path.pose(stations[k]))) < 1e-9
        speed = np.linalg.norm(motion.velocity(times[k] + 1e-12))
        slope = np.linalg.norm(path.points(stations[k : k + 1])[0, 7:13])
        np.testing.assert_allclose(speed, np.sqrt(x[k]) * slope, rtol=1e-6)
    t, h = 0.5 * (times[20] + times[21]), 1e-6
    rate = (motion.velocity(t + h) - motion.velocity(t - h)) / (2.0 * h)
    np.testing.assert_allclose(motion.acceleration(t), rate, atol=1e-6)
    for still in (0.0, motion.end_time, motion.end_time + 1.0):
        np.testing.assert_array_equal(motion.motion(still)[7:], 0.0)
    assert max(pose_error(motion.pose(9e9), POSES[-1])) < 1e-9


# Arcs.

WIDE = 0.2  # scale of turns [m]


def arc(center, axis, angle):
    return Arc(np.asarray(center, float), np.asarray(axis) / np.linalg.norm(axis), angle)


def random_arc(rng):
    """An arc, a start, its end along the arc and by a rise."""
    about = arc(rng.uniform(-1, 1, 3), rng.standard_normal(3), rng.uniform(0.3, 6.28))
    if rng.uniform() < 0.5:
        about = Arc(about.center, about.axis, -about.angle)
    start, rise, k = rng.uniform(-1, 1, 3), rng.uniform(-0.3, 0.3), about.axis
    d, c, s = start - about.center, np.cos(about.angle), np.sin(about.angle)
    end = about.center + c * d + s * np.cross(k, d) + (1.0 - c) * (k @ d) * k
    return about, start, end + rise * k, rise


@pytest.mark.parametrize("seed", range(20))
def test_points_lie_on_the_circle_and_the_length_is_that_of_a_helix(seed):
    about, start, end, rise = random_arc(np.random.default_rng(seed))
    path = curved_path(places(start, end), [Move(about)], WIDE)
    radial = start - about.center
    radius = np.linalg.norm(radial - (radial @ about.axis) * about.axis)
    length = np.hypot(radius * about.angle, rise)
    np.testing.assert_allclose(path.length, length, rtol=1e-12)
    s = np.linspace(0.0, length, 400)
    points = path.points(s)
    d = points[:, 4:7] - about.center
    along = d @ about.axis
    away = np.linalg.norm(d - along[:, np.newaxis] * about.axis, axis=1)
    assert np.max(np.abs(away - radius)) <= ARC_ERROR * radius + 1e-14
    np.testing.assert_allclose(along, radial @ about.axis + rise * s / length, atol=1e-8 * radius)
    np.testing.assert_allclose(np.linalg.norm(points[:, 10:13], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(points[[0, -1], 4:7], [start, end], atol=ROUNDING)


def test_a_whole_circle_and_a_turning_platform():
    about = [Move(arc([0.1, 0.0, 0.3], [0, 0, 1], 2.0 * np.pi))]
    circle = curved_path([pose(0.3, 0, 0.3)] * 2, about, WIDE)
    assert circle.length == pytest.approx(0.4 * np.pi)
    turning = curved_path([pose(0.3, 0, 0.3), pose(0.3, 0, 0.3, 0, 0, 40)], about, WIDE)
    assert turning.length == pytest.approx(np.hypot(0.4 * np.pi, WIDE * np.radians(40)))
    half = turning.pose(0.5 * turning.length)
    expected = pose(-0.1, 0, 0.3, 0, 0, 20).GetAsMatrix4()
    np.testing.assert_allclose(half.GetAsMatrix4(), expected, atol=ROUNDING)


@pytest.mark.parametrize("tolerance", [0.0, 0.005])
def test_straight_moves_are_the_straight_path(tolerance):
    poses = [pose(0, 0, 0), pose(1, 0, 0, 0, 0, 30), pose(1, 1, 0), pose(1, 2, 0), pose(0, 0, 1)]
    one = straight_path(poses, WIDE, tolerance)
    other = curved_path(poses, [STRAIGHT] * 4, WIDE, tolerance)
    np.testing.assert_array_equal(one.breaks, other.breaks)
    np.testing.assert_array_equal(one.pieces, other.pieces)
    assert one.rests == other.rests
    assert other.speeds is None


def slot(*speeds):
    """Two lines and two half circles, tangent to each other, and a corner at the end."""
    ways = [None, arc([1, 0.2, 0], [0, 0, 1], np.pi), None, None]
    moves = [Move(way, speed) for way, speed in zip(ways, speeds or [np.inf] * 4, strict=True)]
    return places([0, 0, 0], [1, 0, 0], [1, 0.4, 0], [0, 0.4, 0], [0, 0.4, 0.5]), moves


@pytest.mark.parametrize("tolerance", [1e-4, 2e-3])
def test_rounded_corners_stay_within_the_tolerance_and_bend_evenly(tolerance):
    sharp, path = curved_path(*slot(), WIDE), curved_path(*slot(), WIDE, tolerance)
    assert len(sharp.rests) == 3
    assert path.rests == ()
    points = path.points(np.linspace(0.0, path.length, 4000))
    exact = cKDTree(sharp.points(np.linspace(0.0, sharp.length, 200_000))[:, 4:7])
    away = exact.query(points[:, 4:7])[0]  # points 1.6e-5 m apart: 4e-7 m off at most
    assert 0.4 * tolerance < np.max(away) < tolerance + 1e-6
    inner = path.breaks[1:-1]
    before, after = path.points(inner - 1e-9), path.points(inner + 1e-9)
    np.testing.assert_allclose(before[:, 7:13], after[:, 7:13], atol=CURVATURE)
    sharpest = np.max(np.abs(points[:, 13:]))
    np.testing.assert_allclose(before[:, 13:], after[:, 13:], atol=1e-4 * sharpest)


def test_speeds_belong_to_pieces_and_corners_keep_both():
    numbers = (0.1, 0.2, 0.3, np.inf)
    path = curved_path(*slot(*numbers), WIDE, 1e-3)
    most = path.largest_speeds(np.array([0.0, 0.5, path.length]))
    np.testing.assert_array_equal(most, [0.1, 0.1, np.inf])
    assert sorted(set(path.speeds.tolist())) == list(numbers)
    both = np.minimum(path.speeds[:-1], path.speeds[1:])
    np.testing.assert_array_equal(path.largest_speeds(path.breaks[1:-1]), both)
    sharp = curved_path(*slot(*numbers), WIDE)
    assert [leg.speeds[0] for leg in sharp.legs()] == list(numbers)


def test_points_on_arcs():
    poses, moves = slot(1.0, 2.0, 3.0, 4.0)
    points, ways = points_on_arcs(poses, moves, WIDE, np.radians(30))
    assert len(points) == len(poses) + 5
    assert [way.speed for way in ways] == [1.0] + [2.0] * 6 + [3.0, 4.0]
    away = [np.linalg.norm(X.translation() - [1, 0.2, 0]) for X in points[1:8]]
    np.testing.assert_allclose(away, 0.2)
