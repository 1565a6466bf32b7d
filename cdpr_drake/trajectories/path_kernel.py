"""Numba kernel of a path of poses: pose, and its first two derivatives by the path parameter.

A piece of a path has polynomials of degree 5 for the seven numbers of a pose row, quaternion wxyz
and origin, by the parameter s. The quaternion q may have any length but zero. With p = q' q^-1,
whose scalar part a is the growth of that length,

    w' = 2 vec(p),    alpha' = 2 vec(q'' q^-1) - 2 a w',

so that along a motion s(t) the platform's velocity is X' ds/dt, and its acceleration
X' d2s/dt2 + X'' (ds/dt)^2, with X' = (w', p'), X'' = (alpha', p'').
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

DEGREE = 5
"""Of the polynomials."""

POSE_NUMBERS = 7
"""Quaternion wxyz and origin."""

PIECE_NUMBERS = (DEGREE + 1) * POSE_NUMBERS
"""Coefficients of a piece: ascending powers of s, for each the seven numbers."""

POINT_SIZE = 19
"""Of a point of a path: pose row (7), X' (6), X'' (6)."""


@njit(cache=True)
def path_point(piece: Array, s: float, out: Array) -> None:
    """Writes pose and derivatives at a parameter within a piece.

    Args:
        piece: Coefficients, shape (`PIECE_NUMBERS`,), from the beginning of the piece.
        s: Parameter from the beginning of the piece [m].
        out: Gets unit quaternion wxyz and origin of P in W [m], X' = (w', p') [rad/m, -] and
            X'' = (alpha', p'') [rad/m^2, 1/m] in W, shape (`POINT_SIZE`,).
    """
    for k in range(7):
        value, first, second = 0.0, 0.0, 0.0
        for d in range(5, -1, -1):
            second = second * s + 2.0 * first
            first = first * s + value
            value = value * s + piece[7 * d + k]
        if k >= 4:
            out[k], out[k + 6], out[k + 12] = value, first, second
        elif k == 0:
            qw, dw, ddw = value, first, second
        elif k == 1:
            qx, dx, ddx = value, first, second
        elif k == 2:
            qy, dy, ddy = value, first, second
        else:
            qz, dz, ddz = value, first, second
    square = qw * qw + qx * qx + qy * qy + qz * qz
    scale = 1.0 / np.sqrt(square)
    out[0], out[1], out[2], out[3] = scale * qw, scale * qx, scale * qy, scale * qz
    # r times the conjugate of q over |q|^2 is r q^-1.
    a = (dw * qw + dx * qx + dy * qy + dz * qz) / square
    out[7] = 2.0 * (-dw * qx + dx * qw - dy * qz + dz * qy) / square
    out[8] = 2.0 * (-dw * qy + dx * qz + dy * qw - dz * qx) / square
    out[9] = 2.0 * (-dw * qz - dx * qy + dy * qx + dz * qw) / square
    out[13] = 2.0 * (-ddw * qx + ddx * qw - ddy * qz + ddz * qy) / square - 2.0 * a * out[7]
    out[14] = 2.0 * (-ddw * qy + ddx * qz + ddy * qw - ddz * qx) / square - 2.0 * a * out[8]
    out[15] = 2.0 * (-ddw * qz - ddx * qy + ddy * qx + ddz * qw) / square - 2.0 * a * out[9]


@njit(cache=True)
def path_points(breaks: Array, pieces: Array, parameters: Array, out: Array) -> None:
    """Writes `path_point` at many parameters of a path of pieces.

    Args:
        breaks: Where pieces begin and the last one ends, shape (k + 1,), growing [m].
        pieces: Their coefficients, shape (k, `PIECE_NUMBERS`).
        parameters: Shape (n,) [m]; beyond an end, that end's.
        out: Gets a row for each, shape (n, `POINT_SIZE`).
    """
    k = pieces.shape[0]
    for i in range(parameters.shape[0]):
        s = min(max(parameters[i], breaks[0]), breaks[k])
        j = min(max(np.searchsorted(breaks, s, side="right") - 1, 0), k - 1)
        path_point(pieces[j], s - breaks[j], out[i])
