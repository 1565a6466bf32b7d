"""The largest step with which an explicit Runge-Kutta method follows a stiff cable robot."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from cdpr_drake.arrays import Array

_POLYNOMIALS = {
    "runge_kutta2": (1.0, 1.0, 1 / 2),
    "runge_kutta3": (1.0, 1.0, 1 / 2, 1 / 6),
}
"""Stability polynomials R(z), lowest power first, of Drake's explicit integrators."""

LEAST_SQUARED_FREQUENCY = 1e-9
"""A squared frequency below this, relative to the largest, is a direction that no cable holds."""


def explicit_integrators() -> tuple[str, ...]:
    """Names of the integrators that `largest_stable_step` knows, as Drake spells them."""
    return tuple(_POLYNOMIALS)


def vibration_eigenvalues(M: Array, K: Array, retardation: float) -> Array:
    """Eigenvalues of M x'' + T K x' + K x = 0, shape (2 n,), complex [rad/s].

    Args:
        M: Mass matrix, shape (n, n).
        K: Stiffness matrix, shape (n, n).
        retardation: Retardation time T of the cables [s].
    """
    squares = scipy.linalg.eigh(K, M, eigvals_only=True)
    squares[squares < LEAST_SQUARED_FREQUENCY * np.max(squares)] = 0.0
    roots = [np.roots([1.0, retardation * s, s]) for s in squares]
    return np.asarray(np.concatenate(roots))


def largest_stable_step(eigenvalues: Array, integrator: str) -> float:
    """Largest h [s] with |R(h lambda)| <= 1 for all eigenvalues in the left half plane.

    Args:
        eigenvalues: Complex eigenvalues [rad/s]; purely oscillatory ones count as slightly damped,
            since the second order method has no stable step for them.
        integrator: One of `explicit_integrators()`.

    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.2.
    """
    coefficients = np.array(_POLYNOMIALS[integrator])[::-1]
    damped = eigenvalues - 0.01 * np.abs(eigenvalues) * (
        np.real(eigenvalues) > -1e-9 * np.abs(eigenvalues)
    )

    def stable(h: float) -> bool:
        return bool(np.all(np.abs(np.polyval(coefficients, h * damped)) <= 1.0))

    fastest = float(np.max(np.abs(damped)))
    steps = np.linspace(0.02, 4.0, 400) / fastest
    unstable = [h for h in steps if not stable(float(h))]
    return float(unstable[0] - (steps[1] - steps[0])) if unstable else float(steps[-1])


def largest_discrete_step(M: Array, K: Array, D: Array) -> float:
    """Largest stable time step of a discrete plant with explicit springs and dampers [s].

    The plant steps by symplectic Euler, v+ = v - h M^-1 (D v + K x), x+ = x + h v+, as Drake's
    discrete MultibodyPlant does with forces on its input ports. A vibration becomes unstable where
    its multiplier is -1, that is at h = 2 / s with the largest real root s of

        det(s^2 M - s D - K) = 0;

    a single mass with D = T K has h = -T + sqrt(T^2 + 4 m / k). Directions in which the system
    itself moves away from its rest do not count.

    Args:
        M: Mass matrix, shape (n, n), positive definite.
        K: Stiffness matrix, shape (n, n).
        D: Damping matrix, shape (n, n).

    Returns:
        The step; infinite where nothing is stiff or damped.
    """
    n = len(M)
    inverse = scipy.linalg.inv(M)
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [inverse @ K, inverse @ D]])
    roots = scipy.linalg.eigvals(companion)
    scale = float(np.max(np.abs(roots), initial=0.0))
    real = roots.real[np.abs(roots.imag) <= 1e-6 * scale]
    largest = float(np.max(real, initial=0.0))
    return 2.0 / largest if largest > 0.0 else np.inf
