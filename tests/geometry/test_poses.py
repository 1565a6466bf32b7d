"""Rotations, twists and adjoints against matrix exponentials and finite differences."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

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
from cdpr_drake.geometry.rotation_kernel import quaternion_of_matrix

ROUNDING = 1e-14  # a few products of numbers of size one
EXPONENTIAL_TOLERANCE = 1e-11  # (1 - cos theta) / theta^2 loses half the digits near theta = 1e-4
INVERSE_TOLERANCE = 1e-9  # arcus functions of numbers rounded at 1e-16, away from their ends
GIMBAL_TOLERANCE = 1e-11  # below its threshold of 1e-12 the inverse treats the pose as locked
STEP = 1e-6  # central differences
DIFFERENCE_TOLERANCE = 1e-8  # h^2 times third derivatives of size one, plus 1e-16 / h

angle = st.floats(-3.1, 3.1)
tilt = st.floats(-1.5, 1.5)  # short of +-pi/2, where phi and psi are not determined
coordinate = st.floats(-2.0, 2.0)
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
size = st.one_of(
    st.just(0.0), st.floats(1e-12, 1e-3), st.floats(9e-5, 1.1e-4), st.floats(1e-3, 9.0)
)
unit = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def twist_matrix(twist):
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = cross_matrix(twist[:3])
    matrix[:3, 3] = twist[3:]
    return matrix


def pose(axis, theta, p):
    return RigidTransform(RotationMatrix(scipy.linalg.expm(cross_matrix(axis * theta))), p)


def close(R, S, tolerance):
    return np.max(np.abs(R.matrix() - S.matrix())) <= tolerance


def test_cross_matrix_multiplies_as_the_cross_product():
    p, q = np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.7, -0.2])
    np.testing.assert_allclose(cross_matrix(p) @ q, np.cross(p, q), atol=ROUNDING)


@given(angle, angle, angle)
def test_angles_multiply_in_the_order_x_y_z(phi, theta, psi):
    c, s = np.cos([phi, theta, psi]), np.sin([phi, theta, psi])
    Rx = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    Ry = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    Rz = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    R = rotation_from_angles(np.array([phi, theta, psi])).matrix()
    np.testing.assert_allclose(R, Rx @ Ry @ Rz, atol=ROUNDING)


def test_angles_are_not_roll_pitch_yaw():
    angles = np.array([0.4, -0.3, 0.2])
    R = rotation_from_angles(angles)
    assert not close(R, RollPitchYaw(angles).ToRotationMatrix(), 0.1)
    # Reversing the order and the signs is transposing.
    assert close(R.inverse(), RollPitchYaw(-angles).ToRotationMatrix(), ROUNDING)


@given(angle, tilt, angle)
def test_angles_from_rotation_inverts(phi, theta, psi):
    angles = np.array([phi, theta, psi])
    found = angles_from_rotation(rotation_from_angles(angles))
    np.testing.assert_allclose(found, angles, atol=INVERSE_TOLERANCE)


@given(angle, st.sampled_from([-np.pi / 2, np.pi / 2]), angle)
def test_angles_from_rotation_give_the_same_rotation_in_gimbal_lock(phi, theta, psi):
    R = rotation_from_angles(np.array([phi, theta, psi]))
    found = angles_from_rotation(R)
    assert found[2] == 0.0
    assert close(rotation_from_angles(found), R, GIMBAL_TOLERANCE)


def test_pose_from_angles_joins_position_and_rotation():
    X = pose_from_angles([1, 2, 3], np.array([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(X.translation(), [1.0, 2.0, 3.0])
    assert close(X.rotation(), rotation_from_angles(np.array([0.1, 0.2, 0.3])), ROUNDING)


@given(unit, size, vector)
def test_exponential_is_the_matrix_exponential(axis, theta, v):
    twist = np.concatenate([axis * theta, v])
    expected = scipy.linalg.expm(twist_matrix(twist))
    found = exponential(twist).GetAsMatrix4()
    np.testing.assert_allclose(found, expected, atol=EXPONENTIAL_TOLERANCE)


@given(unit, size, vector)
def test_exponential_of_the_opposite_twist_is_the_inverse(axis, theta, v):
    twist = np.concatenate([axis * theta, v])
    there_and_back = exponential(twist) @ exponential(-twist)
    assert there_and_back.IsNearlyIdentity(EXPONENTIAL_TOLERANCE)


@given(unit, st.floats(0.0, 1e6), vector)
def test_rotations_of_exponentials_need_no_check(axis, theta, v):
    """It is left out: Drake's accepts them all."""
    assert exponential(np.concatenate([axis * theta, v])).rotation().IsValid()


