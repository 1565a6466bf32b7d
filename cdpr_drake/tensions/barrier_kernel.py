"""Tensions with continuous rates: a barrier at the bounds instead of active bounds.

With a_i = (t_i - lower_i) / (upper_i - lower_i) the method minimises over 0 < a < 1

    sum_i a_i^4 / 4  -  BARRIER sum_i [ln a_i + ln (1 - a_i)]  +  |e|^2 / (2 SOFTNESS),

e = (W t + w) / (row_scale size), where size is that of the wrench at the lower bounds. This is
strictly convex and smooth, so its minimum is, by the implicit function theorem, as smooth a
function of W and w as they are of time, also where a wrench becomes infeasible. Balance is not a
constraint: the remaining error is SOFTNESS times the multiplier y of e = 0, far below the residual
of balanced tensions unless the feasible tensions are a sliver, or there are none.

The conditions for the minimum, with multipliers z and v of the bounds,

    a^3 - z + v + B' y = 0,   B a + b - SOFTNESS y = 0,   z a = BARRIER,   v (1 - a) = BARRIER,

are solved by Newton's method. Its matrix is reduced to one of the size of the wrench,

    (B D^-1 B' + SOFTNESS 1) y = B a + b - B D^-1 (a^3 - mu/a + mu/(1 - a)),
    D = 3 a^2 + z / a + v / (1 - a),

in which y needs no start. From the tensions of a step before, mu is BARRIER from the first
iteration on; else mu falls to it, tenfold at a time, from the middle of the bounds.

Source: Ueland, Sauder and Skjetne, Optimal force allocation for overconstrained cable-driven
parallel robots: continuously differentiable solutions with assessment of computational efficiency,
2020, for barrier, p-norm, penalised wrench error and Newton's method from the last step; Nocedal
and Wright, Numerical Optimization, chapter 19, for separate multipliers of the bounds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.problem import RESIDUAL_TOLERANCE, balance
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    NOT_FOUND,
    SINGULAR,
    factor,
    nearest_tensions_in,
)
from cdpr_drake.tensions.quadratic_program_kernel import balance as nearest_balanced

BARRIER = 1e-4
"""Weight of the barrier. At its fourth root, a tenth of the range, barrier and 4-norm are of one
size; with a range of 60 N a tension that is pushed to its bound stays about 1 N away."""

SOFTNESS = 1e-10
"""Inverse weight of balance: the wrench error is this times y, relative to the wrench. A multiplier
is about BARRIER over the least distance to a bound as a share of the range, so the error counts as
none until feasible tensions are within about 1e-5 of the range of their bounds. Where nothing is
feasible, y is the error over SOFTNESS, and rounding of y moves tensions by some 1e-6 of the range;
a smaller value would move them more."""

LEAST_SHARE = 1e-3
"""Least scale of the error, relative to what the range of tensions can do."""

COLD = 0.1
"""First mu without a start."""

NEAREST = 0.99
"""Largest share of the way to a bound in one iteration."""

FALLING = 0.1
"""Factor of mu from iteration to iteration."""

CONVERGED = 1e-9
"""Relative change of all distances to bounds in the last step; Newton's method squares the rest."""

STALLED = 1e-3
"""Change below which one that does not fall is rounding: where a wrench is infeasible, multipliers
are as large as SOFTNESS is small."""

MOST_ITERATIONS = 100
"""More than any problem needs; without convergence the solution counts as missed."""


