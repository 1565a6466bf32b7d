"""The exact quadratic program of tension distribution, as a numba kernel.

In the null space of the wrench matrix the tensions nearest to a reference are the projection of a
point on a polytope, t = t_c + N' z with least |z|. The dual active-set method of Goldfarb and
Idnani, with the identity as Hessian, finds it in finitely many steps, or proves that the polytope
is empty.

Source: Goldfarb and Idnani, A numerically stable dual method for solving strictly convex quadratic
programs, Mathematical Programming 27, 1983.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.tensions.null_space_kernel import balance, factor, null_basis

SINGULAR = -2
"""Code of a kernel: the wrench matrix has not full rank, or a number is NaN."""

INFEASIBLE = -1
"""Code of a kernel: no tensions within the bounds balance the wrench; a proof."""

FEASIBLE = 1
"""Code of a kernel: the tensions balance the wrench within the bounds."""

BOUND_ROUNDING = 4e-14
"""A bound counts as kept when it is passed by less than this, relative to the largest tension,
lower bound or wanted tension; then the tension is put on it. Far below the residual a feasible
solution may have."""

DEPENDENT = 1e-13
"""A bound's normal counts as a combination of others when what is left of it is shorter."""


@njit(cache=True)
def nearest_tensions(
    W: Array, w: Array, lower: Array, upper: Array, reference: Array, t: Array
) -> int:
    """Tensions nearest to a reference that balance a wrench within bounds.

    min |t - reference|^2 subject to W t + w = 0, lower <= t <= upper.

    Args:
        W: Wrench matrix, shape (n, m).
        w: Wrench on the platform, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        reference: Wanted tensions, shape (m,) [N]; zeros give the least 2-norm.
        t: Gets the tensions, shape (m,) [N]; without meaning unless the code is FEASIBLE.

    Returns:
        FEASIBLE, INFEASIBLE or SINGULAR.
    """
    n, m = W.shape
    work = np.empty(workspace_shape(n, m))
    return nearest_tensions_in(work, W, w, lower, upper, reference, t)


@njit(cache=True)
def workspace_shape(n: int, m: int) -> Any:
    """Shape of the work space that kernels share.

    The basis and the active set of `nearest_tensions_in`, or what Newton's method of
    `barrier_kernel` needs, and one row for tensions that are asked for beside them.
    """
    return max(m + 3 * (m - n) + 6, 2 * n + 9) + 1, m + 2


@shared(types.int64(MATRIX, MATRIX, *[VECTOR] * 5))
@njit(cache=True)
def nearest_tensions_in(
    work: Array, W: Array, w: Array, lower: Array, upper: Array, reference: Array, t: Array
) -> int:
    """As `nearest_tensions`, in a work space of `workspace_shape` that the caller reuses."""
    n, m = W.shape
    if not factor(W, work[:n]):
        return SINGULAR
    balance(work[:n], w, reference, W, t)
    inside = True
    for i in range(m):
        inside = inside and lower[i] <= t[i] <= upper[i]
    if inside:  # the basis costs half of all, and nothing asks for it
        return FEASIBLE
    N = work[n:m]
    null_basis(work[:n], m, N)
    size = 0.0
    for i in range(m):
        size = max(size, abs(reference[i]))
    return project_on_polytope(t, N, lower, upper, size, work[m:])


