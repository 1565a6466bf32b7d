"""Numba kernels for contacts that rub as a platform turns; see `contact_hysteresis` for the law.

Those for whole robots are shared: one that does not rub neither compiles nor calls them. A law is
packed as K of the turns that the platform has, and a, see `pack_contacts`. Of a floating platform z
and K are in P, moments and velocities in W; of one in a plane there is one of each.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.geometry.rotation_kernel import quaternion_into
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

SLIP, CONTACTS = 3, 4
"""Where a stands in a packed law, behind K, and how many numbers that has."""

FLOATING_TURN, PLANAR_TURN = 7, 5
"""Where the angular velocity begins in the state of a floating platform, and of one in a plane."""

_PLANAR_MOMENT = 2


def pack_contacts(contacts: ContactHysteresis | None, joint: PlatformJoint) -> tuple[int, Array]:
    """How many turns are rubbed against, and the law, shape (`CONTACTS`,).

    Args:
        contacts: The law; None: nothing rubs.
        joint: What the platform moves by.
    """
    law = np.zeros(CONTACTS)
    if contacts is None or not contacts.is_there():
        return 0, law
    along = contacts.along(joint)
    law[: len(along)], law[SLIP] = along, contacts.slip
    return len(along), law


@njit(cache=True)
def _rotation(state: Array, R: Array) -> None:
    q = state[:4]
    s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    quaternion_into(q[0], q[1], q[2], q[3], s, R)


@shared(types.void(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR))
@njit(cache=True)
def rub(state: Array, bent: Array, law: Array, force: Array, rates: Array) -> None:
    """Adds M to the generalized force on a platform, and writes dz/dt.

    Args:
        state: Begins with the platform's state, 13 numbers, or 6 where there is one z.
        bent: z, shape (3,) in P, or (1,) [rad].
        law: As `pack_contacts` has it.
        force: The moment about Po in W first, or (f_x, f_y, m_z) in F; changed.
        rates: Where dz/dt is written, shape as z [rad/s].
    """
    if bent.shape[0] == 1:
        w = state[PLANAR_TURN]
        rates[0] = w - abs(w) / law[SLIP] * bent[0]
        force[_PLANAR_MOMENT] -= law[0] * bent[0]
        return
    R = np.empty((3, 3))
    _rotation(state, R)
    wx, wy, wz = state[FLOATING_TURN], state[FLOATING_TURN + 1], state[FLOATING_TURN + 2]
    back = np.sqrt(wx * wx + wy * wy + wz * wz) / law[SLIP]
    for i in range(3):
        rates[i] = R[0, i] * wx + R[1, i] * wy + R[2, i] * wz - back * bent[i]
        for j in range(3):
            force[i] -= R[i, j] * law[j] * bent[j]


@shared(types.void(VECTOR, types.int64, VECTOR, types.float64, MATRIX))
@njit(cache=True)
def stiffen_by_contacts(state: Array, turns: int, law: Array, share: float, S: Array) -> None:
    """Adds what contacts that stick add to the matrix of an implicit stage: share^2 R K R'.

    Args:
        state: Begins with the platform's state.
        turns: 3, or 1 of a platform in a plane.
        law: As `pack_contacts` has it.
        share: Share of the step that is implicit [s].
        S: The matrix, its first rows those of the platform; changed.
    """
    if turns == 1:
        S[_PLANAR_MOMENT, _PLANAR_MOMENT] += share * share * law[0]
        return
    R = np.empty((3, 3))
    _rotation(state, R)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                S[i, j] += share * share * R[i, k] * law[k] * R[j, k]


@shared(types.void(VECTOR, types.int64, VECTOR, types.float64, VECTOR, VECTOR))
@njit(cache=True)
def push_by_contacts(
    state: Array, turns: int, law: Array, share: float, bends: Array, x: Array
) -> None:
    """Takes share R K b from the right hand side of an implicit stage.

    Args:
        state: Begins with the platform's state.
        turns: 3, or 1 of a platform in a plane.
        law: As `pack_contacts` has it.
        share: Share of the step that is implicit [s].
        bends: b, right hand sides of z, shape (turns,).
        x: The right hand side, its first rows those of the platform; changed.
    """
    if turns == 1:
        x[_PLANAR_MOMENT] -= share * law[0] * bends[0]
        return
    R = np.empty((3, 3))
    _rotation(state, R)
    for i in range(3):
        for j in range(3):
            x[i] -= share * R[i, j] * law[j] * bends[j]


@shared(types.void(VECTOR, types.int64, types.float64, VECTOR, VECTOR))
@njit(cache=True)
def bend_by_stage(state: Array, turns: int, share: float, speeds: Array, bends: Array) -> None:
    """Adds to what a stage has of z by how it changes velocities: share R' k.

    Args:
        state: Begins with the platform's state.
        turns: 3, or 1 of a platform in a plane.
        share: Share of the step that is implicit [s].
        speeds: k of the platform's velocities, shape (nv,).
        bends: k of z, shape (turns,); changed.
    """
    if turns == 1:
        bends[0] += share * speeds[_PLANAR_MOMENT]
        return
    R = np.empty((3, 3))
    _rotation(state, R)
    for i in range(3):
        for j in range(3):
            bends[i] += share * R[j, i] * speeds[j]
