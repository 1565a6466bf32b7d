"""Numba kernels for the motion of bodies that joints connect: mass matrix, bias, accelerations.

    M(q) vdot + c(q, v) = tau,      c = what Coriolis, gravity and gyroscopic moments ask for,
                                        less what wrenches on the bodies do

by composite rigid bodies. All spatial vectors are in W about its origin O, so that what a body
carries is added to it without a shift: with S the columns of a joint, I the inertia, V and A the
velocity and acceleration of a body,

    A_k = A_P + dS/dt v,   f_k = I_k A_k + V_k x* (I_k V_k),   c = S' sum f,
    M_jk = S_j' I^c_k S_k,   I^c the inertia of a body and what it carries,

A of the world being -g. A column of a turn is (e, p_Mo x e), of a move (0, e), with e an axis
that turns with the parent.

Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, 5.3 and 6.2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.tree_kernel import (
    AXIS,
    BALL,
    FLOATING,
    FLOATING_PLAIN,
    KIND,
    P_MB,
    PARENT,
    PLANAR,
    PRISMATIC,
    R_MB,
    R_PF,
    RATE,
    REVOLUTE,
    UNIVERSAL,
    Q,
    V,
)

INERTIA = 10
"""Numbers of a body: mass [kg], centre of mass in B (3) [m], inertia about it in B (6: xx, yy, zz,
xy, xz, yz) [kg m^2]."""

MOST = 6
"""Velocities of a joint, at most."""

BODY_ROOM = 2 * MOST * 6 + 3 * 6 + INERTIA + 6
"""Room of a body: columns S and dS/dt, V, A, f about O, inertia about O (10), and f of it."""


@njit(cache=True)
def joint_size(kind: int) -> int:
    """Velocities of a kind of joint."""
    if kind in (REVOLUTE, PRISMATIC):
        return 1
    if kind == UNIVERSAL:
        return 2
    if kind in (PLANAR, BALL):
        return 3
    if kind in (FLOATING, FLOATING_PLAIN):
        return 6
    return 0


@njit(cache=True, inline="always")
def _cross(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> Any:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True, inline="always")
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@njit(cache=True, inline="always")
def _turn(e: Any, w: Any, p: Any, v: Any, S: Array, S_dot: Array) -> None:
    """A column for a turn about e, which turns with w, through p, which moves with v."""
    ex, ey, ez = e
    rx, ry, rz = _cross(w[0], w[1], w[2], ex, ey, ez)
    S[0], S[1], S[2] = ex, ey, ez
    S[3], S[4], S[5] = _cross(p[0], p[1], p[2], ex, ey, ez)
    ax, ay, az = _cross(v[0], v[1], v[2], ex, ey, ez)
    bx, by, bz = _cross(p[0], p[1], p[2], rx, ry, rz)
    S_dot[0], S_dot[1], S_dot[2] = rx, ry, rz
    S_dot[3], S_dot[4], S_dot[5] = ax + bx, ay + by, az + bz


@njit(cache=True, inline="always")
def _move(e: Any, w: Any, S: Array, S_dot: Array) -> None:
    """A column for a move along e, which turns with w."""
    S[0] = S[1] = S[2] = S_dot[0] = S_dot[1] = S_dot[2] = 0.0
    S[3], S[4], S[5] = e
    S_dot[3], S_dot[4], S_dot[5] = _cross(w[0], w[1], w[2], e[0], e[1], e[2])


@njit(cache=True, inline="always")
def _axis(P: Array, row: Array, j: int) -> Any:
    """Axis j of F in W."""
    x, y, z = row[R_PF + j], row[R_PF + 3 + j], row[R_PF + 6 + j]
    return (
        P[0] * x + P[1] * y + P[2] * z,
        P[3] * x + P[4] * y + P[5] * z,
        P[6] * x + P[7] * y + P[8] * z,
    )


@njit(cache=True)
def _columns(row: Array, state: Array, P: Array, B: Array, S: Array, S_dot: Array) -> None:
    """Columns of a joint that moves and their rates, shape (6, 6) each, one a row.

    Args:
        row: Of the tree.
        state: Of the plant.
        P: Motion of the parent, see `tree_kernel.MOTION`.
        B: Motion of the body.
        S: Where the columns are written.
        S_dot: Where their rates are written.
    """
    kind = int(row[KIND])
    w = P[12], P[13], P[14]
    e0, e1, e2 = _axis(P, row, 0), _axis(P, row, 1), _axis(P, row, 2)
    # Mo is fixed in B: p_BoMo = -R_BM p_MB, and its velocity is that of B there.
    x, y, z = row[P_MB], row[P_MB + 1], row[P_MB + 2]
    mx = -(row[R_MB] * x + row[R_MB + 3] * y + row[R_MB + 6] * z)
    my = -(row[R_MB + 1] * x + row[R_MB + 4] * y + row[R_MB + 7] * z)
    mz = -(row[R_MB + 2] * x + row[R_MB + 5] * y + row[R_MB + 8] * z)
    x = B[0] * mx + B[1] * my + B[2] * mz
    y = B[3] * mx + B[4] * my + B[5] * mz
    z = B[6] * mx + B[7] * my + B[8] * mz
    vx, vy, vz = _cross(B[12], B[13], B[14], x, y, z)
    p = B[9] + x, B[10] + y, B[11] + z
    v = B[15] + vx, B[16] + vy, B[17] + vz
    if kind in (REVOLUTE, PRISMATIC):
        a, b, c = row[AXIS], row[AXIS + 1], row[AXIS + 2]
        e = (
            a * e0[0] + b * e1[0] + c * e2[0],
            a * e0[1] + b * e1[1] + c * e2[1],
            a * e0[2] + b * e1[2] + c * e2[2],
        )
        if kind == REVOLUTE:
            _turn(e, w, p, v, S[0], S_dot[0])
        else:
            _move(e, w, S[0], S_dot[0])
    elif kind == PLANAR:
        _move(e0, w, S[0], S_dot[0])
        _move(e1, w, S[1], S_dot[1])
        _turn(e2, w, p, v, S[2], S_dot[2])
    elif kind == UNIVERSAL:
        _turn(e0, w, p, v, S[0], S_dot[0])
        c, s = np.cos(state[int(row[Q])]), np.sin(state[int(row[Q])])
        turn = state[int(row[RATE])]
        e = c * e1[0] + s * e2[0], c * e1[1] + s * e2[1], c * e1[2] + s * e2[2]
        u = w[0] + turn * e0[0], w[1] + turn * e0[1], w[2] + turn * e0[2]
        _turn(e, u, p, v, S[1], S_dot[1])
    else:
        _turn(e0, w, p, v, S[0], S_dot[0])
        _turn(e1, w, p, v, S[1], S_dot[1])
        _turn(e2, w, p, v, S[2], S_dot[2])
        if kind != BALL:
            _move(e0, w, S[3], S_dot[3])
            _move(e1, w, S[4], S_dot[4])
            _move(e2, w, S[5], S_dot[5])


@njit(cache=True)
def _world_inertia(b: Array, X: Array, out: Array) -> None:
    """Inertia about O in W: mass, mass times p_OCo (3), and inertia about O (6)."""
    m = b[0]
    cx = X[9] + (X[0] * b[1] + X[1] * b[2] + X[2] * b[3])
    cy = X[10] + (X[3] * b[1] + X[4] * b[2] + X[5] * b[3])
    cz = X[11] + (X[6] * b[1] + X[7] * b[2] + X[8] * b[3])
    # R I, row by row, and then times R'.
    ax = X[0] * b[4] + X[1] * b[7] + X[2] * b[8]
    ay = X[0] * b[7] + X[1] * b[5] + X[2] * b[9]
    az = X[0] * b[8] + X[1] * b[9] + X[2] * b[6]
    bx = X[3] * b[4] + X[4] * b[7] + X[5] * b[8]
    by = X[3] * b[7] + X[4] * b[5] + X[5] * b[9]
    bz = X[3] * b[8] + X[4] * b[9] + X[5] * b[6]
    dx = X[6] * b[4] + X[7] * b[7] + X[8] * b[8]
    dy = X[6] * b[7] + X[7] * b[5] + X[8] * b[9]
    dz = X[6] * b[8] + X[7] * b[9] + X[8] * b[6]
    out[0], out[1], out[2], out[3] = m, m * cx, m * cy, m * cz
    out[4] = ax * X[0] + ay * X[1] + az * X[2] + m * (cy * cy + cz * cz)
    out[5] = bx * X[3] + by * X[4] + bz * X[5] + m * (cx * cx + cz * cz)
    out[6] = dx * X[6] + dy * X[7] + dz * X[8] + m * (cx * cx + cy * cy)
    out[7] = ax * X[3] + ay * X[4] + az * X[5] - m * cx * cy
    out[8] = ax * X[6] + ay * X[7] + az * X[8] - m * cx * cz
    out[9] = bx * X[6] + by * X[7] + bz * X[8] - m * cy * cz


@njit(cache=True, inline="always")
def _momentum(body: Array, V: Array, out: Array) -> None:
    """I V about O, (moment, force) of a motion (w, v of what is at O)."""
    m, hx, hy, hz = body[0], body[1], body[2], body[3]
    wx, wy, wz, vx, vy, vz = V[0], V[1], V[2], V[3], V[4], V[5]
    out[0] = body[4] * wx + body[7] * wy + body[8] * wz + (hy * vz - hz * vy)
    out[1] = body[7] * wx + body[5] * wy + body[9] * wz + (hz * vx - hx * vz)
    out[2] = body[8] * wx + body[9] * wy + body[6] * wz + (hx * vy - hy * vx)
    out[3] = m * vx + (wy * hz - wz * hy)
    out[4] = m * vy + (wz * hx - wx * hz)
    out[5] = m * vz + (wx * hy - wy * hx)


@njit(cache=True)
def tree_dynamics(
    tree: Array, bodies: Array, gravity: Array, state: Array, motion: Array, wrenches: Array,
    room: Array, M: Array, bias: Array,
) -> None:  # fmt: skip
    """Writes mass matrix and bias of a tree that has all bodies of a plant.

    Args:
        tree: From `models.PlantTree`, shape (n, 32).
        bodies: Mass, centre of mass and inertia of each, shape (n, 10), see `INERTIA`.
        gravity: Acceleration of gravity in W, shape (3,) [m/s^2].
        state: Positions and velocities of the plant, shape (nq + nv,).
        motion: What `tree_kernel.tree_motion` wrote, shape (n, 18).
        wrenches: On the bodies, moments about Bo and forces in W, shape (n, 6) [N m, N].
        room: Shape (n, BODY_ROOM).
        M: Mass matrix, shape (nv, nv), is written.
        bias: c less what the wrenches do, shape (nv,), is written [N, N m].
    """
    n = tree.shape[0]
    M[:] = 0.0
    s, d, g = MOST * 6, 2 * MOST * 6, 2 * MOST * 6 + 18
    for i in range(3):
        room[0, d + 6 + i] = 0.0
        room[0, d + 9 + i] = -gravity[i]
    h = room[0, :6]
    for k in range(1, n):
        row, mine, X = tree[k], room[k], motion[k]
        acc, force, parent = mine[d + 6 : d + 12], mine[d + 12 : d + 18], int(row[PARENT])
        vel, inertia, size = mine[d : d + 6], mine[g : g + INERTIA], joint_size(int(row[KIND]))
        for i in range(6):
            acc[i] = room[parent, d + 6 + i]
        if size > 0:
            S_dot, u = mine[s:d].reshape(MOST, 6), int(row[RATE])
            _columns(row, state, motion[parent], X, mine[:s].reshape(MOST, 6), S_dot)
            for j in range(size):
                for i in range(6):
                    acc[i] += S_dot[j, i] * state[u + j]
        wx, wy, wz = X[12], X[13], X[14]
        vx, vy, vz = _cross(X[9], X[10], X[11], wx, wy, wz)  # of what is at O
        vx, vy, vz = X[15] + vx, X[16] + vy, X[17] + vz
        vel[0], vel[1], vel[2], vel[3], vel[4], vel[5] = wx, wy, wz, vx, vy, vz
        _world_inertia(bodies[k], X, inertia)
        _momentum(inertia, acc, force)
        _momentum(inertia, vel, h)
        ax, ay, az = _cross(wx, wy, wz, h[0], h[1], h[2])
        bx, by, bz = _cross(vx, vy, vz, h[3], h[4], h[5])
        cx, cy, cz = _cross(wx, wy, wz, h[3], h[4], h[5])
        F = wrenches[k]
        mx, my, mz = _cross(X[9], X[10], X[11], F[3], F[4], F[5])
        force[0] += ax + bx - F[0] - mx
        force[1] += ay + by - F[1] - my
        force[2] += az + bz - F[2] - mz
        force[3] += cx - F[3]
        force[4] += cy - F[4]
        force[5] += cz - F[5]
    for k in range(n - 1, 0, -1):
        row, mine = tree[k], room[k]
        force, inertia, v = mine[d + 12 : d + 18], mine[g : g + INERTIA], int(row[V])
        S, size, parent = mine[:s].reshape(MOST, 6), joint_size(int(row[KIND])), int(row[PARENT])
        for j in range(size):
            bias[v + j] = _dot(S[j], force)
            _momentum(inertia, S[j], h)
            for i in range(j, size):
                M[v + i, v + j] = _dot(S[i], h)
                M[v + j, v + i] = M[v + i, v + j]
            up = parent
            while up > 0:
                above, b = room[up, :s].reshape(MOST, 6), int(tree[up, V])
                for i in range(joint_size(int(tree[up, KIND]))):
                    M[b + i, v + j] = _dot(above[i], h)
                    M[v + j, b + i] = M[b + i, v + j]
                up = int(tree[up, PARENT])
        if parent > 0:
            below = room[parent]
            for i in range(6):
                below[d + 12 + i] += force[i]
            for i in range(INERTIA):
                below[g + i] += inertia[i]


@njit(cache=True, error_model="numpy")
def solve_symmetric(M: Array, b: Array) -> bool:
    """Solves M x = b in place, M symmetric and positive definite; both are overwritten.

    Returns:
        Whether M is positive definite.
    """
    n = M.shape[0]
    for j in range(n):
        for k in range(j):
            M[j, j] -= M[j, k] * M[j, k]
        if not M[j, j] > 0.0:
            return False
        M[j, j] = np.sqrt(M[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                M[i, j] -= M[i, k] * M[j, k]
            M[i, j] /= M[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= M[i, k] * b[k]
        b[i] /= M[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= M[k, i] * b[k]
        b[i] /= M[i, i]
    return True


@njit(cache=True)
def position_rates(tree: Array, state: Array, out: Array) -> None:
    """Writes dq/dt of all joints, shape (nq + nv,), its first nq entries."""
    for k in range(1, tree.shape[0]):
        row = tree[k]
        kind, q, u = int(row[KIND]), int(row[Q]), int(row[RATE])
        if kind in (FLOATING, FLOATING_PLAIN):
            w, x, y, z = state[q], state[q + 1], state[q + 2], state[q + 3]
            a, b, c = state[u], state[u + 1], state[u + 2]
            out[q] = -0.5 * (x * a + y * b + z * c)
            out[q + 1] = 0.5 * (w * a + z * b - y * c)
            out[q + 2] = 0.5 * (-z * a + w * b + x * c)
            out[q + 3] = 0.5 * (y * a - x * b + w * c)
            for i in range(3):
                out[q + 4 + i] = state[u + 3 + i]
        elif kind == BALL:
            pitch, yaw = state[q + 1], state[q + 2]
            cp, sp, cy, sy = np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
            along = (cy * state[u] + sy * state[u + 1]) / cp
            out[q] = along
            out[q + 1] = -sy * state[u] + cy * state[u + 1]
            out[q + 2] = sp * along + state[u + 2]
        else:
            for i in range(joint_size(kind)):
                out[q + i] = state[u + i]
