"""From a camera's twist to cable velocities, through the platform frame or the base frame."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import adjoint_of_arrays
from cdpr_drake.geometry.pulley_kernel import PULLEY_RADIUS, pulley_line
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared


@njit(cache=True)
def _rate_over_pulley(R_WP: Array, p_WP: Array, cable: Array, w: Array, v: Array) -> float:
    """Rate of one cable's length [m/s] for a twist (w, v) of P in W, by servoing thesis (1.20)."""
    X = (
        R_WP[0, 0], R_WP[0, 1], R_WP[0, 2], R_WP[1, 0], R_WP[1, 1], R_WP[1, 2],
        R_WP[2, 0], R_WP[2, 1], R_WP[2, 2], p_WP[0], p_WP[1], p_WP[2],
    )  # fmt: skip
    _, ux, uy, uz, rx, ry, rz = pulley_line(X, cable)
    along = ux * (v[0] + w[1] * rz - w[2] * ry) + uy * (v[1] + w[2] * rx - w[0] * rz)
    return along + uz * (v[2] + w[0] * ry - w[1] * rx)


@shared(VECTOR(MATRIX, VECTOR, MATRIX, VECTOR))
@njit(cache=True)
def cable_rates_from_platform_twist(R_WP: Array, p_WP: Array, cables: Array, V_P: Array) -> Array:
    """Rates of the cable lengths, shape (m,) [m/s], by the Jacobian in the platform frame.

    Args:
        R_WP: Rotation of the platform P in W, shape (3, 3).
        p_WP: Its position, shape (3,) [m].
        cables: `CableSet.packed()`, shape (m, 17); over their pulleys, where they have any.
        V_P: Twist (w, v) of P in P, shape (6,) [rad/s, m/s].

    Source: servoing thesis (1.18), (1.19), there with twists (translation, rotation).
    """
    m = cables.shape[0]
    rates = np.empty(m)
    wx, wy, wz, vx, vy, vz = V_P
    for k in range(m):
        if cables[k, PULLEY_RADIUS] != 0.0 or cables[k, ANCHOR_RADIUS] > 0.0:
            w, v = R_WP @ np.ascontiguousarray(V_P[:3]), R_WP @ np.ascontiguousarray(V_P[3:])
            rates[k] = _rate_over_pulley(R_WP, p_WP, cables[k], w, v)
            continue
        bx, by, bz = cables[k, 3], cables[k, 4], cables[k, 5]
        dx, dy, dz = cables[k, 0] - p_WP[0], cables[k, 1] - p_WP[1], cables[k, 2] - p_WP[2]
        # The cable from A to B, in P.
        ux = bx - (R_WP[0, 0] * dx + R_WP[1, 0] * dy + R_WP[2, 0] * dz)
        uy = by - (R_WP[0, 1] * dx + R_WP[1, 1] * dy + R_WP[2, 1] * dz)
        uz = bz - (R_WP[0, 2] * dx + R_WP[1, 2] * dy + R_WP[2, 2] * dz)
        along = ux * (vx + wy * bz - wz * by)
        along += uy * (vy + wz * bx - wx * bz) + uz * (vz + wx * by - wy * bx)
        rates[k] = along / np.sqrt(ux * ux + uy * uy + uz * uz)
    return rates


@shared(VECTOR(MATRIX, VECTOR, MATRIX, VECTOR))
@njit(cache=True)
def cable_rates_from_base_twist(R_WP: Array, p_WP: Array, cables: Array, V_WP: Array) -> Array:
    """Rates of the cable lengths, shape (m,) [m/s], by the Jacobian in the base frame W.

    Arguments as for `cable_rates_from_platform_twist`, but the twist V_WP = (w, v) of P in W.

    Source: servoing thesis (A.3), there with twists (translation, rotation).
    """
    m = cables.shape[0]
    rates = np.empty(m)
    wx, wy, wz, vx, vy, vz = V_WP
    for k in range(m):
        if cables[k, PULLEY_RADIUS] != 0.0 or cables[k, ANCHOR_RADIUS] > 0.0:
            rates[k] = _rate_over_pulley(R_WP, p_WP, cables[k], V_WP[:3], V_WP[3:])
            continue
        b = R_WP @ cables[k, 3:6]
        u = b + p_WP - cables[k, :3]
        along = u[0] * (vx + wy * b[2] - wz * b[1])
        along += u[1] * (vy + wz * b[0] - wx * b[2]) + u[2] * (vz + wx * b[1] - wy * b[0])
        rates[k] = along / np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    return rates


@njit(cache=True)
def base_adjoint(R_WP: Array, R_PC: Array, p_PC: Array) -> Array:
    """Ad with V_WP = Ad @ V_C, from the camera's twist in C to the platform's in W, shape (6, 6).

    Source: servoing thesis (A.11), whose middle factor stands for [R_WP p_PC]x; there with twists
    (translation, rotation).
    """
    return adjoint_of_arrays(R_WP @ R_PC, R_WP @ p_PC)
