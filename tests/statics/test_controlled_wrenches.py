"""What few cables control, whatever the units, and what they balance up to rounding."""

import numpy as np
import pytest

from cdpr_drake.statics.controlled_wrenches import wrench_control

RANDOM = np.random.default_rng(4)
W = RANDOM.normal(size=(6, 3))
"""Three cables on six degrees of freedom."""

SCALE = np.ones(6)
ROUNDING = 1e-9
"""Of products of a few numbers of size 1, by an elimination of three columns."""


def control(matrix, wrench, scale=SCALE):
    m = matrix.shape[1]
    return wrench_control(matrix, wrench, np.zeros(m), np.full(m, 1e12), scale)


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
def test_the_rank_does_not_depend_on_the_unit(unit):
    """Of three cables, of which two pull in the same direction up to rounding."""
    doubled = unit * np.column_stack([W[:, 0], W[:, 1], W[:, 0] / 3.0 + W[:, 1] / 7.0])
    assert np.linalg.svd(doubled)[1][2] > 0.0  # rounded, or this looks at nothing
    assert control(unit * W, np.zeros(6)).rank == 3
    assert control(doubled, np.zeros(6)).rank == 2
    nearly = unit * np.column_stack([W[:, 0], W[:, 0] + 1e-8 * W[:, 1]])
    assert control(nearly, np.zeros(6)).rank == 2


def test_cables_without_any_effect_control_nothing():
    nothing = np.zeros((6, 3))
    found = control(nothing, np.zeros(6))
    assert found.rank == 0
    assert found.balances
    np.testing.assert_array_equal(np.abs(found.free).sum(axis=0), np.ones(6))
    assert not control(nothing, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e-6])).balances


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_a_wrench_of_any_size_is_balanced_up_to_rounding(size):
    tensions = size * np.array([1.0, 2.0, 3.0])
    wrench = -W @ tensions
    found = control(W, wrench)
    assert found.balances
    np.testing.assert_allclose(found.tensions, tensions, rtol=1e-6)
    twist = found.free[:, 0] / np.linalg.norm(found.free[:, 0])
    share = np.linalg.norm(wrench) * twist
    assert control(W, wrench + 1e-10 * share).balances
    pushed = control(W, wrench + 1e-6 * share)
    assert not pushed.balances
    assert pushed.tensions is None


def test_each_free_twist_stands_alone_in_a_row():
    """So that it is read without the others; and none of them changes a length."""
    free = control(W, np.zeros(6)).free
    assert free.shape == (6, 3)
    np.testing.assert_allclose(W.T @ free, 0.0, atol=ROUNDING)
    for k in range(3):
        others = np.delete(free, k, axis=1)
        alone = (free[:, k] != 0.0) & np.all(others == 0.0, axis=1)
        assert np.any(alone)
