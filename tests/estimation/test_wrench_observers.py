"""Observers of a wrench: exact for what they are exact for, as late and as noisy as they say."""

from functools import cache

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
BODY = packed_body(MASS, COM, INERTIA, GRAVITY)
WEIGHT = np.concatenate([np.cross(COM, MASS * GRAVITY), MASS * GRAVITY])

SECOND_ORDER = 2e-4  # of a wrench: the square of the period times that of the tumbling's rates
CONSTANT = np.array([0.2, -0.1, 0.15, 3.0, -2.0, 4.0])
RAMP = np.array([0.0, 0.0, 0.0, 5.0, 0.0, -3.0])
OUTER = {"constant": lambda t: CONSTANT, "ramp": lambda t: RAMP * t}


def cross_matrix(p):
    return np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])


def at_com(central, R):
    """A wrench about the centre of mass as one about Po."""
    return np.concatenate([central[:3] + np.cross(R @ COM, central[3:]), central[3:]])


def lifting(t):
    """Wrench of the cables about Po."""
    return np.array([0.3, 0.1 * np.sin(7.0 * t), -0.2, 2.0 * np.sin(5.0 * t), 1.0, 29.0])


@cache
def tumbling(outer):
    """Times and poses of a body under cables and a wrench about its centre of mass.

    By Euler's equations and a general integrator.
    """
    central = INERTIA - MASS * (COM @ COM * np.eye(3) - np.outer(COM, COM))

    def rates(t, state):
        R, w, v = state[:9].reshape(3, 3), state[9:12], state[15:18]
        F = lifting(t) + at_com(OUTER[outer](t), R)
        n = F[:3] - np.cross(R @ COM, F[3:])  # about C, in W
        I_W = R @ central @ R.T
        alpha = np.linalg.solve(I_W, n - np.cross(w, I_W @ w))
        return np.concatenate([(cross_matrix(w) @ R).ravel(), alpha, v, F[3:] / MASS + GRAVITY])

    first = np.concatenate([np.eye(3).ravel(), [0.4, -0.6, 0.9], COM, [0.1, 0.2, -0.1]])
    times = np.arange(0.0, 1.0, PERIOD)
    states = solve_ivp(rates, (0, 1.0), first, t_eval=times, rtol=1e-11, atol=1e-12).y.T
    turns = [RotationMatrix.ProjectToRotationMatrix(state[:9].reshape(3, 3)) for state in states]
    poses = [RigidTransform(R, s[12:15] - R @ COM) for R, s in zip(turns, states, strict=True)]
    return times, poses


def last_of(kind, outer):
    observer = WrenchObserver(kind, BODY, BANDWIDTH, PERIOD)
    for t, X_WP in zip(*tumbling(outer), strict=True):
        estimate = observer.update(X_WP, lifting(t))
    return estimate


@pytest.mark.parametrize("kind", [MOMENTUM, EXTENDED])
def test_a_constant_wrench_on_a_tumbling_body(kind):
    """Constant about the centre of mass, since about Po it would change as the body turns."""
    expected = at_com(CONSTANT, tumbling("constant")[1][-1].rotation().matrix())
    tolerance = SECOND_ORDER * np.abs(expected).max()
    np.testing.assert_allclose(last_of(kind, "constant"), expected, atol=tolerance)


def test_at_rest_the_static_one_is_exact_at_once_and_else_takes_acceleration_for_a_wrench():
    observer = WrenchObserver(STATIC, BODY, BANDWIDTH, PERIOD)
    at_rest = observer.update(RigidTransform(), -WEIGHT - CONSTANT)
    np.testing.assert_allclose(at_rest, CONSTANT, atol=1e-12)
    assert np.max(np.abs(last_of(STATIC, "constant") - CONSTANT)) > 1.0


