"""Numba kernels for bodies that joints connect: their motion, and the generalized force on them.

A tree is a table with a row for each body that matters, parents before children; row 0 is the
world. The joint of a row lies between a frame F on the parent P and a frame M on the body B:

    X_WB = X_WP X_PF X_FM(q) X_MB,
    V_WB = V_WP shifted to Bo, plus what the joint adds,
    tau = H' (moment about Mo, force),

with H the joint's hinge matrix, and every wrench shifted on to the parent. Coordinates q and
velocities v are those of MultibodyPlant, see `models.PlantTree`, which makes the table of a plant.

Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, 4.4 and 5.3; coordinates by the
documentation of Drake's joints.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import floating_motion

WORLD, WELD, REVOLUTE, PRISMATIC, PLANAR, FLOATING, FLOATING_PLAIN, BALL, UNIVERSAL = range(9)
"""Kinds of joints. `FLOATING_PLAIN` floats in the world by identity frames, with the arithmetic of
`motion_kernel.floating_motion`."""

KIND, PARENT, Q, V, RATE, R_PF, P_PF, R_MB, P_MB, AXIS = 0, 1, 2, 3, 4, 5, 14, 17, 26, 29
"""Columns of a tree: kind, row of the parent, where q begins in the state, where v begins among the
velocities, and in the state; X_PF (9 + 3), X_MB (9 + 3), axis in F (3)."""

TREE_COLUMNS = 32
"""Columns of a tree."""

TREE_WORK = 48
"""Numbers that kernels of a tree need to work with."""

MOTION = 18
"""Numbers of a body's motion in W: rotation row by row, position [m], angular velocity [rad/s],
velocity of its origin [m/s]."""


@njit(cache=True)
def _turn_about(a: Array, angle: float, R: Array) -> None:
    """Rotation by an angle about a unit axis, shape (3,), written row by row."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z, k = a[0], a[1], a[2], 1.0 - c
    R[0], R[1], R[2] = c + k * x * x, k * x * y - s * z, k * x * z + s * y
    R[3], R[4], R[5] = k * x * y + s * z, c + k * y * y, k * y * z - s * x
    R[6], R[7], R[8] = k * x * z - s * y, k * y * z + s * x, c + k * z * z


@njit(cache=True)
def _times(A: Array, B: Array, out: Array) -> None:
    """Product of two matrices that are given row by row."""
    for i in range(0, 9, 3):
        for j in range(3):
            out[i + j] = A[i] * B[j] + A[i + 1] * B[3 + j] + A[i + 2] * B[6 + j]