@njit(cache=True)
def log_barrier(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Tensions with continuous rates, within the bounds in any case.

    The reference is the start, and does not change the result; if it is not between the bounds, the
    start is their middle. Arguments and codes are those of `TensionMethod.kernel`.
    """
    n, m = W.shape
    if not factor(W, work[:n]):
        return SINGULAR
    converged = minimize_barrier(work, W, w, lower, upper, reference, row_scale, t) > 0
    if not converged:  # once more from the middle: upper bounds are no start
        converged = minimize_barrier(work, W, w, lower, upper, upper, row_scale, t) > 0
    for i in range(m):
        if not lower[i] <= t[i] <= upper[i]:
            return SINGULAR  # NaN
    _, residual = balance(W, w, lower, upper, t)
    balanced = converged and residual <= RESIDUAL_TOLERANCE
    other = work[-1][:m]
    if balanced and factor(W, work[:n]):
        # The error that is left does not count if the nearest balanced tensions are within bounds.
        nearest_balanced(work[:n], w, t, W, other)
        inside = True
        for i in range(m):
            inside = inside and lower[i] <= other[i] <= upper[i]
        if inside:
            return FEASIBLE
    code = nearest_tensions_in(work, W, w, lower, upper, lower, other)
    return NOT_FOUND if code == FEASIBLE and not balanced else code


@njit(cache=True)
def minimize_barrier(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    start: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Writes the minimum to t; returns the number of iterations, 0 without convergence."""
    n, m = W.shape
    B, M = work[:n], work[n : 2 * n]
    a, g, z, v = work[2 * n], work[2 * n + 1], work[2 * n + 2], work[2 * n + 3]
    D, pull, step = work[2 * n + 4], work[2 * n + 5], work[2 * n + 6]
    b, y = work[2 * n + 7], work[2 * n + 8]
    _scale(W, w, lower, upper, row_scale, B, b)
    warm = True
    for i in range(m):
        warm = warm and (lower[i] < start[i] < upper[i] or lower[i] == upper[i])
    mu = BARRIER if warm else COLD
    for i in range(m):
        span = upper[i] - lower[i]
        a[i] = g[i] = 0.5
        if warm and span > 0.0:
            a[i], g[i] = (start[i] - lower[i]) / span, (upper[i] - start[i]) / span
        z[i], v[i] = mu / a[i], mu / g[i]
    iterations, last_change = 0, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        # Direction.
        for i in range(m):
            D[i] = 3.0 * a[i] * a[i] + z[i] / a[i] + v[i] / g[i]
            pull[i] = a[i] * a[i] * a[i] - mu / a[i] + mu / g[i]
        _multipliers(B, b, a, D, pull, lower, upper, M, y)
        # Length of the step.
        share, dual_share, change = 1.0, 1.0, 0.0
        for i in range(m):
            if upper[i] <= lower[i]:
                step[i] = 0.0
                continue
            force = pull[i]
            for j in range(n):
                force += B[j, i] * y[j]
            step[i] = -force / D[i]
            change = max(change, abs(step[i]) / min(a[i], g[i]))
            if step[i] < 0.0:
                share = min(share, -NEAREST * a[i] / step[i])
            elif step[i] > 0.0:
                share = min(share, NEAREST * g[i] / step[i])
            lift = mu / a[i] - z[i] - z[i] / a[i] * step[i]
            press = mu / g[i] - v[i] + v[i] / g[i] * step[i]
            change = max(change, abs(lift) / z[i], abs(press) / v[i])
            if lift < 0.0:
                dual_share = min(dual_share, -NEAREST * z[i] / lift)
            if press < 0.0:
                dual_share = min(dual_share, -NEAREST * v[i] / press)
        if not np.isfinite(change):
            break
        total = 0.0
        for i in range(m):
            if upper[i] <= lower[i]:
                continue
            lift = mu / a[i] - z[i] - z[i] / a[i] * step[i]
            press = mu / g[i] - v[i] + v[i] / g[i] * step[i]
            z[i] += dual_share * lift
            v[i] += dual_share * press
            a[i] += share * step[i]
            g[i] -= share * step[i]
            total += z[i] * a[i] + v[i] * g[i]
        if mu == BARRIER and (change <= CONVERGED or last_change <= change <= STALLED):
            iterations = iteration
            break
        last_change = change if mu == BARRIER else np.inf
        mu = max(BARRIER, min(mu, FALLING * total / (2.0 * m)))
    for i in range(m):
        span = upper[i] - lower[i]
        tension = lower[i] + a[i] * span if a[i] < g[i] else upper[i] - g[i] * span
        t[i] = min(max(tension, lower[i]), upper[i])
    return iterations


@njit(cache=True)
def _scale(
    W: Array, w: Array, lower: Array, upper: Array, row_scale: Array, B: Array, b: Array
) -> None:
    """B, shape (n, m), and b, shape (n,), of e = B a + b."""
    n, m = W.shape
    square = wrench = 0.0
    for j in range(n):
        b[j] = w[j] / row_scale[j]
        for i in range(m):
            B[j, i] = W[j, i] * (upper[i] - lower[i]) / row_scale[j]
            b[j] += W[j, i] * lower[i] / row_scale[j]
            square += B[j, i] * B[j, i]
        wrench += b[j] * b[j]
    size = np.sqrt(wrench + LEAST_SHARE * LEAST_SHARE * square)
    size = size if size > 0.0 else 1.0
    for j in range(n):
        b[j] /= size
        for i in range(m):
            B[j, i] /= size


@njit(cache=True)
def _multipliers(
    B: Array, b: Array, a: Array, D: Array, pull: Array, lower: Array, upper: Array,
    M: Array, y: Array,
) -> None:  # fmt: skip
    """Solves the reduced system for y, shape (n,), by Cholesky's factors in M."""
    n, m = B.shape[0], lower.shape[0]
    for j in range(n):
        for k in range(j + 1):
            M[j, k] = SOFTNESS if k == j else 0.0
        y[j] = b[j]
    for i in range(m):
        if upper[i] <= lower[i]:
            continue
        for j in range(n):
            weighted = B[j, i] / D[i]
            y[j] += B[j, i] * a[i] - weighted * pull[i]
            for k in range(j + 1):
                M[j, k] += weighted * B[k, i]
    for j in range(n):
        for k in range(j + 1):
            value = M[j, k]
            for o in range(k):
                value -= M[j, o] * M[k, o]
            if k < j:
                M[j, k] = value / M[k, k]
            else:
                M[j, j] = np.sqrt(max(value, SOFTNESS))
        value = y[j]
        for o in range(j):
            value -= M[j, o] * y[o]
        y[j] = value / M[j, j]
    for j in range(n - 1, -1, -1):
        value = y[j]
        for o in range(j + 1, n):
            value -= M[o, j] * y[o]
        y[j] = value / M[j, j]
