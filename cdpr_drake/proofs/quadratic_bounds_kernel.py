"""Quadratic forms that bound v' Pi v from below: a proof that no perturbation makes it negative.

This is the proof behind the certified verdict; it is this project's own. `fill_blocks` writes its
blocks, `linear_forms_kernel.cable_remainder` its remainders, `bound_ascent_kernel` finds their free
parameters, and `certified_kernel` cuts the perturbations into pieces and counts what is rounded.

Only perturbations of the estimate are covered, and of the object only its position under PBVS. The
proof is an expansion about one perturbation, the centre of a piece of `subdivision_kernel`, that
holds for the whole piece; with the nominal model as the centre the piece may be everything.

**Notation.** All vectors in the axes of the centre's camera frame C. v any vector of R^6,
x = K_l' v, z = K_r v, w = (J^+)' x with the nominal J; of the centre: J_c, X = J^+ J_c, y = X' x;
cable i has the vector q_i = l_i u_i from exit to anchor point, the anchor's arms b_i from P and c_i
from C, and n_i = z_v + z_w x c_i, so that (J_c z)_i = u_i . n_i. Perturbations away from the
centre: turns exp(f), exp(g) of platform and camera with |f| <= F, |g| <= G, shifts dp, dt, ds of
platform, camera and object, da_i, db_i of the points. A common shift of the exit points is one of
the platform; a common shift h of the anchor points is one of the platform by h and of the camera by
-h. Both are counted there, r_bp and r_pc being enlarged, and da_i, db_i stay for the others. Then,
exactly,

  v' Pi v = sum_i w_i U_i . N_i,   U = e^-f u^,   q^_i = q_i + dp - da_i + (e^f - 1) b_i + e^f db_i,
  N_i = e^g (z_v + ds x z_w) + (e^g z_w) x (c_i + db_i - dt).

A planar robot adds |v|^2 of the components that it cannot move to both sides.

**Order 0.** sum_i w_i u_i . n_i = v' Pi_c v, with Pi_c that of the centre; 1 for the nominal model.

**Order 1**, with P_i = 1 - u_i u_i', U1 = P (dp + f x b - da + db) / l - f x u, and
N1 = n_g + m, n_g = g x z_v + (g x z_w) x c, m = (ds + dt) x z_w + z_w x db:

  dp:   sum_i w_i (P_i dp / l_i) . n_i
  f:    sum_i w_i (P_i (f x b_i) / l_i - f x u_i) . n_i
  g:    y_w . (g x z_w) + y_v . (g x z_v)            (the sum over the cables is y . (g x z))
  dt, ds:  y_v . ((dt + ds) x z_w)   (at most (r_pc + r_s) |y_v| |z_w|, a product below)
  da_i: -w_i (P_i da_i / l_i) . n_i
  db_i: w_i db_i . (P_i n_i / l_i + u_i x z_w)

**Order 2** is kept as forms in dp, f and g: with u2(e) = -(u . e) P e / l^2 - |P e|^2 u / (2 l^2),
the second order of a unit vector,

  U2 = u2(dp + f x b) + P (f x (f x b)) / (2 l) - f x (P (dp + f x b) / l) + f x (f x u) / 2,
  sum_i w_i U2_i . n_i + w_i (P_i (dp + f x b_i) / l_i - f x u_i) . n_g,i,

bounded as |sum_kl dp_k f_l v' Q_kl v| <= r_bp F |(v' Q_kl v)_kl| and so on, where dp_k dp_l and
f_k f_l are six numbers with the weights 1 and sqrt(2).

**Remainder**, per cable. e = r_bp + F |b| and o = |da| + |db| bound the shift of q at first order,
E = (e + o) / l, which must stay below 0.9; r = r_pc + r_s.

- lin: |u^ - u - P (q^ - q) / l|. The sine s of the angle between u and u^ is at most E. The part
  along u is 1 - cos <= a s^2 with a = 1 / (1 + sqrt(1 - E^2)), that across is s |1 - |q^| / l| <=
  s (a s^2 + sqrt(E^2 - s^2)). With t = s^2 / E^2 the sum of their squares is at most
  E^4 (a^2 t^2 + t (1 - t) + 2 a E t^2 sqrt(1 - t) + a^2 E^2 t^3), where t^2 sqrt(1 - t) < 0.2863,
  and a^2 t^2 + t - t^2 <= 1 / (4 (1 - a^2)) if a^2 <= 1/2, else a^2. With e^f:
  |q^ - q - (its linear part)| <= F^2 |b| / 2 + F |db| =: o2, so lin is that sum plus o2 / l.
- chi = E sqrt(2 a) bounds |u^ - u|, the chord of that angle, and chi + F bounds |U - u|.
- mu = lin + F chi + F^2 / 2 + o / l bounds |U - u - (U1 without da, db)|, since
  U = u^ - f x u^ + O(F^2 / 2).
- |u^ - u - P (q^ - q) / l - u2(q^ - q)|: in the plane of u and q^ - q, (q^ - q) / l is a complex
  number zeta with |zeta| <= E, u is 1, and u^ = exp(i theta), theta = Im log(1 + zeta) =
  Im zeta - Im zeta^2 / 2 + r3 with |r3| <= E^3 / (3 (1 - E)) and |theta| <= E / sqrt(1 - E^2). So
  the difference is at most |theta|^3 / 6 + |r3| + |(Im zeta)^2 - theta^2| / 2, the last one at most
  (E^2 / 2 + |r3|) (E + |theta|) / 2.
- |u2(e)| <= |e|^2 / (sqrt(3) l^2), hence |u2(e + o) - u2(e)| <= (2 |e| |o| + |o|^2) / (sqrt(3)
  l^2); here with o + o2 in place of o.
- |e^f - 1 - fx - fx fx / 2| <= F^3 / 6, |e^f - 1 - fx| <= F^2 / 2, |e^f - 1| <= F. So
  U - u - U1 - U2 is at most the last two bounds plus (F^3 |b| / 6 + F |db|) / l + F (lin + o / l) +
  F^2 chi / 2 + F^3 / 6, which goes with |n|.
- |n_g| <= G |n| + G |c| |z_w|, as n_g = g x n - z_w x (g x c); it goes with mu.
- N - n - n_g - m = r_N: (e^g - 1 - gx) applied to z as to a twist, at most G^2 |n| / 2 +
  G^2 |c| |z_w|, and G (r + |db|) |z_w|. Both go with |U - u|. With u itself the first sums to
  at most G^2 (|y_v| |z_v| + |y_w| |z_w|) / 2, r's part of the second to G r |y_v| |z_w|, and
  G |db| |z_w| stays for each cable.
- (U - u) . m: with m's part of dt and ds, -f x u sums to at most F r |y_v| |z_w|; P dp / l to
  r_bp r |(sum_i w_i P_i / l_i) | |z_w| and P (f x b) / l likewise, in the norm of all nine numbers,
  each linear in v; what is left of U - u is at most mu. m's part of db: (chi + F) |db| |z_w|.

**Blocks.** What is left are sums of two kinds of terms, and each is bounded by a quadratic form for
any choice of its free parameter:

  c |a v| |b v|           <= c / 2 v' (t a'a + b'b / t) v           for every t > 0,
  r |(v' S_k v)_k|        <= r / 2 v' (Z + sum_k S_k Z^-1 S_k) v    for every Z > 0,

the second since y . (v' S_k v)_k = sum_k (y_k Z^1/2 v) . (Z^-1/2 S_k v) for a unit vector y. The
first three vectors lie in boxes besides, |y_k - m_k| <= h_k: then y_k = m_k + e_k with
sum_k p_k (e_k / h_k)^2 <= 1 for any p > 0 of sum 1, so that sum_k y_k v' S_k v is
sum_k m_k v' S_k v plus such a term with h_k S_k / sqrt(p_k) and r = 1. If the sum H of all these
forms and of 1 - Pi_c has its largest eigenvalue below 1, the criterion holds on the piece, and
1 - that eigenvalue is a lower bound of the margin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector
from cdpr_drake.proofs.linear_forms_kernel import (
    add_cross,
    add_curvature,
    add_outer,
    add_row,
    add_with_turn,
    cable_remainder,
    cross,
    cross_rows,
    forms_along,
    gram,
    part_across,
)
from cdpr_drake.proofs.subdivision_kernel import BOXES, Piece
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, Work
from cdpr_drake.stability.criterion_kernel import OUTSIDE, turn_after
from cdpr_drake.stability.perturbation_samples_kernel import COMMON, CORNERS
from cdpr_drake.stability.stability_case import IBVS, PBVS

BALLS = 8
"""Vector blocks: f, dp, g, and of second order dp with f, dp with g, dp with dp, ff, f with g."""

BALL_SIZES = np.array([3, 3, 3, 9, 9, 6, 6, 9])
"""Numbers of their matrices."""

ROOT_2 = np.sqrt(2.0)


class Blocks(NamedTuple):
    """The terms of one piece; unused ones have the bound 0.

    Attributes:
        radius: Bounds r of the vector blocks, shape (BALLS,).
        half: Half the edges of the boxes that the first BOXES vectors lie in besides, shape
            (BOXES, 3).
        middle: Their midpoints, shape (BOXES, 3).
        S: Their symmetric matrices, shape (BALLS, 9, 6, 6).
        bound: Bounds c of the products, shape (n,).
        left: a'a, shape (n, 6, 6).
        right: b'b, shape (n, 6, 6).
    """

    radius: Array
    half: Array
    middle: Array
    S: Array
    bound: Array
    left: Array
    right: Array


@njit(cache=True, error_model="numpy")
def new_blocks(m: int) -> Blocks:
    """Room for the blocks of m cables."""
    n = 8 * m + 5
    return Blocks(
        np.zeros(BALLS), np.zeros((BOXES, 3)), np.zeros((BOXES, 3)), np.zeros((BALLS, 9, 6, 6)),
        np.zeros(n), np.zeros((n, 6, 6)), np.zeros((n, 6, 6)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _add_product(weight: Array, rows: Array, c: float, blocks: Blocks, at: int) -> int:
    """Adds the product c |weight v| |rows v| at index `at`; returns the next index."""
    blocks.bound[at] = c
    for j in range(6):
        for k in range(6):
            blocks.left[at, j, k] = weight[j] * weight[k]
    gram(rows, blocks.right[at])
    return at + 1


@njit(cache=True, error_model="numpy")
def _add_points(
    weight: Array,
    rows: Array,
    radius: float,
    direction: int,
    axes: Array,
    planar: bool,
    blocks: Blocks,
    at: int,
) -> int:
    """Adds a point's own ball, or its cube along the rows of `axes` in C; common ones have none."""
    if direction == COMMON:
        return at
    if direction != CORNERS:
        return _add_product(weight, rows, radius, blocks, at)
    one = np.empty((1, 6))
    for k in range(2 if planar else 3):
        for j in range(6):
            one[0, j] = axes[k, 0] * rows[0, j] + axes[k, 1] * rows[1, j] + axes[k, 2] * rows[2, j]
        at = _add_product(weight, one, radius, blocks, at)
    return at


