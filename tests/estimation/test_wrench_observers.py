"""Observers of a wrench: exact for what they are exact for, as late and as noisy as they say."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.integrate import solve_ivp

from cdpr_drake.estimation.wrench_observers import (
    EXTENDED,
    MOMENTUM,
    OBSERVERS,
    STATIC,
    WrenchError,
    WrenchObserver,
    observer_response,
    packed_body,
    tension_at_platform,
    tension_before_pulley,
)
from cdpr_drake.geometry.poses import rotation_from_vector

PERIOD, BANDWIDTH = 0.002, 40.0
MASS, COM = 3.0, np.array([0.02, -0.05, 0.1])
INERTIA = np.array([[0.08, 0.002, -0.003], [0.002, 0.07, 0.001], [-0.003, 0.001, 0.05]])
GRAVITY = np.array([0.0, 0.0, -9.81])


def body():
    return packed_body(MASS, COM, INERTIA, GRAVITY)


def at_com(central, R):
    """A wrench about the centre of mass as one about Po."""
    return np.concatenate([central[:3] + np.cross(R @ COM, central[3:]), central[3:]])


def tumbling(cables, outer, duration=1.0):
    """Poses of a body under wrenches by cables about Po and others about its centre of mass.

    By Euler's equations and a general integrator.
    """
    central = INERTIA - MASS * (COM @ COM * np.eye(3) - np.outer(COM, COM))

    def rates(t, state):
        R, w, v = state[:9].reshape(3, 3), state[9:12], state[15:18]
        F = cables(t) + at_com(outer(t), R)
        c = R @ COM
        n = F[:3] - np.cross(c, F[3:])  # about C, in W
        I_W = R @ central @ R.T
        alpha = np.linalg.solve(I_W, n - np.cross(w, I_W @ w))
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([(skew @ R).ravel(), alpha, v, F[3:] / MASS + GRAVITY])

    first = np.concatenate([np.eye(3).ravel(), [0.4, -0.6, 0.9], COM, [0.1, 0.2, -0.1]])
    times = np.arange(0.0, duration, PERIOD)
    found = solve_ivp(rates, (0, duration), first, t_eval=times, rtol=1e-11, atol=1e-12)
    poses = []
    for state in found.y.T:
        R = state[:9].reshape(3, 3)
        poses.append((R, state[12:15] - R @ COM))
    return times, poses


def follow(kind, times, poses, cables, bandwidth=BANDWIDTH):
    observer = WrenchObserver(kind, body(), bandwidth, PERIOD)
    return np.array([
        observer.update(RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p), cables(t))
        for t, (R, p) in zip(times, poses, strict=True)
    ])  # fmt: skip


def lifting(t):
    return np.array([0.3, 0.1 * np.sin(7.0 * t), -0.2, 2.0 * np.sin(5.0 * t), 1.0, 29.0])


SECOND_ORDER = 2e-4
"""Of a wrench: the square of the period, 4e-6 s^2, times that of the tumbling's rates."""

CONSTANT = np.array([0.2, -0.1, 0.15, 3.0, -2.0, 4.0])


@pytest.mark.parametrize("kind", [MOMENTUM, EXTENDED])
def test_a_constant_wrench_on_a_tumbling_body(kind):
    """Constant about the centre of mass, since about Po it would change as the body turns."""
    times, poses = tumbling(lifting, lambda _: CONSTANT)
    found = follow(kind, times, poses, lifting)
    expected = at_com(CONSTANT, poses[-1][0])
    np.testing.assert_allclose(found[-1], expected, atol=SECOND_ORDER * np.abs(expected).max())


def test_at_rest_the_static_one_is_exact_at_once_and_else_takes_acceleration_for_a_wrench():
    weight = np.concatenate([np.cross(COM, MASS * GRAVITY), MASS * GRAVITY])
    observer = WrenchObserver(STATIC, body(), BANDWIDTH, PERIOD)
    found = observer.update(RigidTransform(), -weight - CONSTANT)
    np.testing.assert_allclose(found, CONSTANT, atol=1e-12)
    times, poses = tumbling(lifting, lambda _: CONSTANT)
    moving = follow(STATIC, times, poses, lifting)
    assert np.max(np.abs(moving[-1] - CONSTANT)) > 1.0


