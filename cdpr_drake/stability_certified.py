"""The certified verdict: a proof that no perturbation within the bounds makes a pose unstable.

`cdpr_drake.stability_blocks` bounds v' Pi v from below by |v|^2 - v' H v, where H is a sum of
quadratic forms with free parameters t > 0 and Z > 0. Any parameters give a proof; good ones are
found as a game: against a density matrix D the best ones are

  t = sqrt(tr(D b'b) / tr(D a'a)),   Z = D^-1/2 (D^1/2 (sum_k S_k D S_k) D^1/2)^1/2 D^-1/2,

and D grows where H is large, D ~ exp(sum of the H so far). It starts at the eigenvector that the
search found. After each round the largest eigenvalue of H, with the parameters of the round and
with their running geometric means for t and means for Z, is a valid bound; the best one counts.

**Rounding.** The left inverse of J is only used where the pivots of J'J stay above 1e-8 of its
diagonal, so its relative error is below 1e-5 for any rounding of relative size 1e-15 on the way,
with two powers of ten to spare; H, which is linear in it, is enlarged by that factor, and 1e-5 is
taken off the result, for |v|^2 stands for x' J^+ J z.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from cdpr_drake.arrays import Array
from cdpr_drake.stability_blocks import BALL_SIZES, BALLS, Blocks, fill_blocks, new_blocks
from cdpr_drake.stability_kernel import OUTSIDE
from cdpr_drake.stability_pose import CaseArrays, PoseRows, Work, evaluate, new_work, prepare

ROUNDING = 1e-5
"""Share by which H is enlarged, and what is taken off the result, for rounding errors."""

PIVOT = 1e-8
"""Smallest pivot of J'J, relative to its diagonal, with which anything is certified."""

FLOOR = 1e-3
"""Share of the identity in the density matrix, so that the parameters stay finite."""


@njit(cache=True)
def _well_conditioned(J: Array, planar: bool) -> bool:
    S, F = np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            for k in range(J.shape[0]):
                S[i, j] += J[k, i] * J[k, j]
        if planar:
            S[i, i] += OUTSIDE[i]
    for j in range(6):
        x = S[j, j]
        for k in range(j):
            x -= F[j, k] * F[j, k]
        if not x > PIVOT * S[j, j]:
            return False
        F[j, j] = np.sqrt(x)
        for i in range(j + 1, 6):
            y = S[i, j]
            for k in range(j):
                y -= F[i, k] * F[j, k]
            F[i, j] = y / F[j, j]
    return True


@njit(cache=True)
def _sandwich(V: Array, values: Array, out: Array) -> None:
    """out <- V diag(values) V'."""
    for i in range(6):
        for j in range(i + 1):
            x = 0.0
            for k in range(6):
                x += V[i, k] * values[k] * V[j, k]
            out[i, j] = x
            out[j, i] = x


@njit(cache=True)
def _product(X: Array, Y: Array, out: Array) -> None:
    for i in range(6):
        for j in range(6):
            x = 0.0
            for k in range(6):
                x += X[i, k] * Y[k, j]
            out[i, j] = x


