"""Eigenvalues in closed form, and the step limit tried by stepping oscillators."""

import numpy as np
import pytest
import scipy.linalg

from cdpr_drake.numerics.explicit_integration import (
    explicit_integrators,
    largest_stable_step,
    vibration_eigenvalues,
)

RELATIVE = 1e-9  # roots of a quadratic and a symmetric eigenproblem
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
integrators = pytest.mark.parametrize("integrator", METHODS)


def final_size(M, K, retardation, integrator, h):
    """Largest entry of the state after many steps from a push."""
    n, to_acceleration = len(M), np.linalg.inv(M)
    rows = [-to_acceleration @ K, -retardation * to_acceleration @ K]
    # Rates scaled by the highest frequency, so that one bound fits positions and velocities.
    scale = np.sqrt(np.max(scipy.linalg.eigh(K, M, eigvals_only=True)))
    S = np.diag([1.0] * n + [1.0 / scale] * n)
    A = S @ np.block([[np.zeros((n, n)), np.eye(n)], rows]) @ np.linalg.inv(S)
    step = METHODS[integrator](lambda x: A @ x, np.eye(2 * n), h)
    with np.errstate(over="ignore", invalid="ignore"):
        state = np.linalg.matrix_power(step, STEPS) @ np.repeat([0.0, 1.0], n)
    return np.max(np.abs(np.nan_to_num(state, nan=np.inf)))


def test_integrators_are_named_as_drake_spells_them():
    assert explicit_integrators() == ("runge_kutta2", "runge_kutta3")


@pytest.mark.parametrize("retardation", [0.0, 1e-4, 2e-3, 1e-2])
@pytest.mark.parametrize("k", [1.0, 3e3, 1e6])
@pytest.mark.parametrize("m", [0.1, 10.0])
def test_eigenvalues_of_one_oscillator_in_closed_form(m, k, retardation):
    values = vibration_eigenvalues(np.array([[m]]), np.array([[k]]), retardation)
    square = k / m
    root = np.sqrt(complex((retardation * square) ** 2 - 4.0 * square))
    assert np.sum(values) == pytest.approx(-retardation * square, rel=RELATIVE)
    assert np.prod(values) == pytest.approx(square, rel=RELATIVE)
    # Near critical damping the two roots fall together and are known to half the digits only.
    for sign in (1.0, -1.0):
        expected = (-retardation * square + sign * root) / 2.0
        assert np.min(np.abs(values - expected)) <= np.sqrt(RELATIVE * square)


def test_eigenvalues_are_those_of_the_first_order_system():
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    K = np.array([[500.0, -200.0], [-200.0, 300.0]])
    a, values = np.linalg.solve(M, K), vibration_eigenvalues(M, K, 0.01)
    assert values.shape == (4,)
    for value in np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-a, -0.01 * a]])):
        assert np.min(np.abs(values - value)) <= RELATIVE * np.abs(value)


SYSTEMS = {
    # Damped little, as cables are; about critically; and so much that the real axis counts.
    **{
        f"damping {share}": ([[2.0]], [[2.0 * 300.0**2]], 2.0 * share / 300.0)
        for share in (0.02, 0.1, 0.7, 2.0)
    },
    "coupled": ([[2.0, 0.3], [0.3, 1.0]], [[5e4, -2e4], [-2e4, 3e4]], 1e-3),
}


@pytest.mark.parametrize("system", SYSTEMS)
@integrators
def test_oscillators_stay_bounded_below_and_grow_above(integrator, system):
    M, K, retardation = (np.array(part) for part in SYSTEMS[system])
    h = largest_stable_step(vibration_eigenvalues(M, K, float(retardation)), integrator)
    assert final_size(M, K, retardation, integrator, h) < BOUND
    assert final_size(M, K, retardation, integrator, BEYOND * h) > BOUND


@pytest.mark.parametrize(
    ("integrator", "limit"), [("runge_kutta2", 2.0), ("runge_kutta3", 2.5127453266)]
)
def test_the_limit_on_the_real_axis_is_the_textbook_one(integrator, limit):
    """Stability intervals of Runge-Kutta methods of order 2 and 3, Hairer and Wanner IV.2."""
    h = largest_stable_step(np.array([-50.0 + 0.0j]), integrator)
    assert limit / BEYOND < h * 50.0 <= limit


def test_the_limits_on_the_imaginary_axis():
    """The square root of three for the third order; the second order has a step, too."""
    undamped = np.array([100.0j, -100.0j])
    h = largest_stable_step(undamped, "runge_kutta3")
    assert np.sqrt(3.0) / BEYOND < 100.0 * h < np.sqrt(3.0) * BEYOND
    assert largest_stable_step(undamped, "runge_kutta2") > 0.0


@integrators
def test_the_step_scales_with_time(integrator):
    eigenvalues = np.array([-1.0 + 3.0j, -1.0 - 3.0j, -8.0 + 0.0j])
    h = largest_stable_step(eigenvalues, integrator)
    assert largest_stable_step(10.0 * eigenvalues, integrator) == pytest.approx(h / 10.0)
