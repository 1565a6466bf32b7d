"""What bounds v' Pi v from below, as blocks of quadratic forms: the proof behind `certified`.

Only perturbations of the estimate are covered, and of the object only its position under PBVS.

**Notation.** All vectors in the axes of the nominal camera frame C. v any vector of R^6,
x = K_l' v, z = K_r v, w = (J^+)' x; cable i has the vector q_i = l_i u_i from exit to anchor point,
the anchor's arms b_i from P and c_i from C, and n_i = z_v + z_w x c_i. Perturbations: turns
exp(f), exp(g) of platform and camera with |f| <= F, |g| <= G, shifts dp, dt, ds of platform, camera
and object, da_i, db_i of the points, and T = exp(f) exp(g). Then, exactly,

  v' Pi v = sum_i w_i u^_i . n^_i,    n^_i = T (z_v + ds x z_w) + (T z_w) x (e^f (c_i + db_i - dt)),
  q^_i = q_i + dp - da_i + (e^f - 1) b_i + e^f db_i.

A planar robot adds |v|^2 of the components that it cannot move to both sides.

**Order 0.** sum_i w_i u_i . n_i = x' J^+ J z = v' K_l K_r v = |v|^2, since the object's nominal
place is the same on both sides.

**Order 1**, with P_i = 1 - u_i u_i':

  dp:   sum_i w_i (P_i dp / l_i) . n_i
  f:    sum_i w_i (P_i (f x b_i) / l_i) . n_i + w_i u_i . (f x n_i)
  g:    x_w . (g x z_w) + x_v . (g x z_v)            (J^+ J = 1 takes the sum over the cables away)
  dt, ds:  x_v . ((dt + ds) x z_w)   (at most (r_pc + r_s) |x_v| |z_w|, a product below)
  da_i: -w_i (P_i da_i / l_i) . n_i
  db_i: w_i db_i . (P_i n_i / l_i + u_i x z_w)

**Remainder.** e_i = r_bp + F |b_i| + |da| + |db| bounds |q^_i - q_i|; E = e_i / l_i must stay
below 1.
- |u^ - u - P (q^ - q) / l|: the sine s of the angle between u and u^ is at most E. The part along u
  is 1 - cos <= a s^2 with a = 1 / (1 + sqrt(1 - E^2)), that across is s |1 - |q^| / l| <=
  s (a s^2 + sqrt(E^2 - s^2)). With t = s^2 / E^2 the sum of their squares is at most
  E^4 (a^2 t^2 + t (1 - t) + 2 a E t^2 sqrt(1 - t) + a^2 E^2 t^3), where t^2 sqrt(1 - t) < 0.2863,
  and a^2 t^2 + t - t^2 <= 1 / (4 (1 - a^2)) if a^2 <= 1/2, else a^2.
- |q^ - q - (its linear part)| <= F^2 |b_i| / 2 + F |db|, since |e^f - 1 - fx| <= F^2 / 2 and
  |e^f - 1| <= F.
- |n^ - n| <= (F + G) |n| + d_i |z_w| with d_i = r_s + r_pc + |db| + G |c_i|, because n^ is T
  applied to z_v + ds x z_w + z_w x (e^-g (c_i + db_i - dt)).
- T - 1 - fx - gx has norm at most (F + G)^2 / 2. Its rigid part sums to x . (T - 1 - ...) z; what
  is left of n^ - n - (its linear part) is (T z_w) x y - z_w x (linear part of y), with
  y = (e^f - 1) c_i + e^f (db_i - dt).
- The product of u^ - u and n^ - n: what dp in the first does with f and g in the second is kept as
  bilinear forms, |sum_kl dp_k f_l v' Q_kl v| <= r_bp F |(v' Q_kl v)_kl|; the rest takes the bounds
  above.

**Blocks.** What is left are sums of two kinds of terms, and each is bounded by a quadratic form for
any choice of its free parameter:

  c |a v| |b v|           <= c / 2 v' (t a'a + b'b / t) v           for every t > 0,
  r |(v' S_k v)_k|        <= r / 2 v' (Z + sum_k S_k Z^-1 S_k) v    for every Z > 0,

the second since y . (v' S_k v)_k = sum_k (y_k Z^1/2 v) . (Z^-1/2 S_k v) for a unit vector y. If
the sum H of all these forms has its largest eigenvalue below 1, the criterion holds for every
perturbation, and 1 - that eigenvalue is a lower bound of the margin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.perturbation_draws import COMMON, CORNERS
from cdpr_drake.servo_interaction import IBVS, PBVS
from cdpr_drake.stability_kernel import OUTSIDE
from cdpr_drake.stability_pose import CaseArrays, Work

BALLS = 7
"""Vector blocks: f, dp, g, dt + ds (bounded as a product instead), common db, dp with f, dp with
g."""

BALL_SIZES = np.array([3, 3, 3, 3, 3, 9, 9])
"""Numbers of their matrices."""


class Blocks(NamedTuple):
    """The terms of one pose; unused ones have the bound 0.

    Attributes:
        radius: Bounds r of the vector blocks, shape (BALLS,).
        S: Their symmetric matrices, shape (BALLS, 9, 6, 6).
        bound: Bounds c of the products, shape (n,).
        left: a'a, shape (n, 6, 6).
        right: b'b, shape (n, 6, 6).
    """

    radius: Array
    S: Array
    bound: Array
    left: Array
    right: Array


@njit(cache=True)
def new_blocks(m: int) -> Blocks:
    """Room for the blocks of m cables."""
    n = 8 * m + 4
    return Blocks(
        np.zeros(BALLS), np.zeros((BALLS, 9, 6, 6)), np.zeros(n), np.zeros((n, 6, 6)),
        np.zeros((n, 6, 6)),
    )  # fmt: skip


@njit(cache=True)
def _gram(X: Array, out: Array) -> None:
    """out <- X'X for X of shape (k, 6)."""
    for i in range(6):
        for j in range(6):
            s = 0.0
            for k in range(X.shape[0]):
                s += X[k, i] * X[k, j]
            out[i, j] = s


