"""Numba kernel of a grip: the forces between a platform and a box that a compliance holds."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.rotation_kernel import quaternion_into

FORCES = 14
"""Numbers that the kernel writes."""


@njit(cache=True)
def _turned(q: Array, p: Array, R: Array, out: Array) -> None:
    """out <- R(q) p for a quaternion that need not be of unit length; R is left as well."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    quaternion_into(q[0], q[1], q[2], q[3], 2.0 / square, R)
    for i in range(3):
        out[i] = R[i, 0] * p[0] + R[i, 1] * p[1] + R[i, 2] * p[2]


@njit(cache=True)
def _cross(a: Array, b: Array, i: int) -> float:
    """Component i of a x b."""
    j, k = (i + 1) % 3, (i + 2) % 3
    return float(a[j] * b[k] - a[k] * b[j])


@njit(cache=True)
def grip_forces(
    platform: Array, box: Array, hold: Array, p_BF: Array, law: Array, work: Array
) -> None:
    """Writes what a grip does to both bodies.

    Args:
        platform: State of the platform: quaternion, position [m], (w, v) in W [rad/s, m/s], (13,).
        box: State of the box, the same.
        hold: Pose X_PB at which the compliance rests: quaternion, position [m], shape (7,).
        p_BF: Where the grip holds the box, in B, shape (3,) [m].
        law: Stiffness [N/m], damping [N s/m], rotational stiffness [N m] and damping [N m s], (4,).
        work: Out, shape (`FORCES`,): moment about Po and force on the platform, moment about Bo and
            force on the box, in W [N m, N]; force on the box along z of P; its norm [N].
    """
    R_P, R_B, R_H = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    arm_P, arm_B, p_PF = np.empty(3), np.empty(3), np.empty(3)
    _turned(hold[:4], p_BF, R_H, p_PF)
    for i in range(3):
        p_PF[i] += hold[4 + i]
    _turned(platform[:4], p_PF, R_P, arm_P)
    _turned(box[:4], p_BF, R_B, arm_B)
    # Turn of the box against where it should be, R_B (R_P R_H)^T, as a rotation vector.
    turned = R_B @ (R_P @ R_H).T
    w = 0.5 * np.sqrt(max(1.0 + turned[0, 0] + turned[1, 1] + turned[2, 2], 1e-12))
    x = np.array([
        turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]
    ]) / (4.0 * w)  # fmt: skip
    sine = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    share = 2.0 if sine < 1e-8 else 2.0 * np.arctan2(sine, w) / sine
    moment, force, lever = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        # Both forces act where the grip holds the box, so that no moment is made out of nothing.
        lever[i] = box[4 + i] + arm_B[i] - platform[4 + i]
    for i in range(3):
        moment[i] = -law[2] * share * x[i] - law[3] * (box[7 + i] - platform[7 + i])
        slip = platform[10 + i] + _cross(platform[7:10], lever, i)
        slip -= box[10 + i] + _cross(box[7:10], arm_B, i)
        force[i] = law[0] * (arm_P[i] - lever[i]) + law[1] * slip
    along = 0.0
    square = 0.0
    for i in range(3):
        work[i] = -moment[i] - _cross(lever, force, i)
        work[3 + i] = -force[i]
        work[6 + i] = moment[i] + _cross(arm_B, force, i)
        work[9 + i] = force[i]
        along += R_P[i, 2] * force[i]
        square += force[i] * force[i]
    work[12] = along
    work[13] = np.sqrt(square)
