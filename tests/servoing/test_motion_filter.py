"""Drift of features: the difference is exact, the Kalman filters are the textbook's."""

import numpy as np
import pytest

from cdpr_drake.servoing.target_motion import MotionFilter, feature_drift

ROUND_OFF = 1e-9
"""Of estimates of order one, from variances that begin at 1e6."""

PERIOD = 0.04


def textbook(kind, ratio, measured):
    """The same filter with matrices, for one feature."""
    q, T = ratio**2, PERIOD
    if kind == "constant_velocity":
        F, Q, H = np.eye(1), np.array([[q * T]]), np.eye(1)
    else:
        F = np.array([[1.0, T], [0.0, 1.0]])
        Q = q * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
        H = np.array([[1.0, 0.0]])
    x, P = np.zeros(len(F)), 1e6 * np.eye(len(F))
    estimates = []
    for z in measured:
        x, P = F @ x, F @ P @ F.T + Q
        K = P @ H.T / (H @ P @ H.T + 1.0)
        x = x + K[:, 0] * (z - (H @ x)[0])
        P = (np.eye(len(F)) - K @ H) @ P
        estimates.append(x[0])
    return np.array(estimates)


def estimates(kind, ratio, measured):
    one = MotionFilter(kind, ratio, PERIOD)
    state, found = MotionFilter.start(measured.shape[1]), []
    for z in measured:
        b, state = one.step(state, z)
        found.append(b)
    return np.array(found)


@pytest.mark.parametrize("kind", ["constant_velocity", "constant_acceleration"])
@pytest.mark.parametrize("ratio", [0.2, 2.0, 50.0])
def test_filters_are_the_textbook_s(kind, ratio):
    measured = np.random.default_rng(1).standard_normal((200, 3)) + np.linspace(0, 3, 200)[:, None]
    found = estimates(kind, ratio, measured)
    for k in range(3):
        np.testing.assert_allclose(found[:, k], textbook(kind, ratio, measured[:, k]), atol=1e-6)


def test_a_difference_is_taken_as_it_is():
    measured = np.random.default_rng(2).standard_normal((20, 4))
    np.testing.assert_array_equal(estimates("difference", 1.0, measured), measured)


def test_constant_velocity_is_found_and_an_accelerated_one_needs_the_other_model():
    steady = np.full((300, 1), 0.7)
    growing = 0.3 * PERIOD * np.arange(300)[:, np.newaxis]
    for kind in ("constant_velocity", "constant_acceleration"):
        assert estimates(kind, 2.0, steady)[-1] == pytest.approx(0.7, abs=1e-6)
    lag = growing[-1] - estimates("constant_velocity", 2.0, growing)[-1]
    assert lag > 0.01
    assert estimates("constant_acceleration", 2.0, growing)[-1] == pytest.approx(
        growing[-1], abs=1e-5
    )


def test_filters_smooth_what_the_difference_does_not():
    noise = np.random.default_rng(3).standard_normal((2000, 1))
    spread = {
        kind: np.std(estimates(kind, 2.0, noise)[200:])
        for kind in ("difference", "constant_velocity", "constant_acceleration")
    }
    assert spread["constant_velocity"] < 0.5 * spread["difference"]
    assert spread["constant_acceleration"] < 0.6 * spread["difference"]


def test_the_drift_is_what_the_camera_s_motion_does_not_explain():
    before, own, period = np.array([0.1, -0.2]), np.array([0.5, 0.25]), 0.04
    drift = np.array([0.3, -0.7])
    now = before + period * (own + drift)
    np.testing.assert_allclose(feature_drift(now, before, own, period), drift, atol=1e-12)
