"""Eigenvalues in closed form, and the step limit tried by stepping oscillators."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.numerics.explicit_integration import (
    explicit_integrators,
    largest_stable_step,
    vibration_eigenvalues,
)

EIGENVALUE_TOLERANCE = 1e-9  # relative; roots of a quadratic and a symmetric eigenproblem
BOUND = 10.0  # a stable method may grow for a while where the modes are not orthogonal
STEPS = 20_000  # enough that 5 per cent too large a step grows far beyond the bound
BEYOND = 1.05  # the limit is found on a grid of 0.4 to 2 per cent of the step


def midpoint(f, x, h):
    return x + h * f(x + h / 2.0 * f(x))


def kutta_third_order(f, x, h):
    k1 = f(x)
    k2 = f(x + h / 2.0 * k1)
    k3 = f(x + h * (2.0 * k2 - k1))
    return x + h * (k1 + 4.0 * k2 + k3) / 6.0


METHODS = {"runge_kutta2": midpoint, "runge_kutta3": kutta_third_order}


def final_size(M, K, retardation, step, h):
    """Largest entry of the state after many steps from a push, infinite where it grew too far."""
    n = len(M)
    to_acceleration = np.linalg.inv(M)
    A = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-to_acceleration @ K, -retardation * to_acceleration @ K]]
    )
    # Rates scaled by the highest frequency, so that one bound fits positions and velocities.
    scale = np.sqrt(np.max(scipy.linalg.eigh(K, M, eigvals_only=True)))
    S = np.diag([1.0] * n + [1.0 / scale] * n)
    A = S @ A @ np.linalg.inv(S)
    x = np.concatenate([np.zeros(n), np.ones(n)])
    for _ in range(STEPS):
        x = step(lambda x: A @ x, x, h)
        if np.max(np.abs(x)) > 1e3 * BOUND:
            return np.inf
    return np.max(np.abs(x))


def test_integrators_are_named_as_drake_spells_them():
    assert explicit_integrators() == ("runge_kutta2", "runge_kutta3")


@given(st.floats(0.1, 10.0), st.floats(1.0, 1e6), st.floats(0.0, 1e-2))
def test_eigenvalues_of_one_oscillator_in_closed_form(m, k, retardation):
    found = vibration_eigenvalues(np.array([[m]]), np.array([[k]]), retardation)
    square = k / m
    root = np.sqrt(complex((retardation * square) ** 2 - 4.0 * square))
    expected = [(-retardation * square + sign * root) / 2.0 for sign in (1.0, -1.0)]
    assert np.sum(found) == pytest.approx(-retardation * square, rel=EIGENVALUE_TOLERANCE)
    assert np.prod(found) == pytest.approx(square, rel=EIGENVALUE_TOLERANCE)
    # Near critical damping the two roots fall together and are known to half the digits only.
    tolerance = np.sqrt(EIGENVALUE_TOLERANCE) * np.sqrt(square)
    for value in expected:
        assert np.min(np.abs(found - value)) <= tolerance


def test_eigenvalues_are_those_of_the_first_order_system():
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    K = np.array([[500.0, -200.0], [-200.0, 300.0]])
    found = vibration_eigenvalues(M, K, 0.01)
    a = np.linalg.solve(M, K)
    expected = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-a, -0.01 * a]]))
    assert found.shape == (4,)
    for value in expected:
        assert np.min(np.abs(found - value)) <= EIGENVALUE_TOLERANCE * np.abs(value)


# Damped little, as cables are; about critically; and so much that the real axis counts.
@pytest.mark.parametrize("damping", [0.02, 0.1, 0.7, 2.0])
@pytest.mark.parametrize("integrator", explicit_integrators())
def test_one_oscillator_stays_bounded_below_and_grows_above(integrator, damping):
    frequency = 300.0  # [rad/s]
    M, K = np.array([[2.0]]), np.array([[2.0 * frequency**2]])
    retardation = 2.0 * damping / frequency
    h = largest_stable_step(vibration_eigenvalues(M, K, retardation), integrator)
    assert final_size(M, K, retardation, METHODS[integrator], h) < BOUND
    assert final_size(M, K, retardation, METHODS[integrator], BEYOND * h) > BOUND


@pytest.mark.parametrize("integrator", explicit_integrators())
def test_coupled_oscillators_stay_bounded_below_and_grow_above(integrator):
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    K = 1e4 * np.array([[5.0, -2.0], [-2.0, 3.0]])
    retardation = 1e-3
    h = largest_stable_step(vibration_eigenvalues(M, K, retardation), integrator)
    assert final_size(M, K, retardation, METHODS[integrator], h) < BOUND
    assert final_size(M, K, retardation, METHODS[integrator], BEYOND * h) > BOUND


@pytest.mark.parametrize(
    ("integrator", "limit"), [("runge_kutta2", 2.0), ("runge_kutta3", 2.5127453266)]
)
def test_the_limit_on_the_real_axis_is_the_textbook_one(integrator, limit):
    """Stability intervals of Runge-Kutta methods of order 2 and 3, Hairer and Wanner IV.2."""
    rate = 50.0
    h = largest_stable_step(np.array([-rate + 0.0j]), integrator)
    assert limit / BEYOND < h * rate <= limit


def test_the_third_order_limit_on_the_imaginary_axis_is_the_square_root_of_three():
    h = largest_stable_step(np.array([100.0j, -100.0j]), "runge_kutta3")
    assert np.sqrt(3.0) / BEYOND < 100.0 * h < np.sqrt(3.0) * BEYOND


def test_undamped_oscillators_have_a_step_with_the_second_order_method():
    assert largest_stable_step(np.array([100.0j, -100.0j]), "runge_kutta2") > 0.0


@pytest.mark.parametrize("integrator", explicit_integrators())
def test_the_step_scales_with_time(integrator):
    eigenvalues = np.array([-1.0 + 3.0j, -1.0 - 3.0j, -8.0 + 0.0j])
    h = largest_stable_step(eigenvalues, integrator)
    assert largest_stable_step(10.0 * eigenvalues, integrator) == pytest.approx(h / 10.0)
