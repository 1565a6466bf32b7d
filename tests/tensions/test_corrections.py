"""Corrections wind up what is slack, by how much the equations say, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdpr_drake.tensions.slack_correction import (
    TensionFollower,
    adaptive_gains,
    length_correction,
    length_thresholds,
    tension_correction,
)

ROUNDING = 1e-12
"""Relative rounding of a few operations."""

tensions = arrays(float, 8, elements=st.floats(-50.0, 500.0))
lengths = arrays(float, 8, elements=st.floats(0.1, 20.0))


def test_the_numbers_of_5_1():
    found = tension_correction(
        np.array([0.0, 0.25, 1.0, 7.0]), np.array([1.0, 1.0, 1.0, 8.0]), np.full(4, 0.04)
    )
    np.testing.assert_allclose(found, [-0.04, -0.03, 0.0, -0.04], rtol=ROUNDING)


@given(tensions, tensions, arrays(float, 8, elements=st.floats(0.0, 1.0)))
def test_a_cable_above_its_threshold_is_left_alone_and_none_is_paid_out(now, thresholds, gains):
    found = tension_correction(now, thresholds, gains)
    assert np.all(found <= 0.0)
    assert np.all(found[now >= thresholds] == 0.0)
    below = now < thresholds
    np.testing.assert_allclose(found[below], -(gains * (thresholds - now))[below], rtol=ROUNDING)


def test_slack_of_any_length_goes_in_the_same_time_by_the_adaptive_gain():
    """dl/dt = -k l (tau_t - 0) while the cable is slack: an exponential, whatever l was."""
    threshold, gain, period = 1.0, 2.0, 1e-4
    left = []
    for surplus in (0.01, 0.08):
        length = surplus
        for _ in range(10_000):
            gains = adaptive_gains(np.array([length]), np.zeros(1), gain)
            length += period * tension_correction(np.zeros(1), np.array([threshold]), gains)[0]
        left.append(length / surplus)
    euler = (1.0 - gain * period) ** 10_000
    np.testing.assert_allclose(left, euler, rtol=1e-9)


@given(lengths, lengths)
def test_a_cable_shorter_than_expected_is_not_paid_out(now, expected):
    gains = adaptive_gains(now, expected, 3.0)
    assert np.all(gains >= 0.0)
    assert np.all(gains[now <= expected] == 0.0)


@given(tensions, lengths, lengths, st.floats(0.0, 0.1), st.floats(1.0, 20.0))
def test_the_two_least_tensions_are_corrected_and_never_beyond(
    now, length, expected, allowance, slowness
):
    period = 0.04
    found = length_correction(
        now, length, expected, allowance=allowance, slowness=slowness, period=period
    )
    assert np.all(found <= 0.0)
    assert np.count_nonzero(found) <= 2
    corrected = np.flatnonzero(found)
    assert np.all(now[corrected] <= np.sort(now)[1])
    after = length + found * period
    assert np.all(after[corrected] >= (expected + allowance)[corrected] - 1e-9)


def test_the_numbers_of_5_5():
    found = length_correction(
        np.array([5.0, 0.0, 0.1, 9.0]),
        np.array([2.0, 2.12, 2.005, 3.0]),
        np.array([1.0, 2.0, 2.0, 2.0]),
        allowance=0.01,
        slowness=2.0,
        period=0.04,
    )
    np.testing.assert_allclose(found, [0.0, -0.11 / 0.08, 0.0, 0.0], rtol=ROUNDING, atol=1e-15)


@pytest.mark.parametrize(("shape", "middle"), [("linear", 5.0), ("exponential", 3.0)])
def test_thresholds_between_two_lengths(shape, middle):
    found = length_thresholds(
        np.array([0.5, 1.0, 2.0, 3.0, 4.0]),
        1.0,
        3.0,
        lowest=np.full(5, 1.0),
        highest=np.full(5, 9.0),
        shape=shape,
    )
    np.testing.assert_allclose(found, [9.0, 9.0, middle, 1.0, 1.0], rtol=ROUNDING)


@given(lengths, st.sampled_from(["linear", "exponential"]))
def test_a_shorter_cable_has_no_smaller_threshold(now, shape):
    found = length_thresholds(
        now, 1.0, 12.0, lowest=np.full(8, 2.0), highest=np.full(8, 30.0), shape=shape
    )
    assert np.all(np.diff(found[np.argsort(now)]) <= ROUNDING * 30.0)
    assert np.all((found >= 2.0 - 1e-9) & (found <= 30.0 + 1e-9))


def test_other_shapes_are_refused():
    with pytest.raises(ValueError, match="found 'cubic'; accepted: linear, exponential"):
        length_thresholds(
            np.ones(1), 1.0, 2.0, lowest=np.ones(1), highest=np.ones(1), shape="cubic"
        )


def follow(follower, stiffness, wanted, steps=4000, period=0.002):
    """Tensions of springs that are wound by a follower: dt/ds = -stiffness."""
    now = np.zeros_like(wanted)
    before, integral = None, np.zeros_like(wanted)
    for _ in range(steps):
        missing = wanted - now
        velocity, integral = follower.step(missing, before, integral, period)
        before = missing
        now = now - stiffness * period * velocity
    return now


def test_each_kind_of_follower_reaches_wanted_tensions_of_springs():
    wanted = np.array([5.0, 40.0])
    for follower in (
        TensionFollower(0.01),
        TensionFollower(0.01, 0.02),
        TensionFollower(0.01, 0.02, 1e-5),
    ):
        np.testing.assert_allclose(follow(follower, 500.0, wanted), wanted, rtol=1e-3)


def test_an_integral_does_not_wind_up_at_the_limit():
    follower = TensionFollower(0.001, 1.0, fastest=0.01)
    integral = np.zeros(1)
    for _ in range(1000):
        velocity, integral = follower.step(np.array([20.0]), None, integral, 0.01)
        assert velocity[0] == -0.01
    assert integral[0] < 20.0 * 0.01 * 1.5  # of a thousand steps' 200 N s
    velocity, _ = follower.step(np.array([-20.0]), None, integral, 0.01)
    assert velocity[0] > 0.0
