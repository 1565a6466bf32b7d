"""Lengths, Jacobian and wrench matrix against plain loops, finite differences and virtual work."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import exponential, rotation_from_angles
from cdpr_drake.geometry.straight_cables import (
    PLANAR_ROWS,
    cable_lengths,
    cable_vectors,
    gravity_wrench,
    length_jacobian,
    wrench_matrix,
)

ROUNDING = 1e-13  # a dozen products of numbers of size one
STEP = 1e-6  # central differences
DIFFERENCE_TOLERANCE = 1e-8  # h^2 / length^2, plus 1e-16 / h, at lengths above 0.3 m

# Eight cables from the corners of a box of 2 m to a platform of 0.2 m, without symmetry.
P_WA = np.array([(x, y, z) for x in (-1.0, 1.1) for y in (-0.9, 1.0) for z in (0.0, 1.9)]).T
P_PB = np.array([(x, y, z) for x in (0.1, -0.11) for y in (-0.1, 0.12) for z in (0.08, 0.0)]).T

position = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.5, 1.4)).map(np.array)
angles = st.tuples(*[st.floats(-1.5, 1.5)] * 3).map(np.array)
poses = st.builds(lambda a, p: RigidTransform(rotation_from_angles(a), p), angles, position)
spatial = st.tuples(*[st.floats(-1.0, 1.0)] * 6).map(np.array)


def moved(X_WP, V_WP, t):
    """The pose after moving at the spatial velocity V_WP = (w, v of Po) in W, to second order."""
    R = exponential(np.concatenate([V_WP[:3] * t, np.zeros(3)])).rotation() @ X_WP.rotation()
    return RigidTransform(R, X_WP.translation() + V_WP[3:] * t)


@given(poses)
def test_lengths_are_distances_of_the_points(X_WP):
    naive = [np.linalg.norm(X_WP @ P_PB[:, i] - P_WA[:, i]) for i in range(P_WA.shape[1])]
    np.testing.assert_allclose(cable_lengths(X_WP, P_WA, P_PB), naive, rtol=ROUNDING)


@given(poses)
def test_vectors_run_from_exit_to_anchor_points(X_WP):
    p_AB_W, p_PB_W = cable_vectors(X_WP, P_WA, P_PB)
    np.testing.assert_allclose(P_WA + p_AB_W, X_WP @ P_PB, atol=ROUNDING)
    np.testing.assert_allclose(p_PB_W, X_WP.rotation() @ P_PB, atol=ROUNDING)


@given(poses)
def test_jacobian_is_the_plain_formula(X_WP):
    rows = []
    for i in range(P_WA.shape[1]):
        along = X_WP @ P_PB[:, i] - P_WA[:, i]
        u = along / np.linalg.norm(along)
        rows.append(np.concatenate([np.cross(X_WP.rotation() @ P_PB[:, i], u), u]))
    np.testing.assert_allclose(length_jacobian(X_WP, P_WA, P_PB), rows, atol=ROUNDING)


@given(poses, spatial)
def test_jacobian_is_the_derivative_of_lengths(X_WP, V_WP):
    ahead = cable_lengths(moved(X_WP, V_WP, STEP), P_WA, P_PB)
    back = cable_lengths(moved(X_WP, V_WP, -STEP), P_WA, P_PB)
    rates = length_jacobian(X_WP, P_WA, P_PB) @ V_WP
    np.testing.assert_allclose(rates, (ahead - back) / (2.0 * STEP), atol=DIFFERENCE_TOLERANCE)


def test_jacobian_takes_integers_and_slices():
    X_WP = RigidTransform([0.1, 0.0, 1.0])
    p_WA = np.array([[-2, 2], [0, 0], [3, 3]])
    p_PB = np.asfortranarray(np.array([[0, 0, 1], [0, 0, 0], [1, 1, 1]]))[:, ::2]
    expected = length_jacobian(X_WP, p_WA.astype(float), np.array(p_PB, float, order="C"))
    np.testing.assert_array_equal(length_jacobian(X_WP, p_WA, p_PB), expected)


@given(poses)
def test_wrench_matrix_is_minus_the_transposed_jacobian(X_WP):
    W = wrench_matrix(X_WP, P_WA, P_PB)
    assert W.shape == (6, P_WA.shape[1])
    np.testing.assert_array_equal(W, -length_jacobian(X_WP, P_WA, P_PB).T)


@given(poses, spatial)
def test_tensions_do_the_work_that_the_shortening_takes(X_WP, V_WP):
    """Virtual work: the power of W t is that of the tensions, -t . dl/dt."""
    t = np.linspace(1.0, 20.0, P_WA.shape[1])
    ahead = cable_lengths(moved(X_WP, V_WP, STEP), P_WA, P_PB)
    back = cable_lengths(moved(X_WP, V_WP, -STEP), P_WA, P_PB)
    power = (wrench_matrix(X_WP, P_WA, P_PB) @ t) @ V_WP
    expected = -t @ (ahead - back) / (2.0 * STEP)
    assert abs(power - expected) <= np.sum(t) * DIFFERENCE_TOLERANCE


def test_a_platform_hanging_on_one_cable_is_pulled_up():
    W = wrench_matrix(RigidTransform([0.0, 0.0, 1.0]), [[0.0], [0.0], [3.0]], [[0.1], [0.0], [0.0]])
    assert W[5, 0] > 0.9  # the anchor point lies 0.1 m off the plumb line, so almost all of it
    assert W[4, 0] == 0.0
    np.testing.assert_allclose(W[:3, 0], np.cross([0.1, 0.0, 0.0], W[3:, 0]), atol=ROUNDING)


def test_a_mirrored_robot_pulls_as_the_mirror_image():
    """In the plane x = 0 of a robot that is its own mirror image, equal tensions pull within it."""
    half_A = np.array([[0.8, 0.7, 1.5], [0.9, -0.6, 1.4]]).T
    half_B = np.array([[0.1, 0.1, 0.1], [0.1, -0.1, 0.0]]).T
    mirror = np.diag([-1.0, 1.0, 1.0])
    p_WA, p_PB = np.hstack([half_A, mirror @ half_A]), np.hstack([half_B, mirror @ half_B])
    X_WP = RigidTransform(RotationMatrix.MakeXRotation(0.2), [0.0, 0.1, 0.4])
    W = wrench_matrix(X_WP, p_WA, p_PB)
    pull = W @ np.array([3.0, 5.0, 3.0, 5.0])
    np.testing.assert_allclose(pull[[1, 2, 3]], 0.0, atol=ROUNDING)
    lengths = cable_lengths(X_WP, p_WA, p_PB)
    np.testing.assert_allclose(lengths[:2], lengths[2:], rtol=ROUNDING)


@given(poses, poses)
def test_lengths_do_not_depend_on_the_choice_of_world(X_WP, X_VW):
    moved_lengths = cable_lengths(X_VW @ X_WP, X_VW @ P_WA, P_PB)
    np.testing.assert_allclose(moved_lengths, cable_lengths(X_WP, P_WA, P_PB), rtol=ROUNDING)


def test_planar_rows_are_turning_about_z_and_moving_along_x_and_y():
    V = np.zeros(6)
    V[list(PLANAR_ROWS)] = 1.0
    np.testing.assert_array_equal(V, [0.0, 0.0, 1.0, 1.0, 1.0, 0.0])


@given(poses)
def test_gravity_wrench_is_the_derivative_of_the_potential_energy(X_WP):
    mass, p_PCo, gravity = 3.5, np.array([0.02, -0.03, 0.05]), 9.0
    w = gravity_wrench(X_WP, mass, p_PCo, gravity)

    def energy(V, t):
        return mass * gravity * (moved(X_WP, V, t) @ p_PCo)[2]

    slope = [(energy(V, STEP) - energy(V, -STEP)) / (2.0 * STEP) for V in np.eye(6)]
    np.testing.assert_allclose(w, -np.array(slope), atol=mass * gravity * DIFFERENCE_TOLERANCE)


def test_gravity_is_9_81_unless_said_otherwise():
    w = gravity_wrench(RigidTransform(), 2.0, np.zeros(3))
    np.testing.assert_array_equal(w, [0.0, 0.0, 0.0, 0.0, 0.0, -2.0 * 9.81])
