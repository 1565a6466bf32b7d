"""The adaptive gain's published properties, least squares against NumPy, saturation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.numerics.linear_algebra_kernel import least_squares
from cdpr_drake.servoing.servo_law import AdaptiveGain, saturation_share

STEP = 1e-6  # forward difference at 0, where the norm has no derivative on the other side
SLOPE_TOLERANCE = 1e-4  # relative; the step times the curvature, which is slope / span
FAR = 1e6  # an error so large that only lambda(infinity) is left
ROUNDING = 1e-12  # a pseudo-inverse of a well conditioned 6 x 6 matrix
PSEUDO_INVERSE = 1e-6  # two factorizations; random matrices, rarely worse than 1e5 conditioned

gains = st.builds(
    lambda low, span, slope: AdaptiveGain(low + span, low, slope),
    st.floats(0.05, 2.0),
    st.floats(0.1, 5.0),
    st.floats(0.1, 30.0),
)


@given(gains)
def test_the_gain_has_its_limits(gain):
    assert gain(np.zeros(6)) == pytest.approx(gain.at_zero, rel=ROUNDING)
    assert gain(np.full(6, FAR)) == pytest.approx(gain.at_infinity, rel=ROUNDING)


@given(gains)
def test_the_gain_falls_at_zero_with_its_slope(gain):
    slope = (gain(np.array([STEP])) - gain(np.zeros(1))) / STEP
    assert slope == pytest.approx(-gain.slope, rel=SLOPE_TOLERANCE * max(1.0, gain.slope))


@given(gains, st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_the_gain_never_rises_with_the_error(gain, a, b):
    near, far = sorted([a, b])
    assert gain(np.array([near])) >= gain(np.array([far]))
    assert gain.at_infinity <= gain(np.array([far])) <= gain.at_zero * (1.0 + ROUNDING)


def test_the_gain_counts_the_norm_of_all_components():
    gain = AdaptiveGain(4.0, 0.4, 30.0)
    assert gain(np.array([0.3, 0.4])) == pytest.approx(gain(np.array([-0.5])), rel=ROUNDING)


@given(st.floats(0.01, 10.0), st.floats(0.0, 100.0), st.floats(0.0, 10.0))
def test_equal_limits_make_a_constant_gain(constant, slope, x):
    assert AdaptiveGain(constant, constant, slope)(np.array([x])) == constant


@given(st.integers(0, 2**32 - 1), st.integers(3, 10))
def test_least_squares_are_the_pseudo_inverse_s(seed, features):
    random = np.random.default_rng(seed)
    matrix, rate = random.standard_normal((features, 6)), random.standard_normal(features)
    v, free = least_squares(matrix, rate, 6)
    inverse = np.linalg.pinv(matrix)
    np.testing.assert_allclose(v, inverse @ rate, rtol=0.0, atol=PSEUDO_INVERSE * np.abs(v).max())
    np.testing.assert_allclose(free, np.eye(6) - inverse @ matrix, atol=PSEUDO_INVERSE)


@pytest.mark.parametrize("features", [6, 8])
@pytest.mark.parametrize("power", [2.0, 7.0, 8.5, 8.9, 9.1, 11.0])
def test_what_counts_is_decided_by_singular_values(features, power):
    random = np.random.default_rng(int(10.0 * power))
    U = np.linalg.qr(random.normal(size=(features, 6)))[0]
    V = np.linalg.qr(random.normal(size=(6, 6)))[0]
    S = 10.0 ** -np.linspace(0.0, power, 6)
    matrix, rate = np.ascontiguousarray(U * S @ V.T), random.normal(size=features)
    counts = S > 1e-9
    v, free = least_squares(matrix, rate, 6)
    expected = V[:, counts] @ (U[:, counts].T @ rate / S[counts])
    # Rounding of the matrix alone moves what is sought by the condition number times itself.
    rounding = 1e-14 * S[0] / S[counts][-1]
    assert np.linalg.norm(v - expected) <= 10.0 * rounding * np.linalg.norm(expected)
    np.testing.assert_allclose(free, V[:, ~counts] @ V[:, ~counts].T, atol=1e-14 + rounding)


def test_singular_values_beyond_the_rank_count_as_zero():
    """Where features hardly show a motion, the error in it does not move anything."""
    matrix = np.diag([3.0, 2.0, 1.0, 1e-7])
    v, free = least_squares(matrix, np.array([3.0, 2.0, 1.0, 1.0]), 3)
    np.testing.assert_allclose(v, [1.0, 1.0, 1.0, 0.0], atol=ROUNDING)
    np.testing.assert_allclose(free, np.diag([0.0, 0.0, 0.0, 1.0]), atol=ROUNDING)


def test_singular_values_of_round_off_count_as_zero():
    matrix = np.diag([1.0, 1e-12])
    v, free = least_squares(matrix, np.array([1.0, 1.0]), 2)
    np.testing.assert_allclose(v, [1.0, 0.0], atol=ROUNDING)
    np.testing.assert_allclose(free, np.diag([0.0, 1.0]), atol=ROUNDING)


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=8).map(np.array), st.floats(0.1, 5.0))
def test_a_saturated_motion_keeps_its_direction_within_the_limit(rates, limit):
    share = saturation_share(rates, limit)
    assert 0.0 < share <= 1.0
    assert np.max(np.abs(share * rates)) <= limit * (1.0 + ROUNDING)
    if share < 1.0:  # then no more is taken than needed
        assert np.max(np.abs(share * rates)) == pytest.approx(limit, rel=ROUNDING)
    else:
        assert np.max(np.abs(rates)) <= limit


def test_rates_at_the_limit_are_left_alone():
    assert saturation_share(np.array([0.5, -0.5]), 0.5) == 1.0
    assert saturation_share(np.zeros(8), 0.5) == 1.0