@njit(cache=True)
def median(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Tensions nearest to the middle of the bounds, exactly. Arguments as `TensionMethod.kernel`.

    What the median method looks for; its own way there, `improved_closed_form`, stops at the first
    tensions within the bounds, which are not always the nearest, or before it finds some.

    Source: servoing thesis 1.3.4, and there Pott, An improved force distribution algorithm for
    over-constrained cable-driven parallel robots, 2014, for the goal.
    """
    m = W.shape[1]
    middle = work[-1][:m]
    for i in range(m):
        middle[i] = (lower[i] + upper[i]) / 2.0
    return nearest_tensions_in(work, W, w, lower, upper, middle, t)


@shared(types.int64(VECTOR, MATRIX, VECTOR, VECTOR, types.float64, MATRIX))
@njit(cache=True)
def project_on_polytope(
    t: Array, N: Array, lower: Array, upper: Array, size: float, work: Array
) -> int:
    """Moves t along the rows of N by the least distance that brings it within bounds.

    Args:
        t: Point, shape (m,) [N]; becomes the nearest one within bounds.
        N: Orthonormal directions, row by row, shape (r, m) or with columns to spare.
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        size: Largest number that t was computed from, whose rounding it carries [N]; 0 where t
            itself is that.
        work: Work space, shape (3 r + 6, r) or more columns.

    Returns:
        FEASIBLE, INFEASIBLE, or SINGULAR where a number is NaN; then t is without meaning.
    """
    # In one piece: in inlined parts, a call takes 3 to 5 % longer, in called ones 10 %.
    r, m = N.shape[0], t.shape[0]
    Q = work[:r]  # orthonormal basis of the active normals, column by column
    R = work[r : 2 * r]  # active normals = Q R
    C = work[2 * r : 3 * r]  # active normals, column by column
    z, d, c = work[3 * r], work[3 * r + 1], work[3 * r + 2]
    multiplier, dual, active = work[3 * r + 3], work[3 * r + 4], work[3 * r + 5]
    for i in range(m):
        size = max(size, abs(t[i]), abs(lower[i]))
    rounding = BOUND_ROUNDING * size
    q = 0
    for _ in range(50 * (m + 1)):
        # The bound that is passed by most.
        worst, row, sign = rounding, -1, 1.0
        for i in range(m):
            if lower[i] - t[i] > worst:
                worst, row, sign = lower[i] - t[i], i, 1.0
            if t[i] - upper[i] > worst:
                worst, row, sign = t[i] - upper[i], i, -1.0
        if row < 0:
            for i in range(m):
                if not lower[i] - rounding <= t[i] <= upper[i] + rounding:
                    return SINGULAR  # NaN, which no comparison finds
                t[i] = min(max(t[i], lower[i]), upper[i])
            return FEASIBLE
        for j in range(r):
            c[j] = sign * N[j, row]
        new = 0.0
        while True:
            # c = Q d + z, and c = C multiplier + z.
            for k in range(q):
                d[k] = 0.0
                for j in range(r):
                    d[k] += Q[j, k] * c[j]
            square = 0.0
            for j in range(r):
                z[j] = c[j]
                for k in range(q):
                    z[j] -= Q[j, k] * d[k]
            for k in range(q):  # once more, against cancellation
                again = 0.0
                for j in range(r):
                    again += Q[j, k] * z[j]
                d[k] += again
                for j in range(r):
                    z[j] -= Q[j, k] * again
            for j in range(r):
                square += z[j] * z[j]
            for k in range(q - 1, -1, -1):
                multiplier[k] = d[k]
                for o in range(k + 1, q):
                    multiplier[k] -= R[k, o] * multiplier[o]
                multiplier[k] /= R[k, k]
            length, drop = np.inf, -1
            for k in range(q):
                if multiplier[k] > 0.0 and dual[k] / multiplier[k] < length:
                    length, drop = dual[k] / multiplier[k], k
            violation = lower[row] - t[row] if sign > 0.0 else t[row] - upper[row]
            free = q < r and square > DEPENDENT * DEPENDENT
            if free and violation / square <= length:
                step = violation / square
                for j in range(r):
                    along = step * z[j]
                    for i in range(m):
                        t[i] += along * N[j, i]
                for k in range(q):
                    dual[k] -= step * multiplier[k]
                norm = np.sqrt(square)
                for j in range(r):
                    Q[j, q] = z[j] / norm
                    C[j, q] = c[j]
                for k in range(q):
                    R[k, q] = d[k]
                R[q, q] = norm
                dual[q] = new + step
                active[q] = row
                q += 1
                break
            if drop < 0:
                return INFEASIBLE
            if free:
                for j in range(r):
                    along = length * z[j]
                    for i in range(m):
                        t[i] += along * N[j, i]
            for k in range(q):
                dual[k] -= length * multiplier[k]
            new += length
            q -= 1
            for k in range(drop, q):
                dual[k] = dual[k + 1]
                active[k] = active[k + 1]
                for j in range(r):
                    C[j, k] = C[j, k + 1]
            for k in range(drop, q):  # factor again behind the dropped normal
                for j in range(r):
                    z[j] = C[j, k]
                for o in range(k):
                    dot = 0.0
                    for j in range(r):
                        dot += Q[j, o] * z[j]
                    R[o, k] = dot
                    for j in range(r):
                        z[j] -= dot * Q[j, o]
                norm = 0.0
                for j in range(r):
                    norm += z[j] * z[j]
                norm = np.sqrt(norm)
                R[k, k] = norm
                for j in range(r):
                    Q[j, k] = z[j] / norm
    return INFEASIBLE
