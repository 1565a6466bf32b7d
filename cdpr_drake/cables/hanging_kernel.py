"""Numba kernels that find how a sagging elastic cable hangs, from its exit point or its pulley.

Given are the anchor point B at (rho, z) from the exit point A, z up, in the vertical plane of the
cable, and the whole unstrained length l0 from A to B. Over a pulley (radius r, swivel axis up for
sigma = 1, down for -1) the cable leaves the groove along its tangent at A', so that the force
(H, V_A) there says where A' lies,

    sin(alpha) = H / T_A,   cos(alpha) = -sigma V_A / T_A,
    A' = (r (1 + cos(alpha)), sigma r sin(alpha)),

and how much unstrained length lies in the groove. There it slides without friction and keeps its
weight: (1 + T / ES)^2 - 2 w z / ES is the same all along. What remains are two equations for
(H, V_A), solved by Newton's method with steps that keep H positive and make the error smaller.

Source: Irvine, Cable Structures, 1981, 1.3, for the free part, and the servoing thesis 1.3.1 for
the pulley; the two together are solved here. Over a pulley the equations are not the slope of a
convex energy, as those of a free cable are, and Newton's steps can end where they are not solved.
Then alpha is searched for: the free part from A' to B has a solution for each, of which the angle
of the force must be alpha.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.catenary_kernel import first_guess, free_part, sag_of, stretched_length
from cdpr_drake.geometry.pulley_kernel import tangent

STEPS = 100
"""Newton steps after which a cable is given up."""

LAST_STEP_SHARE = 1e-8
"""A step below this share of the tension is the last: the next one would be its square."""

ROUNDING = 1e-5
"""Below this share, steps that shrink no more are rounding, and end it too."""

SENSITIVITIES = 6
"""Rows of `sagging_cable`'s derivatives: H, V_B, tension at B, tension at A, length, sag."""

ANGLES, HALVINGS = 24, 30
"""Angles at which a cable is tried to leave its groove, and halvings between two of them."""

_NODES = (0.5 - 0.5 * np.sqrt(0.6), 0.5, 0.5 + 0.5 * np.sqrt(0.6))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@njit(cache=True, error_model="numpy")
def _groove(alpha: float, T_A: float, r: float, sigma: float, ES: float, w: float) -> Any:
    """Unstrained length in the groove [m], its derivatives by alpha and T_A, and T where it enters.

    The integrand r / (1 + T / ES) varies by w r / ES, a millionth: three points are exact.
    """
    q = 1.0 + T_A / ES
    square = q * q
    slope = 2.0 * sigma * w * r / ES
    span = np.pi - alpha
    sine = np.sin(alpha)
    length = cubes = 0.0
    for k in range(3):
        at = max(square - slope * (sine - np.sin(alpha + _NODES[k] * span)), 0.25)
        root = np.sqrt(at)
        length += _WEIGHTS[k] / root
        cubes += _WEIGHTS[k] / (at * root)
    by_alpha = -r / q + 0.5 * slope * np.cos(alpha) * cubes * r * span
    by_tension = -q / ES * cubes * r * span
    enters = T_A - 2.0 * sigma * w * r * sine / (q + np.sqrt(max(square - slope * sine, 0.25)))
    return length * r * span, by_alpha, by_tension, enters


