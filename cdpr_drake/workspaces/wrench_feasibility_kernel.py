"""Can tensions within bounds balance a wrench? Yes or no for many poses, as numba kernels.

Elimination leaves n cables whose tensions follow from those of the other r = m - n. What the bounds
of all cables leave to these is an interval (r = 1) or a polygon (r = 2), which is cut until it is
empty or not. A polygon that is not empty for bounds drawn in by a little, or is empty for bounds
let out by as much, is an answer; what lies between, and r > 2, is left to the exact program of
`tensions`.

Source: Bruckmann, Pott and Hiller, 2006, for the polygon in the null space; Sutherland and Hodgman,
Reentrant polygon clipping, 1974.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pulley_kernel import pulley_jacobian
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    nearest_tensions_in,
    workspace_shape,
)

SLACK = 1e-7
"""Bounds are drawn in and let out by this share of the largest of them: far above rounding."""

SMALLEST_PIVOT = 1e-4
"""Below it elimination is left to the exact program; columns of W have forces of length 1."""

LARGEST_ENTRY = 1e4
"""Above it too: rounding is at most some 1e-16 times its square, far below `SLACK`."""

UNKNOWN = 0
"""Answer of `quick_answer`: neither proven."""


@shared(types.int64(MATRIX, VECTOR, VECTOR, types.float64, types.int64[::1], MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def quick_answer(
    table: Array, lower: Array, upper: Array, slack: float, order: np.ndarray, px: Array, py: Array
) -> int:
    """1: tensions balance the wrench; -1: none do; `UNKNOWN`.

    Args:
        table: W and, in the last column, the demanded W t, shape (n, m + 1), rows of like units;
            is overwritten.
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        slack: By which bounds are drawn in or let out [N].
        order: Work space, whole numbers, shape (m,): gets the cable of each column.
        px: Work space, shape (2, 4 m + 8).
        py: Work space, same shape.
    """
    n, m = table.shape[0], table.shape[1] - 1
    r = m - n
    if r > 2 or r < 0:
        return UNKNOWN
    for i in range(m):
        order[i] = i
    for k in range(n):
        pivot, size = -1, SMALLEST_PIVOT
        for i in range(k, m):
            if abs(table[k, i]) > size:
                pivot, size = i, abs(table[k, i])
        if pivot < 0:
            return UNKNOWN
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for row in range(n):
                table[row, k], table[row, pivot] = table[row, pivot], table[row, k]
        per, largest = 1.0 / table[k, k], 0.0
        for i in range(k + 1, m):
            table[k, i] *= per
            largest = max(largest, abs(table[k, i]))
        table[k, m] *= per
        if largest > LARGEST_ENTRY:
            return UNKNOWN
        for row in range(n):  # what is left of the columns before is not looked at again
            factor = table[row, k]
            if row != k and factor != 0.0:
                for i in range(k + 1, m + 1):
                    table[row, i] -= factor * table[k, i]
    if _leaves_something(table, lower, upper, -slack, order, px, py):
        return 1
    return UNKNOWN if _leaves_something(table, lower, upper, slack, order, px, py) else -1


@shared(types.boolean(MATRIX, VECTOR, VECTOR, types.float64, types.int64[::1], MATRIX, MATRIX))
@njit(cache=True, error_model="numpy")
def _leaves_something(
    table: Array, lower: Array, upper: Array, out: float, order: np.ndarray, px: Array, py: Array
) -> bool:
    """Whether some tensions of the cables that are not solved for keep all within bounds."""
    n, m = table.shape[0], table.shape[1] - 1
    low_x = high_x = low_y = high_y = 0.0
    if m > n:
        low_x, high_x = lower[order[n]] - out, upper[order[n]] + out
    if m > n + 1:
        low_y, high_y = lower[order[n + 1]] - out, upper[order[n + 1]] + out
    if low_x > high_x or low_y > high_y:
        return False
    # A cable whose tension stays within bounds all over the rectangle cuts nothing off, one whose
    # tension is nowhere within them leaves nothing.
    for k in range(n):
        a = table[k, n] if m > n else 0.0
        b = table[k, n + 1] if m > n + 1 else 0.0
        ax, ay = a * low_x, a * high_x
        bx, by = b * low_y, b * high_y
        most = table[k, m] - min(ax, ay) - min(bx, by)
        least = table[k, m] - max(ax, ay) - max(bx, by)
        if most < lower[order[k]] - out or least > upper[order[k]] + out:
            return False
    count, here = 4, 0
    px[0, 0], px[0, 1], px[0, 2], px[0, 3] = low_x, high_x, high_x, low_x
    py[0, 0], py[0, 1], py[0, 2], py[0, 3] = low_y, low_y, high_y, high_y
    for k in range(n):
        cable = order[k]
        a = table[k, n] if m > n else 0.0
        b = table[k, n + 1] if m > n + 1 else 0.0
        most = table[k, m] - min(a * low_x, a * high_x) - min(b * low_y, b * high_y)
        least = table[k, m] - max(a * low_x, a * high_x) - max(b * low_y, b * high_y)
        for side in range(2):
            # a x + b y <= bound, from t = d - a x - b y >= lower - out, and the other side.
            if side == 0:
                bound = table[k, m] - lower[cable] + out
                if least >= lower[cable] - out:
                    continue
            else:
                bound, a, b = upper[cable] + out - table[k, m], -a, -b
                if most <= upper[cable] + out:
                    continue
            there = 1 - here
            kept = 0
            before_x, before_y = px[here, count - 1], py[here, count - 1]
            before = bound - a * before_x - b * before_y
            outside = False
            if count + 4 > px.shape[1]:  # rounding made corners; say nothing
                return out > 0.0
            for j in range(count):
                x, y = px[here, j], py[here, j]
                now = bound - a * x - b * y
                if (now < 0.0) != (before < 0.0):
                    share = before / (before - now)
                    px[there, kept] = before_x + share * (x - before_x)
                    py[there, kept] = before_y + share * (y - before_y)
                    kept += 1
                    outside = True
                if now >= 0.0:
                    px[there, kept], py[there, kept] = x, y
                    kept += 1
                else:
                    outside = True
                before_x, before_y, before = x, y, now
            if kept == 0:
                return False
            if outside:
                here, count = there, kept
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def many_static(
    first: int, past: int, positions: Array, rotations: Array, cables: Array, load: Array,
    rows: np.ndarray, lower: Array, upper: Array, row_scale: Array, out: np.ndarray,
) -> None:  # fmt: skip
    """Writes whether tensions balance weight and wrench, for `kernel_calls.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        positions: p_WP, shape (k, 3) [m].
        rotations: R_WP, shape (k, 3, 3).
        cables: `CableSet.packed()`, shape (m, 17).
        load: Centre of mass in P (3) [m], weight in W (3) [N], further wrench (6) [N m, N].
        rows: Components of a spatial vector that are balanced, shape (n,).
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        row_scale: By which rows are divided to compare them, shape (n,) [m, -].
        out: Gets the answers, shape (k,).
    """
    m, n = cables.shape[0], rows.shape[0]
    J, lengths = np.empty((m, 6)), np.empty(m)
    table, W, w = np.empty((n, m + 1)), np.empty((n, m)), np.empty(n)
    px, py = np.empty((2, 4 * m + 8)), np.empty((2, 4 * m + 8))
    order = np.empty(m, np.int64)
    work, t, zero = np.empty(workspace_shape(n, m)), np.empty(m), np.zeros(m)
    full = np.empty(6)
    largest = 0.0
    for i in range(m):
        largest = max(largest, upper[i])
    for pose in range(first, past):
        R, p = rotations[pose], positions[pose]
        X = (
            R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2],
            p[0], p[1], p[2],
        )  # fmt: skip
        pulley_jacobian(X, cables, lengths, J)
        cx = X[0] * load[0] + X[1] * load[1] + X[2] * load[2]
        cy = X[3] * load[0] + X[4] * load[1] + X[5] * load[2]
        cz = X[6] * load[0] + X[7] * load[1] + X[8] * load[2]
        full[0] = load[6] + cy * load[5] - cz * load[4]
        full[1] = load[7] + cz * load[3] - cx * load[5]
        full[2] = load[8] + cx * load[4] - cy * load[3]
        full[3], full[4], full[5] = load[9] + load[3], load[10] + load[4], load[11] + load[5]
        finite = True
        for k in range(n):
            row, per = rows[k], 1.0 / row_scale[k]
            for i in range(m):
                value = -J[i, row]
                W[k, i], table[k, i] = value, value * per
                finite = finite and np.isfinite(value)
            w[k], table[k, m] = full[row], -full[row] * per
        if not finite:
            out[pose] = False
            continue
        answer = quick_answer(table, lower, upper, SLACK * largest, order, px, py)
        if answer == UNKNOWN:
            answer = nearest_tensions_in(work, W, w, lower, upper, zero, t)
        out[pose] = answer == FEASIBLE
