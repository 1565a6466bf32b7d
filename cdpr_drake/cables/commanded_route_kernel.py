"""Numba kernels for cables between any bodies whose tensions are commanded.

tau = -J_l(q)' t, with commands below zero taken as zero; l and l_dot = J_l v beside it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.route_kernel import route_lengths
from cdpr_drake.geometry.cable_routes import Integers
from cdpr_drake.geometry.tree_kernel import add_tree_force, tree_motion


@njit(cache=True)
def commanded_tree_force(
    tree: Array, state: Array, tensions: Array, segments: Array, ends: Integers, first: Integers,
    room: Array, bodies: Array, pulls: Array, out: Array, table: Array,
) -> int:  # fmt: skip
    """Writes the generalized force of commanded tensions, and lengths and their rates.

    Args:
        tree: From `models.PlantTree`, shape (n, 32).
        state: Positions and velocities of the plant, shape (nq + nv,).
        tensions: Shape (m,) [N].
        segments: From `CableRoutes.packed`, shape (s, 17).
        ends: From there, shape (s, 2).
        first: From there, shape (m + 1,).
        room: From `route_kernel.make_route_room`.
        bodies: From `route_kernel.make_tree_room`.
        pulls: Room for the wrenches of 1 N in each cable, shape (m, n, 6).
        out: Generalized force, shape (nv,) [N, N m].
        table: Lengths [m] and their rates [m/s], shape (2, m).

    Returns:
        Index of the first cable that cannot run so, or -1.
    """
    n = tree.shape[0]
    motion, wrenches = bodies[: 18 * n].reshape(n, 18), bodies[18 * n : 24 * n].reshape(n, 6)
    work = bodies[24 * n :]
    tree_motion(tree, state, work, motion)
    bad = route_lengths(motion, segments, ends, first, room, table[0], pulls)
    wrenches[:] = 0.0
    for i in range(tensions.shape[0]):
        t = max(tensions[i], 0.0 * tensions[i])
        rate = 0.0
        for k in range(1, n):
            for j in range(6):
                wrenches[k, j] = wrenches[k, j] + t * pulls[i, k, j]
                rate = rate - pulls[i, k, j] * motion[k, 12 + j]
        table[1, i] = rate
    out[:] = 0.0
    add_tree_force(tree, state, motion, wrenches, work, out)
    return bad


def make_pulls(cables: int, tree: Array) -> Array:
    """Room for the wrenches of 1 N in each cable, shape (m, n, 6)."""
    return np.zeros((cables, len(tree), 6))
