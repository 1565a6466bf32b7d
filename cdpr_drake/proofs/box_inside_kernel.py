"""Proof that a demanded wrench can be given at every pose of a box: a numba kernel.

Notation and proof stand in `box_verdicts_kernel`, under **Inside**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_expansion_kernel import NUMBERS, ROUNDING
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, nearest_tensions_in

START_SHARE = 1e-4
"""The search for the analytic centre begins at least this share of the range within the bounds."""

NEWTON_STEPS = 30
NEWTON_END = 0.1
"""Steps towards the analytic centre end where the step is so short, in units of the room."""

LARGEST_KAPPA = 0.9

ENDLESS = 1e4
"""Over the upper bound of the search: an upper limit that no tension gets to."""


@njit(cache=True, error_model="numpy")
def _weighted_inverse(W: Array, D2: Array, L: Array) -> bool:
    """L <- Cholesky factor of W D^2 W'; False if it is not positive."""
    n, m = W.shape
    for a in range(n):
        for b in range(a + 1):
            value = 0.0
            for i in range(m):
                value += W[a, i] * D2[i] * W[b, i]
            for c in range(b):
                value -= L[a, c] * L[b, c]
            if a == b:
                if not value > 0.0:
                    return False
                L[a, a] = np.sqrt(value)
            else:
                L[a, b] = value / L[b, b]
    return True


@njit(cache=True, error_model="numpy")
def _solve(L: Array, x: Array) -> None:
    """x <- (L L')^-1 x."""
    n = L.shape[0]
    for a in range(n):
        for c in range(a):
            x[a] -= L[a, c] * x[c]
        x[a] /= L[a, a]
    for a in range(n - 1, -1, -1):
        for c in range(a + 1, n):
            x[a] -= L[c, a] * x[c]
        x[a] /= L[a, a]


@njit(cache=True, error_model="numpy")
def central_tensions(
    W: Array, d: Array, lower: Array, upper: Array, work: Array, t: Array, D2: Array, L: Array
) -> bool:
    """Writes the analytic centre of the tensions that give d, and the room of each there.

    Args:
        W: Wrench matrix, shape (n, m).
        d: Demanded wrench W t, shape (n,).
        lower: Smallest tensions, shape (m,).
        upper: Largest tensions, shape (m,), above them.
        work: Of `quadratic_program_kernel.workspace_shape`.
        t: Gets the tensions, shape (m,).
        D2: Gets squares of the room, shape (m,).
        L: Gets the Cholesky factor of W D^2 W', shape (n, n).

    Returns:
        False: there are none, or hardly any room.
    """
    n, m = W.shape
    low, high, middle, x = np.empty(m), np.empty(m), np.empty(m), np.empty(n)
    for i in range(m):
        inset = START_SHARE * (upper[i] - lower[i])
        low[i], high[i] = lower[i] + inset, upper[i] - inset
        middle[i] = 0.5 * (lower[i] + upper[i])
    if nearest_tensions_in(work, W, -d, low, high, middle, t) != FEASIBLE:
        return False
    for _ in range(NEWTON_STEPS):
        for i in range(m):
            a, b = 1.0 / (t[i] - lower[i]), 1.0 / (upper[i] - t[i])
            D2[i] = 1.0 / (a * a + b * b)
            middle[i] = a - b  # minus the gradient of the barrier
        if not _weighted_inverse(W, D2, L):
            return False
        for k in range(n):
            x[k] = 0.0
            for i in range(m):
                x[k] += W[k, i] * D2[i] * middle[i]
        _solve(L, x)
        farthest = size = 0.0
        for i in range(m):
            step = middle[i]
            for k in range(n):
                step -= W[k, i] * x[k]
            step *= D2[i]
            low[i] = step
            size += step * step / D2[i]
            farthest = max(farthest, step / (upper[i] - t[i]), -step / (t[i] - lower[i]))
        if size < NEWTON_END * NEWTON_END:
            return True
        share = min(1.0, 0.9 / farthest) if farthest > 0.0 else 1.0
        if share == 1.0 and size > 1.0:
            share = 1.0 / (1.0 + np.sqrt(size))
        for i in range(m):
            t[i] += share * low[i]
    return True


@njit(cache=True, error_model="numpy", inline="always")
def proves_inside(
    half: Array, g: Array, gk: Array, lengths: Array, rest: Array, d: Array, d_rest: Array,
    lower: Array, upper: Array, endless: bool, blamed: Array, work: Array, stretch: Array,
) -> bool:  # fmt: skip
    """Whether every pose of a box can give d within the bounds, and W is regular there.

    Args:
        half: Half widths of the box, shape (6,).
        g: V_0, shape (n, m), with the next three as `expand` writes them.
        gk: V^k, shape (6, n, m).
        lengths: l and u.v^k, shape (7, m).
        rest: Bounds on the rest, shape (3 + n, m).
        d: d_0 and d^k, shape (7, n).
        d_rest: Bound on the rest of each row of d, shape (n,).
        lower: Smallest tensions, shape (m,).
        upper: Largest tensions, shape (m,).
        endless: Whether the proof may take any positive tensions; the bounds serve to find some.
        blamed: How much of the rest of V is due to each half width, shape (6,).
        work: Of `quadratic_program_kernel.workspace_shape`.
        stretch: Gets how much of the room each of the half widths takes, shape (6,).
    """
    n, m = g.shape
    W, t, D2, L = np.empty((n, m)), np.empty(m), np.empty(m), np.empty((n, n))
    stretch[:] = half
    for i in range(m):
        for k in range(n):
            W[k, i] = g[k, i] / lengths[0, i]
    if not central_tensions(W, d[0], lower, upper, work, t, D2, L):
        return False
    P, x = np.empty((m, n)), np.empty(n)
    for k in range(n):
        x[:] = 0.0
        x[k] = 1.0
        _solve(L, x)
        for i in range(m):
            value = 0.0
            for a in range(n):
                value += W[a, i] * x[a]
            P[i, k] = D2[i] * value / lengths[0, i]
    tau, tk = np.empty(m), np.zeros((NUMBERS, m))
    for i in range(m):
        tau[i] = t[i] / lengths[0, i]
    for j in range(NUMBERS):
        stretch[j] = 0.0
        if half[j] == 0.0:
            continue
        for k in range(n):
            x[k] = d[1 + j, k]
            for i in range(m):
                x[k] += g[k, i] * tau[i] * lengths[1 + j, i] / lengths[0, i] - gk[j, k, i] * tau[i]
        for i in range(m):
            moved = 0.0
            for k in range(n):
                moved += P[i, k] * x[k]
            tk[j, i] = moved - tau[i] * lengths[1 + j, i] / lengths[0, i]
            room = t[i] - lower[i] if endless else min(t[i] - lower[i], upper[i] - t[i])
            stretch[j] = max(stretch[j], half[j] * abs(moved) * lengths[0, i] / room)
    _blame_rest(blamed, lengths, rest, lower, upper, t, P, stretch)
    if endless:
        for i in range(m):
            D2[i], t[i] = 0.0, ENDLESS * upper[i]  # bounds from here on
        return _holds(half, g, gk, lengths, rest, d, d_rest, D2, t, tau, tk, P)
    return _holds(half, g, gk, lengths, rest, d, d_rest, lower, upper, tau, tk, P)


