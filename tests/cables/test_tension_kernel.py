"""Kernels of tension-driven cables against the Jacobian of cable lengths, over pulleys or not."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.cables.commanded_tension_kernel import cable_motions, tension_force
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot

ROUNDING = 1e-12
"""Sums of eight products of order one, times tensions of at most a hundred, relative to these."""

LARGEST = 100.0
"""Largest tension of the examples [N]."""

FLOATING = load_robot("acrobot_large")
PLANAR = load_robot("planar")


def cables_of(robot, pulleys):
    return robot.cable_set() if pulleys else robot.cable_set().without_pulleys()


share = st.floats(-0.3, 0.3)
triple = st.tuples(share, share, share).map(np.array)
spatial = st.tuples(*[st.floats(-2.0, 2.0)] * 6).map(np.array)
tension = st.floats(-LARGEST, LARGEST)


@given(
    triple, triple, spatial, st.tuples(*[tension] * 8).map(np.array), st.booleans(), st.booleans()
)
def test_floating_platform(turn, offset, V_WP, tensions, push, pulleys):
    home = FLOATING.home.transform()
    X_WP = RigidTransform(rotation_from_vector(turn), home.translation() + offset)
    q = X_WP.rotation().ToQuaternion().wxyz()
    state = np.concatenate([q, X_WP.translation(), V_WP])
    cables = cables_of(FLOATING, pulleys)
    paths = cable_paths(X_WP, cables)
    J = paths.J
    force = np.full(8, np.nan)
    tension_force(state, tensions, cables.packed(), 0.0, push, 1, force)
    np.testing.assert_array_equal(force[[0, 7]], np.zeros(2))
    expected = -J.T @ (tensions if push else np.maximum(tensions, 0.0))
    np.testing.assert_allclose(force[1:7], expected, atol=ROUNDING * LARGEST)
    motions = np.empty((2, 8))
    cable_motions(state, cables.packed(), 0.0, motions)
    np.testing.assert_allclose(motions, [paths.lengths, J @ V_WP], atol=ROUNDING)


@given(triple, triple, st.tuples(*[tension] * 4).map(np.array), st.booleans(), st.booleans())
def test_planar_platform(q, v, tensions, push, pulleys):
    height = PLANAR.plane_height
    X_WP = RigidTransform(RotationMatrix.MakeZRotation(q[2]), [q[0], q[1], height])
    V_WP = np.array([0.0, 0.0, v[2], v[0], v[1], 0.0])
    state = np.concatenate([q, v])
    cables = cables_of(PLANAR, pulleys)
    paths = cable_paths(X_WP, cables)
    J = paths.J
    force = np.full(4, np.nan)
    tension_force(state, tensions, cables.packed(), height, push, 1, force)
    assert force[0] == 0.0
    expected = (-J.T @ (tensions if push else np.maximum(tensions, 0.0)))[[3, 4, 2]]
    np.testing.assert_allclose(force[1:], expected, atol=ROUNDING * LARGEST)
    motions = np.empty((2, 4))
    cable_motions(state, cables.packed(), height, motions)
    np.testing.assert_allclose(motions, [paths.lengths, J @ V_WP], atol=ROUNDING)


def test_a_tension_that_is_no_number_shows():
    state = np.concatenate([[1.0, 0.0, 0.0, 0.0], FLOATING.home.position, np.zeros(6)])
    tensions = np.full(8, 10.0)
    tensions[3] = np.nan
    force = np.empty(6)
    tension_force(state, tensions, FLOATING.cable_set().packed(), 0.0, False, 0, force)
    assert np.all(np.isnan(force))
