"""The best bound that the blocks of a certificate give, found as a game.

`quadratic_bounds_kernel` bounds v' Pi v from below by |v|^2 - v' H v, where H is a sum of
quadratic forms with free parameters t > 0, Z > 0 and p > 0. Any parameters give a proof; good ones
are found as a game: against a density matrix D the best ones are

  t = sqrt(tr(D b'b) / tr(D a'a)),   Z = D^-1/2 (D^1/2 (sum_k S_k D S_k) D^1/2)^1/2 D^-1/2,

and p_k in proportion to h_k sqrt(tr(D S_k D S_k)); a vector in both a ball and a box takes what is
smaller for D. With them tr(D H) is a concave function of D with the gradient H, no choice of the
parameters brings the largest eigenvalue below it, and D climbs it by mirror ascent, D ~ exp(log D +
step H), with a step that grows while it climbs and is halved where it fell. The largest eigenvalue
of H of every round is a valid bound; the lowest one counts.

Source: for the ascent, Tsuda, Ratsch and Warmuth, Matrix exponentiated gradient updates for on-line
learning and Bregman projection, J. Machine Learning Research 6 (2005).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix
from cdpr_drake.proofs.quadratic_bounds_kernel import BALL_SIZES, BALLS, Blocks
from cdpr_drake.proofs.subdivision_kernel import BOXES

IDENTITY_SHARE = 1e-3
"""Share of the identity in the density matrix, so that the parameters stay finite."""

STEP, LONGER, SHORTER = 2.0, 1.2, 0.5
"""First step over tr(D H), and its factors after a round that climbed and after one that fell."""


@njit(cache=True, error_model="numpy")
def _sandwich(V: Array, values: Array, out: Array) -> None:
    """out <- V diag(values) V'."""
    for i in range(6):
        for j in range(i + 1):
            x = 0.0
            for k in range(6):
                x += V[i, k] * values[k] * V[j, k]
            out[i, j] = x
            out[j, i] = x


@njit(cache=True, error_model="numpy")
def _product(X: Array, Y: Array, out: Array) -> None:
    for i in range(6):
        for j in range(6):
            x = 0.0
            for k in range(6):
                x += X[i, k] * Y[k, j]
            out[i, j] = x


@njit(cache=True, error_model="numpy")
def bound_blocks(
    blocks: Blocks, base: Array, D: Array, rounds: int, enough: float, hopeless: float
) -> float:
    """Upper bound of v' (base + sum of the blocks) v / |v|^2, valid whatever the start.

    Args:
        blocks: The terms.
        base: What comes on top of them, symmetric, shape (6, 6).
        D: Density matrix to start from, shape (6, 6); becomes the last one.
        rounds: Rounds of the game at most.
        enough: A bound below this ends it.
        hopeless: It ends as well once no choice of the parameters can get below this.
    """
    # In one piece: cut into functions, certified verdicts took 5 % longer.
    radius, boxes, middle, S, bound, left, right = blocks
    logs, H, half, back = (
        np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)),
    )  # fmt: skip
    C, X, Y, Z, Zi = (
        np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)), np.empty((6, 6)),
    )  # fmt: skip
    best, square = np.inf, np.ones(9)
    spread, kept, slope, highest, step = (
        np.empty(3),
        np.empty((6, 6)),
        np.empty((6, 6)),
        -np.inf,
        STEP,
    )
    for _ in range(rounds):
        for i in range(6):
            for j in range(6):
                D[i, j] *= 1.0 - IDENTITY_SHARE
            D[i, i] += IDENTITY_SHARE / 6.0
        values, V = np.linalg.eigh(D)
        for i in range(6):
            values[i] = max(values[i], 0.1 * IDENTITY_SHARE)
        _sandwich(V, np.log(values), logs)
        for i in range(6):
            values[i] = np.sqrt(values[i])
        _sandwich(V, values, half)
        _sandwich(V, 1.0 / values, back)
        copy_matrix(base, H)
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
            square[:] = radius[block] * radius[block]
            if block < BOXES:  # the ball, or an ellipsoid about the box
                ball, box, shift = 0.0, 0.0, 0.0
                for k in range(3):
                    _product(S[block, k], D, X)
                    s = 0.0
                    for i in range(6):
                        shift -= middle[block, k] * X[i, i]
                        for j in range(6):
                            s += X[i, j] * X[j, i]
                    spread[k] = boxes[block, k] * np.sqrt(max(s, 0.0))
                    ball += s * square[k]
                    box += spread[k]
                if shift + box < np.sqrt(ball):
                    for k in range(3):
                        for i in range(6):
                            for j in range(6):
                                H[i, j] -= middle[block, k] * S[block, k, i, j]
                        share = 0.99 * spread[k] / max(box, 1e-300) + 0.01 / 3.0
                        square[k] = boxes[block, k] * boxes[block, k] / share
            C[:] = 0.0
            for k in range(BALL_SIZES[block]):
                _product(S[block, k], D, X)
                _product(X, S[block, k], Y)
                for i in range(6):
                    for j in range(6):
                        C[i, j] += square[k] * Y[i, j]
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
            for i in range(6):
                for j in range(6):
                    H[i, j] += 0.25 * (Z[i, j] + Z[j, i])
            for k in range(BALL_SIZES[block]):
                _product(S[block, k], Zi, X)
                _product(X, S[block, k], Y)
                for i in range(6):
                    for j in range(6):
                        H[i, j] += 0.25 * square[k] * (Y[i, j] + Y[j, i])
        worst = np.linalg.eigvalsh(H)[5]
        if not np.isfinite(worst):
            break
        best = min(best, worst)
        game = 0.0
        for i in range(6):
            for j in range(6):
                game += D[i, j] * H[i, j]
        if best < enough or game >= hopeless:
            break
        # The density of the next round: onwards from the best one so far.
        if game > highest:
            highest = game
            copy_matrix(logs, kept)
            copy_matrix(H, slope)
            step *= LONGER
        else:
            step *= SHORTER
        f = step / max(abs(highest), 0.1)
        for i in range(6):
            for j in range(6):
                logs[i, j] = kept[i, j] + f * slope[i, j]
        values, V = np.linalg.eigh(logs)
        top = values[5]
        mass = 0.0
        for i in range(6):
            values[i] = np.exp(values[i] - top)
            mass += values[i]
        _sandwich(V, values / mass, D)
    return best


@njit(cache=True, error_model="numpy")
def second_order_size(blocks: Blocks, D: Array) -> float:
    """About what all but the first order of the vector blocks takes off tr(D Pi)."""
    total = 0.0
    for k in range(len(blocks.bound)):
        if blocks.bound[k] == 0.0:
            continue
        a, b = 0.0, 0.0
        for i in range(6):
            for j in range(6):
                a += D[i, j] * blocks.left[k, i, j]
                b += D[i, j] * blocks.right[k, i, j]
        total += blocks.bound[k] * np.sqrt(max(a * b, 0.0))
    X = np.empty((6, 6))
    for block in range(BOXES, BALLS):
        s = 0.0
        for k in range(BALL_SIZES[block]):
            _product(blocks.S[block, k], D, X)
            for i in range(6):
                for j in range(6):
                    s += X[i, j] * X[j, i]
        total += blocks.radius[block] * np.sqrt(max(s, 0.0))
    return total