@given(unit, st.one_of(st.just(0.0), st.floats(1e-15, 1e-3), st.floats(1e-3, 3.1)), vector)
def test_logarithm_inverts_exponential(axis, theta, v):
    twist = np.concatenate([axis * theta, v])
    np.testing.assert_allclose(logarithm(exponential(twist)), twist, atol=INVERSE_TOLERANCE)


@given(unit, st.one_of(st.just(0.0), st.floats(1e-15, 1e-6), st.floats(1e-6, 3.1)))
def test_rotation_vector_inverts_rotation_from_vector(axis, theta):
    found = rotation_vector(rotation_from_vector(axis * theta))
    np.testing.assert_allclose(found, axis * theta, atol=INVERSE_TOLERANCE)


@given(unit, st.floats(0.0, 1e-7))
def test_rotation_vector_near_a_half_turn_has_the_right_angle_and_rotation(axis, short_of):
    R = rotation_from_vector(axis * (np.pi - short_of))
    theta_u = rotation_vector(R)
    assert np.linalg.norm(theta_u) == pytest.approx(np.pi - short_of, abs=INVERSE_TOLERANCE)
    assert close(rotation_from_vector(theta_u), R, INVERSE_TOLERANCE)


@given(unit, st.floats(3.2, 6.2))
def test_rotation_vector_takes_the_shorter_way_round(axis, theta):
    found = rotation_vector(rotation_from_vector(axis * theta))
    np.testing.assert_allclose(found, axis * (theta - 2.0 * np.pi), atol=INVERSE_TOLERANCE)


@given(unit, st.floats(0.0, 3.0), vector, unit, vector)
def test_adjoint_carries_twists_between_frames_of_one_body(axis, theta, p, w, v):
    """The body moves with V_B in B; frame A moves along, and its twist comes from differences."""
    X_AB, V_B = pose(axis, theta, p), np.concatenate([w, v])

    def X_A0A(t):
        return X_AB @ exponential(V_B * t) @ X_AB.inverse()

    rate = (X_A0A(STEP).GetAsMatrix4() - X_A0A(-STEP).GetAsMatrix4()) / (2.0 * STEP)
    expected = np.array([rate[2, 1], rate[0, 2], rate[1, 0], *rate[:3, 3]])
    np.testing.assert_allclose(adjoint(X_AB) @ V_B, expected, atol=DIFFERENCE_TOLERANCE)


@given(unit, st.floats(0.0, 3.0), vector)
def test_adjoint_of_the_inverse_is_the_inverse_adjoint(axis, theta, p):
    X = pose(axis, theta, p)
    product = adjoint(X) @ adjoint(X.inverse())
    np.testing.assert_allclose(product, np.eye(6), atol=10 * ROUNDING)


@given(unit, st.floats(0.0, 3.0), vector, unit, st.floats(0.0, 3.0), vector)
def test_adjoint_of_a_product_is_the_product_of_adjoints(u1, a1, p1, u2, a2, p2):
    X, Y = pose(u1, a1, p1), pose(u2, a2, p2)
    np.testing.assert_allclose(adjoint(X @ Y), adjoint(X) @ adjoint(Y), atol=10 * ROUNDING)


@given(unit, st.one_of(angle, st.sampled_from([0.0, np.pi, -np.pi, 1e-9])))
def test_quaternion_of_matrix_is_that_of_drake(axis, theta):
    R = pose(axis, theta, np.zeros(3)).rotation()
    q, expected = np.empty(4), R.ToQuaternion().wxyz()
    quaternion_of_matrix(R.matrix(), q)
    assert q[0] >= 0.0
    if q @ expected < 0.0:  # a half turn, where both signs are right
        assert q[0] <= ROUNDING
        expected = -expected
    np.testing.assert_allclose(q, expected, rtol=0.0, atol=ROUNDING)


@given(unit, st.floats(0.0, 3.1), vector, vector, unit, st.floats(0.0, 3.1))
def test_pose_error_is_distance_and_angle(axis, theta, p, offset, other_axis, other):
    X_AB = pose(other_axis, other, p)
    X_AC = RigidTransform(X_AB.rotation() @ pose(axis, theta, p).rotation(), p + offset)
    distance, turned = pose_error(X_AB, X_AC)
    assert distance == pytest.approx(np.linalg.norm(offset), abs=10 * ROUNDING)
    assert turned == pytest.approx(theta, abs=INVERSE_TOLERANCE)
    assert pose_error(X_AC, X_AB) == pytest.approx((distance, turned), abs=INVERSE_TOLERANCE)


def test_pose_error_of_a_pose_with_itself_is_zero():
    X = pose_from_angles([1.0, 2.0, 3.0], np.array([0.1, 0.2, 0.3]))
    assert pose_error(X, X) == pytest.approx((0.0, 0.0), abs=ROUNDING)
