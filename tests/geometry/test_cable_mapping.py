"""Cable velocities through the platform frame and through the base frame are the same."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_rates import (
    base_adjoint,
    cable_rates_from_base_twist,
    cable_rates_from_platform_twist,
)
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import adjoint, rotation_from_vector
from cdpr_drake.geometry.straight_cables import length_jacobian

ROUND_OFF = 1e-12
"""Of rates of order one."""

coordinate = st.floats(-1.0, 1.0)
vectors = st.tuples(coordinate, coordinate, coordinate).map(np.array)
poses = st.builds(lambda r, p: RigidTransform(rotation_from_vector(r), 0.3 * p), vectors, vectors)
twists = st.tuples(*[coordinate] * 6).map(np.array)

RANDOM = np.random.default_rng(4)
A = 3.0 + RANDOM.random((3, 8))
B = 0.1 * RANDOM.standard_normal((3, 8))
CABLES = CableSet.make(A, B, 1e5).packed()
OVER_PULLEYS = CableSet.make(A, B, 1e5, pulley_radius=0.05)


def arrays(X):
    """Of the kind that kernels get: they are compiled for each kind anew."""
    return np.ascontiguousarray(X.rotation().matrix()), np.array(X.translation())


@given(poses, twists)
def test_rates_are_those_of_the_length_jacobian(X_WP, V_P):
    R = X_WP.rotation().matrix()
    V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
    expected = length_jacobian(X_WP, A, B) @ V_WP
    for found in (
        cable_rates_from_platform_twist(*arrays(X_WP), CABLES, V_P),
        cable_rates_from_base_twist(*arrays(X_WP), CABLES, V_WP),
    ):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUND_OFF)


@given(poses, poses, twists)
def test_both_frames_give_the_same_cable_velocities(X_WP, X_PC, V_C):
    """Servoing thesis A.3: A A_d = bA bA_d."""
    by_platform = cable_rates_from_platform_twist(*arrays(X_WP), CABLES, adjoint(X_PC) @ V_C)
    V_WP = base_adjoint(arrays(X_WP)[0], *arrays(X_PC)) @ V_C
    by_base = cable_rates_from_base_twist(*arrays(X_WP), CABLES, V_WP)
    np.testing.assert_allclose(by_platform, by_base, rtol=0.0, atol=ROUND_OFF)


@given(poses, twists)
def test_rates_over_pulleys_are_those_of_their_jacobian(X_WP, V_P):
    R = X_WP.rotation().matrix()
    V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
    expected = cable_jacobian(X_WP, OVER_PULLEYS) @ V_WP
    rows = OVER_PULLEYS.packed()
    for found in (
        cable_rates_from_platform_twist(*arrays(X_WP), rows, V_P),
        cable_rates_from_base_twist(*arrays(X_WP), rows, V_WP),
    ):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUND_OFF)
