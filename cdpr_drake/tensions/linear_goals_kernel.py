"""Tension methods that are linear programs in the null space, as one numba kernel.

What the walk of `linear_program_kernel.lowest_point` ends at is projected back on the bounds: that
takes away its rounding, and proves infeasibility where there is nothing.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.numerics.linear_program_kernel import lowest_point
from cdpr_drake.tensions.null_space_kernel import null_space
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, SINGULAR, project_on_polytope

LINEAR_PROGRAM, INFINITY_NORM, OPTIMALLY_SAFE = range(3)
"""Goals: least sum, least largest tension, largest margin to all bounds."""


@njit(cache=True)
def search(goal: int, work: Array, W: Array, w: Array, lower: Array, upper: Array, t: Array) -> int:
    """Tensions that are best for a goal; which of several that are equally good is not defined.

    With t = t_0 + N' eta all goals are linear programs in (eta, s):

        least sum:       min 1' N' eta   subject to  lower <= t <= upper
        infinity norm:   min s           subject to  lower <= t <= upper,  t <= s
        optimally safe:  max s           subject to  lower + s <= t <= upper - s

    Args:
        goal: `LINEAR_PROGRAM`, `INFINITY_NORM` or `OPTIMALLY_SAFE`.
        work: Work space of `quadratic_program_kernel.workspace_shape`.
        W: Wrench matrix, shape (n, m), m > n.
        w: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        t: Gets the tensions, shape (m,) [N].

    Returns:
        FEASIBLE, INFEASIBLE or SINGULAR.

    Source: Gazebo thesis (6.24) for the least sum; Borgstrom et al., Rapid computation of
    optimally safe tension distributions for parallel cable-driven robots, 2009.
    """
    n, m = W.shape
    r = m - n
    base, N = np.empty(m), np.empty((r, m))
    if not null_space(W, w, base, N):
        return SINGULAR
    # A start: feasible tensions, or the nearest to the middle with a margin that may be negative.
    for i in range(m):
        t[i] = base[i]
    if goal != OPTIMALLY_SAFE:
        code = project_on_polytope(t, N, lower, upper, 0.0, work[m:])
        if code != FEASIBLE:
            return code
    x, cost = np.zeros(r + 1), np.zeros(r + 1)
    rows, low, high = np.zeros((2 * m, r + 1)), np.empty(2 * m), np.empty(2 * m)
    for i in range(m):
        start = (lower[i] + upper[i]) / 2.0 if goal == OPTIMALLY_SAFE else t[i]
        for j in range(r):
            x[j] += N[j, i] * start
            rows[i, j] = rows[m + i, j] = N[j, i]
        low[i], high[i] = lower[i] - base[i], upper[i] - base[i]
        low[m + i], high[m + i] = -np.inf, np.inf
        if goal == LINEAR_PROGRAM:
            for j in range(r):
                cost[j] += N[j, i]
        elif goal == INFINITY_NORM:
            rows[m + i, r], high[m + i] = -1.0, -base[i]
        else:
            rows[i, r], rows[m + i, r] = -1.0, 1.0
            high[i], high[m + i] = np.inf, high[i]
    _put(base, N, x, t)
    if goal != LINEAR_PROGRAM:  # the least sum has no use for s, which stays at zero
        cost[r] = 1.0 if goal == INFINITY_NORM else -1.0
        x[r] = -np.inf if goal == INFINITY_NORM else np.inf
        for i in range(m):
            if goal == INFINITY_NORM:
                x[r] = max(x[r], t[i])
            else:
                x[r] = min(x[r], t[i] - lower[i], upper[i] - t[i])
    lowest_point(cost, rows, low, high, x)
    _put(base, N, x, t)
    return project_on_polytope(t, N, lower, upper, 0.0, work[m:])


@njit(cache=True)
def _put(base: Array, N: Array, eta: Array, t: Array) -> None:
    """Writes the tensions base + N' eta; eta may be longer than N."""
    r, m = N.shape
    for i in range(m):
        t[i] = base[i]
        for j in range(r):
            t[i] += N[j, i] * eta[j]


@njit(cache=True)
def linear_program(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Tensions of least sum. Arguments as `TensionMethod.kernel`."""
    return search(as_number(LINEAR_PROGRAM), work, W, w, lower, upper, t)


@njit(cache=True)
def infinity_norm(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Tensions of which the largest is least. Arguments as `TensionMethod.kernel`."""
    return search(as_number(INFINITY_NORM), work, W, w, lower, upper, t)


@njit(cache=True)
def optimally_safe(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Tensions of largest margin to all bounds. Arguments as `TensionMethod.kernel`."""
    return search(as_number(OPTIMALLY_SAFE), work, W, w, lower, upper, t)
