"""The certified verdict: a proof that no perturbation within the bounds makes a pose unstable.

`quadratic_bounds_kernel` bounds v' Pi v from below on a piece of the perturbations, which is the
proof. First the whole set is one piece. Where that proves nothing, the set is cut into pieces,
depth first, each one that is not proven into two, until all are proven or so many have been looked
at that it is given up. Where the centre of a piece is unstable itself it is given up, too. A piece
starts with the density matrix that its parent ended with.

**Rounding.** Nothing in the expansion needs the left inverse M of J to be exact: with the computed
one it bounds v' K_l M J^ K_r v for every perturbed J^. The solution of the normal equations by
Cholesky factors has a columnwise relative error below 4e-15 tr(J'J) |(J'J)^-1| for up to 16 cables
(Higham, Accuracy and stability of numerical algorithms, 2nd ed., theorems 3.5, 10.3 and 10.4), and
that of J of about 1e-15 moves M by |J| |M| 1e-15 at most, relatively. So with Frobenius norms and a
power of ten to spare the criterion differs from what is bounded by at most

  1e-13 |J|^2 |M|^2 |K_l| |M| |J^| |K_r|,   |J^|^2 <= sum_i 1 + (|c_i| + r_pc + |db_i|)^2,

which is taken off the result, or 1e-5 where that is more; nothing is certified where it is above
1e-3, for the errors are those of first order. The sums of H themselves have relative errors below
1e-7: the worst step is Z^-1, with Z of a condition below 1e4 between two factors of a condition
below 1e2. H is enlarged by 1e-5.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix
from cdpr_drake.proofs.bound_ascent_kernel import bound_blocks, second_order_size
from cdpr_drake.proofs.quadratic_bounds_kernel import Blocks, fill_blocks, new_blocks
from cdpr_drake.proofs.subdivision_kernel import (
    BOXES,
    Piece,
    best_cut,
    is_cut,
    new_piece,
    place_piece,
    shrink_box,
    whole_box,
    whole_piece,
    worst_axes,
)
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CaseArrays,
    PoseRows,
    Work,
    evaluate,
    new_work,
    prepare,
)
from cdpr_drake.stability.perturbation_samples_kernel import CORNERS
from cdpr_drake.stability.stability_case import IBVS

ROUNDING = 1e-5
"""Share by which H is enlarged, and what is taken off the result at least, for rounding errors."""

LARGEST_ROUNDING = 1e-3
"""Nothing is certified where rounding may do more than this to the criterion."""

SOLUTION_ERROR = 1e-13
"""Relative error of the left inverse over the square of the Jacobian's condition."""

MOST_CABLES = 16
"""So many cables the bound of rounding is for."""

PIECE_ROUNDS = 6
"""Rounds of the game for a piece at most."""

DEPTH = 80
"""Cuts one within the other at most."""


@njit(cache=True, error_model="numpy")
def _square(X: Array) -> float:
    total = 0.0
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            total += X[i, j] * X[i, j]
    return total


@njit(cache=True, error_model="numpy")
def rounding_error(case: CaseArrays, w: Work) -> float:
    """Bound of what rounding does to the criterion at the pose that `prepare` has seen."""
    plane = 3.0 if case.planar else 0.0  # the identity where a planar robot cannot move
    M = _square(w.M) + plane
    r_B = case.radii[7] * (np.sqrt(3.0) if case.directions[1] == CORNERS else 1.0)
    rows = 0.0
    for i in range(case.A.shape[0]):
        arm = 0.0
        for k in range(3):
            arm += (case.B[i, k] - case.t[k]) ** 2
        rows += 1.0 + (np.sqrt(arm) + case.radii[3] + r_B) ** 2
    sides = 1.0 if case.scheme == IBVS else np.sqrt(_square(w.L) * _square(w.Li))
    return float(SOLUTION_ERROR * (_square(w.J) + plane) * M * sides * np.sqrt(M * rows))


@njit(cache=True, error_model="numpy")
def prove(
    case: CaseArrays, rows: PoseRows, n: int, w: Work, piece: Piece, blocks: Blocks, D: Array,
    rounds: int, first_only: bool, loss: float,
) -> tuple[float, float]:  # fmt: skip
    """Lower bound of the margin on a piece, and the smallest eigenvalue at its centre.

    Args:
        case: The case.
        rows: The poses.
        n: Number of the pose, which `prepare` has seen.
        w: Work space.
        piece: The piece.
        blocks: Work space; becomes the blocks of the piece.
        D: Density matrix to start from; becomes the last one.
        rounds: Rounds of the game at most.
        first_only: Whether a positive bound is enough.
        loss: What rounding may do to the criterion.
    """
    if not evaluate(case, rows, n, w, piece.d):
        return -np.inf, -np.inf
    base = np.empty((6, 6))
    for i in range(6):
        for j in range(6):
            base[i, j] = -w.S[i, j]
        base[i, i] += 1.0
    if not np.isfinite(np.sum(w.S)):  # a cable of length zero
        return -np.inf, -np.inf
    centre = np.linalg.eigvalsh(w.S)[0]
    if not fill_blocks(case, w, piece, blocks) or not centre > 0.0:
        return -np.inf, centre
    enough = 1.0 - loss - 3.0 * ROUNDING if first_only else -np.inf
    top = bound_blocks(blocks, base, D, rounds, enough, 1.0)
    return 1.0 - loss - top - ROUNDING * abs(top), centre


