"""Numba kernels that take a robot from one event to the next, with few arguments.

They are `advance_kernel`'s, called from a block of a diagram: what was reached once, from the same
state to the same time, is not computed again.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_kernel import advance_explicitly, advance_semi_implicitly
from cdpr_drake.dynamics.robot_arrays import RobotArrays
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.numerics.kernel_calls import (
    array_addresses,
    cube_at,
    integers_at,
    matrix_at,
    vector_at,
)

METHOD, MAX_STEP, BOUND = range(3)
"""Entries of a rule: number of a method, largest step [s], largest estimated error of a step [m
and rad], infinite for any."""

BACKWARD = -3
"""Result of `integrate_explicit` where the time lies before the state's."""

REACHED_MORE = 5
"""Numbers of what is reached behind the state: its time [s] and `advance_kernel.REPORTED`."""


def fresh_memory(states: int, cables: int) -> Array:
    """Memory of `integrate_explicit` that has reached nothing, for platform and winches."""
    memory = np.zeros(2 * (states + REACHED_MORE) + 1 + cables)
    memory[2 * (states + REACHED_MORE)] = np.nan
    return memory


def robot_addresses(robot: RobotArrays) -> np.ndarray:
    """Where the arrays of a robot are, shape (14, 4); the robot must be kept."""
    return array_addresses(robot)


@njit(cache=True)
def robot_at(table: np.ndarray) -> RobotArrays:
    """The robot of which `robot_addresses` gave the table."""
    return RobotArrays(
        integers_at(table, 0),
        vector_at(table, 1),
        matrix_at(table, 2),
        vector_at(table, 3),
        matrix_at(table, 4),
        vector_at(table, 5),
        vector_at(table, 6),
        vector_at(table, 7),
        matrix_at(table, 8),
        matrix_at(table, 9),
        matrix_at(table, 10),
        matrix_at(table, 11),
        cube_at(table, 12),
        matrix_at(table, 13),
    )


@njit(cache=True)
def _begins(present: Array, memory: Array, command: Array, rate: Array, time: float) -> int:
    """Prepares a way: 1 where it was taken already, `BACKWARD`, or 0.

    The command where the way begins is left at the end of the memory.
    """
    size = present.shape[0]
    begin, new, at = memory[:size], memory[size : 2 * size], 2 * size
    if memory[at] == time:
        same = True
        for i in range(size):
            same = same and present[i] == begin[i]
        if same:
            return 1
    passed = time - present[size - REACHED_MORE]
    if passed < 0.0:
        return BACKWARD
    memory[at] = np.nan
    for i in range(size):
        begin[i] = present[i]
        new[i] = present[i]
    for i in range(command.shape[0]):
        memory[at + 1 + i] = command[i] - rate[i] * passed
    return 0


@njit(cache=True)
def integrate_explicit(
    robot: np.ndarray, rule: Array, present: Array, command: Array, others: Array, time: float,
    memory: Array,
) -> int:  # fmt: skip
    """Takes a state to a time by one of the explicit methods.

    Args:
        robot: `robot_addresses` of a robot.
        rule: See `METHOD`, shape (3,).
        present: State, its time [s] and its report as they are now, shape (k,).
        command: At the end of the way, shape (m,).
        others: By which the command changes [1/s], and 1 where the motor's brake holds, shape
            (2, m).
        time: Where the way ends [s].
        memory: As of `fresh_memory`. What was present where the last way began; the same where
            it ended, which is what this call writes; the time of that, NaN if there was none; the
            rest is work space.

    Returns:
        `INTEGRATION_OK`, `BACKWARD`, or as `advance_robot`; then the state that is written is the
        last good one, and its time not changed.
    """
    size = present.shape[0]
    done = _begins(present, memory, command, others[0], time)
    if done != 0:
        return INTEGRATION_OK if done == 1 else done
    new, n, at = memory[size : 2 * size], size - REACHED_MORE, 2 * size
    passed = time - new[n]
    if passed > 0.0:
        bad = advance_explicitly(
            robot_at(robot), int(rule[METHOD]), new[:n], memory[at + 1 :], others[0],
            others[1], passed, rule[MAX_STEP], rule[BOUND], new[n + 1 :],
        )  # fmt: skip
        if bad != INTEGRATION_OK:
            return bad
    new[n] = time
    memory[at] = time
    return INTEGRATION_OK


@njit(cache=True)
def integrate_explicit_along(
    robot: np.ndarray, rule: Array, present: Array, commands: Array, others: Array, times: Array,
    memory: Array, reached: Array,
) -> int:  # fmt: skip
    """`integrate_explicit` from each time to the next, with a command for each way.

    Args:
        robot: As of `integrate_explicit`.
        rule: As of `integrate_explicit`.
        present: As there at the first time; what is reached at the last one is written into it.
        commands: At the ends of the ways, shape (n, m).
        others: As of `integrate_explicit`.
        times: Where ways begin and end, shape (n + 1,) [s].
        memory: As of `integrate_explicit`.
        reached: What is present at the end of each way is written here, shape (n, k).

    Returns:
        As `integrate_explicit`, of the last way, or of the first that fails; then what is present
        stays that of its beginning.
    """
    size = present.shape[0]
    for k in range(commands.shape[0]):
        bad = integrate_explicit(robot, rule, present, commands[k], others, times[k + 1], memory)
        if bad != INTEGRATION_OK:
            return bad
        for i in range(size):
            present[i] = memory[size + i]
            reached[k, i] = memory[size + i]
    return INTEGRATION_OK


@njit(cache=True)
def integrate_semi_implicit(
    robot: np.ndarray, rule: Array, present: Array, command: Array, others: Array, time: float,
    memory: Array,
) -> int:  # fmt: skip
    """As `integrate_explicit` by the semi-implicit method; of its own, since it compiles longer."""
    size = present.shape[0]
    done = _begins(present, memory, command, others[0], time)
    if done != 0:
        return INTEGRATION_OK if done == 1 else done
    new, n, at = memory[size : 2 * size], size - REACHED_MORE, 2 * size
    passed = time - new[n]
    if passed > 0.0:
        bad = advance_semi_implicitly(
            robot_at(robot), new[:n], memory[at + 1 :], others[0],
            others[1], passed, rule[MAX_STEP], rule[BOUND], new[n + 1 :],
        )  # fmt: skip
        if bad != INTEGRATION_OK:
            return bad
    new[n] = time
    memory[at] = time
    return INTEGRATION_OK
