import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake import pose_fit_kernel as kernel
from cdpr_drake.models import load_robot
from cdpr_drake.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.pulley_geometry import cable_paths

ROUNDING = 1e-12


def state_of(X_WP):
    return np.concatenate([X_WP.rotation().ToQuaternion().wxyz(), X_WP.translation(), np.zeros(6)])


@given(st.lists(st.floats(-7.0, 7.0), min_size=3, max_size=3), st.floats(1e-9, 1.0))
def test_a_turn_is_multiplied_from_the_left(vector, size):
    X = pose_from_angles([0.1, 0.2, 0.3], [0.4, -0.5, 0.6])
    state, turn = state_of(X), size * np.array(vector)
    kernel._turn(state, *turn)
    expected = rotation_from_vector(turn) @ X.rotation()
    found = RotationMatrix(Quaternion(state[:4]))
    np.testing.assert_allclose(found.matrix(), expected.matrix(), atol=ROUNDING)


@pytest.mark.parametrize("planar", [False, True])
def test_normal_equations(planar):
    cables = load_robot("acrobot_large").cable_set()
    X = pose_from_angles([0.1, -0.1, 0.4], [0.2, 0.1, -0.3])
    paths, used = cable_paths(X, cables), np.array([0, 2, 3, 4, 6, 7])
    lengths = paths.lengths + np.linspace(-0.1, 0.2, 8)
    A, g = np.empty((6, 6)), np.empty(6)
    cost, largest = kernel._normal_equations(
        state_of(X), cables.packed(), used, lengths, planar, A, g
    )
    J, r = paths.J[used], (paths.lengths - lengths)[used]
    expected, slope = J.T @ J, J.T @ r
    if planar:
        moving = np.isin(np.arange(6), [2, 3, 4])
        expected[~moving] = 0.0
        expected[:, ~moving] = 0.0
        expected[~moving, ~moving] = 1.0
        slope[~moving] = 0.0
    np.testing.assert_allclose(np.tril(A), np.tril(expected), atol=ROUNDING)
    np.testing.assert_allclose(g, slope, atol=ROUNDING)
    assert cost == pytest.approx(r @ r)
    assert largest == pytest.approx(np.max(np.abs(r)))


@given(st.integers(0, 1000), st.sampled_from([0.0, 0.1, 10.0]))
def test_solves_damped_equations(seed, damping):
    random = np.random.default_rng(seed)
    J, g = random.normal(size=(8, 6)) * [1e-2, 1.0, 1e2, 1.0, 1.0, 1e-3], random.normal(size=6)
    A, C, x = J.T @ J, np.empty((6, 6)), np.empty(6)
    assert kernel._solve(A, g, damping, C, x) > 0.0
    damped = A + damping * np.diag(np.diag(A))
    np.testing.assert_allclose(damped @ x, -g, atol=1e-6)


def test_singular_equations_have_no_solution():
    J = np.random.default_rng(0).normal(size=(5, 6))
    assert kernel._solve(J.T @ J, np.ones(6), 0.0, np.empty((6, 6)), np.empty(6)) < 0.0
    nan = np.full((6, 6), np.nan)
    assert kernel._solve(nan, np.ones(6), 0.0, np.empty((6, 6)), np.empty(6)) < 0.0


def test_turned_guesses_help_where_the_first_ends_wrong():
    cables = load_robot("acrobot_large").cable_set().packed()
    true = RigidTransform([0.0, 0.0, 0.3])
    lengths, J = np.empty(8), np.empty((8, 6))
    kernel.lengths_at(state_of(true), cables, lengths, J)
    state, work, used = np.empty(13), np.empty(kernel.WORK_SHAPE), np.arange(8)
    random, helped = np.random.default_rng(0), 0
    for _ in range(300):
        R = rotation_from_vector(2.0 * random.normal(size=3) / np.sqrt(3.0))
        guess = state_of(RigidTransform(R, [0.0, 0.0, 0.3]))
        alone = guess.copy()
        first, _ = kernel._descend(alone, cables, used, lengths, False, 1e-6, work)
        code, _ = kernel.fit_pose(guess[:7], cables, used, lengths, False, 1e-6, state, work)
        helped += code == kernel.FITS != first
        if code == kernel.FITS:
            np.testing.assert_allclose(np.abs(state[:4]), [1.0, 0.0, 0.0, 0.0], atol=1e-9)
        else:
            np.testing.assert_array_equal(state, alone)
    assert helped > 0
