"""Numba kernels that move one robot and see what its cables do, in calls of few arguments.

To hand all arrays over from Python costs a tenth of what a way of 20 ms does; so they stand in one
table, see `numerics.array_addresses`. What integrates and what says of cables what they do are the
kernels that blocks call, at their addresses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import put_crept
from cdpr_drake.cables.simulation_kernel import guesses_of
from cdpr_drake.dynamics.batch_kernel import call_outputs, call_reach
from cdpr_drake.dynamics.robot_kernel import ideal_rates
from cdpr_drake.numerics.kernel_calls import integers_at, matrix_at, vector_at

REACH, OUTPUTS, PLATFORM = range(3)
"""Whole numbers of a `LoneRobot`."""


class LoneRobot(NamedTuple):
    """Arrays of a robot in motion, m cables, of which `array_addresses` makes the kernels' table.

    Attributes:
        whole: Addresses of `integrate_explicit`, or one of its kind, and of an `outputs_kernel`;
            numbers of the platform's state.
        rule: As of `integrate_explicit`, and so are present, command, others and memory.
        present: See rule.
        command: See rule.
        others: See rule.
        memory: See rule.
        cables: The cables, shape (m, k).
        room: `make_room` of the cables.
        table: What the cables do, as `model_outputs` writes it, shape (6, m).
        crept: What has crept of each cable, a part of the state, shape (m,) or (0,).
        rates: Rates of the unstrained lengths, shape (m,) [m/s]: a part of the state of winches
            with motors.
        limit: Largest speed of ideal winches, NaN of others, shape (1,) [m/s].
    """

    whole: np.ndarray
    rule: Array
    present: Array
    command: Array
    others: Array
    memory: Array
    cables: Array
    room: Array
    table: Array
    crept: Array
    rates: Array
    limit: Array


@njit(cache=True)
def move(at: np.ndarray, robot: np.ndarray, time: float) -> int:
    """Takes the present state to a time [s]; returns what `integrate_explicit` does.

    Args:
        at: Addresses of a `LoneRobot`.
        robot: `robot_addresses` of the robot.
        time: The time [s].
    """
    present, memory = vector_at(at, 2), vector_at(at, 5)
    bad = call_reach(
        integers_at(at, 0)[REACH], robot, vector_at(at, 1), present, vector_at(at, 3),
        matrix_at(at, 4), time, memory,
    )  # fmt: skip
    size = present.shape[0]
    for i in range(size):
        present[i] = memory[size + i]
    return bad


@njit(cache=True)
def see_cables(at: np.ndarray) -> int:
    """Writes what the cables do now; returns the number of one that cannot run, or -1.

    Args:
        at: Addresses of a `LoneRobot`.
    """
    whole, present, room, table = (
        integers_at(at, 0),
        vector_at(at, 2),
        vector_at(at, 7),
        matrix_at(at, 8),
    )
    rates, limit = vector_at(at, 10), vector_at(at, 11)[0]
    n, m = whole[PLATFORM], table.shape[1]
    if not np.isnan(limit):
        ideal_rates(limit, vector_at(at, 3), rates)
    put_crept(vector_at(at, 9), guesses_of(room, m))
    return call_outputs(
        whole[OUTPUTS], present[:n], present[n : n + m], rates, matrix_at(at, 6), room, table
    )
