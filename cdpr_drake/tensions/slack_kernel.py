"""The tensions within bounds that leave the least wrench unbalanced, as a numba kernel."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_program_kernel import append_column
from cdpr_drake.tensions.quadratic_program_kernel import INFEASIBLE, nearest_tensions_in

GRADIENT_ROUNDING = 1e-13
"""A cable does not lessen the slack if its force along it is below this, relative to the forces."""

DEPENDENT = 1e-12
"""A cable's wrench counts as a combination of others' when what is left of it is shorter, relative
to its length."""


@njit(cache=True)
def least_slack(W: Array, w: Array, lower: Array, upper: Array, row_scale: Array, t: Array) -> bool:
    """Writes tensions of least |s| with s_i = (W t + w)_i / row_scale_i, within bounds.

    Cables enter a set of free ones while that lessens the slack, and leave it at their bounds; the
    free ones solve a least-squares problem.

    Args:
        W: Wrench matrix, shape (n, m).
        w: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        row_scale: What each row is divided by, above 0, shape (n,): a length [m] makes a moment
            comparable to forces, which have 1.
        t: Gets the tensions, shape (m,) [N].

    Returns:
        Whether the optimum was reached; False: the steps ran out.

    Source: Stark and Parker, Bounded-variable least-squares: an algorithm and applications, 1995.
    """
    n, m = W.shape
    A, length = np.empty((m, n)), np.empty(m)  # scaled columns of W
    b, slack = np.empty(n), np.empty(n)
    for k in range(n):
        b[k] = w[k] / row_scale[k]
    for i in range(m):
        square = 0.0
        for k in range(n):
            A[i, k] = W[k, i] / row_scale[k]
            square += A[i, k] * A[i, k]
        length[i] = np.sqrt(square)
        t[i] = lower[i]
    is_free, skipped = np.zeros(m, np.bool_), np.zeros(m, np.bool_)
    free = np.empty(n + 1, np.int64)
    Q, R = np.empty((n, n + 1)), np.empty((n + 1, n + 1))
    x = np.empty(n + 1)
    q = 0
    for _ in range(100 * (m + 1)):
        size = 0.0
        for k in range(n):
            slack[k] = b[k]
            size += abs(b[k])
            for i in range(m):
                slack[k] += A[i, k] * t[i]
                size += abs(A[i, k] * t[i])
        best, enters = GRADIENT_ROUNDING * size, -1
        for i in range(m):
            if is_free[i] or skipped[i] or upper[i] <= lower[i] or length[i] == 0.0:
                continue
            gain = 0.0
            for k in range(n):
                gain += A[i, k] * slack[k] / length[i]
            if t[i] <= lower[i]:
                gain = -gain
            if gain > best:
                best, enters = gain, i
        if enters < 0:
            return True
        free[q], is_free[enters] = enters, True
        q += 1
        while q > 0:
            if not _least_squares(A, b, t, is_free, free, q, Q, R, x):
                # The cable that came last gains nothing, or less than rounding shows.
                q -= 1
                is_free[free[q]], skipped[free[q]] = False, True
                break
            share, leaves = 1.0, -1
            for k in range(q):
                i = free[k]
                bound = lower[i] if x[k] < lower[i] else upper[i]
                if x[k] < lower[i] or x[k] > upper[i]:
                    here = (bound - t[i]) / (x[k] - t[i]) if x[k] != t[i] else 0.0
                    if leaves < 0 or here < share:
                        share, leaves = min(max(here, 0.0), 1.0), k
            for k in range(q):
                t[free[k]] += share * (x[k] - t[free[k]])
            if leaves < 0:
                skipped[:] = False
                break
            i = free[leaves]
            t[i] = lower[i] if x[leaves] < lower[i] else upper[i]
            if share > 0.0:
                skipped[:] = False
            elif i == enters:
                skipped[i] = True  # rounding sent it the wrong way
            is_free[i] = False
            q -= 1
            for k in range(leaves, q):
                free[k] = free[k + 1]
    return False


@njit(cache=True)
def _least_squares(
    A: Array,
    b: Array,
    t: Array,
    is_free: np.ndarray,
    free: np.ndarray,
    q: int,
    Q: Array,
    R: Array,
    x: Array,
) -> bool:
    """Writes to x[:q] the free tensions of least slack; False if their wrenches are dependent."""
    m, n = A.shape
    if q > n:
        return False
    for c in range(q):
        column = A[free[c]]
        square = 0.0
        for k in range(n):
            square += column[k] * column[k]
        if append_column(column, 1.0, c, Q, R) <= DEPENDENT * np.sqrt(square):
            return False
    rest = np.empty(n)
    for k in range(n):
        rest[k] = b[k]
        for i in range(m):
            if not is_free[i]:
                rest[k] += A[i, k] * t[i]
    for c in range(q - 1, -1, -1):
        value = 0.0
        for k in range(n):
            value -= Q[k, c] * rest[k]
        for o in range(c + 1, q):
            value -= R[c, o] * x[o]
        x[c] = value / R[c, c]
    return True


@njit(cache=True)
def slack_relaxed(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """The exact program, or tensions of least slack where it has none.

    Arguments as `TensionMethod.kernel`.
    """
    code = nearest_tensions_in(work, W, w, lower, upper, reference, t)
    if code == INFEASIBLE:
        least_slack(W, w, lower, upper, row_scale, t)
    return code