@njit(cache=True, error_model="numpy")
def radius_weights(
    case: CaseArrays, w: Work, piece: Piece, blocks: Blocks, D: Array, weight: Array
) -> None:
    """weight <- what the margin loses per radius beyond the first order, shape (BOXES,).

    From the whole ball and half of it; only used to choose cuts.
    """
    for block in range(BOXES):
        weight[block] = 0.0
        r = piece.radius[block]
        if not is_cut(case, block):
            continue
        full = second_order_size(blocks, D) if fill_blocks(case, w, piece, blocks) else 2.0
        piece.radius[block] = 0.5 * r
        half = second_order_size(blocks, D) if fill_blocks(case, w, piece, blocks) else 1.0
        piece.radius[block] = r
        weight[block] = max(full - half, 1e-9) / (0.5 * r)


@njit(cache=True, error_model="numpy", inline="always")
def certify_pose(
    case: CaseArrays, rows: PoseRows, n: int, w: Work, start: Array, worst: Array, rounds: int,
    pieces: int, first_only: bool,
) -> float:  # fmt: skip
    """Lower bound of the margin at the pose that `prepare` has seen; minus infinity for none.

    Args:
        case: The case.
        rows: The poses.
        n: Number of the pose.
        w: Work space.
        start: Vector near which the bound matters first, shape (6,).
        worst: The worst perturbation that is known, shape (18 + 6 m,).
        rounds: Rounds of the game at most.
        pieces: Pieces at most; 1: only the whole.
        first_only: Whether a positive bound is enough. Pieces are not looked at any further then,
            either way.
    """
    loss = max(rounding_error(case, w), ROUNDING)
    if not loss < LARGEST_ROUNDING:
        return -np.inf
    m = case.A.shape[0]
    blocks, piece = new_blocks(m), new_piece(m)
    D, weight, slope = np.empty((6, 6)), np.empty(BOXES), np.empty((BOXES, 3))
    for i in range(6):
        for j in range(6):
            D[i, j] = 0.7 * start[i] * start[j]
        D[i, i] += 0.05
    whole_piece(case, piece)
    whole, _ = prove(case, rows, n, w, piece, blocks, D, rounds, first_only, loss)
    if whole > 0.0 or pieces <= 1:
        return whole
    radius_weights(case, w, piece, blocks, D, weight)
    lo, hi, Ds = np.empty((DEPTH, BOXES, 3)), np.empty((DEPTH, BOXES, 3)), np.empty((DEPTH, 6, 6))
    ball, Q = np.empty(BOXES), np.empty((BOXES, 3, 3))
    worst_axes(case, w.R, worst, Q)
    whole_box(case, ball, lo[0], hi[0])
    copy_matrix(D, Ds[0])
    top, lowest = 0, np.inf
    # Variables and no literals, for which `prove` would be compiled again.
    few, positive_will_do = min(rounds, PIECE_ROUNDS), pieces > 1
    for _ in range(pieces):
        copy_matrix(Ds[top], D)
        inside = place_piece(case, Q, ball, lo[top], hi[top], piece)
        bound, centre = prove(case, rows, n, w, piece, blocks, D, few, positive_will_do, loss)
        if bound > 0.0:
            lowest = min(lowest, bound)
            if top == 0:
                return lowest
            top -= 1
            continue
        if (inside and not centre > 0.0) or top + 2 > DEPTH:
            return whole
        for i in range(BOXES):
            for k in range(3):
                slope[i, k] = 0.0
                for a in range(6):
                    for b in range(6):
                        slope[i, k] += D[a, b] * blocks.S[i, k, a, b]
        block, axis = best_cut(case, ball, lo[top], hi[top], slope, weight)
        middle = 0.5 * (lo[top, block, axis] + hi[top, block, axis])
        copy_matrix(lo[top], lo[top + 1])
        copy_matrix(hi[top], hi[top + 1])
        copy_matrix(D, Ds[top])
        copy_matrix(D, Ds[top + 1])
        hi[top, block, axis] = lo[top + 1, block, axis] = middle
        upper = shrink_box(ball[block], lo[top + 1, block], hi[top + 1, block])
        lower = shrink_box(ball[block], lo[top, block], hi[top, block])
        if upper and lower:
            top += 1
        elif upper:
            copy_matrix(lo[top + 1], lo[top])
            copy_matrix(hi[top + 1], hi[top])
        elif not lower:  # only by rounding: the parent was not empty
            return whole
    return whole


@njit(cache=True, error_model="numpy", nogil=True)
def certified_margins(
    first: int,
    past: int,
    case: CaseArrays,
    rows: PoseRows,
    searched: Array,
    found_at: Array,
    rounds: int,
    pieces: int,
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
        pieces: Pieces of the perturbations that are looked at, at most.
        first_only: Whether a positive bound is enough.
        margins: Output, shape (N,), minus infinity where nothing is proven.
    """
    w = new_work(case)
    for n in range(first, past):
        margins[n] = -np.inf
        if not searched[n] > 0.0:
            continue
        start = np.full(6, np.sqrt(1.0 / 6.0))
        if not prepare(case, rows, n, w):
            continue
        if evaluate(case, rows, n, w, found_at[n]) and np.isfinite(np.sum(w.S)):
            start = np.ascontiguousarray(np.linalg.eigh(w.S)[1][:, 0])
        bound = certify_pose(
            case, rows, n, w, start, found_at[n], rounds, pieces, first_only
        )  # fmt: skip
        margins[n] = min(bound, searched[n])