@njit(cache=True)
def _add_outer(a: Array, b: Array, f: float, out: Array) -> None:
    """out += f / 2 (a b' + b a')."""
    for i in range(6):
        for j in range(6):
            out[i, j] += 0.5 * f * (a[i] * b[j] + b[i] * a[j])


@njit(cache=True)
def _cross_rows(p: Array, X: Array, out: Array) -> None:
    """out <- [p]x X for X of shape (3, 6)."""
    for j in range(6):
        out[0, j] = p[1] * X[2, j] - p[2] * X[1, j]
        out[1, j] = p[2] * X[0, j] - p[0] * X[2, j]
        out[2, j] = p[0] * X[1, j] - p[1] * X[0, j]


@njit(cache=True)
def _unit_remainder(E: float) -> float:
    """Bound of |u^ - u - P (q^ - q) / l| for |q^ - q| <= E l, E < 1."""
    a = 1.0 / (1.0 + np.sqrt(1.0 - E * E))
    first = 0.25 / (1.0 - a * a) if a * a <= 0.5 else a * a
    k = a * E
    return E * E * np.sqrt(first + 2.0 * 0.2863 * k + k * k)


@njit(cache=True)
def _add_product(weight: Array, rows: Array, c: float, blocks: Blocks, at: int) -> int:
    """Adds the product c |weight v| |rows v| at place `at`; returns the next place."""
    blocks.bound[at] = c
    for j in range(6):
        for k in range(6):
            blocks.left[at, j, k] = weight[j] * weight[k]
    _gram(rows, blocks.right[at])
    return at + 1


@njit(cache=True)
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