@pytest.mark.parametrize("kind", [MOMENTUM, EXTENDED])
def test_a_ramp_is_shown_late_by_what_the_response_says(kind):
    late = tumbling("ramp")[0][-1] - last_of(kind, "ramp") @ RAMP / (RAMP @ RAMP)
    SHARE = 0.02  # of the delay: the estimate of a tumbling body, see above
    assert late == pytest.approx(observer_response(kind, BANDWIDTH, PERIOD).delay, rel=SHARE)


@pytest.mark.parametrize(("kind", "lags"), [(STATIC, 1.0), (MOMENTUM, 1.0), (EXTENDED, 3.0)])
def test_the_delay_in_time_constants_as_periods_get_short(kind, lags):
    """It falls to them with the period: as much too long or short at half of it by half."""
    wrong = [10.0 * observer_response(kind, 10.0, T).delay - lags for T in (2e-3, 1e-3)]
    assert 2.0 * wrong[1] - wrong[0] == pytest.approx(0.0, abs=2e-3 * lags)
    assert abs(wrong[1]) < 2e-2 * lags


def test_noise_by_closed_forms_of_the_momentum_observer():
    """Of a first-order filter, and of it after a second difference."""
    a = np.exp(-BANDWIDTH * PERIOD)
    response = observer_response(MOMENTUM, BANDWIDTH, PERIOD)
    assert response.tension_noise == pytest.approx((1.0 - a) / (1.0 + a), rel=1e-6)
    h = (1.0 - a) * a ** np.arange(2000)
    second = np.convolve(h, [1.0, -2.0, 1.0]) / PERIOD**2
    assert response.pose_noise == pytest.approx(second @ second, rel=1e-6)


@pytest.mark.parametrize("kind", list(OBSERVERS))
def test_the_covariance_is_that_of_noise_in_tensions_and_lengths(kind):
    """Answers to impulses of each, summed over the samples before; all is linear that small."""
    random, bandwidth, samples = np.random.default_rng(3), 60.0, 150
    J, tensions = random.normal(size=(8, 6)), random.uniform(2.0, 8.0, 8)
    error = WrenchError(noise=0.05, offset=0.02, friction=0.03, length=2e-6)
    mass = np.block([
        [INERTIA, MASS * cross_matrix(COM)], [-MASS * cross_matrix(COM), MASS * np.eye(3)]
    ])  # fmt: skip
    rests = RigidTransform()

    def answers(twist, wrench):
        """Estimates after an impulse in one sample, shape (samples, 6)."""
        observer = WrenchObserver(kind, BODY, bandwidth, PERIOD)
        for _ in range(4):
            observer.update(rests, -WEIGHT)
        hit = RigidTransform(rotation_from_vector(twist[:3]), twist[3:])
        first = observer.update(hit, -WEIGHT - wrench)
        return np.array([first, *(observer.update(rests, -WEIGHT) for _ in range(samples - 1))])

    summed = np.zeros((6, 6))
    constant = error.offset**2 + (error.friction * tensions) ** 2 / 3.0
    for of_length, of_tension, always in zip(np.linalg.pinv(J).T, J, constant, strict=True):
        moved = answers(error.length * of_length, np.zeros(6))
        pulled = answers(np.zeros(6), of_tension)
        summed += moved.T @ moved + error.noise**2 * pulled.T @ pulled
        steady = np.sum(pulled, axis=0)
        summed += always * np.outer(steady, steady)
    stated = error.covariance(J, tensions, mass, observer_response(kind, bandwidth, PERIOD))
    size = np.sqrt(np.diag(stated))
    np.testing.assert_allclose((summed - stated) / np.outer(size, size), 0.0, atol=1e-3)


def test_friction_of_pulleys_is_undone_and_points_against_the_motion():
    tensions, rates = np.array([5.0, 5.0, 5.0]), np.array([-0.1, 0.0, 0.1])
    measured = tension_before_pulley(tensions, rates, 0.04, 1e-3)
    assert measured[0] > measured[1] == tensions[1] > measured[2]
    np.testing.assert_allclose(tension_at_platform(measured, rates, 0.04, 1e-3), tensions)
