"""Quintic time laws and pose trajectories: boundary values, finite differences, fixed axes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from scipy.interpolate import BPoly

from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector, rotation_vector
from cdpr_drake.trajectories.pose_trajectory import (
    MOTION_SIZE,
    PoseTrajectory,
    motion_row,
)

ROUNDING = 1e-13
"""A dozen products of numbers of order one."""

BOUNDARY = 1e-10
"""Boundary values of order one after division by T^5 and multiplication by it, T within 0.2..20 s:
terms up to a thousand times larger than their sum cancel."""

DIFFERENCE = 1e-7
"""Central differences with a step of 1e-4 s of motions that last seconds and have derivatives of
order one leave h^2 / 6 times the third derivative, some 1e-8, and round-off 1e-16 / h."""

STEP = 1e-4

HOME = pose_from_angles(np.array([0.1, -0.2, 0.4]), np.array([0.3, -0.2, 0.5]))
AWAY = pose_from_angles(np.array([-0.3, 0.5, 0.9]), np.array([-0.4, 0.6, -0.1]))
LAST = pose_from_angles(np.array([0.0, 0.4, 0.6]), np.array([0.1, 0.1, 1.2]))
TRAJECTORY = PoseTrajectory((HOME, AWAY, AWAY, LAST), (3.0, 1.0, 2.0), start_time=0.5)

number = st.floats(-3.0, 3.0)
boundary = st.tuples(number, number, number).map(np.array)
duration = st.floats(0.2, 20.0)
vector = st.tuples(number, number, number).map(np.array)


@st.composite
def poses(draw):
    turn = draw(vector)
    return RigidTransform(rotation_from_vector(turn * (3.0 / 5.2)), draw(vector))


def test_rest_to_rest_law_is_the_quintic_with_nothing_at_its_ends():
    """The trajectory's s(t) = 10 x^3 - 15 x^4 + 6 x^5, x = t / T."""
    T = 4.0
    law = BPoly.from_derivatives([0.0, T], [np.zeros(3), [1.0, 0.0, 0.0]])
    line = PoseTrajectory((RigidTransform(), RigidTransform([1.0, 0.0, 0.0])), (T,))
    for time in np.linspace(0.0, T, 17):
        s, s_dot, s_ddot = (law(time, nu=k) for k in range(3))
        assert line.pose(time).translation()[0] == pytest.approx(s, abs=ROUNDING)
        assert line.velocity(time)[3] == pytest.approx(s_dot, abs=ROUNDING)
        assert line.acceleration(time)[3] == pytest.approx(s_ddot, abs=ROUNDING)


@pytest.mark.parametrize(
    ("time", "X"), [(-1.0, HOME), (0.5, HOME), (3.5, AWAY), (4.1, AWAY), (6.5, LAST), (99.0, LAST)]
)
def test_rests_in_its_poses_and_outside_its_time(time, X):
    assert TRAJECTORY.pose(time).IsNearlyEqualTo(X, ROUNDING)
    np.testing.assert_allclose(TRAJECTORY.velocity(time), np.zeros(6), atol=ROUNDING)
    np.testing.assert_allclose(TRAJECTORY.acceleration(time), np.zeros(6), atol=ROUNDING)


def test_ends_when_all_stretches_are_done():
    assert TRAJECTORY.end_time == 6.5


@given(poses(), poses(), st.floats(0.01, 0.99))
def test_velocity_and_acceleration_are_the_derivatives_of_the_pose(X_WS, X_WE, share):
    T = 5.0
    trajectory = PoseTrajectory((X_WS, X_WE), (T,))
    time = share * T
    before, after = trajectory.pose(time - STEP), trajectory.pose(time + STEP)
    turn = rotation_vector(after.rotation() @ before.rotation().inverse())
    way = after.translation() - before.translation()
    found = trajectory.velocity(time)
    np.testing.assert_allclose(found, np.concatenate([turn, way]) / (2.0 * STEP), atol=DIFFERENCE)
    change = trajectory.velocity(time + STEP) - trajectory.velocity(time - STEP)
    np.testing.assert_allclose(
        trajectory.acceleration(time), change / (2.0 * STEP), atol=DIFFERENCE
    )


@given(poses(), poses(), st.floats(0.0, 1.0))
def test_way_is_straight_and_the_axis_is_fixed(X_WS, X_WE, share):
    """Every pose lies on the way: Po on the line, P turned by a share of the whole turn."""
    trajectory = PoseTrajectory((X_WS, X_WE), (2.0,))
    X = trajectory.pose(2.0 * share)
    s = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    line = X_WS.translation() + s * (X_WE.translation() - X_WS.translation())
    np.testing.assert_allclose(X.translation(), line, atol=ROUNDING)
    turn_P = s * rotation_vector(X_WS.rotation().inverse() @ X_WE.rotation())
    turned = X_WS.rotation() @ rotation_from_vector(turn_P)  # (A.18), (A.19)
    assert np.max(np.abs(X.rotation().matrix() - turned.matrix())) < ROUNDING


def test_axis_of_a_turned_start_is_expressed_in_the_world():
    """(A.20) taken literally would turn about the axis in the first pose of P."""
    quarter = np.pi / 2.0
    start = rotation_from_vector([quarter, 0.0, 0.0])
    end = start @ rotation_from_vector([0.0, 0.0, 1.0])  # z of P is -y of W
    trajectory = PoseTrajectory((RigidTransform(start), RigidTransform(end)), (1.0,))
    w = trajectory.velocity(0.5)[:3]
    np.testing.assert_allclose(w / np.linalg.norm(w), [0.0, -1.0, 0.0], atol=ROUNDING)


def test_half_a_turn_arrives():
    X_WE = RigidTransform(rotation_from_vector([0.0, np.pi, 0.0]))
    trajectory = PoseTrajectory((RigidTransform(), X_WE), (1.0,))
    assert trajectory.pose(1.0).IsNearlyEqualTo(X_WE, ROUNDING)


def test_motion_row_has_pose_velocity_and_acceleration():
    row = TRAJECTORY.motion(1.7)
    assert row.shape == (MOTION_SIZE,)
    again = motion_row(TRAJECTORY.pose(1.7), TRAJECTORY.velocity(1.7), TRAJECTORY.acceleration(1.7))
    again[:4] *= np.sign(again[:4] @ row[:4])
    np.testing.assert_allclose(again, row, atol=ROUNDING)


@pytest.mark.parametrize(
    ("stops", "durations", "start", "message"),
    [
        ((HOME,), (), 0.0, "at least one duration, found 1 poses"),
        ((HOME, AWAY), (1.0, 2.0), 0.0, "2 durations needs one pose more"),
        ((HOME, AWAY), (0.0,), 0.0, "duration must be above 0 s and finite, found 0.0 s"),
        ((HOME, AWAY), (-1.0,), 0.0, "found -1.0 s"),
        ((HOME, AWAY), (np.nan,), 0.0, "found nan s"),
        ((HOME, AWAY), (np.inf,), 0.0, "found inf s"),
        ((HOME, AWAY), (1.0,), np.nan, "start must be finite, found nan s"),
    ],
)
def test_refuses_times_that_make_no_trajectory(stops, durations, start, message):
    with pytest.raises(TrajectoryError, match=message):
        PoseTrajectory(stops, durations, start)
