"""Numba kernels of observers of a wrench on a rigid body, from its poses and known wrenches.

All is about the centre of mass C in axes of W, where Newton and Euler have no terms of velocity:
with the linear momentum m v, the angular one h = I w, and (n, f) the moment about C and the force
of all that acts, h' = n and m v' = f. Arrays are packed, and nothing is allocated in a step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

MASS, COM, INERTIA, GRAVITY, BODY_SIZE = 0, 1, 4, 13, 16
"""Of a packed body: mass [kg], centre of mass in P (3) [m], rotational inertia about it in P, row
by row (9) [kg m^2], acceleration of a falling body in W (3) [m/s^2]."""

SEEN, R_AT, C_AT, V_AT, W_AT, KNOWN, OUTER, MOMENTUM, HALFWAY, TURN, MEMORY_SIZE = (
    0, 1, 10, 13, 16, 19, 25, 31, 37, 46, 49,
)  # fmt: skip
"""Of an observer's memory: samples so far, rotation (9), position of C (3), its velocity (3), a
turn or the angular momentum (3), the known wrench about C of the sample before (6), the estimated
one (6), momentum (6), room for a rotation (9) and a vector (3)."""

SMALL = 1e-7
"""Angles below this [rad] are their sines."""


@njit(cache=True)
def _log(A: Array, B: Array, out: Array) -> None:
    """Rotation vector of A B', of two rotations row by row, shape (9,) each; below half a turn."""
    x = y = z = trace = 0.0
    for k in range(3):
        a0, a1, a2 = A[k], A[3 + k], A[6 + k]
        b0, b1, b2 = B[k], B[3 + k], B[6 + k]
        x += a2 * b1 - a1 * b2
        y += a0 * b2 - a2 * b0
        z += a1 * b0 - a0 * b1
        trace += a0 * b0 + a1 * b1 + a2 * b2
    sine = 0.5 * np.sqrt(x * x + y * y + z * z)
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    scale = 0.5 if sine < SMALL else 0.5 * angle / sine
    out[0], out[1], out[2] = scale * x, scale * y, scale * z


@njit(cache=True)
def _turn(R: Array, wx: float, wy: float, wz: float) -> None:
    """R <- exp([w]x) R, row by row, shape (9,)."""
    square = wx * wx + wy * wy + wz * wz
    theta = np.sqrt(square)
    if theta < SMALL:
        a, b = 1.0, 0.5
    else:
        a, b = np.sin(theta) / theta, (1.0 - np.cos(theta)) / square
    for k in range(3):
        x, y, z = R[k], R[3 + k], R[6 + k]
        cx, cy, cz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        dx, dy, dz = wy * cz - wz * cy, wz * cx - wx * cz, wx * cy - wy * cx
        R[k], R[3 + k], R[6 + k] = x + a * cx + b * dx, y + a * cy + b * dy, z + a * cz + b * dz