class Centre(NamedTuple):
    """The centre of a piece.

    Attributes:
        x: Rows of x in v, shape (6, 6): K_l' v.
        y: Those of X' x, (w, v), shape (6, 6).
        z: Those of K_r v, (w, v), shape (6, 6).
        C, D: R_PC and R_WC, shape (3, 3).
        p: p_WP, shape (3,) [m].
    """

    x: Array
    y: Array
    z: Array
    C: Array
    D: Array
    p: Array


class Cable(NamedTuple):
    """A cable at the centre, in C.

    Attributes:
        b, c: Anchor point from P and from C, shape (3,) [m].
        u: Unit vector from exit to anchor point, shape (3,).
        weight: Row of w_i in v, shape (6,).
        n: Rows of the anchor point's velocity z_v - c x z_w in v, shape (3, 6).
        across: P n / l, shape (3, 6).
        uz: u x z_w, shape (3, 6).
        fb, fu: e_k x b and e_k x u, rows k, shape (3, 3).
        pe, pfb: P e_k / l and P (e_k x b) / l, likewise.
    """

    b: Array
    c: Array
    u: Array
    weight: Array
    n: Array
    across: Array
    uz: Array
    fb: Array
    fu: Array
    pe: Array
    pfb: Array


@njit(cache=True, error_model="numpy")
def fill_blocks(case: CaseArrays, w: Work, piece: Piece, blocks: Blocks) -> bool:
    """Fills the blocks of a piece whose centre `evaluate` has just seen; False without a proof."""
    F, G = piece.radius[0], piece.radius[2]
    seen, size_A, size_B = _sizes(case)
    radius, _, _, S, bound, left, right = blocks
    _start_blocks(piece, blocks)
    centre = Centre(
        np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), np.empty((3, 3)), np.empty((3, 3)),
        np.empty(3),
    )  # fmt: skip
    _fill_centre(case, w, piece, centre)
    C, D, zw = centre.C, centre.D, centre.z[:3]
    at = _add_without_cables(centre, F, G, seen, blocks)
    cable = Cable(
        np.empty(3), np.empty(3), np.empty(3), np.empty(6), np.empty((3, 6)), np.empty((3, 6)),
        np.empty((3, 6)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)),
    )  # fmt: skip
    shifted, turned, gamma = np.zeros((9, 6)), np.zeros((9, 6)), np.empty((3, 6))
    for i in range(case.A.shape[0]):
        length = _fill_cable(case, w, i, centre, cable)
        _add_first_order(cable, S)
        _add_shifts(cable, centre, length, case.planar, S)
        _add_turns(cable, centre, length, case.planar, S)
        # What every cable has for itself.
        b, c, weight = cable.b, cable.c, cable.weight
        arm = np.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
        lever = np.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        lone = size_A + size_B
        known = radius[1] + F * arm
        if not (known + lone) / length < 0.9:
            return False
        slope, swing = cable_remainder(known, arm, lever, length, F, G, seen, lone, size_B)
        for k in range(3):
            for j in range(3):
                for o in range(6):
                    shifted[3 * k + j, o] += cable.pe[k, j] * weight[o]
                    turned[3 * k + j, o] += cable.pfb[k, j] * weight[o]
        for row in range(3):
            for j in range(6):
                gamma[row, j] = cable.across[row, j] + cable.uz[row, j]
        at = _add_product(weight, cable.n, slope, blocks, at)
        at = _add_product(weight, zw, swing, blocks, at)
        r, codes, flat = case.radii, case.directions, case.planar
        at = _add_points(weight, cable.across, r[6], codes[0], D, flat, blocks, at)
        at = _add_points(weight, gamma, r[7], codes[1], C, flat, blocks, at)
    # (P (dp + f x b) / l) . ((dt + ds) x z_w), summed over the cables.
    bound[at], bound[at + 1] = radius[1] * seen, F * seen
    gram(shifted, left[at])
    gram(turned, left[at + 1])
    gram(zw, right[at])
    gram(zw, right[at + 1])
    # From axes of the centre's C to those of the piece.
    forms_along(piece.axes[0], C, True, S[0])
    forms_along(piece.axes[1], D, True, S[1])
    forms_along(piece.axes[2], C, False, S[2])
    return True


