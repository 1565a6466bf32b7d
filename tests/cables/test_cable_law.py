"""The static cable law against the kernel that simulates it, and energy against differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.cables.elastic_law import (
    axial_stiffness,
    cable_stiffness_matrix,
    elastic_energy,
    stretched_lengths,
    unstrained_lengths,
)
from cdpr_drake.cables.straight_kernel import floating_cables, floating_force
from cdpr_drake.geometry.motion_kernel import pack_cables
from cdpr_drake.geometry.poses import exponential, rotation_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian

STIFFNESS = np.array([1.0e4, 2.0e4, 3.0e5, 5.0e4, 1.0e4, 2.0e4, 3.0e5, 5.0e4])  # [N]
TENSION_TOLERANCE = 1e-9  # [N]; 3e5 N of stiffness times a strain rounded at 4e-16, several times
STEP = 1e-6  # [m]; central differences
ENERGY_TOLERANCE = 1e-5  # relative; 1e-16 of the energy over the step, plus the curvature
PRETENSION_STRAIN = 1e-4  # taut, yet with little stiffness from turning the tensions
STIFFNESS_TOLERANCE = 1e-3  # relative; ten times the strain, for that left-out part

P_WA = np.array([(x, y, z) for x in (-1.0, 1.1) for y in (-0.9, 1.0) for z in (0.0, 1.9)]).T
P_PB = np.array([(x, y, z) for x in (0.1, -0.11) for y in (-0.1, 0.12) for z in (0.08, 0.0)]).T
M = P_WA.shape[1]
CABLES = pack_cables(P_WA, P_PB, STIFFNESS, np.zeros(M))
X_WP = RigidTransform(rotation_from_angles(np.array([0.1, -0.2, 0.3])), [0.1, -0.2, 0.9])

tensions = st.lists(st.floats(0.0, 500.0), min_size=M, max_size=M).map(np.array)


def state_at(X):
    return np.concatenate([X.rotation().ToQuaternion().wxyz(), X.translation(), np.zeros(6)])


def test_axial_stiffness_is_modulus_times_area():
    assert axial_stiffness(100.0e9, 2.0e-3) == pytest.approx(np.pi * 1.0e5)


@given(tensions)
def test_the_kernel_finds_the_tensions_that_unstrained_lengths_were_made_for(t):
    l0 = unstrained_lengths(cable_lengths(X_WP, P_WA, P_PB), t, STIFFNESS)
    out = np.empty((3, M))
    floating_cables(state_at(X_WP), l0, np.zeros(M), CABLES, out)
    np.testing.assert_allclose(out[0], t, rtol=0.0, atol=TENSION_TOLERANCE)


def test_a_cable_without_tension_is_not_strained():
    lengths = np.array([1.0, 2.0])
    l0 = unstrained_lengths(lengths, np.zeros(2), np.array([1e4, 1e5]))
    np.testing.assert_array_equal(l0, lengths)


@given(st.integers(0, M - 1), st.floats(1e-4, 1e-2))
def test_tension_is_the_slope_of_the_elastic_energy(i, strain):
    l0 = np.linspace(1.0, 2.0, M)
    lengths = l0 * (1.0 + strain)
    step = STEP * np.eye(M)[i]
    ahead = elastic_energy(lengths + step, l0, STIFFNESS)
    back = elastic_energy(lengths - step, l0, STIFFNESS)
    tension = STIFFNESS[i] * strain
    scale = max(tension, elastic_energy(lengths, l0, STIFFNESS))
    assert abs((ahead - back) / (2.0 * STEP) - tension) <= ENERGY_TOLERANCE * scale


def test_slack_cables_store_nothing():
    assert elastic_energy(np.array([0.9, 0.5]), np.ones(2), STIFFNESS[:2]) == 0.0
    one = elastic_energy(np.array([1.1]), np.ones(1), STIFFNESS[:1])
    assert elastic_energy(np.array([1.1, 0.5]), np.ones(2), STIFFNESS[:2]) == one


def test_the_kernel_pulls_down_the_slope_of_the_elastic_energy():
    """F_P_W . V = -dE/dt for all six motions of the platform."""
    l0 = unstrained_lengths(cable_lengths(X_WP, P_WA, P_PB), np.full(M, 100.0), STIFFNESS)
    out = np.empty(6)
    floating_force(state_at(X_WP), l0, np.zeros(M), CABLES, 0, out)

    def energy(V, t):
        return elastic_energy(cable_lengths(moved(V * t), P_WA, P_PB), l0, STIFFNESS)

    slope = [(energy(V, STEP) - energy(V, -STEP)) / (2.0 * STEP) for V in np.eye(6)]
    np.testing.assert_allclose(out, -np.array(slope), atol=ENERGY_TOLERANCE * np.max(np.abs(out)))


def moved(turn_and_shift):
    R = exponential(np.concatenate([turn_and_shift[:3], np.zeros(3)])).rotation()
    return RigidTransform(R @ X_WP.rotation(), X_WP.translation() + turn_and_shift[3:])


def test_stiffness_is_minus_the_derivative_of_the_kernels_force():
    lengths = cable_lengths(X_WP, P_WA, P_PB)
    l0 = lengths / (1.0 + PRETENSION_STRAIN)

    def force(turn_and_shift):
        out = np.empty(6)
        floating_force(state_at(moved(turn_and_shift)), l0, np.zeros(M), CABLES, 0, out)
        return out

    columns = [(force(d) - force(-d)) / (2.0 * STEP) for d in STEP * np.eye(6)]
    K = cable_stiffness_matrix(length_jacobian(X_WP, P_WA, P_PB), STIFFNESS, l0)
    tolerance = STIFFNESS_TOLERANCE * np.max(np.abs(K))
    np.testing.assert_allclose(K, -np.array(columns).T, rtol=0.0, atol=tolerance)


def test_stiffness_is_symmetric_and_positive_for_eight_cables():
    K = cable_stiffness_matrix(length_jacobian(X_WP, P_WA, P_PB), STIFFNESS, np.full(M, 1.5))
    np.testing.assert_allclose(K, K.T, rtol=1e-12)
    assert np.min(np.linalg.eigvalsh(K)) > 0.0


def test_a_single_cable_is_a_spring_along_its_direction():
    J = np.array([[0.0, 0.0, 0.0, 0.0, 0.6, 0.8]])
    K = cable_stiffness_matrix(J, np.array([1e4]), np.array([2.0]))
    np.testing.assert_allclose(K, 5e3 * J.T @ J)


def test_stretched_lengths_undo_unstrained_lengths():
    lengths, t, ES = (
        np.array([1.0, 2.0, 3.0]),
        np.array([0.0, 50.0, 2e3]),
        np.array([1e3, 2e4, 3e5]),
    )
    np.testing.assert_allclose(
        stretched_lengths(unstrained_lengths(lengths, t, ES), t, ES), lengths
    )
    np.testing.assert_array_equal(
        stretched_lengths(lengths, -t, ES), lengths
    )  # no cable is compressed
