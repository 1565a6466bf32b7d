"""Tension methods without search, as numba kernels: pseudo-inverse, closed forms, puncture."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.tensions.null_space_kernel import balance, factor, null_space
from cdpr_drake.tensions.problem import VERDICT_ROUNDING
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, SINGULAR

NOT_FOUND = 0
"""Code of a kernel: it found no tensions within the bounds; others may."""

DYKSTRA_ROUNDS = 20_000
"""After this many rounds the alternating projections are taken to have missed."""


@njit(cache=True)
def bound_rounding(upper: Array) -> float:
    """How far a tension may be beyond its bound and still count as on it [N]."""
    size = 1.0
    for i in range(upper.shape[0]):
        size = max(size, upper[i])
    return VERDICT_ROUNDING * size


@njit(cache=True)
def within(t: Array, lower: Array, upper: Array) -> bool:
    """Whether tensions, shape (m,) [N], keep their bounds up to rounding."""
    rounding = bound_rounding(upper)
    inside = True
    for i in range(t.shape[0]):
        # NaN is not within either.
        inside = inside and lower[i] - rounding <= t[i] <= upper[i] + rounding
    return inside


@njit(cache=True)
def toward(W: Array, w: Array, wanted: Array, t: Array) -> bool:
    """Writes the balanced tensions nearest to wanted ones, bounds aside; False if W is singular.

    t = t_w - W^+ (w + W t_w). Arguments as `quadratic_program_kernel.nearest_tensions`.
    """
    n, m = W.shape
    A = np.empty((n, m + 2))
    if not factor(W, A):
        return False
    balance(A, w, wanted, W, t)
    return True


@njit(cache=True)
def pseudo_inverse(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """t = -W^+ w: the least tensions, which know no bounds. Arguments as `TensionMethod.kernel`.

    Source: Gazebo thesis (6.26).
    """
    if not toward(W, w, np.zeros(t.shape[0]), t):
        return SINGULAR
    return FEASIBLE if within(t, lower, upper) else NOT_FOUND


@njit(cache=True)
def closed_form(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """t = t_m - W^+ (w + W t_m): nearest to the middle of the bounds, shape (m,) [N].

    Arguments as `TensionMethod.kernel`.

    Source: Gazebo thesis (6.27), (6.28), corrected; Pott, Bruckmann and Mikelsons, Closed-form
    force distribution for parallel wire robots, 2009.
    """
    if not toward(W, w, (lower + upper) / 2.0, t):
        return SINGULAR
    return FEASIBLE if within(t, lower, upper) else NOT_FOUND


@njit(cache=True)
def improved_closed_form(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Closed form that puts the tension farthest out of its bounds on its bound and tries again.

    Each time one cable less is free; it gives up when the free cables no longer span the wrench.
    Arguments as `TensionMethod.kernel`.

    Source: Gazebo thesis (6.30)-(6.32); Pott, An improved force distribution algorithm for
    over-constrained cable-driven parallel robots, 2014.
    """
    n, m = W.shape
    free = np.arange(m)
    left = w.copy()
    count = m
    rounding = bound_rounding(upper)
    while count >= n:
        part = np.ascontiguousarray(W[:, free[:count]])
        some = np.empty(count)
        middle = np.empty(count)
        for k in range(count):
            middle[k] = (lower[free[k]] + upper[free[k]]) / 2.0
        if not toward(part, left, middle, some):
            return SINGULAR if count == m else NOT_FOUND
        worst, out = 0.0, -1
        for k in range(count):
            i = free[k]
            t[i] = some[k]
            beyond = max(lower[i] - t[i], t[i] - upper[i])
            if beyond > rounding and beyond > worst:
                worst, out = beyond, k
        if out < 0:
            return FEASIBLE if within(t, lower, upper) else NOT_FOUND
        if count == n:
            return NOT_FOUND
        i = free[out]
        t[i] = lower[i] if t[i] < lower[i] else upper[i]
        for j in range(n):
            left[j] += W[j, i] * t[i]
        count -= 1
        for k in range(out, count):
            free[k] = free[k + 1]
    return NOT_FOUND


@njit(cache=True)
def puncture(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """From the closed form straight towards the lowest tensions, until a bound is met.

    Misses where the closed form does. Arguments as `TensionMethod.kernel`.

    Source: Mueller, Reichert and Bruckmann, Analysis of a real-time capable cable force
    computation method, 2015.
    """
    code = closed_form(work, W, w, lower, upper, reference, row_scale, t)
    if code != FEASIBLE:
        return code
    low = np.empty(t.shape[0])
    toward(W, w, lower, low)
    share, rounding = 1.0, bound_rounding(upper)
    for i in range(t.shape[0]):
        change = low[i] - t[i]
        if change < -rounding:
            share = min(share, max(t[i] - lower[i], 0.0) / -change)
        elif change > rounding:
            share = min(share, max(upper[i] - t[i], 0.0) / change)
    for i in range(t.shape[0]):
        t[i] += share * (low[i] - t[i])
    return FEASIBLE


@njit(cache=True)
def kernel_line(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """One redundant cable: t = -W^+ w + lambda h, lambda in the middle of what the bounds allow.

    Arguments as `TensionMethod.kernel`, with m = n + 1.

    Source: Gazebo thesis (6.33); its choice of lambda, (6.34)-(6.35), knows no upper bounds.
    """
    n, m = W.shape
    N = np.empty((m - n, m))
    if not null_space(W, w, t, N):
        return SINGULAR
    least, most = -np.inf, np.inf
    for i in range(m):
        h = N[0, i]
        if abs(h) > 1e-14:
            a, b = (lower[i] - t[i]) / h, (upper[i] - t[i]) / h
            least, most = max(least, min(a, b)), min(most, max(a, b))
    middle = (least + most) / 2.0
    for i in range(m):
        t[i] += middle * N[0, i]
    return FEASIBLE if within(t, lower, upper) else NOT_FOUND


@njit(cache=True)
def dykstra(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """`alternating_projections` from the middle; arguments as `TensionMethod.kernel`."""
    return alternating_projections(
        W, w, lower, upper, (lower + upper) / 2.0, as_number(DYKSTRA_ROUNDS), t
    )


@njit(cache=True)
def alternating_projections(
    W: Array, w: Array, lower: Array, upper: Array, start: Array, rounds: int, t: Array
) -> int:
    """Projections on balance and bounds in turn, which converge to the point nearest to a start.

    They end at the first feasible tensions.

    Args:
        W: Wrench matrix, shape (n, m).
        w: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        start: Wanted tensions, shape (m,) [N].
        rounds: After how many rounds it gives up.
        t: Gets the tensions, shape (m,) [N].

    Source: Hassan and Khajepour, Analysis of bounded cable tensions in cable-actuated parallel
    manipulators, 2011; Boyle and Dykstra, 1986.
    """
    n, m = W.shape
    r = m - n
    N = np.empty((r, m))
    base = np.empty(m)
    if not null_space(W, w, base, N):
        return SINGULAR
    point = start.copy()
    correction = np.zeros(m)
    shares = np.empty(r)
    for _ in range(rounds):
        # On the balanced tensions; a linear set needs no correction.
        for j in range(r):
            shares[j] = 0.0
            for i in range(m):
                shares[j] += N[j, i] * point[i]
        for i in range(m):
            t[i] = base[i]
            for j in range(r):
                t[i] += N[j, i] * shares[j]
        if within(t, lower, upper):
            return FEASIBLE
        for i in range(m):
            raw = t[i] + correction[i]
            point[i] = min(max(raw, lower[i]), upper[i])
            correction[i] = raw - point[i]
    return NOT_FOUND