@njit(cache=True)
def _joint(row: Array, state: Array, R: Array, p: Array, w: Array, v: Array) -> None:
    """Writes R_FM, p_FM [m], and velocities of M in F, expressed in F [rad/s, m/s]."""
    kind, q, u = int(row[KIND]), int(row[Q]), int(row[RATE])
    a = row[AXIS : AXIS + 3]
    p[:] = 0.0
    w[:] = 0.0
    v[:] = 0.0
    R[:] = 0.0
    R[0] = R[4] = R[8] = 1.0
    if kind == REVOLUTE:
        _turn_about(a, state[q], R)
        for i in range(3):
            w[i] = a[i] * state[u]
    elif kind == PRISMATIC:
        for i in range(3):
            p[i] = a[i] * state[q]
            v[i] = a[i] * state[u]
    elif kind == PLANAR:
        c, s = np.cos(state[q + 2]), np.sin(state[q + 2])
        R[0], R[1], R[3], R[4] = c, -s, s, c
        p[0], p[1] = state[q], state[q + 1]
        v[0], v[1] = state[u], state[u + 1]
        w[2] = state[u + 2]
    elif kind == FLOATING:
        x, y, z, k = state[q + 1], state[q + 2], state[q + 3], state[q]
        s = 2.0 / (k * k + x * x + y * y + z * z)
        R[0], R[1], R[2] = 1.0 - s * (y * y + z * z), s * (x * y - k * z), s * (x * z + k * y)
        R[3], R[4], R[5] = s * (x * y + k * z), 1.0 - s * (x * x + z * z), s * (y * z - k * x)
        R[6], R[7], R[8] = s * (x * z - k * y), s * (y * z + k * x), 1.0 - s * (x * x + y * y)
        for i in range(3):
            p[i] = state[q + 4 + i]
            w[i] = state[u + i]
            v[i] = state[u + 3 + i]
    elif kind == BALL:  # R = Rz(yaw) Ry(pitch) Rx(roll)
        cr, sr = np.cos(state[q]), np.sin(state[q])
        cp, sp = np.cos(state[q + 1]), np.sin(state[q + 1])
        cy, sy = np.cos(state[q + 2]), np.sin(state[q + 2])
        R[0], R[1], R[2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
        R[3], R[4], R[5] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
        R[6], R[7], R[8] = -sp, cp * sr, cp * cr
        for i in range(3):
            w[i] = state[u + i]
    elif kind == UNIVERSAL:  # R = Rx(first) Ry(second)
        ca, sa = np.cos(state[q]), np.sin(state[q])
        cb, sb = np.cos(state[q + 1]), np.sin(state[q + 1])
        R[0], R[2] = cb, sb
        R[3], R[4], R[5] = sa * sb, ca, -sa * cb
        R[6], R[7], R[8] = -ca * sb, sa, ca * cb
        w[0] = state[u]
        w[1] = ca * state[u + 1]
        w[2] = sa * state[u + 1]


@njit(cache=True)
def _place_frame(P: Array, row: Array, R_WF: Array, p: Array) -> None:
    """Writes R_WF and p_PF in W, of a parent's motion P [m]."""
    _times(P[:9], row[R_PF : R_PF + 9], R_WF)
    for i in range(3):
        p[i] = P[3 * i] * row[P_PF] + P[3 * i + 1] * row[P_PF + 1] + P[3 * i + 2] * row[P_PF + 2]


@njit(cache=True)
def tree_motion(tree: Array, state: Array, work: Array, out: Array) -> None:
    """Writes the motion of all bodies of a tree in W, shape (n, 18), see `MOTION`.

    Args:
        tree: From `models.PlantTree`, shape (n, 32).
        state: Positions and velocities of the whole plant, shape (nq + nv,).
        work: Room, shape (TREE_WORK,), of the scalars of the state.
        out: Where the motions are written.
    """
    R_FM, p_FM, w_FM, v_FM = work[0:9], work[9:12], work[12:15], work[15:18]
    R_WF, p_PF, R_WM, p_PM = work[18:27], work[27:30], work[30:39], work[39:42]
    out[0, :] = 0.0
    out[0, 0] = out[0, 4] = out[0, 8] = 1.0
    for k in range(1, tree.shape[0]):
        row = tree[k]
        if int(row[KIND]) == FLOATING_PLAIN:
            plain = work[0:13]
            plain[:7] = state[int(row[Q]) : int(row[Q]) + 7]
            plain[7:] = state[int(row[RATE]) : int(row[RATE]) + 6]
            X = floating_motion(plain)
            for i in range(MOTION):
                out[k, i] = X[i]
            continue
        P = out[int(row[PARENT])]
        _joint(row, state, R_FM, p_FM, w_FM, v_FM)
        _place_frame(P, row, R_WF, p_PF)
        _times(R_WF, R_FM, R_WM)
        _times(R_WM, row[R_MB : R_MB + 9], out[k, :9])
        for i in range(3):
            a, b, c = R_WF[3 * i], R_WF[3 * i + 1], R_WF[3 * i + 2]
            p_PM[i] = p_PF[i] + (a * p_FM[0] + b * p_FM[1] + c * p_FM[2])
            out[k, 12 + i] = P[12 + i] + (a * w_FM[0] + b * w_FM[1] + c * w_FM[2])
            out[k, 15 + i] = P[15 + i] + (a * v_FM[0] + b * v_FM[1] + c * v_FM[2])
        # M moves with P, which turns, and then B with M.
        x, y, z = p_PM[0], p_PM[1], p_PM[2]
        out[k, 15] = out[k, 15] + (P[13] * z - P[14] * y)
        out[k, 16] = out[k, 16] + (P[14] * x - P[12] * z)
        out[k, 17] = out[k, 17] + (P[12] * y - P[13] * x)
        m = row[P_MB : P_MB + 3]
        x = R_WM[0] * m[0] + R_WM[1] * m[1] + R_WM[2] * m[2]
        y = R_WM[3] * m[0] + R_WM[4] * m[1] + R_WM[5] * m[2]
        z = R_WM[6] * m[0] + R_WM[7] * m[1] + R_WM[8] * m[2]
        out[k, 9] = P[9] + p_PM[0] + x
        out[k, 10] = P[10] + p_PM[1] + y
        out[k, 11] = P[11] + p_PM[2] + z
        w = out[k, 12:15]
        out[k, 15] = out[k, 15] + (w[1] * z - w[2] * y)
        out[k, 16] = out[k, 16] + (w[2] * x - w[0] * z)
        out[k, 17] = out[k, 17] + (w[0] * y - w[1] * x)


@njit(cache=True)
def _project(row: Array, state: Array, R_WF: Array, m: Array, f: Array, out: Array) -> None:
    """Adds a joint's generalized force; m: moment about Mo in W [N m], f: force in W [N]."""
    kind, v, q = int(row[KIND]), int(row[V]), int(row[Q])
    for j in range(3):
        # Along axis j of F.
        mj = R_WF[j] * m[0] + R_WF[3 + j] * m[1] + R_WF[6 + j] * m[2]
        fj = R_WF[j] * f[0] + R_WF[3 + j] * f[1] + R_WF[6 + j] * f[2]
        if kind == REVOLUTE:
            out[v] = out[v] + row[AXIS + j] * mj
        elif kind == PRISMATIC:
            out[v] = out[v] + row[AXIS + j] * fj
        elif kind == PLANAR:
            if j < 2:
                out[v + j] = out[v + j] + fj
            else:
                out[v + 2] = out[v + 2] + mj
        elif kind == FLOATING:
            out[v + j] = out[v + j] + mj
            out[v + 3 + j] = out[v + 3 + j] + fj
        elif kind == BALL:
            out[v + j] = out[v + j] + mj
        elif kind == UNIVERSAL:
            if j == 0:
                out[v] = out[v] + mj
            elif j == 1:
                out[v + 1] = out[v + 1] + np.cos(state[q]) * mj
            else:
                out[v + 1] = out[v + 1] + np.sin(state[q]) * mj


@njit(cache=True)
def add_tree_force(
    tree: Array, state: Array, motion: Array, wrenches: Array, work: Array, out: Array
) -> None:
    """Adds the generalized force of wrenches on the bodies of a tree.

    Args:
        tree: See `tree_motion`.
        state: See `tree_motion`.
        motion: What `tree_motion` wrote.
        wrenches: Moments about Bo and forces in W, shape (n, 6) [N m, N]; those of the bodies
            carried are added to those of the bodies that carry them.
        work: Room, see `tree_motion`.
        out: Generalized force of the plant, shape (nv,).
    """
    R_WF, p_PF, p_MB, m = work[0:9], work[9:12], work[12:15], work[15:18]
    R_FM, p_FM, R_WM = work[18:27], work[27:30], work[30:39]
    for k in range(tree.shape[0] - 1, 0, -1):
        row, F = tree[k], wrenches[k]
        v = int(row[V])
        if int(row[KIND]) == FLOATING_PLAIN:
            for i in range(6):
                out[v + i] = out[v + i] + F[i]
            continue
        parent = int(row[PARENT])
        P = motion[parent]
        if int(row[KIND]) != WELD:
            _place_frame(P, row, R_WF, p_PF)
            _joint(row, state, R_FM, p_FM, work[39:42], work[42:45])
            _times(R_WF, R_FM, R_WM)
            b = row[P_MB : P_MB + 3]
            for i in range(3):
                p_MB[i] = R_WM[3 * i] * b[0] + R_WM[3 * i + 1] * b[1] + R_WM[3 * i + 2] * b[2]
            m[0] = F[0] + (p_MB[1] * F[5] - p_MB[2] * F[4])
            m[1] = F[1] + (p_MB[2] * F[3] - p_MB[0] * F[5])
            m[2] = F[2] + (p_MB[0] * F[4] - p_MB[1] * F[3])
            _project(row, state, R_WF, m, F[3:6], out)
        if parent == 0:
            continue
        x, y, z = motion[k, 9] - P[9], motion[k, 10] - P[10], motion[k, 11] - P[11]
        to = wrenches[parent]
        to[0] = to[0] + (F[0] + (y * F[5] - z * F[4]))
        to[1] = to[1] + (F[1] + (z * F[3] - x * F[5]))
        to[2] = to[2] + (F[2] + (x * F[4] - y * F[3]))
        for i in range(3, 6):
            to[i] = to[i] + F[i]


@njit(cache=True, inline="always")
def motion_of_row(X: Array) -> Any:
    """A row of motions, shape (18,), as the tuple that kernels of cables take."""
    return (
        X[0], X[1], X[2], X[3], X[4], X[5], X[6], X[7], X[8],
        X[9], X[10], X[11], X[12], X[13], X[14], X[15], X[16], X[17],
    )  # fmt: skip


@njit(cache=True)
def relative_motion(E: Array, B: Array) -> Any:
    """Motion of a body as another one sees it, in its frame: X_EB, and velocities in E.

    Args:
        E: Motion of the one that looks, shape (18,).
        B: Motion of the other.
    """
    x, y, z = B[9] - E[9], B[10] - E[10], B[11] - E[11]
    wx, wy, wz = B[12] - E[12], B[13] - E[13], B[14] - E[14]
    vx = B[15] - E[15] - (E[13] * z - E[14] * y)
    vy = B[16] - E[16] - (E[14] * x - E[12] * z)
    vz = B[17] - E[17] - (E[12] * y - E[13] * x)
    a, b, c, d, e, f, g, h, i = E[0], E[1], E[2], E[3], E[4], E[5], E[6], E[7], E[8]
    return (
        a * B[0] + d * B[3] + g * B[6], a * B[1] + d * B[4] + g * B[7],
        a * B[2] + d * B[5] + g * B[8],
        b * B[0] + e * B[3] + h * B[6], b * B[1] + e * B[4] + h * B[7],
        b * B[2] + e * B[5] + h * B[8],
        c * B[0] + f * B[3] + i * B[6], c * B[1] + f * B[4] + i * B[7],
        c * B[2] + f * B[5] + i * B[8],
        a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z,
        a * wx + d * wy + g * wz, b * wx + e * wy + h * wz, c * wx + f * wy + i * wz,
        a * vx + d * vy + g * vz, b * vx + e * vy + h * vz, c * vx + f * vy + i * vz,
    )  # fmt: skip


@njit(cache=True)
def motion_from_point(E: Array, B: Array, p: Array) -> Any:
    """Motion of a body relative to a point of another one, in axes of W.

    So a cable that hangs sees it, whose plane stays vertical however its exit point turns.

    Args:
        E: Motion of the body with the point, shape (18,).
        B: Motion of the other one.
        p: The point in E, shape (3,) [m].
    """
    x = E[0] * p[0] + E[1] * p[1] + E[2] * p[2]
    y = E[3] * p[0] + E[4] * p[1] + E[5] * p[2]
    z = E[6] * p[0] + E[7] * p[1] + E[8] * p[2]
    return (
        B[0], B[1], B[2], B[3], B[4], B[5], B[6], B[7], B[8],
        B[9] - E[9] - x, B[10] - E[10] - y, B[11] - E[11] - z,
        B[12], B[13], B[14],
        B[15] - E[15] - (E[13] * z - E[14] * y),
        B[16] - E[16] - (E[14] * x - E[12] * z),
        B[17] - E[17] - (E[12] * y - E[13] * x),
    )  # fmt: skip