@pytest.mark.parametrize("kind", [MOMENTUM, EXTENDED])
def test_a_ramp_is_shown_late_by_what_the_response_says(kind):
    rate = np.array([0.0, 0.0, 0.0, 5.0, 0.0, -3.0])
    times, poses = tumbling(lifting, lambda t: rate * t)
    found = follow(kind, times, poses, lifting)
    delay = observer_response(kind, BANDWIDTH, PERIOD).delay
    late = times[-1] - found[-1] @ rate / (rate @ rate)
    SHARE = 0.02  # of the delay: the estimate of a tumbling body, see above
    assert late == pytest.approx(delay, rel=SHARE)


@pytest.mark.parametrize(("kind", "lags"), [(STATIC, 1.0), (MOMENTUM, 1.0), (EXTENDED, 3.0)])
def test_the_delay_in_time_constants_as_periods_get_short(kind, lags):
    assert observer_response(kind, 10.0, 1e-4).delay == pytest.approx(lags / 10.0, rel=2e-3)


def test_noise_by_closed_forms_of_the_momentum_observer():
    """Of a first-order filter, and of it after a second difference."""
    a = np.exp(-BANDWIDTH * PERIOD)
    found = observer_response(MOMENTUM, BANDWIDTH, PERIOD)
    assert found.tension_noise == pytest.approx((1.0 - a) / (1.0 + a), rel=1e-6)
    j = np.arange(2000)
    h = (1.0 - a) * a**j
    second = np.convolve(h, [1.0, -2.0, 1.0]) / PERIOD**2
    assert found.pose_noise == pytest.approx(second @ second, rel=1e-6)


@pytest.mark.parametrize("kind", list(OBSERVERS))
def test_the_covariance_is_that_of_drawn_noise(kind):
    random, bandwidth = np.random.default_rng(3), 60.0
    J = random.normal(size=(8, 6))
    tensions = random.uniform(2.0, 8.0, 8)
    error = WrenchError(noise=0.05, offset=0.02, length=2e-6)
    cross = np.array([[0, -COM[2], COM[1]], [COM[2], 0, -COM[0]], [-COM[1], COM[0], 0]])
    mass = np.block([[INERTIA, MASS * cross], [-MASS * cross, MASS * np.eye(3)]])
    stated = error.covariance(J, tensions, mass, observer_response(kind, bandwidth, PERIOD))
    weight = np.concatenate([np.cross(COM, MASS * GRAVITY), MASS * GRAVITY])
    solve = np.linalg.pinv(J)
    ends = []
    for _ in range(400):
        observer = WrenchObserver(kind, body(), bandwidth, PERIOD)
        offset = error.offset * random.normal(size=8)
        for _ in range(120):
            step = solve @ (error.length * random.normal(size=8))
            X = RigidTransform(rotation_from_vector(step[:3]), step[3:])
            wrong = offset + error.noise * random.normal(size=8)
            found = observer.update(X, -weight - J.T @ wrong)
        ends.append(found)
    ends = np.array(ends)
    # Squares by the stated covariance are chi-square of 6: mean 6, variance 12.
    squares = np.einsum("ki,ij,kj->k", ends, np.linalg.inv(stated), ends)
    SIGMA = np.sqrt(2.0 * 6.0 / len(ends))
    assert abs(np.mean(squares) - 6.0) < 4.0 * SIGMA
    bias = np.mean(ends, axis=0) / np.sqrt(np.diag(stated) / len(ends))
    assert np.all(np.abs(bias) < 4.0)


def test_friction_of_pulleys_is_undone_and_points_against_the_motion():
    tensions, rates = np.array([5.0, 5.0, 5.0]), np.array([-0.1, 0.0, 0.1])
    measured = tension_before_pulley(tensions, rates, 0.04, 1e-3)
    assert measured[0] > measured[1] == tensions[1] > measured[2]
    np.testing.assert_allclose(tension_at_platform(measured, rates, 0.04, 1e-3), tensions)
