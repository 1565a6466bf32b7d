"""Numba kernels for the motion of one rigid body by Newton and Euler: free, in a plane, on a line.

With c = p_PoCo, m the mass and I the inertia about Po, a wrench (moment about Po, force) in W gives

    I dw/dt + m c x dv/dt = moment - w x I w + c x m g,
    m dv/dt + m dw/dt x c = force - m w x (w x c) + m g,

which is solved in P, where the mass matrix is constant; a wrench that acts beside the cables is
added, see `robot_arrays.apply_wrench`. The state is MultibodyPlant's: quaternion
wxyz, position of Po, w and v in W; or (x, y, turn) and their rates; or (x, rate). Of the latter, W
and P here are the joint's frames F and M, see `geometry.PlatformJoint`. The quaternion may have any
length; dq/dt is linear in it, so that its length does not matter to the rotation.

Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, 2.15.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.robot_arrays import APPLIED, COM, DAMPING, GRAVITY, INERTIA, INVERSE
from cdpr_drake.geometry.motion_kernel import Motion, floating_motion
from cdpr_drake.numerics.kernel_calls import as_number


@njit(cache=True, error_model="numpy", forceinline=True)
def _row(body: Array, k: int, b: tuple[float, ...]) -> float:
    """The row of the mass matrix' inverse that begins at k by what stands beside it, shape (6,)."""
    total = body[k] * b[0] + body[k + 1] * b[1] + body[k + 2] * b[2]
    total += body[k + 3] * b[3] + body[k + 4] * b[4] + body[k + 5] * b[5]
    return float(total)