@njit(cache=True, error_model="numpy")
def _sizes(case: CaseArrays) -> tuple[float, float, float]:
    """Bounds of dt and ds together, and of an exit and an anchor point's own shift [m]."""
    seen = case.radii[3]  # dt and ds; schemes other than PBVS see no shift, or are refused
    if case.scheme == PBVS:
        seen += case.radii[5]
    if case.directions[1] == COMMON:
        seen += case.radii[7]
    diagonal = np.sqrt(2.0) if case.planar else np.sqrt(3.0)
    size_A = case.radii[6] * diagonal if case.directions[0] == CORNERS else case.radii[6]
    size_B = case.radii[7] * diagonal if case.directions[1] == CORNERS else case.radii[7]
    if case.directions[0] == COMMON:
        size_A = 0.0
    if case.directions[1] == COMMON:
        size_B = 0.0
    return seen, size_A, size_B


@njit(cache=True, error_model="numpy")
def _start_blocks(piece: Piece, blocks: Blocks) -> None:
    """No terms yet, within the piece's bounds."""
    radius, half, middle, S, bound, _, _ = blocks
    S[:] = 0.0
    bound[:] = 0.0
    copy_vector(piece.radius, radius)
    copy_matrix(piece.half, half)
    copy_matrix(piece.middle, middle)
    F, G = piece.radius[0], piece.radius[2]
    radius[3], radius[4], radius[5] = radius[1] * F, radius[1] * G, radius[1] * radius[1]
    radius[6], radius[7] = F * F, F * G


