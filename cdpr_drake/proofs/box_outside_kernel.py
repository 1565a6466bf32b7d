"""Proof that no pose of a box can give a demanded wrench, or has wrench closure: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Outside**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_expansion_kernel import NUMBERS, ROUNDING

SMALL_PIVOT = 1e-9
"""Where a pivot is smaller the normal is not turned."""


TILT = 1.1
"""The normal is tilted by so much more than a product can change, so that its sign is sure."""

CENTRE_STEPS = 12
"""Newton steps towards the middle of a cone."""

TILTS = 2
"""So often; each time from what the products can change then."""


@njit(cache=True, error_model="numpy")
def _eliminate(A: Array) -> bool:
    """Solves A[:, :n] x = A[:, n:] in place by partial pivoting; False where it is singular."""
    n, columns = A.shape
    for k in range(n):
        best = k
        for a in range(k + 1, n):
            if abs(A[a, k]) > abs(A[best, k]):
                best = a
        if abs(A[best, k]) < SMALL_PIVOT:
            return False
        for c in range(k, columns):
            A[k, c], A[best, c] = A[best, c], A[k, c]
        per = 1.0 / A[k, k]
        for c in range(k, columns):
            A[k, c] *= per
        for a in range(n):
            if a != k and A[a, k] != 0.0:
                factor = A[a, k]
                for c in range(k, columns):
                    A[a, c] -= factor * A[k, c]
    return True


@njit(cache=True, error_model="numpy")
def _nearly_normal(c: Array, W: Array, some: np.ndarray) -> None:
    """Writes the n - 1 cables that c is most nearly normal to."""
    n, m = W.shape
    q = np.zeros(m)
    for i in range(m):
        for k in range(n):
            q[i] += c[k] * W[k, i]
        q[i] = abs(q[i])
    for a in range(n - 1):
        some[a] = np.argmin(q)
        q[some[a]] = np.inf


@njit(cache=True, error_model="numpy")
def _turned_normals(
    c: Array, some: np.ndarray, half: Array, W: Array, gk: Array, lengths: Array, ck: Array
) -> None:
    """Writes c_k that keep the product of c with some cables as it is, shape (6, n)."""
    n = W.shape[0]
    A = np.zeros((n, n + NUMBERS))
    for a in range(n - 1):
        i = some[a]
        value = 0.0
        for k in range(n):
            value += c[k] * W[k, i]
        for k in range(n):
            A[a, k] = W[k, i]
            for j in range(NUMBERS):
                A[a, n + j] -= c[k] * gk[j, k, i] / lengths[0, i]
        for j in range(NUMBERS):
            A[a, n + j] += value * lengths[1 + j, i] / lengths[0, i]
    for k in range(n):
        A[n - 1, k] = c[k]
    turned = _eliminate(A)
    for j in range(NUMBERS):
        for k in range(n):
            ck[j, k] = A[k, n + j] if turned and half[j] > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _tilted(
    c: Array, some: np.ndarray, W: Array, d: Array, lower: Array, upper: Array, width: Array
) -> bool:
    """Tilts c so that the sign of its product with some cables is sure; False if it cannot.

    Where the wrench meets the facet, these cables have some tension between their bounds; each is
    put on the bound that is nearer.
    """
    n, m = W.shape
    A = np.zeros((n, n + 1))
    for k in range(n):
        A[k, n] = d[k]
        A[k, n - 1] = c[k]
        for a in range(n - 1):
            A[k, a] = W[k, some[a]]
    for i in range(m):
        taken = False
        q = 0.0
        for a in range(n - 1):
            taken = taken or some[a] == i
        for k in range(n):
            q += c[k] * W[k, i]
        if not taken:
            for k in range(n):
                A[k, n] -= (upper[i] if q > 0.0 else lower[i]) * W[k, i]
    if not _eliminate(A):
        return False
    B = np.zeros((n, n + 1))
    for a in range(n - 1):
        i = some[a]
        for k in range(n):
            B[a, k] = W[k, i]
        B[a, n] = TILT * width[i] if A[a, n] > 0.5 * (lower[i] + upper[i]) else -TILT * width[i]
    for k in range(n):
        B[n - 1, k] = c[k]
        B[n - 1, n] += c[k] * c[k]
    if not _eliminate(B):
        return False
    for k in range(n):
        c[k] = B[k, n]
    return True


@njit(cache=True, error_model="numpy")
def proves_outside(
    c: Array, half: Array, g: Array, gk: Array, lengths: Array, rest: Array, d: Array,
    d_rest: Array, lower: Array, upper: Array, blame: Array,
) -> bool:  # fmt: skip
    """Whether no pose of a box can give d within the bounds; c any vector, shape (n,), is changed.

    blame, shape (6,), gets how much each half width is in the way. Other arguments as
    `box_inside_kernel.proves_inside`.
    """
    n, m = g.shape
    ck, width, some, W = (
        np.empty((NUMBERS, n)), np.empty(m), np.empty(n - 1, np.int64), np.empty((n, m))
    )  # fmt: skip
    for i in range(m):
        for k in range(n):
            W[k, i] = g[k, i] / lengths[0, i]
    _nearly_normal(c, W, some)
    for attempt in range(TILTS + 1):
        if attempt > 0 and not _tilted(c, some, W, d[0], lower, upper, width):
            return False
        _turned_normals(c, some, half, W, gk, lengths, ck)
        if separates(c, ck, half, g, gk, lengths, rest, d, d_rest, lower, upper, width, blame):
            return True
    return False


@njit(cache=True, error_model="numpy")
def separates(
    c: Array, ck: Array, half: Array, g: Array, gk: Array, lengths: Array, rest: Array, d: Array,
    d_rest: Array, lower: Array, upper: Array, width: Array, blame: Array,
) -> bool:  # fmt: skip
    """The proof itself, for any c, shape (n,), and ck, shape (6, n).

    Also writes how much each q_i can change, shape (m,), and how much each half width is in the
    way, shape (6,), which are no part of the proof.
    """
    n, m = g.shape
    gap, total, loss = 0.0, 0.0, 0.0
    blame[:] = 0.0
    rate, fk, qk, largest = np.zeros(NUMBERS), np.empty(NUMBERS), np.empty(NUMBERS), np.empty(n)
    for k in range(n):
        largest[k] = abs(c[k])
        for j in range(NUMBERS):
            largest[k] += half[j] * abs(ck[j, k])
    for k in range(n):
        gap += c[k] * d[0, k]
        total += largest[k] * abs(d[0, k])
        loss += largest[k] * d_rest[k]
    for j in range(NUMBERS):
        for k in range(n):
            rate[j] += ck[j, k] * d[0, k] + c[k] * d[1 + j, k]
            total += half[j] * largest[k] * abs(d[1 + j, k])
        for o in range(NUMBERS):
            value = 0.0
            for k in range(n):
                value += ck[o, k] * d[1 + j, k]
            loss += half[j] * half[o] * abs(value)
    for i in range(m):
        length = lengths[0, i]
        f = size = remainder = 0.0
        for k in range(n):
            f += c[k] * g[k, i]
            size += largest[k] * abs(g[k, i])
            remainder += largest[k] * rest[3 + k, i]
        change = along = 0.0
        for j in range(NUMBERS):
            qk[j] = 0.0
            if half[j] == 0.0:
                continue
            fk[j] = 0.0
            for k in range(n):
                fk[j] += ck[j, k] * g[k, i] + c[k] * gk[j, k, i]
                size += half[j] * largest[k] * abs(gk[j, k, i])
            for o in range(j + 1):
                value = 0.0
                for k in range(n):
                    value += ck[j, k] * gk[o, k, i]
                    if o != j:
                        value += ck[o, k] * gk[j, k, i]
                remainder += half[j] * half[o] * abs(value)
            qk[j] = (fk[j] - f / length * lengths[1 + j, i]) / length
            change += half[j] * abs(qk[j])
            along += half[j] * abs(lengths[1 + j, i])
        q = f / length
        shortest = length - rest[0, i] - rest[1, i]
        remainder += change * along + (abs(q) + change) * rest[2, i]
        remainder = (remainder + ROUNDING * (size + remainder)) / shortest
        size /= shortest
        total += max(abs(lower[i]), abs(upper[i])) * size
        width[i] = change + remainder
        highest = q + width[i]
        if abs(q) > width[i]:
            t = upper[i] if q > 0.0 else lower[i]
            gap -= t * q
            loss += t * remainder
            for j in range(NUMBERS):
                rate[j] -= t * qk[j]
        else:
            loss += max(upper[i] * highest, lower[i] * highest)
            for j in range(NUMBERS):
                blame[j] += upper[i] * half[j] * (abs(qk[j]) + half[j] / (length * length))
    for j in range(NUMBERS):
        loss += half[j] * abs(rate[j])
        blame[j] += half[j] * abs(rate[j])
    return gap - loss > ROUNDING * (total + loss)


@njit(cache=True, error_model="numpy")
def central_direction(W: Array, c: Array) -> bool:
    """Moves c within {c: W'c < 0} to the least of |c|^2 m / 2 - sum log(-W'c); no part of a proof.

    Returns:
        False: c is not in it, and stays as it is.
    """
    n, m = W.shape
    A, q = np.empty((n, n + 1)), np.empty(m)
    for _ in range(CENTRE_STEPS):
        for i in range(m):
            q[i] = 0.0
            for k in range(n):
                q[i] -= c[k] * W[k, i]
            if not q[i] > 0.0:
                return False
        for a in range(n):
            A[a, n] = -m * c[a]
            for i in range(m):
                A[a, n] -= W[a, i] / q[i]
            for b in range(n):
                A[a, b] = float(m) if a == b else 0.0
                for i in range(m):
                    A[a, b] += W[a, i] * W[b, i] / (q[i] * q[i])
        largest = 1.0
        for a in range(n):
            largest = max(largest, A[a, a])
        for a in range(n):
            for b in range(n + 1):
                A[a, b] /= largest
        if not _eliminate(A):
            return True
        farthest = 0.0
        for i in range(m):
            step = 0.0
            for k in range(n):
                step += A[k, n] * W[k, i]
            farthest = max(farthest, step / q[i])
        share = min(1.0, 0.9 / farthest) if farthest > 0.0 else 1.0
        for k in range(n):
            c[k] += share * A[k, n]
    return True


@njit(cache=True, error_model="numpy")
def follow_cone(c: Array, half: Array, W: Array, gk: Array, lengths: Array, ck: Array) -> None:
    """Writes c_k, shape (6, n), that keep all W'c relative to themselves; no part of a proof."""
    n, m = W.shape
    A, D = np.zeros((n, n + NUMBERS)), np.empty(m)
    for i in range(m):
        q = 0.0
        for k in range(n):
            q += c[k] * W[k, i]
        D[i] = 1.0 / (q * q) if q != 0.0 else 0.0
    for i in range(m):
        for j in range(NUMBERS):
            rate = 0.0
            if half[j] > 0.0:
                for k in range(n):
                    rate += c[k] * gk[j, k, i] / lengths[0, i]
            for a in range(n):
                A[a, n + j] -= D[i] * W[a, i] * rate
        for a in range(n):
            for b in range(n):
                A[a, b] += D[i] * W[a, i] * W[b, i]
    largest = 0.0
    for a in range(n):
        largest = max(largest, A[a, a])
    for a in range(n):
        for b in range(n + NUMBERS):
            A[a, b] /= largest
    turned = largest > 0.0 and _eliminate(A)
    for j in range(NUMBERS):
        for k in range(n):
            ck[j, k] = A[k, n + j] if turned else 0.0


