"""Numba kernel: what a point of a path asks of cables, linear in d2s/dt2 and (ds/dt)^2.

With u = d2s/dt2 and x = (ds/dt)^2, velocity X' sqrt(x) and acceleration X' u + X'' x of the
platform need a wrench that is linear in (u, x), and so are, up to the null space of the wrench
matrix, the tensions that give it, and the accelerations of the cables:

    t = T_0 + T_u u + T_x x + N' eta,    d2l/dt2 = l' u + l'' x,    dl/dt = l' sqrt(x).

Viscous damping of the platform needs a wrench D X' sqrt(x), which is not linear in x. It is taken
as D X' x / v, which is exact at a speed v = ds/dt: the caller says at which.

Source: Bobrow, Dubowsky and Gibson, 1985; for cable robots with redundancy as free variables,
Pham and Stasse, Time-optimal path parameterization for redundantly actuated robots, 2015.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import floating_wrench
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line, unit_vector_derivative
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS, add_platform_turning
from cdpr_drake.tensions.quadratic_program_kernel import null_space

T_0, T_U, T_X, RATE, BEND = range(5)
"""Rows of a station that are the same for all robots: T_0 [N], T_u [N s^2/m], T_x [N s^2/m^2],
l' [-], l'' [1/m]. The null space N follows, row by row."""

BASIS = 5
"""First row of the null space."""

GOOD, NO_CABLE, SINGULAR = range(3)
"""What may be said of a station: all well, a cable that cannot run, a singular wrench matrix."""


@njit(cache=True)
def stations_of(
    points: Array, cables: Array, dynamics: Array, moves: np.ndarray, slowness: Array, out: Array,
    reach: Array,
) -> tuple[int, int]:  # fmt: skip
    """Fills the rows of all stations.

    Args:
        points: Points of the path as `pose_path.PosePath.points`, shape (n, 19).
        cables: `CableSet.packed`, shape (m, 17).
        dynamics: `PlatformDynamics.packed`.
        moves: Components of a spatial vector in W that the platform can move, whole numbers in
            growing order, shape (f,).
        slowness: 1 / v, shape (n,) [s/m]; 0: without damping.
        out: Gets the rows, shape (n, 5 + r, m), r = m - f.
        reach: Gets |p'| of Po, shape (n,).

    Returns:
        (`GOOD`, n), or what is wrong and the first station where it is.
    """
    n, m = points.shape[0], cables.shape[0]
    rows = moves.shape[0]
    state, desired, still = np.zeros(13), np.zeros(19), np.zeros(4)
    F0, Fu, Fx, back = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    W, D = np.empty((rows, m)), np.empty((3, 3))
    N, spare = np.empty((m - rows, m)), np.empty((m - rows, m))
    w, turning, pull = np.empty((3, rows)), np.empty((6, 6)), np.empty(6)
    for i in range(n):
        point = points[i]
        for k in range(7):
            state[k] = point[k]
            desired[k] = point[k]
        for k in range(6):
            state[7 + k] = 0.0
            desired[7 + k] = 0.0
            desired[13 + k] = 0.0
        # Without gains the computed torque is the wrench of a motion.
        floating_wrench(state, desired, dynamics, still, F0)
        for k in range(6):
            desired[13 + k] = point[7 + k]
        floating_wrench(state, desired, dynamics, still, Fu)
        for k in range(6):
            state[7 + k] = point[7 + k]
            desired[7 + k] = point[7 + k]
            desired[13 + k] = point[13 + k]
        floating_wrench(state, desired, dynamics, still, Fx)
        for k in range(6):
            state[7 + k] = -point[7 + k]
        floating_wrench(state, desired, dynamics, still, back)
        for k in range(rows):
            row = moves[k]
            # Backwards the terms of velocity are the same but those of damping, which turn around.
            even, odd = 0.5 * (Fx[row] + back[row]), 0.5 * (Fx[row] - back[row])
            w[0, k] = -F0[row]
            w[1, k] = F0[row] - Fu[row]
            w[2, k] = F0[row] - even - slowness[i] * odd
        X = floating_motion(state)[:12]
        wx, wy, wz = point[7], point[8], point[9]
        ax, ay, az = point[13], point[14], point[15]
        for j in range(m):
            _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[j])
            if ux != ux:
                return NO_CABLE, i
            pull[0], pull[1], pull[2] = ry * uz - rz * uy, rz * ux - rx * uz, rx * uy - ry * ux
            pull[3], pull[4], pull[5] = ux, uy, uz
            for k in range(rows):
                W[k, j] = -pull[moves[k]]
            # First and second derivative of the anchor point's place by s.
            tx, ty, tz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
            vx, vy, vz = point[10] + tx, point[11] + ty, point[12] + tz
            bx = point[16] + ay * rz - az * ry + wy * tz - wz * ty
            by = point[17] + az * rx - ax * rz + wz * tx - wx * tz
            bz = point[18] + ax * ry - ay * rx + wx * ty - wy * tx
            unit_vector_derivative(X, cables[j], D)
            out[i, RATE, j] = ux * vx + uy * vy + uz * vz
            out[i, BEND, j] = (
                ux * bx + uy * by + uz * bz
                + vx * (D[0, 0] * vx + D[0, 1] * vy + D[0, 2] * vz)
                + vy * (D[1, 0] * vx + D[1, 1] * vy + D[1, 2] * vz)
                + vz * (D[2, 0] * vx + D[2, 1] * vy + D[2, 2] * vz)
            )  # fmt: skip
            if cables[j, ANCHOR_RADIUS] > 0.0:  # the line also moves in the platform
                turning[:] = 0.0
                add_platform_turning(X, cables[j], 1.0, turning)
                for k in range(6):
                    for q in range(6):
                        out[i, BEND, j] += point[7 + k] * turning[k, q] * point[7 + q]
        if not null_space(W, w[0], out[i, T_0], N):
            return SINGULAR, i
        null_space(W, w[1], out[i, T_U], spare)
        null_space(W, w[2], out[i, T_X], spare)
        for k in range(m - rows):
            for j in range(m):
                out[i, BASIS + k, j] = N[k, j]
        reach[i] = np.sqrt(point[10] ** 2 + point[11] ** 2 + point[12] ** 2)
    return GOOD, n
