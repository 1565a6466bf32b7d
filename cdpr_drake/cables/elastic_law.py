"""The elastic cable law in its static form: unstrained lengths, elastic energy, stiffness."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def axial_stiffness(youngs_modulus: float, diameter: float) -> float:
    """E S of a round cable [N] from Young's modulus E [Pa] and diameter [m]."""
    return float(youngs_modulus * np.pi * diameter**2 / 4.0)


def unstrained_lengths(lengths: Array, tensions: Array, stiffness: Array) -> Array:
    """Unstrained lengths l0 = l / (1 + t / E S) of taut cables, shape (m,) [m].

    Args:
        lengths: Lengths under tension, shape (m,) [m].
        tensions: Tensions, shape (m,), not negative [N].
        stiffness: E S, shape (m,) [N].

    Source: servoing thesis (2.7), there linearised.
    """
    return np.asarray(lengths / (1.0 + tensions / stiffness), float)


def stretched_lengths(l0: Array, tensions: Array, stiffness: Array) -> Array:
    """Lengths l = l0 (1 + t / E S) of cables under tension, shape (m,) [m].

    Args:
        l0: Unstrained lengths, shape (m,) [m].
        tensions: Tensions, shape (m,); a cable with none or less (a sensor's offset) keeps l0 [N].
        stiffness: E S, shape (m,) [N].

    Source: servoing thesis (2.7), there linearised.
    """
    return np.asarray(l0 * (1.0 + np.maximum(tensions, 0.0) / stiffness), float)


def elastic_energy(lengths: Array, l0: Array, stiffness: Array) -> float:
    """Energy stored in the taut cables [J]: sum of E S (l - l0)^2 / (2 l0) where l > l0.

    Arguments of shape (m,): lengths [m], unstrained lengths [m], E S [N].
    """
    stretch = np.maximum(lengths - l0, 0.0)
    return float(np.sum(stiffness * stretch**2 / (2.0 * l0)))


def cable_stiffness_matrix(J: Array, stiffness: Array, l0: Array) -> Array:
    """Stiffness of the platform against small displacements by cable elasticity alone.

    K = J' diag(E S / l0) J, shape (n, n), columns (rotation, translation); the part that comes
    from turning the tensions is left out, which is small against it where cables are stiff.

    Args:
        J: Length Jacobian, shape (m, n).
        stiffness: E S, shape (m,) [N].
        l0: Unstrained lengths, shape (m,) [m].

    Source: Gazebo thesis (2.28).
    """
    return np.asarray(J.T @ ((stiffness / l0)[:, np.newaxis] * J), float)
