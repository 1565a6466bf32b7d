import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_type import FREE, LEVEL
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics import pose_fit_kernel as kernel

ROUNDING = 1e-12


def state_of(X_WP):
    return np.concatenate([X_WP.rotation().ToQuaternion().wxyz(), X_WP.translation(), np.zeros(6)])


@pytest.mark.parametrize("planar", [False, True])
def test_normal_equations(planar):
    cables = load_robot("acrobot_large").cable_set()
    X = pose_from_angles([0.1, -0.1, 0.4], [0.2, 0.1, -0.3])
    paths, used = cable_paths(X, cables), np.array([0, 2, 3, 4, 6, 7])
    lengths = paths.lengths + np.linspace(-0.1, 0.2, 8)
    A, g = np.empty((6, 6)), np.empty(6)
    cost, largest = kernel._normal_equations(
        state_of(X),
        cables.packed(),
        used,
        lengths,
        (LEVEL if planar else FREE).packed(),
        np.empty((7, 6)),
        A,
        g,
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


def test_turned_guesses_help_where_the_first_ends_wrong():
    cables = load_robot("acrobot_large").cable_set().packed()
    true = RigidTransform([0.0, 0.0, 0.3])
    lengths, J = np.empty(8), np.empty((8, 6))
    kernel.lengths_at(state_of(true), cables, lengths, J)
    state, work, used = np.empty(13), np.empty(kernel.WORK_SHAPE), np.arange(8)
    random, helped, free = np.random.default_rng(0), 0, FREE.packed()
    for _ in range(300):
        R = rotation_from_vector(2.0 * random.normal(size=3) / np.sqrt(3.0))
        guess = state_of(RigidTransform(R, [0.0, 0.0, 0.3]))
        alone = guess.copy()
        first, _ = kernel._descend(alone, cables, used, lengths, free, 1e-6, work)
        code, _ = kernel.fit_pose(guess[:7], cables, used, lengths, free, 1e-6, state, work)
        helped += code == kernel.FITS != first
        if code == kernel.FITS:
            np.testing.assert_allclose(np.abs(state[:4]), [1.0, 0.0, 0.0, 0.0], atol=1e-9)
        else:
            np.testing.assert_array_equal(state, alone)
    assert helped > 0
