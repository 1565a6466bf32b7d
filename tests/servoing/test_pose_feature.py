"""The interaction matrix of the pose against finite differences of a moving camera."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import exponential, rotation_from_vector
from cdpr_drake.servoing.pose_features import (
    pose_feature_error,
    pose_interaction,
    theta_u_interaction,
)

ROUNDING = 1e-12  # rotation vectors of nearly equal rotations
STEP = 1e-6  # central differences
# 1e-16 / h, plus h^2 times third derivatives, which grow to 1e3 where theta nears pi or above.
DIFFERENCE_TOLERANCE = 1e-8
DETERMINANT_TOLERANCE = 1e-10  # relative; a 3 x 3 determinant of entries up to 3

coordinate = st.floats(-1.0, 1.0)
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
unit = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
# Short of pi, where the rotation vector jumps to the other side.
turn = st.builds(lambda u, theta: u * theta, unit, st.floats(0.0, 3.0))
small_turn = st.builds(lambda u, theta: u * theta, unit, st.floats(0.0, 1e-5))
poses = st.builds(lambda r, p: RigidTransform(rotation_from_vector(r), p), turn, vector)
twists = st.tuples(*[coordinate] * 6).map(np.array)


def desired(X_CO, theta_u, offset):
    """X_CdO such that R_CdC = exp(theta_u)."""
    R = rotation_from_vector(theta_u) @ X_CO.rotation()
    return RigidTransform(R, X_CO.translation() + offset)


def rate_of_error(X_CO, X_CdO, V_C):
    """The camera moves by exp(V t) in its own frame, the object is at rest."""
    ahead = pose_feature_error(exponential(-V_C * STEP) @ X_CO, X_CdO)
    back = pose_feature_error(exponential(V_C * STEP) @ X_CO, X_CdO)
    return (ahead - back) / (2.0 * STEP)


@given(poses)
def test_the_error_is_zero_at_the_desired_pose(X):
    np.testing.assert_allclose(pose_feature_error(X, X), np.zeros(6), atol=ROUNDING)


@given(poses, turn, vector)
def test_the_error_is_rotation_vector_and_offset(X_CO, theta_u, offset):
    error = pose_feature_error(X_CO, desired(X_CO, theta_u, offset))
    np.testing.assert_allclose(error, np.concatenate([theta_u, -offset]), atol=ROUNDING)


@given(poses, st.one_of(turn, small_turn), vector, twists)
def test_pose_interaction_is_the_derivative_of_the_error(X_CO, theta_u, offset, V_C):
    X_CdO = desired(X_CO, theta_u, offset)
    found = pose_interaction(X_CO, X_CdO) @ V_C
    expected = rate_of_error(X_CO, X_CdO, V_C)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=DIFFERENCE_TOLERANCE)


@given(st.one_of(turn, small_turn), vector)
def test_theta_u_interaction_is_the_derivative_of_the_rotation_vector(theta_u, w_C):
    X_CO = RigidTransform()
    expected = rate_of_error(X_CO, desired(X_CO, theta_u, np.zeros(3)), np.append(w_C, np.zeros(3)))
    found = theta_u_interaction(theta_u) @ w_C
    np.testing.assert_allclose(found, expected[:3], rtol=0.0, atol=DIFFERENCE_TOLERANCE)


@given(unit, st.one_of(st.floats(0.0, 1e-5), st.floats(1e-5, 6.2)))
def test_the_determinant_has_a_closed_form(axis, theta):
    """det(L) = 1 / sinc^2(theta / 2), so L is regular within a full turn."""
    determinant = np.linalg.det(theta_u_interaction(axis * theta))
    expected = 1.0 / np.sinc(theta / 2.0 / np.pi) ** 2  # NumPy's sinc has the pi inside
    assert determinant == pytest.approx(expected, rel=DETERMINANT_TOLERANCE)


@given(turn)
def test_turning_about_the_axis_changes_only_the_angle(theta_u):
    L = theta_u_interaction(theta_u)
    np.testing.assert_allclose(L @ theta_u, theta_u, atol=ROUNDING)


def test_without_rotation_error_turning_is_seen_as_it_is():
    np.testing.assert_array_equal(theta_u_interaction(np.zeros(3)), np.eye(3))


@given(poses, turn)
def test_the_interaction_matrix_is_block_triangular(X_CO, theta_u):
    """Translations do not turn the object in the image, and shift it one to one."""
    L = pose_interaction(X_CO, desired(X_CO, theta_u, np.zeros(3)))
    np.testing.assert_array_equal(L[:3, 3:], np.zeros((3, 3)))
    np.testing.assert_array_equal(L[3:, 3:], -np.eye(3))
