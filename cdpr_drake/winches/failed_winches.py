"""Winches with motors that fail: drums that stand still, motors without power.

A drum that jams is held by dry friction without a limit, so that its speed fades within the
settling time of `friction`, and stays zero whatever pulls. A motor without power has no torque; its
drum turns by the cable's pull, friction and its inertia.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.winches.motor import WinchLaw
from cdpr_drake.winches.motor_kernel import pack_winch

HOLD = 1e9
"""What holds a jammed drum, at the motor's shaft: far more than any cable can turn [N m]."""

_RATED_TORQUE, _BRAKE_TORQUE = 7, 13


def pack_failing_winches(law: WinchLaw, m: int) -> Array:
    """`pack_winch` with a row of its own for each of m cables, shape (m, 18)."""
    rows = pack_winch(law)
    if len(rows) == m:
        return rows.copy()
    rows = np.tile(rows, (m, 1))
    rows[:, -1] = np.arange(m)
    return rows


def fail_winches(whole: Array, brakes: Array, jammed: Array, powerless: Array, out: Array) -> Array:
    """Writes the constants of winches some of which failed; returns their brakes, shape (m,).

    Args:
        whole: `pack_failing_winches`, shape (m, 18).
        brakes: 1 where a brake holds, shape (m,).
        jammed: Not 0 where a drum stands still, shape (m,).
        powerless: Not 0 where a motor has no torque, shape (m,).
        out: Where they are written, shape (m, 18).
    """
    out[:] = whole
    out[powerless != 0.0, _RATED_TORQUE] = 0.0
    out[jammed != 0.0, _BRAKE_TORQUE] = HOLD
    return held_brakes(brakes, jammed)


def held_brakes(brakes: Array, jammed: Array) -> Array:
    """Brakes of which those of what is jammed hold, shape (m,)."""
    return np.where(jammed != 0.0, 1.0, brakes)


def failed_law(law: WinchLaw, jammed: Array, powerless: Array) -> WinchLaw:
    """The same for `motor.winch_motion`: a law with numbers for each cable.

    The brakes of what is jammed must hold, too: `held_brakes`.
    """
    each: Any = {  # numbers for each cable, where the law has one for all
        "rated_torque": np.where(powerless != 0.0, 0.0, law.rated_torque),
        "brake_torque": np.where(jammed != 0.0, HOLD, law.brake_torque),
    }
    return replace(law, **each)
