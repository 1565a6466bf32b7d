"""How far cables and platform are from what moves, at poses and times, one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.cable_distance_kernel import BOX_COLUMNS
from cdpr_drake.workspaces.cable_interference import PART_NAMES, Surroundings, clearances
from cdpr_drake.workspaces.moving_shapes import MovingObstacle, shapes_at

CABLES, PLATFORM = (PART_NAMES.index(name) for name in ("cable-obstacle", "platform"))


def moving_clearances(
    around: Surroundings,
    things: Sequence[MovingObstacle],
    times: Array,
    positions: Array,
    rotations: Array,
) -> Array:
    """Clearances of cables and of the platform from what moves, shape (t, n, 2) [m].

    Args:
        around: The robot's cables and platform; what rests is not looked at.
        things: What moves.
        times: Shape (t,) [s].
        positions: p_WP, shape (t, n, 3), or (n, 3) for all times [m].
        rotations: R_WP, shape (t, n, 3, 3), or (n, 3, 3).
    """
    none = np.zeros((0, BOX_COLUMNS))
    one = np.ndim(positions) == 2
    found = []
    for k, time in enumerate(times):
        there = replace(
            around, fixtures=none, obstacles=none, solids=shapes_at(things, float(time))
        )
        p, R = (positions, rotations) if one else (positions[k], rotations[k])
        found.append(clearances(there, p, R)[:, [CABLES, PLATFORM]])
    return np.array(found)