@njit(cache=True)
def fill_blocks(case: CaseArrays, w: Work, blocks: Blocks) -> bool:
    """Fills the blocks of the pose that `prepare` has seen; False where nothing can be proven."""
    m = case.A.shape[0]
    F, r_bp, G, r_pc = case.radii[0], case.radii[1], case.radii[2], case.radii[3]
    r_A, r_B = case.radii[6], case.radii[7]
    r_s = (
        case.radii[5] if case.scheme == PBVS else 0.0
    )  # other schemes see no shift, or are refused
    diagonal = np.sqrt(2.0) if case.planar else np.sqrt(3.0)
    size_A = r_A * diagonal if case.directions[0] == CORNERS else r_A
    size_B = r_B * diagonal if case.directions[1] == CORNERS else r_B
    radius, S, bound, left, right = blocks
    S[:] = 0.0
    bound[:] = 0.0
    radius[0], radius[1], radius[2], radius[3] = F, r_bp, G, 0.0
    if case.directions[0] == COMMON:
        radius[1] += r_A  # a common shift of exit points is a shift of the platform
    radius[4] = r_B if case.directions[1] == COMMON else 0.0
    radius[5], radius[6] = radius[1] * F, radius[1] * G
    x, z = np.zeros((6, 6)), np.zeros((6, 6))  # x = (these rows) v, z likewise
    for i in range(6):
        for j in range(6):
            if case.scheme == IBVS:
                x[i, j] = z[i, j] = 1.0 if i == j else 0.0
            else:
                x[i, j], z[i, j] = w.L[j, i], w.Li[i, j]
            if case.planar and OUTSIDE[i] > 0.0:
                x[i, j] = z[i, j] = 0.0
    xw, xv, zw, zv = x[:3], x[3:], z[:3], z[3:]
    turn = F + G
    at = 0
    # Products that no cable has a part in.
    for c, a, b in (
        (0.5 * turn * turn, xv, zv),
        (0.5 * turn * turn, xw, zw),
        (turn * (r_s + r_pc) + F * r_pc, xv, zw),
        (r_pc + r_s, xv, zw),  # dt, ds
    ):
        bound[at] = c
        _gram(a, left[at])
        _gram(b, right[at])
        at += 1
    e, out, other = np.zeros(3), np.empty((3, 6)), np.empty((3, 6))
    for k in range(3):
        e[:] = 0.0
        e[k] = 1.0
        _cross_rows(e, zw, out)
        _cross_rows(e, zv, other)
        for row in range(3):
            _add_outer(xw[row], out[row], 1.0, S[2, k])
            _add_outer(xv[row], other[row], 1.0, S[2, k])
            _add_outer(xv[row], out[row], 1.0, S[3, k])
            _add_outer(xv[row], out[row], -1.0, S[4, k])
    # The cables. J's rows hold c x u and u in C; the arm b from P needs the camera's place.
    D = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            D[i, j] = w.R[i, 0] * case.C[0, j] + w.R[i, 1] * case.C[1, j] + w.R[i, 2] * case.C[2, j]
    n, across, weight = np.empty((3, 6)), np.empty((3, 6)), np.empty(6)
    b, c, q, u, t = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    uz, gamma = np.empty((3, 6)), np.empty((3, 6))
    for i in range(m):
        for j in range(3):
            b[j] = c[j] = 0.0
            for k in range(3):
                b[j] += case.C[k, j] * case.B[i, k]
                c[j] += case.C[k, j] * (case.B[i, k] - case.t[k])
            q[j] = b[j]
            for k in range(3):
                q[j] += D[k, j] * (w.p[k] - case.A[i, k])
        length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
        for j in range(3):
            u[j] = q[j] / length
        for j in range(6):
            weight[j] = 0.0
            for k in range(6):
                weight[j] += w.M[k, i] * x[k, j]
        _cross_rows(c, zw, n)  # n = zv - c x zw
        for row in range(3):
            for j in range(6):
                n[row, j] = zv[row, j] - n[row, j]
        for j in range(6):
            un = u[0] * n[0, j] + u[1] * n[1, j] + u[2] * n[2, j]
            for row in range(3):
                across[row, j] = (n[row, j] - un * u[row]) / length
        _cross_rows(u, zw, uz)
        _cross_rows(u, n, out)  # u . (f x n) = -f . (u x n)
        _cross_rows(b, across, other)  # across . (f x b) = f . (b x across)
        for k in range(3):
            for j in range(6):
                gamma[k, j] = other[k, j] - out[k, j]
            _add_outer(weight, gamma[k], 1.0, S[0, k])
            _add_outer(weight, across[k], 1.0, S[1, k])
            _add_outer(weight, across[k], 1.0, S[4, k])
        # dp with f: (P dp / l) . (f x n); with g: (P dp / l) . (g x zv + (g x zw) x c).
        for k in range(2 if case.planar else 3):
            e[:] = 0.0
            e[k] = 1.0
            for j in range(3):
                t[j] = (e[j] - u[k] * u[j]) / length  # P e_k / l
            _cross_rows(t, n, out)  # t . (f x n) = -f . (t x n)
            for o in range(3):
                _add_outer(weight, out[o], -1.0, S[5, 3 * k + o])
            # t . (g x zv) = -g . (t x zv); t . ((g x zw) x c) = (c x t) . (g x zw)
            _cross_rows(t, zv, out)
            e[0] = c[1] * t[2] - c[2] * t[1]
            e[1] = c[2] * t[0] - c[0] * t[2]
            e[2] = c[0] * t[1] - c[1] * t[0]
            _cross_rows(e, zw, other)
            for o in range(3):
                _add_outer(weight, out[o], -1.0, S[6, 3 * k + o])
                _add_outer(weight, other[o], -1.0, S[6, 3 * k + o])
        # What every cable has for itself.
        arm = np.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
        lever = np.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        own = F * arm + size_A + size_B
        if case.directions[0] == COMMON:
            own -= size_A
        E = (radius[1] + own) / length
        if not E < 0.9:
            return False
        linear = _unit_remainder(E) + (0.5 * F * F * arm + F * size_B) / length
        d = r_s + r_pc + size_B + G * lever
        # (u^ - u) . (n^ - n) less the bilinear parts of dp with f and g: what is left of u^ - u is
        # h_own, with all of n^ - n; dp also meets what is not linear or not f, g in n^ - n.
        h_own = linear + own / length
        shift = radius[1] / length
        slope = h_own * turn + shift * (0.5 * turn * turn)
        swing = (
            h_own * d
            + shift * (r_s + r_pc + size_B) * (1.0 + turn + F)
            + shift * (turn * turn + 0.5 * F * F + turn * F) * lever
        )
        rest = turn * (F * lever + size_B) + 0.5 * F * F * lever + F * size_B
        for row in range(3):
            for j in range(6):
                gamma[row, j] = across[row, j] + uz[row, j]
        at = _add_product(weight, n, linear + slope, blocks, at)
        at = _add_product(weight, zw, swing + rest, blocks, at)
        at = _add_points(weight, across, r_A, case.directions[0], D, case.planar, blocks, at)
        at = _add_points(weight, gamma, r_B, case.directions[1], case.C, case.planar, blocks, at)
    return True
