"""Numba kernels for cables of any model in a simulation: force on the platform, cable by cable.

They read the platform's state as MultibodyPlant gives it and write the generalized force. Without
pulleys and weight, `straight_kernel` does the same for straight cables, a little faster.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import cable_motion, slack_tension
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.models import STRAIGHT
from cdpr_drake.cables.response_kernel import DERIVATIVES, straight_motion
from cdpr_drake.geometry.motion_kernel import Motion, joint_motion

OUTPUTS = 6
"""Rows of `model_outputs`: tension at the platform, tension at the exit point, length, slack flag,
surplus over the straight path, sag."""


_LAW, _HEIGHT, _START, _GUESSES = 0, 1, 2, 3
_INNER, _OUTER = 3 * SENSITIVITIES, 4 * DERIVATIVES


def make_room(m: int, law: int, height: float = 0.0, start: int = 0, dtype: Any = float) -> Any:
    """Settings of the kernels and their room to work in, as one array: fewer arguments are faster.

    Args:
        m: Number of cables.
        law: Number of their law, see `CableModel`.
        height: Height of the plane of a planar joint [m]; not used for a floating platform.
        start: Where the platform's velocities begin among those of the plant.
        dtype: object for scalars other than float.
    """
    room = np.zeros(_GUESSES + 2 * m + _INNER + _OUTER, dtype=dtype)
    room[_LAW], room[_HEIGHT], room[_START] = law, height, start
    return room


@njit(cache=True)
def guesses_of(room: Array, m: int) -> Array:
    """Where catenaries keep their solution, and creeping cables what has crept, shape (m, 2)."""
    return room[_GUESSES : _GUESSES + 2 * m].reshape(m, 2)


@njit(cache=True)
def _parts(room: Array, m: int) -> Any:
    a = _GUESSES + 2 * m
    b = a + _INNER
    return (
        room[_GUESSES:a].reshape(m, 2),
        room[a:b].reshape(SENSITIVITIES, 3),
        room[b : b + _OUTER].reshape(DERIVATIVES, 4),
    )


@njit(cache=True)
def _force(
    X: Motion, law: int, l0: Array, l0_dot: Array, cables: Array,
    guesses: Array, inner: Array, D: Array, drum: Array,
) -> Any:  # fmt: skip
    mx = my = mz = fx = fy = fz = 0.0
    bad = -1
    for i in range(cables.shape[0]):
        px, py, pz, _, t_A, _, _, _, rx, ry, rz, good = cable_motion(
            law, X, cables[i], l0[i], l0_dot[i], guesses[i], inner, D
        )
        if not good and bad < 0:
            bad = i
        if drum.shape[0] > 0:
            drum[i] = t_A
        fx = fx - px
        fy = fy - py
        fz = fz - pz
        mx = mx - (ry * pz - rz * py)
        my = my - (rz * px - rx * pz)
        mz = mz - (rx * py - ry * px)
    return mx, my, mz, fx, fy, fz, bad


@njit(cache=True)
def _write_force(
    state: Array, l0: Array, l0_dot: Array, cables: Array, room: Array, out: Array, drum: Array
) -> int:
    out[:] = 0.0
    guesses, inner, D = _parts(room, cables.shape[0])
    law, start = int(room[_LAW]), int(room[_START])
    motion = joint_motion(state, room[_HEIGHT])
    mx, my, mz, fx, fy, fz, bad = _force(motion, law, l0, l0_dot, cables, guesses, inner, D, drum)
    if state.shape[0] < 13:
        out[start] = fx
        if state.shape[0] == 6:
            out[start + 1] = fy
            out[start + 2] = mz
        return bad
    out[start] = mx
    out[start + 1] = my
    out[start + 2] = mz
    out[start + 3] = fx
    out[start + 4] = fy
    out[start + 5] = fz
    return bad


@njit(cache=True)
def model_force(
    state: Array, l0: Array, l0_dot: Array, cables: Array, room: Array, out: Array
) -> int:
    """Writes the generalized force of all cables on a platform.

    That is the wrench (moment about Po, force) in W [N m, N] of a floating platform, (f_x, f_y,
    m_z) of one on a planar joint, (f_x,) of one on a prismatic joint.

    Args:
        state: State of the platform, shape (13,) floating, (6,) planar or (2,) on a line.
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        cables: `CableSet.packed()`, shape (m, 17); a retardation of 0 is an undamped cable.
        room: From `make_room`. Catenaries begin with the solution that they left there.
        out: Generalized force of the whole plant, shape (nv,); entries of other bodies become 0.

    Returns:
        Index of the first cable that cannot run at this pose, or -1.
    """
    return _write_force(state, l0, l0_dot, cables, room, out, out[:0])


@njit(cache=True)
def model_force_and_drums(
    state: Array, l0: Array, l0_dot: Array, cables: Array, room: Array, nv: int, out: Array
) -> int:
    """As `model_force`, and behind it the tensions at the exit points [N], shape (nv + m,)."""
    return _write_force(state, l0, l0_dot, cables, room, out[:nv], out[nv:])


@njit(cache=True, inline="always")
def write_outputs(
    out: Array, i: int,
    t: float, t_A: float, length: float, surplus: float, sag: float, slack: float,
) -> None:  # fmt: skip
    """Writes what cable i does, rows as in `OUTPUTS`; it is slack up to the tension `slack` [N]."""
    out[0, i] = t
    out[1, i] = t_A
    out[2, i] = length
    out[3, i] = 1.0 if t <= slack else 0.0
    out[4, i] = surplus
    out[5, i] = sag


@njit(cache=True)
def _outputs(
    X: Motion, law: int, l0: Array, l0_dot: Array, cables: Array,
    guesses: Array, inner: Array, D: Array, out: Array,
) -> int:  # fmt: skip
    bad = -1
    for i in range(cables.shape[0]):
        _, _, _, t, t_A, length, surplus, sag, _, _, _, good = cable_motion(
            law, X, cables[i], l0[i], l0_dot[i], guesses[i], inner, D
        )
        if not good and bad < 0:
            bad = i
        slack = slack_tension(law, cables[i, 9], l0[i])
        write_outputs(out, i, t, t_A, length, surplus, sag, slack)
    return bad


@njit(cache=True)
def model_outputs(
    state: Array, l0: Array, l0_dot: Array, cables: Array, room: Array, out: Array
) -> int:
    """Writes what the cables do, shape (6, m), rows as in `OUTPUTS`; arguments as `model_force`.

    Returns:
        Index of the first cable that cannot run at this pose, or -1.
    """
    guesses, inner, D = _parts(room, cables.shape[0])
    law = int(room[_LAW])
    motion = joint_motion(state, room[_HEIGHT])
    return _outputs(motion, law, l0, l0_dot, cables, guesses, inner, D, out)


@njit(cache=True)
def straight_outputs(
    state: Array, l0: Array, l0_dot: Array, cables: Array, room: Array, out: Array
) -> int:
    """As `model_outputs` for the law `STRAIGHT`, with the same numbers.

    A kernel of its own because sagging cables compile for seconds, and most robots have none.
    """
    bad = -1
    motion = joint_motion(state, room[_HEIGHT])
    for i in range(cables.shape[0]):
        _, _, _, t, t_A, length, surplus, sag, _, _, _, good = straight_motion(
            motion, cables[i], l0[i], l0_dot[i]
        )
        if not good and bad < 0:
            bad = i
        slack = slack_tension(STRAIGHT, cables[i, 9], l0[i])
        write_outputs(out, i, t, t_A, length, surplus, sag, slack)
    return bad


def outputs_kernel(law: int) -> Callable[[Array, Array, Array, Array, Array, Array], int]:
    """`model_outputs`, or what does the same for this law and compiles in less time."""
    return straight_outputs if law == STRAIGHT else model_outputs