@njit(cache=True, error_model="numpy")
def proves_open_cone(
    c: Array, ck: Array, half: Array, g: Array, gk: Array, rest: Array, blame: Array
) -> bool:
    """Whether every column of V has a negative product with c(delta) at every pose of a box.

    Args:
        c: Any, shape (n,).
        ck: Any, shape (6, n): c(delta) = c + sum delta_k ck[k].
        half: Half widths of the box, shape (6,).
        g: As `expand` writes it, and the next two.
        gk: V^k.
        rest: Bounds on the rest.
        blame: Gets how much of the least product each half width takes, shape (6,).
    """
    n, m = g.shape
    proven, worst = True, -np.inf
    part, mine = np.empty(n), np.empty(NUMBERS)
    for k in range(n):
        part[k] = abs(c[k])
        for j in range(NUMBERS):
            part[k] += half[j] * abs(ck[j, k])
    for i in range(m):
        f = size = 0.0
        for k in range(n):
            f += c[k] * g[k, i]
            size += part[k] * abs(g[k, i])
        least = f
        for k in range(n):
            f += part[k] * rest[3 + k, i]
        for j in range(NUMBERS):
            mine[j] = 0.0
            if half[j] == 0.0:
                continue
            value = 0.0
            for k in range(n):
                value += c[k] * gk[j, k, i] + ck[j, k] * g[k, i]
                size += half[j] * part[k] * abs(gk[j, k, i])
            f += half[j] * abs(value)
            mine[j] += half[j] * abs(value)
            for o in range(j + 1):
                value = 0.0
                for k in range(n):
                    value += ck[j, k] * gk[o, k, i]
                    if o != j:
                        value += ck[o, k] * gk[j, k, i]
                f += half[j] * half[o] * abs(value)
                mine[j] += 0.5 * half[j] * half[o] * abs(value)
                mine[o] += 0.5 * half[j] * half[o] * abs(value)
        over = f / abs(least) if least != 0.0 else np.inf
        if over > worst:
            worst = over
            for j in range(NUMBERS):
                blame[j] = mine[j]
        proven = proven and f < -ROUNDING * (size + abs(f))
    return proven
