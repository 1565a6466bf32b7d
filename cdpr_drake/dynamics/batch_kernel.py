"""Numba kernels that move many robots, one after the other, in one call.

What moves a robot is one of `advance_events_kernel`'s, called at its address: the machine code that
moves a single robot. So each robot of a batch moves as it does alone, to the last bit, and nothing
of it is compiled again. Rows are shared among threads by `kernel_calls.over_rows`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_kernel import REPORTED
from cdpr_drake.dynamics.robot_arrays import RobotArrays
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.numerics.kernel_calls import array_addresses, call_at_address
from cdpr_drake.numerics.kernel_calls import kernel_address as address
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR

_REACH = types.int64(types.int64[:, ::1], VECTOR, VECTOR, VECTOR, MATRIX, types.float64, VECTOR)
_OUTPUTS = types.int64(VECTOR, VECTOR, VECTOR, MATRIX, VECTOR, MATRIX)


@cache
def reach_address(kernel: Any) -> int:
    """Where the machine code of `integrate_explicit`, or a kernel of its kind, begins."""
    return address(kernel, _REACH)


@cache
def outputs_address(kernel: Any) -> int:
    """Where the machine code of a kernel of `simulation_kernel.outputs_kernel` begins."""
    return address(kernel, _OUTPUTS)


def stacked_robots(robots: Sequence[RobotArrays]) -> RobotArrays:
    """Robots of the same sizes as one, each array with an axis for the robots before its own."""
    return RobotArrays(
        *(np.ascontiguousarray(np.stack(each)) for each in zip(*robots, strict=True))
    )


def robot_tables(stack: RobotArrays) -> np.ndarray:
    """`robot_addresses` of each robot of a stack, shape (count, 14, 4); it must be kept."""
    first = array_addresses([each[0] for each in stack])
    tables = np.tile(first, (len(stack.kinds), 1, 1))
    for k, each in enumerate(stack):
        tables[:, k, 0] += np.arange(len(each)) * each.strides[0]
    return tables


@intrinsic
def call_reach(typing: Any, kernel: Any, robot: Any, rule: Any, present: Any, command: Any,
           others: Any, time: Any, memory: Any) -> Any:  # fmt: skip
    """What the kernel at an address returns."""
    return _REACH.return_type(types.intp, *_REACH.args), call_at_address(_REACH)


@intrinsic
def call_outputs(typing: Any, kernel: Any, state: Any, l0: Any, l0_dot: Any, cables: Any, room: Any,
             out: Any) -> Any:  # fmt: skip
    """What the kernel at an address returns."""
    return _OUTPUTS.return_type(types.intp, *_OUTPUTS.args), call_at_address(_OUTPUTS)


@njit(cache=True, nogil=True)
def advance_rows(
    first: int, past: int, kernel: int, robots: np.ndarray, rule: Array, present: Array,
    commands: Array, others: Array, duration: float, memory: Array, reached: Array,
    results: np.ndarray,
) -> None:  # fmt: skip
    """Moves robots on, one way after the other; those that failed stand still.

    Args:
        first: The first robot.
        past: The one behind the last robot.
        kernel: `reach_address` of the kernel that moves one.
        robots: As of `robot_tables`.
        rule: As of `integrate_explicit`.
        present: State, its time [s] and its report of each robot, shape (count, k); what is
            reached is written into it, of a robot that fails its last good state.
        commands: Of each way, shape (ways, count, m).
        others: As of `integrate_explicit`, of each robot, shape (count, 2, m).
        duration: Of each way [s].
        memory: As of `fresh_memory`, shape (count, 2 k + 1 + m); what it had reached is forgotten.
        reached: Where what is present behind each way is written, shape (ways, count, k), or
            (0, count, k) where nobody asks.
        results: What moving each came to, as `integrate_explicit`, shape (count,).
    """
    size = present.shape[1]
    for i in range(first, past):
        for k in range(commands.shape[0]):
            if results[i] == INTEGRATION_OK:
                memory[i, 2 * size] = np.nan
                time = present[i, size - REPORTED - 1] + duration
                results[i] = call_reach(
                    kernel, robots[i], rule, present[i], commands[k, i], others[i], time, memory[i]
                )
                for j in range(size):
                    present[i, j] = memory[i, size + j]
            if reached.shape[0] > 0:
                for j in range(size):
                    reached[k, i, j] = present[i, j]


@njit(cache=True, nogil=True)
def cables_of_rows(
    first: int, past: int, kernel: int, platform: int, present: Array, rates: Array,
    cables: Array, rooms: Array, out: Array, results: np.ndarray,
) -> None:  # fmt: skip
    """Writes what the cables of robots do now, rows as `simulation_kernel.OUTPUTS` says.

    Args:
        first: The first robot.
        past: The one behind the last robot.
        kernel: `outputs_address` of the kernel of their law.
        platform: Numbers of the platform's state.
        present: As of `advance_rows`.
        rates: Of the unstrained lengths, shape (count, m) [m/s].
        cables: `CableSet.packed`, shape (count, m, 17).
        rooms: `make_room` of each robot, shape (count, r).
        out: Shape (count, 6, m).
        results: Index of the first cable that cannot run, or -1, shape (count,).
    """
    m = rates.shape[1]
    for i in range(first, past):
        state, lengths = present[i, :platform], present[i, platform : platform + m]
        results[i] = call_outputs(kernel, state, lengths, rates[i], cables[i], rooms[i], out[i])
