"""The adaptive gain's published properties, and the decay that the control law promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.servo_law import AdaptiveGain, saturation_share, servo_velocity

STEP = 1e-6  # forward difference at 0, where the norm has no derivative on the other side
SLOPE_TOLERANCE = 1e-4  # relative; the step times the curvature, which is slope / span
FAR = 1e6  # an error so large that only lambda(infinity) is left
ROUNDING = 1e-12  # a pseudo-inverse of a well conditioned 6 x 6 matrix
DECAY_TOLERANCE = 1e-6  # fourth order Runge-Kutta at 0.01 of the time constant

gains = st.builds(
    lambda low, span, slope: AdaptiveGain(low + span, low, slope),
    st.floats(0.05, 2.0),
    st.floats(0.1, 5.0),
    st.floats(0.1, 30.0),
)
L = np.eye(6) + 0.1 * np.arange(36.0).reshape(6, 6) / 36.0
ERROR = np.array([0.3, -0.2, 0.1, 0.05, -0.04, 0.2])


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


@given(st.floats(0.1, 5.0), st.floats(0.1, 10.0))
def test_a_continuous_start_begins_at_rest(gain, sigma):
    start = np.linalg.pinv(L) @ ERROR
    v = servo_velocity(L, ERROR, gain, start, sigma, 0.0)
    np.testing.assert_allclose(v, np.zeros(6), atol=ROUNDING)


def test_the_start_is_forgotten_at_rate_sigma():
    start = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    abrupt = servo_velocity(L, ERROR, 2.0, np.zeros(6), 4.0, 0.5)
    continuous = servo_velocity(L, ERROR, 2.0, start, 4.0, 0.5)
    difference = continuous - abrupt
    np.testing.assert_allclose(difference, 2.0 * start * np.exp(-2.0), atol=ROUNDING)


@given(st.floats(0.1, 5.0), st.floats(0.0, 10.0))
def test_an_abrupt_start_makes_the_error_fall_exponentially(gain, time):
    """de/dt = L v = -lambda e."""
    v = servo_velocity(L, ERROR, gain, np.zeros(6), 4.0, time)
    np.testing.assert_allclose(L @ v, -gain * ERROR, atol=gain * ROUNDING)


def test_the_error_follows_the_closed_form_of_a_continuous_start():
    """de/dt = -lambda (e - e_0 exp(-sigma t)) has a solution in closed form; integrate by hand."""
    gain, sigma, h, steps = 1.5, 4.0, 0.01, 300
    start = np.linalg.pinv(L) @ ERROR

    def rate(t, e):
        return L @ servo_velocity(L, e, gain, start, sigma, t)

    e = ERROR
    for k in range(steps):
        t = k * h
        k1 = rate(t, e)
        k2 = rate(t + h / 2.0, e + h / 2.0 * k1)
        k3 = rate(t + h / 2.0, e + h / 2.0 * k2)
        k4 = rate(t + h, e + h * k3)
        e = e + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    t = steps * h
    share = gain / (gain - sigma)
    expected = ERROR * ((1.0 - share) * np.exp(-gain * t) + share * np.exp(-sigma * t))
    np.testing.assert_allclose(e, expected, rtol=0.0, atol=DECAY_TOLERANCE)


def test_more_features_than_velocities_give_the_least_squares_velocity():
    tall = np.vstack([np.eye(2), [[1.0, 1.0]]])
    error = np.array([0.1, 0.2, 0.5])
    v = servo_velocity(tall, error, 1.0, np.zeros(2), 4.0, 0.0)
    expected = -np.linalg.lstsq(tall, error, rcond=None)[0]
    np.testing.assert_allclose(v, expected, atol=ROUNDING)


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
