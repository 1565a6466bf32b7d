"""A lower bound of the stability margin from constants of Lipschitz: weaker, and very cheap.

With the notation of `quadratic_bounds_kernel`, a_i the columns of K_l M, and the nominal model as
the centre, the criterion with any error of the estimate is exactly

  Pi = sum_i a_i U_i . N_i,  U = e^-f u^,
  N_i = e^g (z_v + ds x z_w) + (e^g z_w) x (c_i + db_i - dt)

as a map of v with (z_w, z_v) = K_r v, and 1 without error, as M J = 1. The difference is taken
apart, one error after the other, and each part is bounded in the spectral norm by a constant times
the radius of the error's ball:

- g alone, all others zero: K_l (T - 1) K_r with T = diag(e^g, e^g). Along g = s n, |n| = 1, its
  derivative is cos s K_l X_n K_r + sin s K_l X_n^2 K_r with X_n = diag([n]x, [n]x), so at most
  a_1 + a_2 sin G for G <= pi / 2, and a_1 + a_2 above. Here a_1 bounds |K_l X_n K_r| over all n: a
  sum of y_k A_k with |y| = 1 is at most |sum_k A_k A_k'|^(1/2) by Cauchy and Schwarz. a_2 likewise
  with the nine matrices of n_j n_k.
- dt and ds with nominal u: sum_i a_i u_i' is the part K_lv of K_l that takes the translation, so at
  most |K_lv| |W| for each metre, W being the rows of K_r that give z_w.
- db with nominal u: one shift for all points likewise; else at most sum_i |a_i| |W|, or
  sqrt(m) |K_l M| |W|, whichever is less.
- f, dp, da, db in U, with N as it then is: |U_i - u_i| <= Lambda_i (|p - a_i| F + r_bp + r_A + r_B)
  with Lambda_i = 1 / (l_i - |p - a_i| F - r_bp - r_A - r_B), since q^ in the believed platform's
  axes is e^-f (p - a_i + dp - da_i) + b_i + db_i, of which a unit vector's derivative is at most
  one over the length. |N_i| <= |W_v - [c_i]x W| + (G |c_i| + r_pc + r_s + r_B) |W| =: h_i. The sum
  over the cables is at most sum_i |a_i| h_i |U_i - u_i|, or |K_l M| times the root of the sum of
  (h_i |U_i - u_i|)^2, whichever is less.

An eigenvalue of a symmetric matrix moves by at most the norm of what is added (Weyl), and that of
the symmetric part of X is at most |X|: so the margin is at least 1 less the sum of these. There is
no bound where a cable could get the length zero. A planar robot has its three rows everywhere.

What rounding does is taken off twice, see `certified_kernel`: once for Pi, once for M J = 1.
"""

from __future__ import annotations

import math

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.stability.certified_kernel import LARGEST_ROUNDING, ROUNDING
from cdpr_drake.stability.nominal_matrices_kernel import NominalMatrices, nominal_matrices
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import packed_case, refuse_unproven

