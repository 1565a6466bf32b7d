"""Numba kernels for cables of given tensions: force on the platform, lengths and length rates.

The cables are massless and inextensible, and straight from their exit points or their pulleys; what
drives them sets their tensions. A cable cannot push: a tension below zero loads the platform with
nothing. Where the kernels are told so, rods take the place of the cables, and a tension below zero
pushes. The platform's state is that of `straight_kernel`, cables are `CableSet.packed()`,
of which exit and anchor points, pulleys and swivel axes matter here. Where a cable cannot run over
its pulley, what is written is NaN.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import Motion, joint_motion
from cdpr_drake.geometry.pulley_kernel import pulley_line


@njit(cache=True)
def _platform_force(X: Motion, tensions: Array, cables: Array, push: bool) -> Any:
    mx = my = mz = fx = fy = fz = 0.0
    for i in range(cables.shape[0]):
        t = tensions[i]
        if t <= 0.0 and not push:  # written so that NaN goes on and shows
            continue
        _, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        fx -= t * ux
        fy -= t * uy
        fz -= t * uz
        mx -= t * (ry * uz - rz * uy)
        my -= t * (rz * ux - rx * uz)
        mz -= t * (rx * uy - ry * ux)
    return mx, my, mz, fx, fy, fz


@njit(cache=True)
def tension_force(
    state: Array, tensions: Array, cables: Array, height: float, push: bool, start: int, out: Array
) -> None:
    """Writes the generalized force -J' max(t, 0) of all cables on a platform.

    That is the wrench (moment about Po, force) in W [N m, N] of a floating platform, (f_x, f_y,
    m_z) of one on a planar joint, (f_x,) of one on a prismatic joint.

    Args:
        state: State of the platform, shape (13,) floating, (6,) planar or (2,) on a line.
        tensions: Commanded tensions t, shape (m,) [N].
        cables: Packed cables, shape (m, 17).
        height: Height of the plane of a planar joint [m]; not used for a floating platform.
        push: Whether a tension below zero pushes, -J' t.
        start: Where the platform's velocities begin among those of the plant.
        out: Generalized force of the whole plant, shape (nv,); entries of other bodies become 0.

    Source: servoing thesis (1.24), over pulleys with the Jacobian (1.20).
    """
    out[:] = 0.0
    motion = joint_motion(state, height)
    mx, my, mz, fx, fy, fz = _platform_force(motion, tensions, cables, push)
    if state.shape[0] < 13:
        out[start] = fx
        if state.shape[0] == 6:
            out[start + 1] = fy
            out[start + 2] = mz
        return
    out[start] = mx
    out[start + 1] = my
    out[start + 2] = mz
    out[start + 3] = fx
    out[start + 4] = fy
    out[start + 5] = fz


@njit(cache=True)
def _cable_motions(X: Motion, cables: Array, out: Array) -> None:
    for i in range(cables.shape[0]):
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        out[0, i] = length
        out[1, i] = (
            ux * (X[15] + X[13] * rz - X[14] * ry)
            + uy * (X[16] + X[14] * rx - X[12] * rz)
            + uz * (X[17] + X[12] * ry - X[13] * rx)
        )


@njit(cache=True)
def cable_motions(state: Array, cables: Array, height: float, out: Array) -> None:
    """Writes lengths from A_i to B_i [m] and their rates [m/s] to `out`, shape (2, m).

    Other arguments as `tension_force`.

    Source: servoing thesis (1.2), (1.19), over pulleys (1.17), (1.20).
    """
    _cable_motions(joint_motion(state, height), cables, out)
