"""Cables that are broken: rows of packed cables that pull nothing, store nothing, weigh nothing."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pulley_kernel import LINEAR_WEIGHT, PULLEY_RADIUS
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS

STIFFNESS, RETARDATION = 6, 7
"""Columns of `CableSet.packed`."""

_OF_A_CABLE = [STIFFNESS, RETARDATION, PULLEY_RADIUS, LINEAR_WEIGHT, ANCHOR_RADIUS]


def break_cables(whole: Array, broken: Array, out: Array) -> None:
    """Writes the rows of a robot of which some cables are broken.

    The kernels of simulations add what cables pull one after the other, so a cable that pulls
    exactly zero leaves the bits of the sum as a robot without that cable has them. Its pulleys go
    with it: whether they can be reached does not matter any more.

    Args:
        whole: `CableSet.packed` of the robot as it was, shape (m, 17).
        broken: Not 0 where a cable is broken, shape (m,).
        out: Where the rows are written, shape (m, 17).
    """
    out[:] = whole
    rows = np.flatnonzero(broken)
    if rows.size:
        for column in _OF_A_CABLE:
            out[rows, column] = 0.0