@njit(cache=True, error_model="numpy")
def _blame_rest(
    blamed: Array, lengths: Array, rest: Array, lower: Array, upper: Array, t: Array, P: Array,
    stretch: Array,
) -> None:  # fmt: skip
    """Adds to the stretch what the rest of V takes of the room; no part of the proof."""
    m, n = P.shape
    s = 0.0
    for j in range(NUMBERS):
        s += blamed[j]
    if s == 0.0:
        return
    most = 0.0
    for i in range(m):
        off = 0.0
        for k in range(n):
            load = 0.0
            for o in range(m):
                load += rest[3 + k, o] * t[o] / lengths[0, o]
            off += abs(P[i, k]) * load
        most = max(most, off * lengths[0, i] / min(t[i] - lower[i], upper[i] - t[i]))
    for j in range(NUMBERS):
        stretch[j] += most * blamed[j] / s


@njit(cache=True, error_model="numpy")
def _holds(
    half: Array, g: Array, gk: Array, lengths: Array, rest: Array, d: Array, d_rest: Array,
    lower: Array, upper: Array, tau: Array, tk: Array, P: Array,
) -> bool:  # fmt: skip
    """The proof itself, for any tau, tk, P; other arguments as `proves_inside`."""
    n, m = g.shape
    largest = np.empty(m)  # of |tau^|
    for i in range(m):
        largest[i] = abs(tau[i])
        for j in range(NUMBERS):
            largest[i] += half[j] * abs(tk[j, i])
    rho, worst, kappa = np.empty(n), 0.0, 0.0
    for k in range(n):
        value, total = d[0, k], abs(d[0, k])
        for i in range(m):
            value -= g[k, i] * tau[i]
            total += abs(g[k, i]) * largest[i]
        bound = abs(value) + d_rest[k]
        for j in range(NUMBERS):
            if half[j] == 0.0:
                continue
            value = d[1 + j, k]
            total += half[j] * abs(value)
            for i in range(m):
                value -= g[k, i] * tk[j, i] + gk[j, k, i] * tau[i]
                total += half[j] * abs(gk[j, k, i]) * largest[i]
            bound += half[j] * abs(value)
            for o in range(j + 1):
                if half[o] == 0.0:
                    continue
                value = 0.0
                for i in range(m):
                    value += gk[j, k, i] * tk[o, i]
                    if o != j:
                        value += gk[o, k, i] * tk[j, i]
                bound += half[j] * half[o] * abs(value)
        for i in range(m):
            bound += rest[3 + k, i] * largest[i]
        rho[k] = bound + ROUNDING * (total + bound)
        worst = max(worst, rho[k])
        row = 0.0
        for a in range(n):
            value, total = 1.0 if a == k else 0.0, 1.0
            extra = 0.0
            for i in range(m):
                value -= g[k, i] * P[i, a]
                total += abs(g[k, i] * P[i, a])
                extra += rest[3 + k, i] * abs(P[i, a])
            row += abs(value) + extra
            for j in range(NUMBERS):
                if half[j] == 0.0:
                    continue
                value = 0.0
                for i in range(m):
                    value += gk[j, k, i] * P[i, a]
                    total += half[j] * abs(gk[j, k, i] * P[i, a])
                row += half[j] * abs(value)
            row += ROUNDING * (total + extra)
        kappa = max(kappa, row)
    if not kappa < LARGEST_KAPPA:
        return False
    more = kappa / (1.0 - kappa) * worst
    for i in range(m):
        length = lengths[0, i]
        off = 0.0
        for k in range(n):
            off += abs(P[i, k]) * (rho[k] + more)
        first = along = change = 0.0
        for j in range(NUMBERS):
            first += half[j] * abs(length * tk[j, i] + tau[i] * lengths[1 + j, i])
            along += half[j] * abs(lengths[1 + j, i])
            change += half[j] * abs(tk[j, i])
        longest = length + rest[0, i] + rest[1, i]
        off = first + along * change + rest[2, i] * largest[i] + longest * off
        off += ROUNDING * (off + longest * largest[i] + abs(lower[i]) + abs(upper[i]))
        middle = length * tau[i]
        if not (lower[i] + off <= middle <= upper[i] - off):
            return False
    return True
