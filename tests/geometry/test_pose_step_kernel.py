import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix

from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.geometry.rotation_kernel import solve_damped, turn_pose

ROUNDING = 1e-12


@given(st.lists(st.floats(-7.0, 7.0), min_size=3, max_size=3), st.floats(1e-9, 1.0))
def test_a_turn_is_multiplied_from_the_left(vector, size):
    X = pose_from_angles([0.1, 0.2, 0.3], [0.4, -0.5, 0.6])
    state, turn = X.rotation().ToQuaternion().wxyz(), size * np.array(vector)
    turn_pose(state, *turn)
    expected = rotation_from_vector(turn) @ X.rotation()
    found = RotationMatrix(Quaternion(state[:4]))
    np.testing.assert_allclose(found.matrix(), expected.matrix(), atol=ROUNDING)


@given(st.integers(0, 1000), st.sampled_from([0.0, 0.1, 10.0]))
def test_solves_damped_equations(seed, damping):
    random = np.random.default_rng(seed)
    J, g = random.normal(size=(8, 6)) * [1e-2, 1.0, 1e2, 1.0, 1.0, 1e-3], random.normal(size=6)
    A, C, x = J.T @ J, np.empty((6, 6)), np.empty(6)
    assert solve_damped(A, g, damping, C, x) > 0.0
    damped = A + damping * np.diag(np.diag(A))
    np.testing.assert_allclose(damped @ x, -g, atol=1e-6)


def test_singular_equations_have_no_solution():
    J = np.random.default_rng(0).normal(size=(5, 6))
    assert solve_damped(J.T @ J, np.ones(6), 0.0, np.empty((6, 6)), np.empty(6)) < 0.0
    nan = np.full((6, 6), np.nan)
    assert solve_damped(nan, np.ones(6), 0.0, np.empty((6, 6)), np.empty(6)) < 0.0