@njit(cache=True)
def bound_blocks(blocks: Blocks, start: Array, rounds: int, enough: float) -> float:
    """Upper bound of v' (sum of the blocks) v / |v|^2, valid whatever the start.

    Args:
        blocks: The terms.
        start: Vector near which the bound matters first, shape (6,).
        rounds: Rounds of the game at most.
        enough: A bound below this ends it.
    """
    radius, S, bound, left, right = blocks
    total, H, D, half, back = (
        np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)),
    )  # fmt: skip
    C, X, Y, Z, Zi = (
        np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)),
    )  # fmt: skip
    best = np.inf
    for i in range(6):
        for j in range(6):
            D[i, j] = start[i] * start[j]
    for number in range(rounds):
        share = 0.3 if number == 0 else FLOOR
        for i in range(6):
            for j in range(6):
                D[i, j] *= 1.0 - share
            D[i, i] += share / 6.0
        values, V = np.linalg.eigh(D)
        for i in range(6):
            values[i] = np.sqrt(max(values[i], 0.1 * FLOOR))
        _sandwich(V, values, half)
        _sandwich(V, 1.0 / values, back)
        H[:] = 0.0
        for k in range(len(bound)):
            if bound[k] == 0.0:
                continue
            a, b = 0.0, 0.0
            for i in range(6):
                for j in range(6):
                    a += D[i, j] * left[k, i, j]
                    b += D[i, j] * right[k, i, j]
            if a <= 0.0 or b <= 0.0:  # one of the factors is zero, D being positive
                continue
            t = np.sqrt(b / a)
            f, g = 0.5 * bound[k] * t, 0.5 * bound[k] / t
            for i in range(6):
                for j in range(6):
                    H[i, j] += f * left[k, i, j] + g * right[k, i, j]
        for block in range(BALLS):
            if radius[block] == 0.0:
                continue
            C[:] = 0.0
            for k in range(BALL_SIZES[block]):
                _product(S[block, k], D, X)
                _product(X, S[block, k], Y)
                C += Y
            _product(half, C, X)
            _product(X, half, Y)
            roots, U = np.linalg.eigh(Y)
            top = max(roots[5], 1e-300)
            for i in range(6):
                roots[i] = np.sqrt(max(roots[i], 1e-8 * top))
            _sandwich(U, roots, X)
            _product(back, X, Y)
            _product(Y, back, Z)
            _sandwich(U, 1.0 / roots, X)
            _product(half, X, Y)
            _product(Y, half, Zi)
            f = 0.5 * radius[block]
            for i in range(6):
                for j in range(6):
                    H[i, j] += 0.5 * f * (Z[i, j] + Z[j, i])
            for k in range(BALL_SIZES[block]):
                _product(S[block, k], Zi, X)
                _product(X, S[block, k], Y)
                for i in range(6):
                    for j in range(6):
                        H[i, j] += 0.5 * f * (Y[i, j] + Y[j, i])
        worst = np.linalg.eigvalsh(H)[5]
        if not np.isfinite(worst):
            break
        best = min(best, worst)
        if best < enough:
            break
        # The density of the next round.
        total += H
        speed = 6.0 / np.sqrt(number + 1.0)
        values, V = np.linalg.eigh(total)
        top = values[5]
        mass = 0.0
        for i in range(6):
            values[i] = np.exp(speed * (values[i] - top) / max(best, 0.3))
            mass += values[i]
        _sandwich(V, values / mass, D)
    return best


@njit(cache=True)
def certify_pose(
    case: CaseArrays, w: Work, blocks: Blocks, start: Array, rounds: int, first_only: bool
) -> float:
    """Lower bound of the margin at the pose that `prepare` has seen; minus infinity for none."""
    if not _well_conditioned(w.J, case.planar) or not fill_blocks(case, w, blocks):
        return -np.inf
    enough = (1.0 - ROUNDING) / (1.0 + ROUNDING) if first_only else -np.inf
    top = bound_blocks(blocks, start, rounds, enough)
    return 1.0 - ROUNDING - (1.0 + ROUNDING) * top


@njit(cache=True, parallel=True)
def certified_margins(
    case: CaseArrays,
    rows: PoseRows,
    searched: Array,
    found_at: Array,
    rounds: int,
    first_only: bool,
    margins: Array,
) -> None:
    """margins <- lower bounds of the margin where the search found nothing unstable.

    Args:
        case: The case.
        rows: The poses.
        searched: Margins of the search, shape (N,); where not positive there is nothing to prove.
        found_at: Its worst perturbations, shape (N, 18 + 6 m).
        rounds: Rounds of the game at most.
        first_only: Whether a positive bound is enough.
        margins: Output, shape (N,), minus infinity where nothing is proven.
    """
    for n in prange(rows.poses.shape[0]):
        margins[n] = -np.inf
        if not searched[n] > 0.0:
            continue
        w, blocks = new_work(case), new_blocks(case.A.shape[0])
        start = np.full(6, np.sqrt(1.0 / 6.0))
        if not prepare(case, rows, n, w):
            continue
        if evaluate(case, rows, n, w, found_at[n]):
            start = np.ascontiguousarray(np.linalg.eigh(w.S)[1][:, 0])
        bound = certify_pose(case, w, blocks, start, rounds, first_only)
        margins[n] = min(bound, searched[n])