@njit(cache=True, error_model="numpy", forceinline=True)
def floating_derivative(
    q: tuple[float, ...], X: Motion, force: tuple[float, ...], body: Array
) -> Any:
    """The derivative of a floating platform's state, 13 numbers.

    Args:
        q: Its quaternion wxyz.
        X: Its motion, see `floating_motion`.
        force: Moment about Po and force in W, 6 numbers [N m, N], without weight.
        body: `RobotArrays.body`.
    """
    qw, qx, qy, qz = q
    wx, wy, wz = X[12], X[13], X[14]
    m = body[0]
    px, py, pz = m * body[GRAVITY], m * body[GRAVITY + 1], m * body[GRAVITY + 2]
    brake_v, brake_w = body[DAMPING], body[DAMPING + 1]
    cx, cy, cz = body[COM], body[COM + 1], body[COM + 2]
    mx, my, mz = force[0] - brake_w * wx, force[1] - brake_w * wy, force[2] - brake_w * wz
    fx = force[3] - brake_v * X[15] + px
    fy = force[4] - brake_v * X[16] + py
    fz = force[5] - brake_v * X[17] + pz
    if body[APPLIED] != 0.0:
        mx, my, mz = mx + body[APPLIED + 1], my + body[APPLIED + 2], mz + body[APPLIED + 3]
        fx, fy, fz = fx + body[APPLIED + 4], fy + body[APPLIED + 5], fz + body[APPLIED + 6]
    # Into P, where the weight's arm and the inertia are constants.
    ax, ay, az = (
        X[0] * wx + X[3] * wy + X[6] * wz,
        X[1] * wx + X[4] * wy + X[7] * wz,
        X[2] * wx + X[5] * wy + X[8] * wz,
    )
    gx, gy, gz = (
        px * X[0] + py * X[3] + pz * X[6],
        px * X[1] + py * X[4] + pz * X[7],
        px * X[2] + py * X[5] + pz * X[8],
    )
    jx = body[INERTIA] * ax + body[INERTIA + 1] * ay + body[INERTIA + 2] * az
    jy = body[INERTIA + 3] * ax + body[INERTIA + 4] * ay + body[INERTIA + 5] * az
    jz = body[INERTIA + 6] * ax + body[INERTIA + 7] * ay + body[INERTIA + 8] * az
    vx, vy, vz = ay * cz - az * cy, az * cx - ax * cz, ax * cy - ay * cx
    b0 = X[0] * mx + X[3] * my + X[6] * mz - (ay * jz - az * jy) + cy * gz - cz * gy
    b1 = X[1] * mx + X[4] * my + X[7] * mz - (az * jx - ax * jz) + cz * gx - cx * gz
    b2 = X[2] * mx + X[5] * my + X[8] * mz - (ax * jy - ay * jx) + cx * gy - cy * gx
    b3 = X[0] * fx + X[3] * fy + X[6] * fz - m * (ay * vz - az * vy)
    b4 = X[1] * fx + X[4] * fy + X[7] * fz - m * (az * vx - ax * vz)
    b5 = X[2] * fx + X[5] * fy + X[8] * fz - m * (ax * vy - ay * vx)
    b, k = (b0, b1, b2, b3, b4, b5), as_number(INVERSE)
    r0, r1, r2 = _row(body, k, b), _row(body, k + 6, b), _row(body, k + 12, b)
    s0, s1, s2 = _row(body, k + 18, b), _row(body, k + 24, b), _row(body, k + 30, b)
    return (
        0.5 * (-wx * qx - wy * qy - wz * qz),
        0.5 * (wx * qw + wy * qz - wz * qy),
        0.5 * (wy * qw + wz * qx - wx * qz),
        0.5 * (wz * qw + wx * qy - wy * qx),
        X[15], X[16], X[17],
        X[0] * r0 + X[1] * r1 + X[2] * r2,
        X[3] * r0 + X[4] * r1 + X[5] * r2,
        X[6] * r0 + X[7] * r1 + X[8] * r2,
        X[0] * s0 + X[1] * s1 + X[2] * s2,
        X[3] * s0 + X[4] * s1 + X[5] * s2,
        X[6] * s0 + X[7] * s1 + X[8] * s2,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def put_state(numbers: tuple[float, ...], out: Array) -> None:
    """out[:13] <- thirteen numbers."""
    out[0], out[1], out[2], out[3] = numbers[0], numbers[1], numbers[2], numbers[3]
    out[4], out[5], out[6] = numbers[4], numbers[5], numbers[6]
    out[7], out[8], out[9] = numbers[7], numbers[8], numbers[9]
    out[10], out[11], out[12] = numbers[10], numbers[11], numbers[12]


@njit(cache=True, error_model="numpy")
def floating_rates(state: Array, force: Array, body: Array, out: Array) -> None:
    """Writes the derivative of a floating platform's state to `out[:13]`.

    Args:
        state: Begins with the state, shape (13,).
        force: Begins with moment about Po and force in W, shape (6,) [N m, N], without weight.
        body: `RobotArrays.body`.
        out: Where it is written.
    """
    wrench = force[0], force[1], force[2], force[3], force[4], force[5]
    q = state[0], state[1], state[2], state[3]
    put_state(floating_derivative(q, floating_motion(state), wrench, body), out)


@njit(cache=True)
def planar_rates(state: Array, force: Array, body: Array, out: Array) -> None:
    """As `floating_rates` for a planar platform: state (6,), force (f_x, f_y, m_z), `out[:6]`."""
    c, s = np.cos(state[2]), np.sin(state[2])
    vx, vy, w = state[3], state[4], state[5]
    out[0], out[1], out[2] = vx, vy, w
    m = body[0]
    brake_v, brake_w = body[DAMPING], body[DAMPING + 1]
    px, py = m * body[GRAVITY], m * body[GRAVITY + 1]
    fx, fy = force[0] - brake_v * vx + px, force[1] - brake_v * vy + py
    mz = force[2] - brake_w * w
    if body[APPLIED] != 0.0:
        fx, fy, mz = fx + body[APPLIED + 1], fy + body[APPLIED + 2], mz + body[APPLIED + 3]
    b0 = c * fx + s * fy + m * w * w * body[COM]
    b1 = -s * fx + c * fy + m * w * w * body[COM + 1]
    b2 = mz
    b2 += (c * body[COM] - s * body[COM + 1]) * py - (s * body[COM] + c * body[COM + 1]) * px
    k = INVERSE
    a0 = body[k] * b0 + body[k + 1] * b1 + body[k + 2] * b2
    a1 = body[k + 3] * b0 + body[k + 4] * b1 + body[k + 5] * b2
    out[3] = c * a0 - s * a1
    out[4] = s * a0 + c * a1
    out[5] = body[k + 6] * b0 + body[k + 7] * b1 + body[k + 8] * b2


@njit(cache=True)
def line_rates(state: Array, force: Array, body: Array, out: Array) -> None:
    """As `floating_rates` for a platform on a line: state (2,), force (f_x,), `out[:2]`."""
    out[0] = state[1]
    pull = force[0] - body[DAMPING] * state[1]
    if body[APPLIED] != 0.0:
        pull += body[APPLIED + 1]
    out[1] = pull / body[0] + body[GRAVITY]


@njit(cache=True)
def mass_in_world(state: Array, body: Array, M: Array) -> None:
    """Writes the mass matrix about Po in W to `M[:n, :n]`.

    Args:
        state: State of the platform; one on a line has 2 numbers, n = 1, a planar one 6, n = 3 (x,
            y, turn), a floating one more, n = 6 (rotation, translation).
        body: `RobotArrays.body`.
        M: Where it is written, shape (n, n) or more.
    """
    m = body[0]
    if state.shape[0] == 2:
        M[0, 0] = m
        return
    if state.shape[0] == 6:
        c, s = np.cos(state[2]), np.sin(state[2])
        x, y = c * body[COM] - s * body[COM + 1], s * body[COM] + c * body[COM + 1]
        M[0, 0], M[0, 1], M[0, 2] = m, 0.0, -m * y
        M[1, 0], M[1, 1], M[1, 2] = 0.0, m, m * x
        M[2, 0], M[2, 1], M[2, 2] = -m * y, m * x, body[INERTIA + 8]
        return
    X = floating_motion(state)
    for i in range(3):
        for j in range(3):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += X[3 * i + a] * body[INERTIA + 3 * a + b] * X[3 * j + b]
            M[i, j] = total
            M[i, 3 + j] = 0.0
            M[3 + i, j] = 0.0
            M[3 + i, 3 + j] = m if i == j else 0.0
    cx, cy, cz = body[COM], body[COM + 1], body[COM + 2]
    x = m * (X[0] * cx + X[1] * cy + X[2] * cz)
    y = m * (X[3] * cx + X[4] * cy + X[5] * cz)
    z = m * (X[6] * cx + X[7] * cy + X[8] * cz)
    M[0, 4], M[0, 5], M[1, 3] = -z, y, z
    M[1, 5], M[2, 3], M[2, 4] = -x, -y, x
    M[4, 0], M[5, 0], M[3, 1] = -z, y, z
    M[5, 1], M[3, 2], M[4, 2] = -x, -y, x
