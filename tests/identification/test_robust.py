"""The cost of residuals that may be outliers: squares, then linear, and weights that lead down."""

import numpy as np
import pytest

from cdpr_drake.identification.robust_cost import HUBER, huber_cost, huber_limit, huber_weights

STEP = 1e-6
DIFFERENCE = 1e-8
"""Of a central difference of a cost of up to 100 by a step of 1e-6."""


def test_the_cost_is_square_up_to_the_limit_and_linear_beyond():
    np.testing.assert_allclose(huber_cost(np.array([-3.0, 2.0]), 4.0), 13.0)
    at = [huber_cost(np.array([x]), 4.0) for x in (4.0, 5.0, -6.0, 104.0)]
    np.testing.assert_allclose(at, [16.0, 24.0, 32.0, 816.0])


@pytest.mark.parametrize("x", [-20.0, -4.5, -3.9, 0.5, 3.9, 4.1, 12.0])
def test_weights_are_those_of_its_slope(x):
    """The cost's derivative is that of weighted squares, 2 w x."""
    ahead, behind = (huber_cost(np.array([x + s]), 4.0) for s in (STEP, -STEP))
    slope = (ahead - behind) / (2.0 * STEP)
    assert 2.0 * huber_weights(np.array([x]), 4.0)[0] * x == pytest.approx(slope, rel=DIFFERENCE)


def test_what_fits_exactly_counts_in_full():
    np.testing.assert_array_equal(huber_weights(np.array([0.0, -4.0]), 4.0), [1.0, 1.0])


def test_the_limit_is_four_of_the_spread_that_is_there():
    residuals = np.random.default_rng(2).normal(size=100_000)
    for spread in (2.0, 5.0):
        wild = np.append(spread * residuals, np.full(1000, 1e6))  # a hundredth is off
        assert huber_limit(wild) == pytest.approx(HUBER * spread, rel=0.03)
    rest = np.array([-30.0, -3.0, 0.0, 2.0, 9.0])
    assert huber_limit(rest) == pytest.approx(4.0 * 1.4826 * 3.0)  # by the median of what is off
    # Sigmas that were given too large, or nothing to judge them by, make none smaller.
    assert huber_limit(0.1 * residuals) == HUBER == huber_limit(np.zeros(0)) == 4.0
