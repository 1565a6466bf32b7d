"""Small linear programs over a polytope, by an exact active-set method.

Starting from a feasible point, the method walks along edges that lower the cost until none does:
the simplex method, written for a few variables and many bounds.

Source: Nocedal and Wright, Numerical Optimization, chapters 13 and 16.5.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

DIRECTION_ROUNDING = 1e-11
"""A direction shorter than this, relative to the cost, is none: the point is a minimum of its
face."""

PARALLEL = 1e-12
"""A row does not block a direction along which it changes by less than this."""


@shared(types.boolean(VECTOR, MATRIX, *[VECTOR] * 3))
@njit(cache=True)
def lowest_point(cost: Array, rows: Array, low: Array, high: Array, x: Array) -> bool:
    """Moves x to where cost' x is least, subject to low <= rows x <= high.

    Allocates its work space.

    Args:
        cost: Shape (k,).
        rows: Shape (p, k).
        low: Shape (p,), -inf where there is no bound.
        high: Shape (p,), inf where there is no bound.
        x: A feasible point, shape (k,); becomes the optimum.

    Returns:
        Whether an optimum was reached; False: the problem is unbounded, or the steps ran out.
    """
    p, k = rows.shape
    Q = np.zeros((k, k))  # orthonormal basis of the active rows
    R = np.zeros((k, k))
    active = np.empty(k, np.int64)
    side = np.empty(k)
    direction = np.empty(k)
    weights = np.empty(k)
    size = _length(cost)
    if size == 0.0:
        return True
    q = as_number(0)
    stalled = False
    for _ in range(200 * (p + k)):
        for j in range(k):
            direction[j] = -cost[j]
        for _repeat in range(2):  # twice against cancellation
            for c in range(q):
                dot = 0.0
                for j in range(k):
                    dot += Q[j, c] * direction[j]
                for j in range(k):
                    direction[j] -= dot * Q[j, c]
        length = _length(direction)
        if q == k or length <= DIRECTION_ROUNDING * size:
            # -cost = sum of weights times the outward active rows; all weights >= 0: optimum.
            for c in range(q - 1, -1, -1):
                dot = 0.0
                for j in range(k):
                    dot -= Q[j, c] * cost[j]
                for o in range(c + 1, q):
                    dot -= R[c, o] * weights[o]
                weights[c] = dot / R[c, c]
            drop, least = -1, -DIRECTION_ROUNDING * size
            for c in range(q):
                if stalled:  # Bland's rule: the lowest index, so that nothing is met twice
                    if weights[c] < -DIRECTION_ROUNDING * size and (
                        drop < 0 or active[c] < active[drop]
                    ):
                        drop = c
                elif weights[c] < least:
                    least, drop = weights[c], c
            if drop < 0:
                return True
            q -= 1
            for c in range(drop, q):
                active[c], side[c] = active[c + 1], side[c + 1]
            for c in range(drop, q):
                append_column(rows[active[c]], side[c], c, Q, R)
            continue
        step, block, blocked_side = np.inf, -1, 0.0
        for i in range(p):
            rate, value = 0.0, 0.0
            for j in range(k):
                rate += rows[i, j] * direction[j]
                value += rows[i, j] * x[j]
            rate /= length
            taken = False
            for c in range(q):
                taken = taken or active[c] == i
            if taken:
                continue
            if rate > PARALLEL and high[i] < np.inf:
                room = max(high[i] - value, 0.0) / rate
                if room < step:
                    step, block, blocked_side = room, i, 1.0
            elif rate < -PARALLEL and low[i] > -np.inf:
                room = max(value - low[i], 0.0) / -rate
                if room < step:
                    step, block, blocked_side = room, i, -1.0
        if block < 0:
            return False
        stalled = step <= 1e-14 * (1.0 + _length(x))
        for j in range(k):
            x[j] += step * direction[j] / length
        active[q], side[q] = block, blocked_side
        append_column(rows[block], blocked_side, q, Q, R)
        q += 1
    return False


@njit(cache=True)
def _length(x: Array) -> float:
    square = 0.0
    for j in range(x.shape[0]):
        square += x[j] * x[j]
    length: float = np.sqrt(square)
    return length


@njit(cache=True)
def append_column(column: Array, sign: float, c: int, Q: Array, R: Array) -> float:
    """Appends sign * column to a factorization Q R as column c, by Gram and Schmidt.

    Args:
        column: Shape (k,).
        sign: 1 or -1.
        c: Columns that Q has so far.
        Q: Orthonormal columns, shape (k, c + 1) or more; gets column c.
        R: Upper triangle, same columns; gets column c.

    Returns:
        Length of what the columns before leave of this one. If it is zero, Q gets zeros.
    """
    k = column.shape[0]
    for j in range(k):
        Q[j, c] = sign * column[j]
    for o in range(c):
        R[o, c] = 0.0
    for _repeat in range(2):  # twice against cancellation
        for o in range(c):
            dot = 0.0
            for j in range(k):
                dot += Q[j, o] * Q[j, c]
            R[o, c] += dot
            for j in range(k):
                Q[j, c] -= dot * Q[j, o]
    square = 0.0
    for j in range(k):
        square += Q[j, c] * Q[j, c]
    norm = np.sqrt(square)
    R[c, c] = norm
    if norm > 0.0:
        for j in range(k):
            Q[j, c] /= norm
    return norm
