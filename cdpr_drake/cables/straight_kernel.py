"""Numba kernels for straight elastic cables that only pull: force on the platform and tensions.

A cable is a Kelvin-Voigt rod of axial stiffness E S: with strain e = l / l0 - 1,

    t = E S (e + T de/dt)  where e > 0 and that is positive, else exactly 0,

T being the retardation time [s]. The platform's state comes as MultibodyPlant gives it: for a
floating body (quaternion wxyz, position, angular velocity, velocity), for a planar joint
(x, y, theta and their rates), for a prismatic one (x and its rate); cables are in its frames, see
`geometry.PlatformJoint`.

Source of the elastic law: servoing thesis (2.6), there without damping.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import (
    Motion,
    cable_line,
    floating_motion,
    line_motion,
    planar_motion,
)


@njit(cache=True)
def cable_pull(X: Motion, cable: Array, l0: float, l0_dot: float) -> Any:
    """Tension [N], length [m], unit vector A to B and anchor arm in W (3 + 3) of one cable.

    Args:
        X: Motion of the platform from `floating_motion` or `planar_motion`.
        cable: One row of the packed cables, shape (8,).
        l0: Unstrained length [m].
        l0_dot: Its rate [m/s].
    """
    length, ux, uy, uz, rx, ry, rz = cable_line(X[:12], cable)
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
def line_force(
    state: Array, l0: Array, l0_dot: Array, cables: Array, start: int, out: Array
) -> None:
    """As `floating_force` for a platform on a prismatic joint along x: (f_x,)."""
    out[:] = 0.0
    _, _, _, fx, _, _ = _platform_force(line_motion(state), l0, l0_dot, cables)
    out[start] = fx