@njit(cache=True, error_model="numpy")
def _fill_centre(case: CaseArrays, w: Work, piece: Piece, centre: Centre) -> None:
    x, y, z, C, D, p = centre
    for i in range(6):
        for j in range(6):
            if case.scheme == IBVS:
                x[i, j] = z[i, j] = 1.0 if i == j else 0.0
            else:
                x[i, j], z[i, j] = w.L[j, i], w.Li[i, j]
            if case.planar and OUTSIDE[i] > 0.0:
                x[i, j] = z[i, j] = 0.0
    for i in range(6):
        for j in range(6):
            for k in range(6):
                y[i, j] += w.X[k, i] * x[k, j]
    R = np.empty((3, 3))
    turn_after(w.R, piece.d[0:3], R)
    turn_after(case.C, piece.d[6:9], C)
    for i in range(3):
        p[i] = w.p[i] + piece.d[3 + i]
        for j in range(3):
            D[i, j] = R[i, 0] * C[0, j] + R[i, 1] * C[1, j] + R[i, 2] * C[2, j]


@njit(cache=True, error_model="numpy")
def _add_without_cables(centre: Centre, F: float, G: float, seen: float, blocks: Blocks) -> int:
    """Adds the terms in which no cable has a part; returns the next index of products."""
    yw, yv, zw, zv = centre.y[:3], centre.y[3:], centre.z[:3], centre.z[3:]
    at = 0
    for size, one, two in (
        (0.5 * G * G, yv, zv),
        (0.5 * G * G, yw, zw),
        ((1.0 + F + G) * seen, yv, zw),
    ):
        blocks.bound[at] = size
        gram(one, blocks.left[at])
        gram(two, blocks.right[at])
        at += 1
    e, out, other = np.zeros(3), np.empty((3, 6)), np.empty((3, 6))
    for k in range(3):
        e[:] = 0.0
        e[k] = 1.0
        cross_rows(e, zw, out)
        cross_rows(e, zv, other)
        for row in range(3):
            add_outer(yw[row], out[row], 1.0, blocks.S[2, k])
            add_outer(yv[row], other[row], 1.0, blocks.S[2, k])
    return at


