"""Small sums over vectors and rows of six that the blocks of a certificate are put together from.

A row is a linear form of v in R^6; three rows are a vector linear in v, shape (3, 6).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

ROOT_3 = np.sqrt(3.0)


@njit(cache=True, error_model="numpy")
def gram(X: Array, out: Array) -> None:
    """out <- X'X for X of shape (k, 6)."""
    for i in range(6):
        for j in range(6):
            s = 0.0
            for k in range(X.shape[0]):
                s += X[k, i] * X[k, j]
            out[i, j] = s


@njit(cache=True, error_model="numpy")
def add_outer(a: Array, b: Array, f: float, out: Array) -> None:
    """out += f / 2 (a b' + b a')."""
    for i in range(6):
        for j in range(6):
            out[i, j] += 0.5 * f * (a[i] * b[j] + b[i] * a[j])


@njit(cache=True, error_model="numpy")
def cross_rows(p: Array, X: Array, out: Array) -> None:
    """out <- [p]x X for X of shape (3, 6)."""
    for j in range(6):
        out[0, j] = p[1] * X[2, j] - p[2] * X[1, j]
        out[1, j] = p[2] * X[0, j] - p[0] * X[2, j]
        out[2, j] = p[0] * X[1, j] - p[1] * X[0, j]


@njit(cache=True, error_model="numpy")
def unit_remainder(E: float) -> float:
    """Bound of |u^ - u - P (q^ - q) / l| for |q^ - q| <= E l, E < 1."""
    a = 1.0 / (1.0 + np.sqrt(1.0 - E * E))
    first = 0.25 / (1.0 - a * a) if a * a <= 0.5 else a * a
    k = a * E
    return E * E * np.sqrt(first + 2.0 * 0.2863 * k + k * k)


@njit(cache=True, error_model="numpy")
def unit_remainder_2(E: float) -> float:
    """Bound of |u^ - u - P (q^ - q) / l - u2(q^ - q)| for |q^ - q| <= E l, E < 1."""
    angle = E / np.sqrt(1.0 - E * E)
    tail = E * E * E / (3.0 * (1.0 - E))
    return angle * angle * angle / 6.0 + tail + 0.5 * (0.5 * E * E + tail) * (E + angle)


@njit(cache=True, error_model="numpy")
def cable_remainder(
    known: float, arm: float, lever: float, length: float, F: float, G: float, seen: float,
    lone: float, size_B: float,
) -> tuple[float, float]:  # fmt: skip
    """What a cable's part may differ by from its expansion, per |w_i n| and per |w_i z_w|.

    Args:
        known: r_bp + F arm [m].
        arm: Distance of the anchor point from P [m].
        lever: Its distance from C [m].
        length: Of the cable [m].
        F: Bound of the platform's turn [rad].
        G: Bound of the camera's turn [rad].
        seen: Bound of dt and ds together [m].
        lone: Bound of |da| + |db| [m].
        size_B: Bound of |db| [m].

    Source: the remainder in `quadratic_bounds_kernel`; (known + lone) / length < 1 there.
    """
    E = (known + lone) / length
    twice, thrice = 0.5 * F * F * arm + F * size_B, F * F * F * arm / 6.0 + F * size_B
    linear = unit_remainder(E) + twice / length
    chord = E * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 - E * E)))
    others = lone + twice
    cubic = unit_remainder_2(E) + thrice / length
    cubic += (2.0 * known + others) * others / (ROOT_3 * length * length)
    cubic += F * (linear + lone / length) + 0.5 * F * F * chord + F * F * F / 6.0
    square = linear + F * chord + 0.5 * F * F + lone / length
    moved = chord + F
    slope = cubic + G * square + 0.5 * G * G * moved
    swing = (
        G * lever * (square + G * moved)
        + square * seen
        + moved * size_B
        + G * (moved * (seen + size_B) + size_B)
    )
    return slope, swing


@njit(cache=True, error_model="numpy")
def part_across(u: Array, x: Array, length: float, out: Array) -> None:
    """out <- (x - u u . x) / length."""
    along = u[0] * x[0] + u[1] * x[1] + u[2] * x[2]
    for j in range(3):
        out[j] = (x[j] - along * u[j]) / length


@njit(cache=True, error_model="numpy")
def add_cross(k: int, x: Array, f: float, out: Array) -> None:
    """out += f e_k x x."""
    i, j = (k + 1) % 3, (k + 2) % 3
    out[i] -= f * x[j]
    out[j] += f * x[i]


@njit(cache=True, error_model="numpy")
def add_curvature(u: Array, x: Array, y: Array, length: float, f: float, out: Array) -> None:
    """out += f u2(x, y), the symmetric form whose square is the second order of a unit vector."""
    a = (u[0] * x[0] + u[1] * x[1] + u[2] * x[2]) / length
    b = (u[0] * y[0] + u[1] * y[1] + u[2] * y[2]) / length
    dot = (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) / (length * length) - a * b
    for j in range(3):
        px, py = x[j] / length - a * u[j], y[j] / length - b * u[j]
        out[j] -= 0.5 * f * (a * py + b * px + dot * u[j])


@njit(cache=True, error_model="numpy")
def add_row(weight: Array, t: Array, n: Array, f: float, S: Array) -> None:
    """S += f times the form (weight . v) (t . n v)."""
    for i in range(6):
        ri = t[0] * n[0, i] + t[1] * n[1, i] + t[2] * n[2, i]
        for j in range(6):
            rj = t[0] * n[0, j] + t[1] * n[1, j] + t[2] * n[2, j]
            S[i, j] += 0.5 * f * (weight[i] * rj + ri * weight[j])


@njit(cache=True, error_model="numpy")
def add_with_turn(
    weight: Array, t: Array, c: Array, zw: Array, zv: Array, rows: Array, S: Array
) -> None:
    """S[l] += the form of t . (e_l x zv + (e_l x zw) x c), l = 0, 1, 2."""
    s = np.empty(3)
    # t . (g x zv) = -g . (t x zv); t . ((g x zw) x c) = (c x t) . (g x zw)
    cross_rows(t, zv, rows)
    for k in range(3):
        add_outer(weight, rows[k], -1.0, S[k])
    cross(c, t, s)
    cross_rows(s, zw, rows)
    for k in range(3):
        add_outer(weight, rows[k], -1.0, S[k])


@njit(cache=True, error_model="numpy")
def cross(a: Array, b: Array, out: Array) -> None:
    """out <- a x b."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def forms_along(axes: Array, C: Array, turned: bool, S: Array) -> None:
    """S[k] <- sum_j (C' axes)_jk S[j] for the first three of S, or without C'."""
    T, old = np.empty((3, 3)), S[:3].copy()
    for j in range(3):
        for k in range(3):
            T[j, k] = axes[j, k]
            if turned:
                T[j, k] = C[0, j] * axes[0, k] + C[1, j] * axes[1, k] + C[2, j] * axes[2, k]
    for k in range(3):
        for i in range(6):
            for j in range(6):
                S[k, i, j] = 0.0
                for n in range(3):
                    S[k, i, j] += T[n, k] * old[n, i, j]
