"""Lines and arcs: circles by closed forms, straight lines by `straight_path`, rounded corners."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.spatial import cKDTree

from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.trajectories.curved_path import (
    ARC_ERROR,
    STRAIGHT,
    Arc,
    Move,
    curved_path,
    points_on_arcs,
)
from cdpr_drake.trajectories.pose_path import PosePath, straight_path

SCALE = 0.2
ROUNDING = 1e-9  # of lengths of about a metre through polynomials of degree 5
CURVATURE = 1e-5  # of second derivatives at breaks, which divide rounding by lengths squared


def pose(*numbers):
    return pose_from_angles(np.array(numbers[:3], float), np.radians(numbers[3:] or (0, 0, 0)))


def arc(center, axis, angle):
    axis = np.asarray(axis, float)
    return Arc(np.asarray(center, float), axis / np.linalg.norm(axis), angle)


def turned(p, about):
    """Where a point goes by an arc, and along it by a rise."""
    k, c, s = about.axis, np.cos(about.angle), np.sin(about.angle)
    d = p - about.center
    return about.center + c * d + s * np.cross(k, d) + (1.0 - c) * (k @ d) * k


def random_arcs(count):
    rng = np.random.default_rng(3)
    for _ in range(count):
        about = arc(rng.uniform(-1, 1, 3), rng.standard_normal(3), rng.uniform(0.3, 6.28))
        if rng.uniform() < 0.5:
            about = Arc(about.center, about.axis, -about.angle)
        start = rng.uniform(-1, 1, 3)
        rise = rng.uniform(-0.3, 0.3)
        yield about, start, turned(start, about) + rise * about.axis, rise


def test_points_lie_on_the_circle_and_the_length_is_that_of_a_helix():
    for about, start, end, rise in random_arcs(50):
        X = [RigidTransform(start), RigidTransform(end)]
        path = curved_path(X, [Move(about)], SCALE)
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
        heights = radial @ about.axis + rise * s / length
        np.testing.assert_allclose(along, heights, atol=1e-8 * radius)
        np.testing.assert_allclose(np.linalg.norm(points[:, 10:13], axis=1), 1.0, atol=1e-6)
        np.testing.assert_allclose(points[[0, -1], 4:7], [start, end], atol=ROUNDING)


def test_a_whole_circle_and_a_turning_platform():
    about = arc([0.1, 0.0, 0.3], [0, 0, 1], 2.0 * np.pi)
    circle = curved_path([pose(0.3, 0, 0.3), pose(0.3, 0, 0.3)], [Move(about)], SCALE)
    assert circle.length == pytest.approx(0.4 * np.pi)
    ends = [pose(0.3, 0, 0.3), pose(0.3, 0, 0.3, 0, 0, 40)]
    turning = curved_path(ends, [Move(about)], SCALE)
    assert turning.length == pytest.approx(np.hypot(0.4 * np.pi, SCALE * np.radians(40)))
    half = turning.pose(0.5 * turning.length)
    np.testing.assert_allclose(half.translation(), [-0.1, 0, 0.3], atol=ROUNDING)
    np.testing.assert_allclose(
        half.rotation().matrix(), pose(0, 0, 0, 0, 0, 20).rotation().matrix(), atol=ROUNDING
    )


@pytest.mark.parametrize("tolerance", [0.0, 0.005])
def test_straight_moves_are_the_straight_path(tolerance):
    poses = [pose(0, 0, 0), pose(1, 0, 0, 0, 0, 30), pose(1, 1, 0), pose(1, 2, 0), pose(0, 0, 1)]
    one = straight_path(poses, SCALE, tolerance)
    other = curved_path(poses, [STRAIGHT] * 4, SCALE, tolerance)
    np.testing.assert_array_equal(one.breaks, other.breaks)
    np.testing.assert_array_equal(one.pieces, other.pieces)
    assert one.rests == other.rests
    assert other.speeds is None


def slot(speeds=(np.inf,) * 4):
    """Two lines and two half circles, tangent to each other, and a corner at the end."""
    poses = [pose(0, 0, 0), pose(1, 0, 0), pose(1, 0.4, 0), pose(0, 0.4, 0), pose(0, 0.4, 0.5)]
    half = arc([1, 0.2, 0], [0, 0, 1], np.pi)
    return poses, [
        Move(None, speeds[0]), Move(half, speeds[1]), Move(None, speeds[2]), Move(None, speeds[3]),
    ]  # fmt: skip


@pytest.mark.parametrize("tolerance", [1e-4, 2e-3])
def test_rounded_corners_stay_within_the_tolerance_and_bend_evenly(tolerance):
    poses, moves = slot()
    sharp = curved_path(poses, moves, SCALE)
    assert len(sharp.rests) == 3
    path = curved_path(poses, moves, SCALE, tolerance)
    assert path.rests == ()
    s = np.linspace(0.0, path.length, 4000)
    places = path.points(s)[:, 4:7]
    exact = cKDTree(sharp.points(np.linspace(0.0, sharp.length, 400_000))[:, 4:7])
    away = exact.query(places)[0]  # points 8e-6 m apart: 1e-7 m off at most
    assert 0.4 * tolerance < np.max(away) < tolerance + 1e-6
    inner = path.breaks[1:-1]
    before, after = path.points(inner - 1e-9), path.points(inner + 1e-9)
    np.testing.assert_allclose(before[:, 7:13], after[:, 7:13], atol=CURVATURE)
    sharpest = np.max(np.abs(path.points(s)[:, 13:]))
    np.testing.assert_allclose(before[:, 13:], after[:, 13:], atol=1e-4 * sharpest)


def test_speeds_belong_to_pieces_and_corners_keep_both():
    poses, moves = slot((0.1, 0.2, 0.3, np.inf))
    path = curved_path(poses, moves, SCALE, 1e-3)
    most = path.largest_speeds(np.array([0.0, 0.5, path.length]))
    np.testing.assert_array_equal(most, [0.1, 0.1, np.inf])
    assert sorted(set(path.speeds.tolist())) == [0.1, 0.2, 0.3, np.inf]
    inner = path.breaks[1:-1]
    np.testing.assert_array_equal(
        path.largest_speeds(inner), np.minimum(path.speeds[:-1], path.speeds[1:])
    )
    sharp = curved_path(poses, moves, SCALE)
    assert [leg.speeds[0] for leg in sharp.legs()] == [0.1, 0.2, 0.3, np.inf]


def test_points_on_arcs():
    poses, moves = slot((1.0, 2.0, 3.0, 4.0))
    points, ways = points_on_arcs(poses, moves, SCALE, np.radians(30))
    assert len(points) == len(poses) + 5
    assert [way.speed for way in ways] == [1.0] + [2.0] * 6 + [3.0, 4.0]
    away = [np.linalg.norm(X.translation() - [1, 0.2, 0]) for X in points[1:8]]
    np.testing.assert_allclose(away, 0.2)


def test_what_is_refused():
    poses, moves = slot()
    with pytest.raises(TrajectoryError, match="found 3 moves and 5 poses"):
        curved_path(poses, moves[:3], SCALE)
    with pytest.raises(TrajectoryError, match="poses 1 and 2 are the same"):
        curved_path([poses[0], poses[0]], [STRAIGHT], SCALE)
    with pytest.raises(TrajectoryError, match="move 1: found an arc of 0 rad"):
        curved_path(poses[:2], [Move(arc([1, 0, 0], [0, 0, 1], 0.0))], SCALE)
    path = curved_path(poses, moves, SCALE)
    with pytest.raises(TrajectoryError, match="found speeds of shape"):
        PosePath(path.breaks, path.pieces, path.rests, np.zeros(len(path.pieces)))