@njit(cache=True, error_model="numpy")
def _fill_cable(case: CaseArrays, w: Work, i: int, centre: Centre, cable: Cable) -> float:
    """Fills what cable i has at the centre; returns its length [m].

    J's rows hold c x u and u in C; the arm b from P needs the camera's position.
    """
    x, _, z, C, D, p = centre
    b, c, u, weight, n, across, uz, fb, fu, pe, pfb = cable
    zw, zv = z[:3], z[3:]
    q, e = np.empty(3), np.empty(3)
    for j in range(3):
        b[j] = c[j] = 0.0
        for k in range(3):
            b[j] += C[k, j] * case.B[i, k]
            c[j] += C[k, j] * (case.B[i, k] - case.t[k])
        q[j] = b[j]
        for k in range(3):
            q[j] += D[k, j] * (p[k] - case.A[i, k])
    length: float = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    for j in range(3):
        u[j] = q[j] / length
    for j in range(6):
        weight[j] = 0.0
        for k in range(6):
            weight[j] += w.M[k, i] * x[k, j]
    cross_rows(c, zw, n)
    for row in range(3):
        for j in range(6):
            n[row, j] = zv[row, j] - n[row, j]
    for j in range(6):
        un = u[0] * n[0, j] + u[1] * n[1, j] + u[2] * n[2, j]
        for row in range(3):
            across[row, j] = (n[row, j] - un * u[row]) / length
    cross_rows(u, zw, uz)
    for k in range(3):
        e[:] = 0.0
        e[k] = 1.0
        cross(e, b, fb[k])
        cross(e, u, fu[k])
        part_across(u, e, length, pe[k])
        part_across(u, fb[k], length, pfb[k])
    return length


