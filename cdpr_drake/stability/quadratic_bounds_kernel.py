"""What bounds v' Pi v from below, as blocks of quadratic forms; see `stability`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, Work
from cdpr_drake.stability.criterion_kernel import OUTSIDE, turn_after
from cdpr_drake.stability.linear_forms_kernel import (
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
from cdpr_drake.stability.perturbation_samples_kernel import COMMON, CORNERS
from cdpr_drake.stability.stability_case import IBVS, PBVS
from cdpr_drake.stability.subdivision_kernel import BOXES, Piece

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