_AXES = np.array([[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
                  [[0, -1, 0], [1, 0, 0], [0, 0, 0]]], float)  # fmt: skip
"""[e_k]x of the three axes."""


def lipschitz_margins(case: StabilityCase, bounds: PerturbationBounds, poses: Array) -> Array:
    """Lower bounds of the margin over all perturbations; stable where they are positive.

    Args:
        case: Robot, scheme, target.
        bounds: What limits the perturbations.
        poses: Nominal platform poses X_WP, rows (qw, qx, qy, qz, x, y, z), shape (N, 7) [-, m].

    Returns:
        Shape (N,) [-]; minus infinity where the criterion does not exist or nothing is bounded.

    Raises:
        StabilityError: As `judge_stability` for a certificate.
    """
    refuse_unproven(case, bounds)
    arrays, rows = packed_case(case, bounds, poses)
    known = nominal_matrices(arrays, rows)
    r_A, r_B = (_point_radius(bounds, name) for name in ("exits", "anchors"))
    good = np.isfinite(known.loss)
    lost = np.full(len(rows.poses), np.inf)
    if not np.any(good):
        return -lost
    n = known.picked(good)
    K_rw = _spatial(n, n.K_r)[:, :3]
    turn = np.linalg.norm(K_rw, 2, (1, 2))
    A = n.K_l @ n.M
    columns, whole = np.linalg.norm(A, axis=1), np.linalg.norm(A, 2, (1, 2))
    to_move = np.linalg.norm(_spatial(n, np.swapaxes(n.K_l, 1, 2))[:, 3:], 2, (1, 2))
    total = bounds.d_theta_pc * _turn_constant(n, bounds.d_theta_pc)
    total += (bounds.r_pc + bounds.r_s) * to_move * turn
    alike = bounds.anchors == "common"
    anchors = np.minimum(np.sum(columns, axis=1), math.sqrt(len(arrays.A)) * whole)
    total += r_B * turn * (to_move if alike else anchors)
    reach = np.linalg.norm(rows.poses[good, None, 4:] - arrays.A, axis=2)
    arms = (arrays.B - arrays.t) @ arrays.C
    lengths = rows.poses[good, None, 4:] + np.einsum("nij,kj->nki", n.R, arrays.B) - arrays.A
    shift = bounds.d_theta_bp * reach + bounds.r_bp + r_A + r_B
    room = np.linalg.norm(lengths, axis=2) - shift
    speeds = _point_speeds(n, arms)
    speeds += turn[:, None] * (
        bounds.d_theta_pc * np.linalg.norm(arms, axis=1) + bounds.r_pc + bounds.r_s + r_B
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        changes = np.where(room > 0.0, speeds * shift / room, np.inf)
        total += np.minimum(
            np.sum(columns * changes, axis=1), whole * np.linalg.norm(changes, axis=1)
        )
    rounding = 2.0 * np.maximum(n.loss, ROUNDING)
    lost[good] = np.where(rounding <= LARGEST_ROUNDING, total + rounding, np.inf)
    return np.asarray(1.0 - lost)


def _point_radius(bounds: PerturbationBounds, directions: str) -> float:
    """Bound of the shift of one point; a corner of a cube is farther away than its sides [m]."""
    radius = bounds.r_A if directions == "exits" else bounds.r_B
    return radius * (math.sqrt(3.0) if getattr(bounds, directions) == "corners" else 1.0)


def _spatial(known: NominalMatrices, matrix: Array) -> Array:
    """With six rows (w, v), those that a planar robot cannot move being zero."""
    full = np.zeros((len(matrix), 6, matrix.shape[2]))
    full[:, known.rows] = matrix
    return full


def _turn_constant(known: NominalMatrices, largest: float) -> Array:
    """Constant of the turns of the camera, shape (N,)."""
    turns = np.zeros((3, 6, 6))
    turns[:, :3, :3], turns[:, 3:, 3:] = _AXES, _AXES
    kept = np.ix_(range(3), known.rows, known.rows)
    axes = [2] if len(known.rows) == 3 else [0, 1, 2]
    X = turns[kept][axes]
    once = _over_directions(known, X)
    twice = _over_directions(known, np.array([turns[j] @ turns[k] for j in axes for k in axes])[
        np.ix_(range(len(axes) ** 2), known.rows, known.rows)
    ])  # fmt: skip
    return np.asarray(once + twice * math.sin(min(largest, 0.5 * math.pi)))


def _over_directions(known: NominalMatrices, matrices: Array) -> Array:
    """Bound of |sum_k y_k K_l X_k K_r| over unit vectors y, shape (N,)."""
    total = np.zeros_like(known.K_l)
    for X in matrices:
        A = known.K_l @ X @ known.K_r
        total += A @ np.swapaxes(A, 1, 2)
    return np.sqrt(np.linalg.norm(total, 2, (1, 2)))


def _point_speeds(known: NominalMatrices, arms: Array) -> Array:
    """Norms of the maps from v to N_i of the nominal model, shape (N, m)."""
    K_r = _spatial(known, known.K_r)
    if len(known.rows) == 3:
        arms = arms * [1.0, 1.0, 0.0]
    maps = [
        K_r[:, 3:] - np.einsum("ijk,j,nkl->nil", _CROSS, arm, K_r[:, :3]) for arm in arms
    ]  # fmt: skip
    return np.stack([np.linalg.norm(one, 2, (1, 2)) for one in maps], axis=1)


_CROSS = np.transpose(_AXES, (1, 0, 2))
"""Of [c]x = sum_j c_j [e_j]x, as (row, j, column)."""
