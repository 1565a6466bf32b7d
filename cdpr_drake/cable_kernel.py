"""Numba kernels for straight elastic cables that only pull: force on the platform and tensions.

A cable is a Kelvin-Voigt rod of axial stiffness E S: with strain e = l / l0 - 1,

    t = E S (e + T de/dt)  where e > 0 and that is positive, else exactly 0,

T being the retardation time [s]. The platform's state comes as MultibodyPlant gives it: for a
floating body (quaternion wxyz, position, angular velocity, velocity), for a planar joint
(x, y, theta and their rates).

Source of the elastic law: servoing thesis (2.6), there without damping.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

Motion = tuple[float, ...]

CABLE_COLUMNS = 8
"""Columns of the packed cable array: exit point (3), anchor point (3), E S [N], T [s]."""


def pack_cables(p_WA: Array, p_PB: Array, stiffness: Array, retardation: Array) -> Array:
    """Cables as one contiguous array, shape (m, 8), for the kernels of this module.

    Args:
        p_WA: Exit points, shape (3, m) [m].
        p_PB: Anchor points, shape (3, m) [m].
        stiffness: Axial stiffness E S, shape (m,) [N].
        retardation: Retardation time T, shape (m,) [s].
    """
    return np.ascontiguousarray(np.vstack([p_WA, p_PB, stiffness, retardation]).T, dtype=float)


@njit(cache=True)
def floating_motion(state: Array) -> Any:
    """Rotation (row by row), position, angular velocity, velocity of a floating platform in W."""
    w, x, y, z = state[0], state[1], state[2], state[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y),
        state[4], state[5], state[6],
        state[7], state[8], state[9],
        state[10], state[11], state[12],
    )  # fmt: skip


@njit(cache=True)
def planar_motion(state: Array, height: float) -> Any:
    """The same for a platform that slides in the plane z = height [m] of W."""
    c, s = np.cos(state[2]), np.sin(state[2])
    return (
        c, -s, 0.0,
        s, c, 0.0,
        0.0, 0.0, 1.0,
        state[0], state[1], height,
        0.0, 0.0, state[5],
        state[3], state[4], 0.0,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def cable_line(X: Motion, cable: Array) -> Any:
    """Length [m], unit vector A to B and anchor arm in W (3 + 3) of one cable.

    The unit vector of a cable of no length is NaN.
    """
    bx, by, bz = cable[3], cable[4], cable[5]
    rx = X[0] * bx + X[1] * by + X[2] * bz
    ry = X[3] * bx + X[4] * by + X[5] * bz
    rz = X[6] * bx + X[7] * by + X[8] * bz
    dx = X[9] + rx - cable[0]
    dy = X[10] + ry - cable[1]
    dz = X[11] + rz - cable[2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    per_length = 1.0 / length
    return length, dx * per_length, dy * per_length, dz * per_length, rx, ry, rz


@njit(cache=True)
def cable_pull(X: Motion, cable: Array, l0: float, l0_dot: float) -> Any:
    """Tension [N], length [m], unit vector A to B and anchor arm in W (3 + 3) of one cable.

    Args:
        X: Motion of the platform from `floating_motion` or `planar_motion`.
        cable: One row of the packed cables, shape (8,).
        l0: Unstrained length [m].
        l0_dot: Its rate [m/s].
    """
    length, ux, uy, uz, rx, ry, rz = cable_line(X, cable)
    per_l0 = 1.0 / l0
    strain = length * per_l0 - 1.0
    tension = 0.0
    if strain > 0.0:
        length_dot = (
            ux * (X[15] + X[13] * rz - X[14] * ry)
            + uy * (X[16] + X[14] * rx - X[12] * rz)
            + uz * (X[17] + X[12] * ry - X[13] * rx)
        )
        strain_rate = (length_dot - length * l0_dot * per_l0) * per_l0
        tension = cable[6] * (strain + cable[7] * strain_rate)
        if tension < 0.0:
            tension = 0.0
    return tension, length, ux, uy, uz, rx, ry, rz


@njit(cache=True)
def _platform_force(X: Motion, l0: Array, l0_dot: Array, cables: Array) -> Any:
    mx = my = mz = fx = fy = fz = 0.0
    for i in range(cables.shape[0]):
        t, _, ux, uy, uz, rx, ry, rz = cable_pull(X, cables[i], l0[i], l0_dot[i])
        fx -= t * ux
        fy -= t * uy
        fz -= t * uz
        mx -= t * (ry * uz - rz * uy)
        my -= t * (rz * ux - rx * uz)
        mz -= t * (rx * uy - ry * ux)
    return mx, my, mz, fx, fy, fz


@njit(cache=True)
def floating_force(
    state: Array, l0: Array, l0_dot: Array, cables: Array, start: int, out: Array
) -> None:
    """Writes the generalized force of all cables on a floating platform.

    That is the wrench (moment about Po, force) in W [N m, N].

    Args:
        state: State of the platform, shape (13,).
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        cables: Packed cables, shape (m, 8).
        start: Where the platform's six velocities begin among those of the plant.
        out: Generalized force of the whole plant, shape (nv,); entries of other bodies become 0.
    """
    out[:] = 0.0
    mx, my, mz, fx, fy, fz = _platform_force(floating_motion(state), l0, l0_dot, cables)
    out[start] = mx
    out[start + 1] = my
    out[start + 2] = mz
    out[start + 3] = fx
    out[start + 4] = fy
    out[start + 5] = fz


@njit(cache=True)
def planar_force(
    state: Array, l0: Array, l0_dot: Array, cables: Array, start: int, out: Array, height: float
) -> None:
    """As `floating_force` for a platform on a planar joint: (f_x, f_y, moment about z)."""
    out[:] = 0.0
    _, _, mz, fx, fy, _ = _platform_force(planar_motion(state, height), l0, l0_dot, cables)
    out[start] = fx
    out[start + 1] = fy
    out[start + 2] = mz


@njit(cache=True)
def _cable_states(X: Motion, l0: Array, l0_dot: Array, cables: Array, out: Array) -> None:
    for i in range(cables.shape[0]):
        t, length, _, _, _, _, _, _ = cable_pull(X, cables[i], l0[i], l0_dot[i])
        out[0, i] = t
        out[1, i] = length
        out[2, i] = 1.0 if t == 0.0 else 0.0


@njit(cache=True)
def floating_cables(state: Array, l0: Array, l0_dot: Array, cables: Array, out: Array) -> None:
    """Writes tensions [N], lengths [m] and slack flags (0 or 1) to `out`, shape (3, m)."""
    _cable_states(floating_motion(state), l0, l0_dot, cables, out)


@njit(cache=True)
def planar_cables(
    state: Array, l0: Array, l0_dot: Array, cables: Array, out: Array, height: float
) -> None:
    """As `floating_cables` for a platform on a planar joint."""
    _cable_states(planar_motion(state, height), l0, l0_dot, cables, out)