@njit(cache=True, error_model="numpy")
def equations(
    H: float, V_A: float, rho: float, z: float,
    r: float, sigma: float, l0: float, ES: float, w: float,
) -> Any:  # fmt: skip
    """Errors of both equations [m], their derivatives by (H, V_A), and the length in the groove."""
    if r == 0.0:
        x, up, xx, xz, zz, _, _, _, _, _ = free_part(H, V_A, l0, ES, w)
        return x - rho, up - z, xx, xz, xz, zz, True
    T_A = np.sqrt(H * H + V_A * V_A)
    sine, cosine = H / T_A, -sigma * V_A / T_A
    alpha = np.arctan2(sine, cosine)
    wound, by_alpha, by_tension, _ = _groove(alpha, T_A, r, sigma, ES, w)
    s = l0 - wound
    if s <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False
    x, up, xx, xz, zz, _, T_B, _, _, _ = free_part(H, V_A, s, ES, w)
    a_H, a_V = cosine / T_A, sigma * sine / T_A
    s_H = -by_alpha * a_H - by_tension * sine
    s_V = -by_alpha * a_V + by_tension * sigma * cosine
    per = 1.0 / T_B + 1.0 / ES
    e_x, e_z = H * per, (V_A + w * s) * per
    return (
        x + r * (1.0 + cosine) - rho, up + sigma * r * sine - z,
        xx + e_x * s_H - r * sine * a_H, xz + e_x * s_V - r * sine * a_V,
        xz + e_z * s_H + sigma * r * cosine * a_H, zz + e_z * s_V + sigma * r * cosine * a_V,
        True,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _begin(
    rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float, tight: bool
) -> Any:
    """(H, V_A) of a cable that leaves the groove where a straight one would.

    Or, `tight`, along the chord with at least its own weight: a safe start far from zero.
    """
    if r == 0.0:
        if tight:
            return _along_chord(rho, z, l0, ES, w)
        return first_guess(rho, z, l0, ES, w)
    free, sine, cosine = tangent(rho, sigma * z, r)
    arc = r * (np.pi - np.arctan2(sine, cosine))
    length = free + arc
    s = l0 - arc if l0 > length else l0 * free / length
    x, up = rho - r * (1.0 + cosine), z - sigma * r * sine
    if tight:
        return _along_chord(x, up, s, ES, w)
    return first_guess(x, up, s, ES, w)


@njit(cache=True, error_model="numpy")
def _along_chord(x: float, z: float, s: float, ES: float, w: float) -> Any:
    chord = np.hypot(x, z)
    t = max(ES * (chord / s - 1.0), 0.0) + w * s
    return t * x / chord, t * z / chord - 0.5 * w * s


@njit(cache=True, error_model="numpy")
def _newton(
    rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float,
    H: float, V_A: float,
) -> Any:  # fmt: skip
    """Newton's steps from one force; as `solve_catenary`."""
    e_x, e_z, xx, xz, zx, zz, good = equations(H, V_A, rho, z, r, sigma, l0, ES, w)
    halvings = 0
    while not good and halvings < 60:  # all of the cable in the groove: pull harder
        H, V_A = 2.0 * H, 2.0 * V_A
        e_x, e_z, xx, xz, zx, zz, good = equations(H, V_A, rho, z, r, sigma, l0, ES, w)
        halvings += 1
    before = np.inf
    for _ in range(STEPS):
        if not good:
            break
        det = xx * zz - xz * zx
        d_H, d_V = -(zz * e_x - xz * e_z) / det, -(xx * e_z - zx * e_x) / det
        tension = np.hypot(H, V_A)
        step = np.hypot(d_H, d_V)
        if not np.isfinite(step):
            break
        # H is a small part of the tension where a cable hangs down, but has its own logarithm.
        share_H = abs(d_H / H)
        small = step <= ROUNDING * tension and share_H <= ROUNDING
        last = step <= LAST_STEP_SHARE * tension and share_H <= LAST_STEP_SHARE
        if small and (last or step >= 0.5 * before):
            return H + d_H, V_A + d_V, True
        before = step
        share = 1.0
        if d_H * H < -0.9 * H * H:
            share = -0.9 * H / d_H
        error = e_x * e_x + e_z * e_z
        for _ in range(60):
            new_H, new_V = H + share * d_H, V_A + share * d_V
            e_x, e_z, xx, xz, zx, zz, good = equations(new_H, new_V, rho, z, r, sigma, l0, ES, w)
            if good and (small or e_x * e_x + e_z * e_z < error):
                break
            share *= 0.5
            good = False
        H, V_A = new_H, new_V
    return H, V_A, False


@njit(cache=True, error_model="numpy")
def _off_angle(
    alpha: float, rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float
) -> Any:
    """Angle of the force less alpha, of a free part that begins there; the force; and success."""
    x, up = rho - r * (1.0 + np.cos(alpha)), z - sigma * r * np.sin(alpha)
    s = l0 - r * (np.pi - alpha)
    if s <= 0.0 or x == 0.0:
        return 0.0, 0.0, 0.0, False
    H, V_A = first_guess(x, up, s, ES, w)
    H, V_A, good = _newton(x, up, 0.0, sigma, s, ES, w, H, V_A)
    if not good:
        H, V_A = _along_chord(x, up, s, ES, w)
        H, V_A, good = _newton(x, up, 0.0, sigma, s, ES, w, H, V_A)
    return np.arctan2(H, -sigma * V_A) - alpha, H, V_A, good


@njit(cache=True, error_model="numpy")
def _search(rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float) -> Any:
    """As `solve_catenary`, by the angle at which the cable leaves its groove."""
    before, off_before, known = 0.0, 0.0, False
    for k in range(ANGLES + 1):
        alpha = -0.5 * np.pi + 2.0 * np.pi * k / ANGLES
        off, H, V_A, good = _off_angle(alpha, rho, z, r, sigma, l0, ES, w)
        if good and known and off * off_before <= 0.0 and abs(off - off_before) < np.pi:
            low, high = before, alpha
            for _ in range(HALVINGS):
                mid = 0.5 * (low + high)
                there, H, V_A, good = _off_angle(mid, rho, z, r, sigma, l0, ES, w)
                if not good:
                    break
                if there * off_before > 0.0:
                    low = mid
                else:
                    high = mid
            H, V_A, good = _newton(rho, z, r, sigma, l0, ES, w, H, V_A)
            if good:
                return H, V_A, True
            good = True
        before, off_before, known = alpha, off, good
    return 0.0, 0.0, False


@njit(cache=True, error_model="numpy")
def solve_catenary(
    rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float,
    H: float, V_A: float,
) -> Any:  # fmt: skip
    """Solves for the force at the near end of a sagging cable.

    Args:
        rho: Horizontal distance of B from A, > 0 [m].
        z: Height of B over A [m].
        r: Radius of the groove; 0: none [m].
        sigma: 1: swivel axis up; -1: down.
        l0: Unstrained length from A to B [m].
        ES: Axial stiffness [N].
        w: Weight per unstrained length, > 0 [N/m].
        H: Horizontal force to begin with, or a number that is not > 0 for a guess [N].
        V_A: Vertical force to begin with [N].

    Returns:
        (H, V_A, good): forces [N], and whether the equations are solved.
    """
    for attempt in range(0 if abs(H) > 0.0 else 1, 3):
        if attempt > 0:
            H, V_A = _begin(rho, z, r, sigma, l0, ES, w, attempt == 2)
        H, V_A, good = _newton(rho, z, r, sigma, l0, ES, w, H, V_A)
        if good:
            return H, V_A, True
    if r > 0.0 and np.hypot(rho - r, z) > r:  # B is outside the pulley
        return _search(rho, z, r, sigma, l0, ES, w)
    return H, V_A, False


@njit(cache=True, error_model="numpy")
def sagging_cable(
    rho: float, z: float, r: float, sigma: float, l0: float, ES: float, w: float,
    H: float, V_A: float, out: Array,
) -> Any:  # fmt: skip
    """How a sagging cable hangs, and how that changes with B and the unstrained length.

    Args:
        rho: Horizontal distance of B from A [m].
        z: Height of B over A [m].
        r: Radius of the groove; 0: none [m].
        sigma: 1: swivel axis up; -1: down.
        l0: Unstrained length from A to B [m].
        ES: Axial stiffness [N].
        w: Weight per unstrained length, > 0 [N/m].
        H: Solved horizontal force, from `solve_catenary` [N].
        V_A: Solved vertical force at the near end [N].
        out: Derivatives by (rho, z, l0) of the first six results, shape (6, 3), are written here.

    Returns:
        (H, V_B, T_B, T_A, length, sag): force on B is -(H, V_B) [N]; tensions at B and at A [N];
        length under load from A to B [m]; largest distance of the free part from its chord [m].
    """
    cosine = sine = a_H = a_V = wound = by_alpha = by_tension = 0.0
    T = np.sqrt(H * H + V_A * V_A)
    cos_T, sin_T = H / T, V_A / T  # dT_A by H and by V_A
    enters, arc = T, 0.0
    if r > 0.0:
        sine, cosine = H / T, -sigma * V_A / T
        alpha = np.arctan2(sine, cosine)
        wound, by_alpha, by_tension, enters = _groove(alpha, T, r, sigma, ES, w)
        arc = r * (np.pi - alpha)
        a_H, a_V = cosine / T, sigma * sine / T
    s = l0 - wound
    x, up, _, _, _, _, T_B, V, S, phi = free_part(H, V_A, s, ES, w)
    _, _, j_xx, j_xz, j_zx, j_zz, _ = equations(H, V_A, rho, z, r, sigma, l0, ES, w)
    det = j_xx * j_zz - j_xz * j_zx
    V_B = V_A + w * s
    per = 1.0 / T_B + 1.0 / ES
    sag, x_low, z_low, s_low = sag_of(x, up, s, ES, w, H, V_A)
    _, _, l_xx, l_xz, l_zz, _, _, _, _, _ = free_part(H, V_A, s_low, ES, w)
    chord = np.sqrt(x * x + up * up)
    along_H, along_V = x - H * s / ES, up - V * s / ES  # integrals of H / T and V / T
    for k in range(3):
        d_x = 1.0 if k == 0 else 0.0
        d_z = 1.0 if k == 1 else 0.0
        d_l = 1.0 if k == 2 else 0.0
        e_x, e_z = d_x - H * per * d_l, d_z - V_B * per * d_l
        d_H = (j_zz * e_x - j_xz * e_z) / det
        d_V = (j_xx * e_z - j_zx * e_x) / det
        d_T = cos_T * d_H + sin_T * d_V
        d_alpha = a_H * d_H + a_V * d_V
        d_s = d_l - by_alpha * d_alpha - by_tension * d_T
        d_VB = d_V + w * d_s
        out[0, k] = d_H
        out[1, k] = d_VB
        out[2, k] = (H * d_H + V_B * d_VB) / T_B
        # (1 + T / ES)^2 - 2 w z / ES is the same at A and A'; z_A' = sigma r sin(alpha).
        out[3, k] = ((1.0 + T / ES) * d_T - w * sigma * r * cosine * d_alpha) / (1.0 + enters / ES)
        out[4, k] = d_s * (1.0 + T_B / ES) + (along_H * d_H + along_V * d_V) / ES - r * d_alpha
        d_span = d_x + r * sine * d_alpha
        d_rise = d_z - sigma * r * cosine * d_alpha
        low_x, low_z = l_xx * d_H + l_xz * d_V, l_xz * d_H + l_zz * d_V
        side = 1.0 if x > 0.0 else -1.0
        out[5, k] = side * (
            low_x * up - low_z * x + x_low * d_rise - z_low * d_span
        ) / chord - sag * (x * d_span + up * d_rise) / (chord * chord)
    length = arc + stretched_length(s, ES, H, V, S, phi)
    return H, V_B, T_B, enters, length, sag