@njit(cache=True, error_model="numpy")
def _add_first_order(cable: Cable, S: Array) -> None:
    """Adds f and dp: (P (dp + f x b) / l) . n + (f x u) . n."""
    out, other, gamma = np.empty((3, 6)), np.empty((3, 6)), np.empty(6)
    cross_rows(cable.u, cable.n, out)  # u . (f x n) = -f . (u x n)
    cross_rows(cable.b, cable.across, other)  # across . (f x b) = f . (b x across)
    for k in range(3):
        for j in range(6):
            gamma[j] = other[k, j] - out[k, j]
        add_outer(cable.weight, gamma, 1.0, S[0, k])
        add_outer(cable.weight, cable.across[k], 1.0, S[1, k])


@njit(cache=True, error_model="numpy")
def _add_shifts(cable: Cable, centre: Centre, length: float, planar: bool, S: Array) -> None:
    """Adds dp with f, dp with g and dp with dp."""
    u, weight, n, fb, pe = cable.u, cable.weight, cable.n, cable.fb, cable.pe
    zw, zv = centre.z[:3], centre.z[3:]
    e, a, t, out = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 6))
    for k in range(2 if planar else 3):
        e[:] = 0.0
        e[k] = 1.0
        for o in range(3):
            # dp with f: (2 u2(dp, f x b) - f x (P dp / l)) . n
            t[:] = 0.0
            add_curvature(u, e, fb[o], length, 2.0, t)
            add_cross(o, pe[k], -1.0, t)
            add_row(weight, t, n, 1.0, S[3, 3 * k + o])
        add_with_turn(weight, pe[k], cable.c, zw, zv, out, S[4, 3 * k : 3 * k + 3])
        for o in range(k + 1):
            a[:] = 0.0
            a[o] = 1.0
            t[:] = 0.0
            add_curvature(u, e, a, length, 1.0, t)
            add_row(weight, t, n, 1.0 if o == k else ROOT_2, S[5, k * (k + 1) // 2 + o])


@njit(cache=True, error_model="numpy")
def _add_turns(cable: Cable, centre: Centre, length: float, planar: bool, S: Array) -> None:
    """Adds f with f and f with g."""
    u, weight, n, fb, fu, pfb = cable.u, cable.weight, cable.n, cable.fb, cable.fu, cable.pfb
    zw, zv = centre.z[:3], centre.z[3:]
    e, a, t, out = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 6))
    for k in range(2 if planar else 0, 3):
        for o in range(2 if planar else 0, k + 1):
            # f with f: (u2(f x b, f x b) + P (f x (f x b)) / 2 l - f x (P (f x b) / l)
            # + f x (f x u) / 2) . n, made symmetric.
            t[:] = 0.0
            add_curvature(u, fb[k], fb[o], length, 1.0, t)
            a[:] = 0.0
            add_cross(k, fb[o], 0.25, a)
            add_cross(o, fb[k], 0.25, a)
            part_across(u, a, length, e)
            for j in range(3):
                t[j] += e[j]
            add_cross(k, pfb[o], -0.5, t)
            add_cross(o, pfb[k], -0.5, t)
            add_cross(k, fu[o], 0.25, t)
            add_cross(o, fu[k], 0.25, t)
            add_row(weight, t, n, 1.0 if o == k else ROOT_2, S[6, k * (k + 1) // 2 + o])
        for j in range(3):
            t[j] = pfb[k, j] - fu[k, j]
        add_with_turn(weight, t, cable.c, zw, zv, out, S[7, 3 * k : 3 * k + 3])
