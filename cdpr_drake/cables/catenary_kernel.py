"""Numba kernels for one elastic cable that sags under its own weight, in its vertical plane.

A cable of unstrained length s, axial stiffness E S and weight w per unstrained length hangs from
A' = (0, 0) to B = (x, z), z up. It pulls B with the force -(H, V_B) and A' with (H, V_A), where
V_B = V_A + w s. Irvine's solution of the equilibrium,

    x = H s / ES + H / w (asinh(V_B / H) - asinh(V_A / H)),
    z = V s / ES + (T_B - T_A) / w,       V = (V_A + V_B) / 2,   T = hypot(H, V_.),

is written here without its differences of nearly equal numbers: with S = T_A + T_B, y = w s / S,

    x = H s (1 / ES + 2 phi / S),   z = V s (1 / ES + 2 / S),   phi = artanh(y) / y >= 1,

so that no division by w is left, and w = 0 is the straight elastic cable. (x, z) is the gradient of
a convex function of (H, V), the complementary energy; its Hessian, the compliance, is
((s/ES + p, q), (q, s/ES + d)) with p d - q^2 = 2 (phi - 1) s d / S > 0 (see `free_part`).

Source: Irvine, Cable Structures, 1981, 1.3; the forms with S by the addition theorem of tanh.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

SERIES = 0.05
"""Below this y, phi - 1 is summed as its power series, to y^10: the next term is 2e-17."""

VERTICAL = 1e-9
"""Horizontal spans below this share of the cable's length count as this share: the direction of H
is lost there, and so is H itself, by the same share of the tension."""


@njit(cache=True, error_model="numpy")
def free_part(H: float, V_A: float, s: float, ES: float, w: float) -> Any:
    """Span and rise of the far end, its compliance and what both are made of.

    Args:
        H: Horizontal force, > 0 [N].
        V_A: Vertical force at the near end [N].
        s: Unstrained length [m].
        ES: Axial stiffness [N].
        w: Weight per unstrained length [N/m].

    Returns:
        (x, z, c_xx, c_xz, c_zz, T_A, T_B, V, S, phi): the far end [m], its derivatives by H and
        V_A [m/N], the tensions at both ends [N], the mean vertical force [N], S [N] and phi.
    """
    weight = w * s
    V_B = V_A + weight
    V = V_A + 0.5 * weight
    T_A, T_B = np.sqrt(H * H + V_A * V_A), np.sqrt(H * H + V_B * V_B)
    S = T_A + T_B
    product = T_A * T_B
    # S - w s, by terms that are not negative.
    above = H * H / (T_A + abs(V_A)) + H * H / (T_B + abs(V_B))
    if V_A > 0.0:
        above += 2.0 * V_A
    elif V_B < 0.0:
        above -= 2.0 * V_B
    y = weight / S
    square = y * y
    if y < SERIES:
        rest = square * (
            1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9 + square / 11)))
        )
    else:
        rest = 0.5 * np.log((S + weight) / above) / y - 1.0
    # S^2 - 4 V^2, by terms that are not negative.
    ends = V_A * V_B
    if ends > 0.0:
        across = 2.0 * H * H * (1.0 + (H * H + V_A * V_A + V_B * V_B) / (product + ends))
    else:
        across = 2.0 * (H * H + product - ends)
    per_ES = 1.0 / ES
    phi = 1.0 + rest
    x = H * s * (per_ES + 2.0 * phi / S)
    z = V * s * (per_ES + 2.0 / S)
    d = s * across / (2.0 * S * product)
    narrow = above * (S + weight) / (S * S)  # 1 - y^2
    p = 2.0 * rest * s / S + 2.0 * s * V * V * narrow / (S * product)
    q = -2.0 * V * H * s / (product * S)
    return x, z, s * per_ES + p, q, s * per_ES + d, T_A, T_B, V, S, phi


@njit(cache=True, error_model="numpy")
def stretched_length(s: float, ES: float, H: float, V: float, S: float, phi: float) -> float:
    """Length under load [m]: s plus the integral of T / ES; arguments as `free_part` gives them."""
    return s + s * (V * V / S + 0.25 * S + H * H * phi / S) / ES


@njit(cache=True, error_model="numpy")
def stored_energy(
    x: float, z: float, s: float, ES: float, w: float, H: float, V: float, S: float, phi: float
) -> float:
    """Elastic energy and potential of the weight, relative to the height of A' [J].

    Its derivative by (x, z) is (H, V_B). Arguments as `free_part` gives them.
    """
    tension = s * (V * V / S + 0.25 * S + H * H * phi / S)  # integral of T
    square = s * (H * H + V * V + (w * s) ** 2 / 12.0)  # integral of T^2
    return H * x + (V + 0.5 * w * s) * z - tension - square / (2.0 * ES)


@njit(cache=True, error_model="numpy")
def first_guess(x: float, z: float, s: float, ES: float, w: float) -> Any:
    """(H, V_A) to begin with: the parabola for cables near the straight line, else inextensible.

    Arguments as in `free_part`, with the end (x, z) [m]; x not 0.
    """
    side = 1.0 if x > 0.0 else -1.0
    x = abs(x)
    chord = np.hypot(x, z)
    if s < 1.02 * chord:
        # Stretch and sag share what the chord is longer than s: s t / ES + s - chord = k / t^2.
        k = (w * x / chord) ** 2 * chord**3 / 24.0
        a, b = s / ES, s - chord
        t = max(-b / a, 0.0) + (k / a) ** (1.0 / 3.0) + 1e-300
        for _ in range(50):
            step = (a * t * t * t + b * t * t - k) / (3.0 * a * t * t + 2.0 * b * t)
            t -= step
            if abs(step) < 1e-6 * t:
                break
        return side * t * x / chord, t * z / chord - 0.5 * w * s
    # Inextensible catenary: sinh(lam) / lam = k with lam = w x / (2 H).
    k = np.sqrt(s * s - z * z) / x
    lam = np.sqrt(6.0 * (k - 1.0)) if k < 3.0 else np.log(2.0 * k) + np.log(np.log(2.0 * k)) + 0.5
    for _ in range(50):
        step = (np.sinh(lam) - k * lam) / (np.cosh(lam) - k)
        lam -= step
        if abs(step) < 1e-6 * lam:
            break
    return side * 0.5 * w * x / lam, 0.5 * w * (z / np.tanh(lam) - s)


@njit(cache=True, error_model="numpy")
def sag_of(x: float, z: float, s: float, ES: float, w: float, H: float, V_A: float) -> Any:
    """Largest distance of the cable from its chord, and what its derivative needs.

    Arguments as in `free_part`, with the end (x, z) [m].

    Returns:
        (sag, x_low, z_low, s_low): the distance [m], the point where the cable runs along the
        chord [m] and the unstrained length up to there [m].
    """
    if w == 0.0 or s <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    s_low = min(max((H * z / x - V_A) / w, 0.0), s)
    x_low, z_low, _, _, _, _, _, _, _, _ = free_part(H, V_A, s_low, ES, w)
    side = 1.0 if x > 0.0 else -1.0
    return side * (x_low * z - z_low * x) / np.sqrt(x * x + z * z), x_low, z_low, s_low
