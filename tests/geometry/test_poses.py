"""Rotations, twists, adjoints and accuracy against matrix exponentials, differences and Drake."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.geometry.pose_accuracy import distances_from_line, mean_pose, repeatability
from cdpr_drake.geometry.poses import (
    adjoint,
    angles_from_rotation,
    cross_matrix,
    exponential,
    logarithm,
    pose_error,
    pose_from_angles,
    rotation_from_angles,
    rotation_from_vector,
    rotation_vector,
)
from cdpr_drake.geometry.rotation_kernel import quaternion_of_matrix, solve_damped, turn_pose
from tests.geometry.geometry_cases import few, twist, unit, vector

ROUNDING = 1e-14  # a few products of numbers of size one
EXPONENTIAL = 1e-11  # (1 - cos theta) / theta^2 loses half the digits near theta = 1e-4
INVERSE = 1e-9  # arcus functions of numbers rounded at 1e-16, away from their ends
GIMBAL = 1e-11  # below its threshold of 1e-12 the inverse treats the pose as locked
DIFFERENCE = 1e-8  # central differences over 1e-6

angle = st.floats(-3.1, 3.1)
size = st.one_of(
    st.just(0.0), st.floats(1e-15, 1e-6), st.floats(1e-6, 1e-3), st.floats(9e-5, 1.1e-4),
    st.floats(1e-3, 9.0),
)  # fmt: skip


def pose(axis, theta, p):
    return RigidTransform(RotationMatrix(scipy.linalg.expm(cross_matrix(axis * theta))), p)


def close(R, S, tolerance):
    return np.max(np.abs(R.matrix() - S.matrix())) <= tolerance


@few
@given(angle, st.floats(-1.5, 1.5), angle)
def test_angles_multiply_in_the_order_x_y_z_and_come_back(phi, theta, psi):
    c, s = np.cos([phi, theta, psi]), np.sin([phi, theta, psi])
    Rx = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    Ry = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    Rz = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    angles = np.array([phi, theta, psi])
    R = rotation_from_angles(angles)
    np.testing.assert_allclose(R.matrix(), Rx @ Ry @ Rz, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(angles_from_rotation(R), angles, rtol=0, atol=INVERSE)
    X = pose_from_angles([1, 2, 3], angles)
    np.testing.assert_array_equal(X.translation(), [1.0, 2.0, 3.0])
    assert close(X.rotation(), R, ROUNDING)
    # Reversing the order and the signs is transposing: these are not roll, pitch, yaw.
    assert close(R.inverse(), RollPitchYaw(-angles).ToRotationMatrix(), ROUNDING)


@few
@given(angle, st.sampled_from([-np.pi / 2, np.pi / 2]), angle)
def test_angles_in_gimbal_lock_give_the_same_rotation(phi, theta, psi):
    R = rotation_from_angles(np.array([phi, theta, psi]))
    angles = angles_from_rotation(R)
    assert angles[2] == 0.0
    assert close(rotation_from_angles(angles), R, GIMBAL)


@given(unit, size, vector)
def test_exponential_is_the_matrix_exponential_and_logarithm_its_inverse(axis, theta, v):
    motion, rate = np.concatenate([axis * theta, 2.0 * v]), np.zeros((4, 4))
    rate[:3, :3], rate[:3, 3] = cross_matrix(motion[:3]), motion[3:]
    X = exponential(motion)
    np.testing.assert_allclose(X.GetAsMatrix4(), scipy.linalg.expm(rate), atol=EXPONENTIAL)
    assert (X @ exponential(-motion)).IsNearlyIdentity(EXPONENTIAL)
    assert exponential(np.concatenate([1e5 * motion[:3], v])).rotation().IsValid()
    if theta < 3.1:
        np.testing.assert_allclose(logarithm(X), motion, rtol=0, atol=INVERSE)
        turn = rotation_vector(rotation_from_vector(axis * theta))
        np.testing.assert_allclose(turn, axis * theta, rtol=0, atol=INVERSE)
    elif 3.2 < theta < 6.2:  # the shorter way round
        turn = rotation_vector(rotation_from_vector(axis * theta))
        np.testing.assert_allclose(turn, axis * (theta - 2.0 * np.pi), rtol=0, atol=INVERSE)


@few
@given(unit, st.floats(0.0, 1e-7))
def test_rotation_vector_near_a_half_turn(axis, short_of):
    R = rotation_from_vector(axis * (np.pi - short_of))
    theta_u = rotation_vector(R)
    assert np.linalg.norm(theta_u) == pytest.approx(np.pi - short_of, abs=INVERSE)
    assert close(rotation_from_vector(theta_u), R, INVERSE)


@few
@given(unit, st.floats(0.0, 3.0), vector, twist, unit, vector)
def test_adjoint_carries_twists_between_frames_of_one_body(axis, theta, p, V_B, other, q):
    """The body moves with V_B in B; frame A moves along, and its twist comes from differences."""
    X_AB, X_BC, step = pose(axis, theta, p), pose(other, theta, q), 1e-6
    ends = [X_AB @ exponential(V_B * t) @ X_AB.inverse() for t in (step, -step)]
    rate = (ends[0].GetAsMatrix4() - ends[1].GetAsMatrix4()) / (2.0 * step)
    expected = np.array([rate[2, 1], rate[0, 2], rate[1, 0], *rate[:3, 3]])
    np.testing.assert_allclose(adjoint(X_AB) @ V_B, expected, rtol=0, atol=DIFFERENCE)
    inverse, product = adjoint(X_AB.inverse()), adjoint(X_AB) @ adjoint(X_BC)
    np.testing.assert_allclose(adjoint(X_AB) @ inverse, np.eye(6), atol=10 * ROUNDING)
    np.testing.assert_allclose(adjoint(X_AB @ X_BC), product, rtol=0, atol=10 * ROUNDING)


@given(unit, st.one_of(angle, st.sampled_from([0.0, np.pi, -np.pi, 1e-9])))
def test_quaternion_of_matrix_is_that_of_drake(axis, theta):
    R = pose(axis, theta, np.zeros(3)).rotation()
    q, expected = np.empty(4), R.ToQuaternion().wxyz()
    quaternion_of_matrix(R.matrix(), q)
    assert q[0] >= 0.0
    if q @ expected < 0.0:  # a half turn, where both signs are right
        assert q[0] <= ROUNDING
        expected = -expected
    np.testing.assert_allclose(q, expected, rtol=0, atol=ROUNDING)


@few
@given(unit, st.floats(0.0, 3.1), vector, vector, unit, st.floats(0.0, 3.1))
def test_pose_error_is_distance_and_angle(axis, theta, p, offset, other_axis, other):
    X_AB = pose(other_axis, other, p)
    X_AC = RigidTransform(X_AB.rotation() @ pose(axis, theta, p).rotation(), p + offset)
    distance, turned = pose_error(X_AB, X_AC)
    assert distance == pytest.approx(np.linalg.norm(offset), abs=10 * ROUNDING)
    assert turned == pytest.approx(theta, abs=INVERSE)
    assert pose_error(X_AC, X_AB) == pytest.approx((distance, turned), abs=INVERSE)
    assert pose_error(X_AB, X_AB)[0] == 0.0


@few
@given(vector, st.floats(1e-9, 7.0))
def test_a_turn_is_multiplied_from_the_left(axis, size):
    X, turn = pose_from_angles([0.1, 0.2, 0.3], [0.4, -0.5, 0.6]), size * axis
    state = X.rotation().ToQuaternion().wxyz()
    turn_pose(state, *turn)
    R = RotationMatrix(Quaternion(state[:4]))
    assert close(R, rotation_from_vector(turn) @ X.rotation(), 1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.1, 10.0])
def test_damped_equations(damping):
    random, C, x = np.random.default_rng(0), np.empty((6, 6)), np.empty(6)
    for _ in range(50):
        J = random.normal(size=(8, 6)) * [1e-2, 1.0, 1e2, 1.0, 1.0, 1e-3]
        A, g = J.T @ J, random.normal(size=6)
        assert solve_damped(A, g, damping, C, x) > 0.0
        np.testing.assert_allclose((A + damping * np.diag(np.diag(A))) @ x, -g, atol=1e-6)
    for singular in (J[:5].T @ J[:5], np.full((6, 6), np.nan)):
        assert solve_damped(singular, np.ones(6), 0.0, C, x) < 0.0


def at(*p, turn=0.0, axis=(0, 0, 1)):
    return RigidTransform(rotation_from_vector(turn * np.array(axis, float)), p)


def test_accuracy_of_a_square_about_a_point_beside_the_desired_one():
    square = [at(0.3 + x, y, 0.4) for x, y in ((0.01, 0), (0, 0.01), (-0.01, 0), (0, -0.01))]
    report = repeatability(square, RigidTransform())
    assert report.count == 4
    numbers = report.accuracy, report.repeatability, report.iso_9283  # all equally far
    assert numbers == pytest.approx((0.5, 0.01, 0.01), abs=1e-12)
    assert report.rotation_accuracy == report.rotation_repeatability == 0.0


def test_accuracy_by_iso_9283_adds_three_standard_deviations():
    report = repeatability([at(x, 0.0, 0.0) for x in range(-2, 3)], RigidTransform())
    deviation = np.sqrt(np.sum((np.array([2.0, 1.0, 0.0, 1.0, 2.0]) - 1.2) ** 2) / 4.0)
    assert report.iso_9283 == pytest.approx(1.2 + 3.0 * deviation, abs=1e-12)
    assert report.repeatability == pytest.approx(2.0, abs=1e-12)


def test_accuracy_of_rotations_and_of_one_pose():
    turns = [at(0, 0, 0, turn=np.radians(a)) for a in (10.0, 14.0, 18.0)]
    report = repeatability(turns, RigidTransform())
    assert report.rotation_accuracy == pytest.approx(np.radians(14.0), abs=1e-12)
    assert report.rotation_repeatability == pytest.approx(np.radians(4.0), abs=1e-12)
    X = at(1, 2, 3, turn=0.3, axis=(1, 0, 0))
    single = repeatability([X], X)
    assert single.accuracy == single.repeatability == 0.0
    assert single.iso_9283 is None
    assert single.rotation_accuracy < 1e-12
    opposite = [at(0, 0, 0, turn=a, axis=(0, 1, 0)) for a in (0.4, -0.4)]
    assert mean_pose(opposite).IsNearlyIdentity(1e-12)


HERE = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("points", "start", "end", "distances"),
    [
        ([[5, 3, 4], [-7, 0, 0], [0, 0, 2]], np.zeros(3), np.array([2.0, 0, 0]), [5, 0, 2]),
        ([[0, 1]], np.zeros(2), np.ones(2), [np.sqrt(0.5)]),  # in the image plane
        ([HERE, [1, 5, 7]], HERE, HERE, [0, 5]),  # a line without length is its point
    ],
)
def test_distances_from_a_line_in_closed_form(points, start, end, distances):
    found = distances_from_line(np.array(points, float), start, end)
    np.testing.assert_allclose(found, distances, atol=1e-11)


@few
@given(vector, unit, st.floats(0.1, 5.0), vector, st.floats(-5.0, 5.0))
def test_distances_from_a_line_are_those_of_the_cross_product(start, u, length, point, along):
    start = 3.0 * start
    points = np.array([3.0 * point, start + along * u])  # the second beyond the ends too
    expected = [np.linalg.norm(np.cross(points[0] - start, u)), 0.0]
    for a, b in ((start, start + length * u), (start + length * u, start)):
        np.testing.assert_allclose(distances_from_line(points, a, b), expected, rtol=0, atol=1e-11)
