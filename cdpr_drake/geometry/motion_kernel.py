"""Numba kernels for the motion of a platform from its state, and for a straight cable on it.

The platform's state comes as MultibodyPlant gives it: for a floating body (quaternion wxyz,
position, angular velocity, velocity), for a planar joint (x, y, theta and their rates), for one
along a line (x and its rate); `PlatformJoint` says in which frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

CABLE_COLUMNS = 8
"""Columns of the packed cable array: exit point (3), anchor point (3), E S [N], T [s]."""


Motion = tuple[float, ...]


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


@njit(cache=True, error_model="numpy")
def floating_motion(state: Array) -> Any:
    """Rotation (row by row), position, angular velocity, velocity of a floating platform in W.

    Of a quaternion of no length NaN: a kernel that may raise counts references of all its arrays,
    which takes as long as three cables.
    """
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


@njit(cache=True)
def line_motion(state: Array) -> Any:
    """The same for a platform that slides along x, state (x, rate)."""
    return (
        1.0, 0.0, 0.0,
        0.0, 1.0, 0.0,
        0.0, 0.0, 1.0,
        state[0], 0.0, 0.0,
        0.0, 0.0, 0.0,
        state[1], 0.0, 0.0,
    )  # fmt: skip


@njit(cache=True)
def joint_motion(state: Array, height: float) -> Any:
    """The motion of a platform on any joint, which the size of its state tells.

    Args:
        state: Shape (13,) floating, (6,) in a plane, (2,) along a line.
        height: Height of the plane [m]; not read otherwise.
    """
    if state.shape[0] == 13:
        return floating_motion(state)
    if state.shape[0] == 6:
        return planar_motion(state, height)
    return line_motion(state)
