"""Paths of poses against finite differences, their corners, and motions along them."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_error, rotation_vector
from cdpr_drake.trajectories.pose_path import (
    POINT_SIZE,
    PosePath,
    path_point,
    smooth_path,
    straight_path,
)
from cdpr_drake.trajectories.timed_path import TimedPath

SCALE = 0.1
STEP = 1e-5
DERIVATIVE = 2e-5  # of central differences of second order at STEP, relative to what they are of


def poses(count=4):
    places = [[0.0, 0.0, 0.3], [0.2, 0.0, 0.3], [0.2, 0.25, 0.4], [0.0, 0.1, 0.2]]
    turns = [[0.0, 0.0, 0.0], [0.2, -0.1, 0.3], [0.0, 0.3, 0.6], [-0.2, 0.0, 0.1]]
    both = list(zip(places, turns, strict=True))[:count]
    return [RigidTransform(RollPitchYaw(turn), place) for place, turn in both]


def derivatives(path, s):
    """X' and X'' by differences of poses."""
    before, here, after = (path.pose(s + d) for d in (-STEP, 0.0, STEP))

    def rate(a, b):
        turn = rotation_vector(b.rotation() @ a.rotation().inverse())
        return np.concatenate([turn, b.translation() - a.translation()]) / STEP

    first, second = rate(before, here), rate(here, after)
    return (first + second) / 2.0, (second - first) / STEP


PATHS = {
    "smooth": smooth_path(poses(), SCALE),
    "blended": straight_path(poses(), SCALE, 0.01),
    "line": straight_path(poses(2), SCALE),
}


@pytest.mark.parametrize("name", PATHS)
def test_derivatives_are_those_of_the_poses(name):
    path = PATHS[name]
    for s in path.length * np.array([0.11, 0.38, 0.52, 0.83]):
        point = path.points(np.array([s]))[0]
        first, second = derivatives(path, s)
        np.testing.assert_allclose(point[7:13], first, atol=DERIVATIVE * np.max(np.abs(first)))
        np.testing.assert_allclose(point[13:], second, atol=2e-3 * (1.0 + np.max(np.abs(second))))


@pytest.mark.parametrize("name", PATHS)
def test_paths_have_no_kink(name):
    path = PATHS[name]
    inner = path.breaks[1:-1]
    before, after = path.points(inner - 1e-9), path.points(inner + 1e-9)
    np.testing.assert_allclose(before, after, atol=1e-5)


@pytest.mark.parametrize("name", PATHS)
def test_a_parameter_is_in_the_piece_that_numpy_finds(name):
    path = PATHS[name]
    breaks, last = path.breaks, len(path.pieces) - 1
    asked = np.concatenate([breaks, breaks[:-1] + 0.3 * np.diff(breaks), [-1.0, path.length + 1.0]])
    for s, found in zip(asked, path.points(asked), strict=True):
        inside = np.clip(s, breaks[0], breaks[-1])
        piece = int(np.clip(np.searchsorted(breaks, inside, side="right") - 1, 0, last))
        expected = np.empty(POINT_SIZE)
        path_point(path.pieces[piece], inside - breaks[piece], expected)
        np.testing.assert_array_equal(found, expected)


def test_a_smooth_path_meets_its_poses():
    path = PATHS["smooth"]
    for s, X in zip(path.breaks, poses(), strict=True):
        assert max(pose_error(path.pose(s), X)) < 1e-12


def test_a_line_turns_and_moves_at_one_rate():
    path, (start, end) = PATHS["line"], poses(2)
    turn = rotation_vector(end.rotation() @ start.rotation().inverse())
    way = end.translation() - start.translation()
    np.testing.assert_allclose(
        path.length, np.hypot(np.linalg.norm(way), SCALE * np.linalg.norm(turn))
    )
    points = path.points(np.linspace(0.0, path.length, 23))
    expected = np.concatenate([turn, way]) / path.length
    np.testing.assert_allclose(points[:, 7:13], np.tile(expected, (23, 1)), atol=1e-8)
    np.testing.assert_allclose(points[:, 13:], 0.0, atol=1e-6)


def test_a_blended_corner_passes_at_its_tolerance():
    corner = [RigidTransform(p) for p in ([0.0, 0, 0], [1.0, 0, 0], [1.0, 1.0, 0])]
    path = straight_path(corner, SCALE, 0.02)
    apart = np.linalg.norm(
        path.points(np.linspace(0.0, path.length, 4001))[:, 4:7] - [1, 0, 0], axis=1
    )
    np.testing.assert_allclose(np.min(apart), 0.02, rtol=1e-5)
    assert path.rests == ()


def test_without_tolerance_it_rests_in_corners_only():
    on_a_line = [RigidTransform(p) for p in ([0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [2.0, 1.0, 0])]
    path = straight_path(on_a_line, SCALE)
    assert [float(path.breaks[i]) for i in path.rests] == [2.0]
    assert [leg.length for leg in path.legs()] == [2.0, 3.0]


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
    assert max(pose_error(motion.pose(9e9), poses()[-1])) < 1e-9


def test_paths_that_are_none_are_refused():
    X = poses()
    with pytest.raises(TrajectoryError, match="poses 2 and 3 are the same"):
        smooth_path([X[0], X[1], X[1]], SCALE)
    with pytest.raises(TrajectoryError, match="found 1 poses"):
        straight_path(X[:1], SCALE)
    with pytest.raises(TrajectoryError, match="length scale"):
        smooth_path(X, 0.0)
    with pytest.raises(TrajectoryError, match="breaks"):
        PosePath(np.array([0.0, 0.0]), np.zeros((1, 42)))
    with pytest.raises(TrajectoryError, match="two zeros"):
        TimedPath.make(PATHS["line"], np.array([0.0, PATHS["line"].length]), np.zeros(2))