@njit(cache=True)
def _turned(R: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R times a vector."""
    return (
        R[0] * x + R[1] * y + R[2] * z,
        R[3] * x + R[4] * y + R[5] * z,
        R[6] * x + R[7] * y + R[8] * z,
    )


@njit(cache=True)
def _turned_back(R: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R' times a vector."""
    return (
        R[0] * x + R[3] * y + R[6] * z,
        R[1] * x + R[4] * y + R[7] * z,
        R[2] * x + R[5] * y + R[8] * z,
    )


@njit(cache=True)
def _inertia_times(
    R: Array, body: Array, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """R I R' times a vector in W."""
    p0, p1, p2 = _turned_back(R, x, y, z)
    q0, q1, q2 = _turned(body[INERTIA : INERTIA + 9], p0, p1, p2)
    return _turned(R, q0, q1, q2)


@njit(cache=True)
def _solve_inertia(R: Array, body: Array, n0: float, n1: float, n2: float, out: Array) -> None:
    """out <- (R I R')^-1 n, by Cramer's rule."""
    p0, p1, p2 = _turned_back(R, n0, n1, n2)
    a, b, c, d, e, f = body[4], body[5], body[6], body[8], body[9], body[12]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    det = a * A + b * B + c * C
    q0 = (A * p0 + B * p1 + C * p2) / det
    q1 = (B * p0 + D * p1 + E * p2) / det
    q2 = (C * p0 + E * p1 + F * p2) / det
    out[0], out[1], out[2] = _turned(R, q0, q1, q2)


@njit(cache=True)
def _arm(R: Array, body: Array) -> tuple[float, float, float]:
    """From Po to C in W."""
    return _turned(R, body[COM], body[COM + 1], body[COM + 2])


@njit(cache=True)
def _centre(R: Array, p: Array, body: Array, i: int) -> float:
    """Coordinate i of C in W."""
    at: float = p[i] + R[3 * i] * body[1] + R[3 * i + 1] * body[2] + R[3 * i + 2] * body[3]
    return at


@njit(cache=True)
def known_about_com(R: Array, cables: Array, body: Array, out: Array) -> None:
    """out[:6] <- moment about C and force of cables, given about Po, and of the weight."""
    c0, c1, c2 = _arm(R, body)
    fx, fy, fz = cables[3], cables[4], cables[5]
    out[0] = cables[0] - (c1 * fz - c2 * fy)
    out[1] = cables[1] - (c2 * fx - c0 * fz)
    out[2] = cables[2] - (c0 * fy - c1 * fx)
    for i in range(3):
        out[3 + i] = cables[3 + i] + body[MASS] * body[GRAVITY + i]


@njit(cache=True)
def about_origin(R: Array, outer: Array, body: Array, out: Array) -> None:
    """out[:6] <- a wrench about C as one about Po."""
    c0, c1, c2 = _arm(R, body)
    fx, fy, fz = outer[3], outer[4], outer[5]
    out[0] = outer[0] + c1 * fz - c2 * fy
    out[1] = outer[1] + c2 * fx - c0 * fz
    out[2] = outer[2] + c0 * fy - c1 * fx
    out[3], out[4], out[5] = fx, fy, fz


@njit(cache=True)
def static_step(
    R: Array, p: Array, cables: Array, body: Array, rates: Array, memory: Array, out: Array
) -> None:
    """The wrench that balances cables and weight, smoothed; see `momentum_step` for arguments."""
    known = memory[KNOWN : KNOWN + 6]
    known_about_com(R, cables, body, known)
    outer, kept = memory[OUTER : OUTER + 6], np.exp(-rates[0] * rates[1])
    if memory[SEEN] == 0.0:
        kept = 0.0
    for i in range(6):
        outer[i] = kept * outer[i] - (1.0 - kept) * known[i]
    memory[SEEN] += 1.0
    about_origin(R, outer, body, out)


@njit(cache=True)
def momentum_step(
    R: Array, p: Array, cables: Array, body: Array, rates: Array, memory: Array, out: Array
) -> None:
    """A sample of the momentum observer.

    The momentum between two samples is that of the displacement; its change from one pair to the
    next, over the period, less what was known at the sample in the middle, is the wrench then.

    Args:
        R: R_WP row by row, shape (9,).
        p: Position of Po, shape (3,) [m].
        cables: Wrench of the cables about Po in W, shape (6,) [N m, N].
        body: Shape (`BODY_SIZE`,).
        rates: Bandwidth [1/s] and period [s].
        memory: Shape (`MEMORY_SIZE`,), zeros before the first sample; changed.
        out: Estimated wrench about Po in W, shape (6,) [N m, N]; written.
    """
    T, before = rates[1], memory[R_AT : R_AT + 9]
    kept, seen = np.exp(-rates[0] * T), memory[SEEN]
    outer, known = memory[OUTER : OUTER + 6], memory[KNOWN : KNOWN + 6]
    momentum, turn = memory[MOMENTUM : MOMENTUM + 6], memory[W_AT : W_AT + 3]
    arm = _arm(R, body)
    if seen > 0.0:
        _log(R, before, turn)
        _turn(before, 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2])
        h0, h1, h2 = _inertia_times(before, body, turn[0] / T, turn[1] / T, turn[2] / T)
        now = memory[V_AT : V_AT + 3]
        now[0], now[1], now[2] = h0, h1, h2
        for i in range(3):
            linear = body[MASS] * (arm[i] + p[i] - memory[C_AT + i]) / T
            if seen > 1.0:
                share = 1.0 - kept
                angular = (now[i] - momentum[i]) / T - known[i]
                force = (linear - momentum[3 + i]) / T - known[3 + i]
                outer[i] += share * (angular - outer[i])
                outer[3 + i] += share * (force - outer[3 + i])
            momentum[i], momentum[3 + i] = now[i], linear
    for i in range(9):
        before[i] = R[i]
    for i in range(3):
        memory[C_AT + i] = p[i] + arm[i]
    known_about_com(R, cables, body, known)
    memory[SEEN] += 1.0
    about_origin(R, outer, body, out)


@njit(cache=True)
def extended_step(
    R: Array, p: Array, cables: Array, body: Array, rates: Array, memory: Array, out: Array
) -> None:
    """A sample of the extended state observer: pose, velocity, and the wrench as a state.

    All three poles of its error are at exp(-bandwidth period). Arguments as of `momentum_step`.
    """
    T, pole = rates[1], np.exp(-rates[0] * rates[1])
    own, known = memory[R_AT : R_AT + 9], memory[KNOWN : KNOWN + 6]
    outer, now = memory[OUTER : OUTER + 6], memory[MOMENTUM : MOMENTUM + 6]
    v, h, c = memory[V_AT : V_AT + 3], memory[W_AT : W_AT + 3], memory[C_AT : C_AT + 3]
    known_about_com(R, cables, body, now)
    if memory[SEEN] == 0.0:
        for i in range(9):
            own[i] = R[i]
        for i in range(3):
            c[i] = _centre(R, p, body, i)
        for i in range(6):
            outer[i] = -now[i]  # at rest
    else:
        first, second = 1.0 - pole**3, 1.5 * (1.0 - pole) ** 2 * (1.0 + pole) / T
        third = (1.0 - pole) ** 3 / T**2
        # Ahead by the mean of what was known at both ends; the turn is that of halfway.
        halfway, turn = memory[HALFWAY : HALFWAY + 9], memory[TURN : TURN + 3]
        for i in range(3):
            known[i] = outer[i] + 0.5 * (known[i] + now[i])
        for i in range(9):
            halfway[i] = own[i]
        _solve_inertia(own, body, h[0], h[1], h[2], turn)
        _turn(halfway, 0.5 * T * turn[0], 0.5 * T * turn[1], 0.5 * T * turn[2])
        for i in range(3):
            h[i] += 0.5 * T * known[i]
        _solve_inertia(halfway, body, h[0], h[1], h[2], turn)
        _turn(own, T * turn[0], T * turn[1], T * turn[2])
        for i in range(3):
            h[i] += 0.5 * T * known[i]
        for i in range(3):
            a = (outer[3 + i] + 0.5 * (known[3 + i] + now[3 + i])) / body[MASS]
            c[i] += T * (v[i] + 0.5 * T * a)
            v[i] += T * a
            wrong = _centre(R, p, body, i) - c[i]
            c[i] += first * wrong
            v[i] += second * wrong
            outer[3 + i] += body[MASS] * third * wrong
        _log(R, own, turn)
        known[0], known[1], known[2] = _inertia_times(R, body, turn[0], turn[1], turn[2])
        _turn(own, first * turn[0], first * turn[1], first * turn[2])
        for i in range(3):
            h[i] += second * known[i]
            outer[i] += third * known[i]
    for i in range(6):
        known[i] = now[i]
    memory[SEEN] += 1.0
    about_origin(R, outer, body, out)
