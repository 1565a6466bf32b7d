"""Numba kernels that move a plant on cables in steps: its joints, cables and ideal winches.

The method is that of Drake's RungeKutta3Integrator with a fixed step,

    k1 = f(t, x), k2 = f(t + h/2, x + h/2 k1), k3 = f(t + h, x - h k1 + 2 h k2),
    x(t + h) = x + h/6 (k1 + 4 k2 + k3),

with winches that pay out at a constant speed over a call. Source: documentation of that class.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.route_kernel import add_any_wrenches, add_plain_wrenches
from cdpr_drake.dynamics.tree_dynamics_kernel import (
    BODY_ROOM,
    position_rates,
    solve_symmetric,
    tree_dynamics,
)
from cdpr_drake.geometry.tree_kernel import TREE_WORK, tree_motion
from cdpr_drake.numerics.kernel_calls import array_addresses, integers_at, matrix_at, vector_at

DONE, STUCK, NOT_FINITE = -1, -2, -3
"""What a call ends with, where it is no number of a cable that cannot run: it is done; the mass
matrix is not positive definite; the state is not finite."""


class TreeMemory:
    """Constants of a plant on cables and room to move it, as one table of addresses."""

    def __init__(
        self,
        tree: Array,
        bodies: Array,
        gravity: Array,
        damping: Array,
        rotors: Array,
        packed: tuple[Array, np.ndarray, np.ndarray],
        room: Array,
    ) -> None:
        """For all bodies of a plant.

        Args:
            tree: From `models.PlantTree`, shape (n, 32).
            bodies: Mass, centre of mass, inertia, shape (n, 10), see `tree_dynamics`.
            gravity: Acceleration of gravity, shape (3,) [m/s^2].
            damping: Viscous damping of joints, shape (nv,) [N s/m, N m s/rad].
            rotors: Inertia of motors as joints feel it, shape (nv,) [kg, kg m^2].
            packed: From `CableRoutes.packed`.
            room: From `route_kernel.make_route_room`.
        """
        n, nv, m = len(tree), len(damping), len(packed[2]) - 1
        size = int(np.max(tree[:, 4])) + nv + 7
        self.arrays = (
            tree,
            bodies,
            gravity,
            damping,
            rotors,
            packed[0],
            packed[1].ravel(),
            packed[2],
            room,
            np.zeros((n, 18)),  # motions
            np.zeros((n, 6)),  # wrenches
            np.zeros(TREE_WORK),
            np.zeros((n, BODY_ROOM)),
            np.zeros((nv, nv)),
            np.zeros(nv),  # bias
            np.zeros((5, size)),  # k1, k2, k3, where they are asked for, forces
            np.zeros((2, m)),  # lengths, and at where they are asked for
        )
        self._kept = [np.ascontiguousarray(array) for array in self.arrays]
        self.table = array_addresses(self._kept)


@njit(cache=True)
def tree_rates(
    memory: Any, straight: bool, state: Array, l0: Array, l0_dot: Array, force: Array, out: Array
) -> int:
    """Writes the rates of positions and velocities of a plant on cables.

    Args:
        memory: Table of a `TreeMemory`.
        straight: Whether all cables are.
        state: Positions and velocities, shape (nq + nv,).
        l0: Unstrained lengths, shape (m,) [m].
        l0_dot: Their rates, shape (m,) [m/s].
        force: Further generalized force, of motors, shape (nv,) [N, N m].
        out: Rates, shape (nq + nv,).

    Returns:
        `DONE`, `STUCK`, or the number of a cable that cannot run.
    """
    tree, bodies, damping = matrix_at(memory, 0), matrix_at(memory, 1), vector_at(memory, 3)
    motion, wrenches = matrix_at(memory, 9), matrix_at(memory, 10)
    work, M = vector_at(memory, 11), matrix_at(memory, 13)
    bias, rotors = vector_at(memory, 14), vector_at(memory, 4)
    nv = damping.shape[0]
    nq = state.shape[0] - nv
    tree_motion(tree, state, work, motion)
    wrenches[:] = 0.0
    ends = integers_at(memory, 6).reshape(-1, 2)
    parts = matrix_at(memory, 5), ends, integers_at(memory, 7), vector_at(memory, 8)
    if straight:
        bad = add_plain_wrenches(
            motion, l0, l0_dot, parts[0], parts[1], parts[2], parts[3], wrenches, damping[:0]
        )
    else:
        bad = add_any_wrenches(
            motion, l0, l0_dot, parts[0], parts[1], parts[2], parts[3], wrenches, damping[:0]
        )
    if bad >= 0:
        return bad
    room = matrix_at(memory, 12)
    tree_dynamics(tree, bodies, vector_at(memory, 2), state, motion, wrenches, room, M, bias)
    tau = out[nq:]
    for i in range(nv):
        M[i, i] += rotors[i]
        tau[i] = force[i] - bias[i] - damping[i] * state[nq + i]
    position_rates(tree, state, out)
    return DONE if solve_symmetric(M, tau) else STUCK


@njit(cache=True)
def advance_tree(
    memory: Any, straight: bool, state: Array, l0: Array, l0_dot: Array, force: Array,
    duration: float, steps: int,
) -> int:  # fmt: skip
    """Moves a plant on cables for a while, in place, winches paying out at constant speeds.

    Args:
        memory: Table of a `TreeMemory`.
        straight: Whether all cables are.
        state: Positions and velocities, shape (nq + nv,).
        l0: Unstrained lengths, shape (m,) [m]; they move on, too.
        l0_dot: Their rates, shape (m,) [m/s].
        force: Further generalized force, held all the while, shape (nv,) [N, N m].
        duration: For how long [s].
        steps: In so many steps.

    Returns:
        `DONE`, `STUCK`, `NOT_FINITE`, or the number of a cable that cannot run.
    """
    k, lengths = matrix_at(memory, 15), matrix_at(memory, 16)
    n, h = state.shape[0], duration / steps
    k1, k2, k3, x, out = k[0, :n], k[1, :n], k[2, :n], k[3, :n], lengths[0]
    for _ in range(steps):
        code = tree_rates(memory, straight, state, l0, l0_dot, force, k1)
        if code != DONE:
            return code
        for i in range(n):
            x[i] = state[i] + 0.5 * h * k1[i]
        for i in range(out.shape[0]):
            out[i] = l0[i] + 0.5 * h * l0_dot[i]
        code = tree_rates(memory, straight, x, out, l0_dot, force, k2)
        if code != DONE:
            return code
        for i in range(n):
            x[i] = state[i] - h * k1[i] + 2.0 * h * k2[i]
        for i in range(out.shape[0]):
            out[i] = l0[i] + h * l0_dot[i]
        code = tree_rates(memory, straight, x, out, l0_dot, force, k3)
        if code != DONE:
            return code
        total = 0.0
        for i in range(n):
            state[i] = state[i] + h / 6.0 * (k1[i] + 4.0 * k2[i] + k3[i])
            total += state[i]
        for i in range(out.shape[0]):
            l0[i] = l0[i] + h * l0_dot[i]
        if not np.isfinite(total):
            return NOT_FINITE
    return DONE
