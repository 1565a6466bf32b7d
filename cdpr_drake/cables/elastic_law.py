"""The elastic cable law at rest: unstrained lengths, stiffness, and the energy that is stored.

The functions on arrays take straight cables without weight. `straight_energy` and `sagging_energy`
are kernels for the potential energy of one cable: its stretch and, where it sags, its weight. The
derivative of that energy by the anchor point p_WB is the pull of `dispatch_kernel.cable_response`.

Source: servoing thesis (2.7), there linearised; Gazebo thesis (2.28).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.catenary_kernel import VERTICAL, free_part, stored_energy
from cdpr_drake.geometry.motion_kernel import Motion
from cdpr_drake.geometry.pulley_kernel import pulley_line

_NODES = (0.5 - 0.5 * np.sqrt(0.6), 0.5, 0.5 + 0.5 * np.sqrt(0.6))

_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Of Gauss' rule with three points on [0, 1]."""


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


@njit(cache=True, error_model="numpy")
def straight_energy(X: Motion, cable: Array, l0: float) -> float:
    """Energy of a spring that only pulls [J]; see `dispatch_kernel.cable_energy`."""
    length, _, _, _, _, _, _ = pulley_line(X, cable)
    stretch = length - l0
    return 0.5 * cable[6] * stretch * stretch / l0 if stretch > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def sagging_energy(X: Motion, cable: Array, l0: float, solved: Array) -> float:
    """Energy of an elastic cable that sags [J]; see `dispatch_kernel.cable_energy`."""
    _, _, _, _, rx, ry, rz = pulley_line(X, cable)
    ES, w, r, sigma = cable[6], cable[9], cable[8], cable[12]
    H, V_A = solved[0], solved[1]
    dx, dy = X[9] + rx - cable[0], X[10] + ry - cable[1]
    x, z = max(np.sqrt(dx * dx + dy * dy), VERTICAL * l0), X[11] + rz - cable[2]
    energy, s, height = 0.0, l0, 0.0
    if r > 0.0:
        T = np.hypot(H, V_A)
        sine, cosine = H / T, -sigma * V_A / T
        energy, wound = _groove_energy(np.arctan2(sine, cosine), T, r, sigma, ES, w)
        s = l0 - wound
        height = sigma * r * sine
        x -= r * (1.0 + cosine)
        z -= height
    _, _, _, _, _, _, _, V, S, phi = free_part(H, V_A, s, ES, w)
    return energy + w * s * height + stored_energy(x, z, s, ES, w, H, V, S, phi)


@njit(cache=True, error_model="numpy")
def _groove_energy(alpha: float, T_A: float, r: float, sigma: float, ES: float, w: float) -> Any:
    """Energy of what lies in the groove, heights from A [J], and its unstrained length [m].

    Three points for an integrand that is nearly a sine over less than half a turn.
    """
    q = 1.0 + T_A / ES
    sine, span = np.sin(alpha), np.pi - alpha
    energy = length = 0.0
    for k in range(3):
        height = sigma * r * np.sin(alpha + _NODES[k] * span)
        root = np.sqrt(max(q * q - 2.0 * w / ES * (sigma * r * sine - height), 0.25))
        T = ES * (root - 1.0)
        energy += _WEIGHTS[k] * (T * T / (2.0 * ES)) / root
        length += _WEIGHTS[k] / root
    # The weight's part in closed form, but for the stretch, which varies by a millionth.
    per_stretch = length
    energy = energy * r * span + w * sigma * r * r * (1.0 + np.cos(alpha)) * per_stretch
    return energy, length * r * span
