"""Cables and demanded wrench about a pose, to first order with a bound on the rest: a numba kernel.

Notation and proof stand in `box_verdicts_kernel`, under **Expansion**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

INSIDE, OPEN, OUTSIDE = 1, 0, -1
"""Verdicts on a box."""

NUMBERS = 6
"""Of a pose: position, angles."""

ROUNDING = 1e-12
"""Share of the sum of absolute values that a computed sum may be wrong by; see **Rounding** in
`box_verdicts_kernel`."""

EXIT, ANCHOR, BEND, GAIN = 0, 1, 2, 3
"""Columns of what is known of a cable's points in a box: bounds r_A, r_B on how far its exit point
and its anchor point may be off [m], on what is not of first order in a tangent point [m], and on
|N| [-]."""


@njit(cache=True, error_model="numpy")
def turn_axes(angles: Array, R: Array, axes: Array) -> None:
    """Writes R = Rx Ry Rz, shape (3, 3), and the axes of its angles in W, as rows, shape (3, 3)."""
    a, b, c = angles[0], angles[1], angles[2]
    sa, ca, sb, cb, sc, cc = np.sin(a), np.cos(a), np.sin(b), np.cos(b), np.sin(c), np.cos(c)
    R[0, 0], R[0, 1], R[0, 2] = cb * cc, -cb * sc, sb
    R[1, 0], R[1, 1], R[1, 2] = sa * sb * cc + ca * sc, -sa * sb * sc + ca * cc, -sa * cb
    R[2, 0], R[2, 1], R[2, 2] = -ca * sb * cc + sa * sc, ca * sb * sc + sa * cc, ca * cb
    axes[0, 0], axes[0, 1], axes[0, 2] = 1.0, 0.0, 0.0
    axes[1, 0], axes[1, 1], axes[1, 2] = 0.0, ca, sa
    axes[2, 0], axes[2, 1], axes[2, 2] = sb, -sa * cb, ca * cb


@njit(cache=True, error_model="numpy")
def _cross(x: Array, y: Array, out: Array) -> None:
    out[0] = x[1] * y[2] - x[2] * y[1]
    out[1] = x[2] * y[0] - x[0] * y[2]
    out[2] = x[0] * y[1] - x[1] * y[0]


@njit(cache=True, error_model="numpy")
def _size(x: Array) -> float:
    return np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


@njit(cache=True, error_model="numpy")
def expand(
    pose: Array, half: Array, points: Array, rows: np.ndarray, scale: Array, off: Array,
    turns: Array, g: Array, gk: Array, lengths: Array, rest: Array,
) -> bool:  # fmt: skip
    """Writes columns of V about a pose, their derivatives, and bounds on the rest.

    Args:
        pose: Position [m] and angles [rad], shape (6,).
        half: Half widths of the box, shape (6,).
        points: Exit points in W and anchor points in P, or tangent points, shape (m, 6) [m].
        rows: Components that are balanced, shape (n,).
        scale: By which they are divided, shape (n,).
        off: `EXIT`, `ANCHOR`, `BEND`, `GAIN` of each cable, shape (m, 4).
        turns: N of cables with `BEND` above 0, shape (m, 3, 3).
        g: Gets V_0, shape (n, m).
        gk: Gets V^k, shape (6, n, m).
        lengths: Gets l, then u.v^k, shape (7, m).
        rest: Gets D_v, E_v, bound on lambda, and the rest of each row of V, shape (3 + n, m).

    Returns:
        False: a cable could have no length in the box; nothing can be said.
    """
    m, n = points.shape[0], rows.shape[0]
    R, axes = np.empty((3, 3)), np.empty((3, 3))
    b, v, bk, vk, x, y = (
        np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip
    turn_axes(pose[3:], R, axes)
    shift = _size(half)  # of the position
    s = half[3] + half[4] + half[5]
    for i in range(m):
        for a in range(3):
            b[a] = R[a, 0] * points[i, 3] + R[a, 1] * points[i, 4] + R[a, 2] * points[i, 5]
            v[a] = pose[a] + b[a] - points[i, a]
        arm, length = _size(b), _size(v)
        gain, bend = off[i, GAIN], off[i, BEND]
        D_b, D_v = s * arm, gain * (shift + s * arm)
        E_b = 0.5 * s * s * arm + off[i, ANCHOR]
        E_v = gain * (0.5 * s * s * arm + off[i, EXIT] + off[i, ANCHOR]) + bend
        if not length > 1.01 * (D_v + E_v) + ROUNDING:
            return False
        moment = D_b * D_v + E_b * (length + D_v) + (arm + D_b) * E_v + E_b * E_v
        lengths[0, i] = length
        rest[0, i], rest[1, i] = D_v, E_v
        rest[2, i] = D_v * D_v / (2.0 * (length - D_v)) + E_v + ROUNDING * length
        _cross(b, v, x)
        for k in range(n):
            row = rows[k]
            g[k, i] = -(x[row] if row < 3 else v[row - 3]) / scale[k]
            # What is subtracted in a cross product may be far larger than what it leaves.
            slip = (arm + D_b) * (length + D_v) if row < 3 else length + D_v
            rest[3 + k, i] = ((moment if row < 3 else E_v) + ROUNDING * slip) / scale[k]
        for j in range(NUMBERS):
            if j < 3:
                for a in range(3):
                    bk[a], vk[a] = 0.0, 1.0 if a == j else 0.0
            else:
                _cross(axes[j - 3], b, bk)
                vk[:] = bk
            if bend > 0.0:
                x[:] = vk
                for a in range(3):
                    vk[a] = turns[i, a, 0] * x[0] + turns[i, a, 1] * x[1] + turns[i, a, 2] * x[2]
            lengths[1 + j, i] = (v[0] * vk[0] + v[1] * vk[1] + v[2] * vk[2]) / length
            _cross(bk, v, x)
            _cross(b, vk, y)
            for k in range(n):
                row = rows[k]
                gk[j, k, i] = -(x[row] + y[row] if row < 3 else vk[row - 3]) / scale[k]
    return True


@njit(cache=True, error_model="numpy")
def expand_demand(
    pose: Array, half: Array, load: Array, rows: np.ndarray, scale: Array, d: Array
) -> float:
    """Writes what the weight demands of the cables, and its derivatives; returns the rest.

    Args:
        pose: Position [m] and angles [rad], shape (6,).
        half: Half widths of the box, shape (6,).
        load: Centre of mass in P (3) [m], weight in W (3) [N].
        rows: Components that are balanced, shape (n,).
        scale: By which they are divided, shape (n,).
        d: Gets d_0, then d^k, shape (7, n).

    Returns:
        Bound on the rest of each row of moments, before scaling.
    """
    n = rows.shape[0]
    R, axes = np.empty((3, 3)), np.empty((3, 3))
    c, ck, up, x = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    turn_axes(pose[3:], R, axes)
    for a in range(3):
        up[a] = -load[3 + a]
        c[a] = R[a, 0] * load[0] + R[a, 1] * load[1] + R[a, 2] * load[2]
    for j in range(NUMBERS + 1):
        if j == 0:
            _cross(c, up, x)
        elif j < 4:
            x[:] = 0.0
        else:
            _cross(axes[j - 4], c, ck)
            _cross(ck, up, x)
        for k in range(n):
            row = rows[k]
            force = up[row - 3] if j == 0 and row >= 3 else 0.0
            d[j, k] = (x[row] if row < 3 else force) / scale[k]
    s = half[3] + half[4] + half[5]
    return (0.5 * s * s + ROUNDING) * _size(c) * _size(up)
