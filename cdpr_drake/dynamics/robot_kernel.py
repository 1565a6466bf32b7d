"""Numba kernel for the derivative of a whole robot's state: platform, cables, winches.

The state is that of the platform (13, 6 or 2 numbers) and, behind it, unstrained lengths of ideal
winches, or what `motor_kernel.winch_rates` integrates, then how far contacts are bent that rub as
the platform turns, and what has crept of the cables, where they do. Laws of forces are those of
`cables`, of winches those of `winches`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import creep_rates, put_crept
from cdpr_drake.cables.commanded_tension_kernel import tension_force
from cdpr_drake.cables.models import STRAIGHT
from cdpr_drake.cables.simulation_kernel import guesses_of, model_force_and_drums
from cdpr_drake.cables.straight_kernel import line_force, planar_force
from cdpr_drake.cables.straight_lanes_kernel import floating_lanes_force, put_columns
from cdpr_drake.dynamics.contact_kernel import CONTACTS, rub
from cdpr_drake.dynamics.platform_kernel import floating_rates, line_rates, planar_rates
from cdpr_drake.dynamics.robot_arrays import (
    COLUMNS,
    CREEPING,
    DRIVE,
    IDEAL,
    LAW,
    MODE,
    MOTORS,
    PLATFORM,
    PUSH,
    RUB,
    RUBBING,
    SPEEDS,
    TENSIONS,
    RobotArrays,
)
from cdpr_drake.geometry.pulley_kernel import PULLEY_RADIUS
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.winches.motor_kernel import winch_rates

INTEGRATION_OK, INTEGRATION_DIVERGED = -1, -2
"""Results of kernels where all went well, and where numbers are not finite; else a cable."""

_HEIGHT = 1


@njit(cache=True)
def ideal_rates(limit: float, command: Array, out: Array) -> None:
    """Writes the cable velocities of ideal winches, within their rated speed, shape (m,) [m/s]."""
    for i in range(out.shape[0]):
        out[i] = max(min(command[i], limit), -limit)


@njit(cache=True)
def lay_out_cables(robot: RobotArrays) -> bool:
    """Whether all cables are straight, from fixed exit points, and nothing rubs.

    Then it puts the cables by columns, for `robot_rates`, anew where a way begins: cables break.
    """
    if robot.kinds[RUBBING] > 0:
        return False
    for i in range(robot.cables.shape[0]):
        if robot.cables[i, PULLEY_RADIUS] != 0.0 or robot.cables[i, ANCHOR_RADIUS] > 0.0:
            return False
    if robot.kinds[LAW] != STRAIGHT:
        return False
    put_columns(robot.cables, robot.vectors[COLUMNS:])
    return True


@njit(cache=True)
def _plain_rates(
    state: Array, command: Array, limit: float, cables: Array, columns: Array, height: float,
    body: Array, n: int, force: Array, out: Array,
) -> int:  # fmt: skip
    if n == 6:
        ideal_rates(limit, command, out[6:])
        planar_force(state[:6], state[6:], out[6:], cables, as_number(0), force, height)
        planar_rates(state, force, body, out)
    elif n == 2:
        ideal_rates(limit, command, out[2:])
        line_force(state[:2], state[2:], out[2:], cables, as_number(0), force)
        line_rates(state, force, body, out)
    else:
        ideal_rates(limit, command, out[13:])
        floating_lanes_force(state, state[13:], out[13:], columns, force)
        floating_rates(state, force, body, out)
    return INTEGRATION_OK


@njit(cache=True)
def _any_rates(robot: RobotArrays, state: Array, command: Array, brakes: Array, out: Array) -> int:
    n, nv, drive = robot.kinds[PLATFORM], robot.kinds[SPEEDS], robot.kinds[DRIVE]
    m = robot.cables.shape[0]
    platform, force, bad = state[:n], robot.force, INTEGRATION_OK
    if drive == TENSIONS:
        tension_force(
            platform, command, robot.cables, robot.room[_HEIGHT], robot.kinds[PUSH] > 0,
            as_number(0), force[:nv],
        )  # fmt: skip
        if np.isnan(force[0]):
            bad = 0
    else:
        l0 = state[n : n + m]
        if drive == IDEAL:
            rates = out[n : n + m]
            ideal_rates(robot.winch[0, 0], command, rates)
        else:
            rates = state[n + m : n + 2 * m]
        first = state.shape[0] - robot.kinds[CREEPING]
        guesses = guesses_of(robot.room, m)
        put_crept(state[first:], guesses)
        bad = model_force_and_drums(platform, l0, rates, robot.cables, robot.room, nv, force)
        creep_rates(guesses, robot.cables, out[first:])
        if drive == MOTORS:
            winch_rates(
                state[n:], force[nv:], command, brakes, robot.home, robot.kinds[MODE],
                robot.winch, out[n:],
            )  # fmt: skip
    turns = robot.kinds[RUBBING]
    if turns > 0:
        at = state.shape[0] - robot.kinds[CREEPING] - turns
        law = robot.body[RUB : RUB + CONTACTS]
        rub(state, state[at : at + turns], law, force, out[at : at + turns])
    if n == 6:
        planar_rates(platform, force, robot.body, out)
    elif n == 2:
        line_rates(platform, force, robot.body, out)
    else:
        floating_rates(platform, force, robot.body, out)
    return bad


@njit(cache=True, inline="always")
def robot_rates(
    robot: RobotArrays, state: Array, command: Array, brakes: Array, plain: bool, out: Array
) -> int:
    """Writes the derivative of a robot's state.

    Args:
        robot: The robot; its `force` is left with force and drum tensions.
        state: Shape (n,).
        command: What the drive takes: cable velocities [m/s], motor torques [N m], unstrained
            lengths [m] or tensions [N], shape (m,).
        brakes: 1 where the motor's brake holds, shape (m,).
        plain: What `lay_out_cables` says.
        out: Where it is written, shape (n,).

    Returns:
        `INTEGRATION_OK`, or the index of the first cable that cannot run.
    """
    # A robot is many arrays, and to hand them on costs half as much as the forces of its cables.
    if plain and robot.kinds[DRIVE] == IDEAL:
        return _plain_rates(
            state, command, robot.winch[0, 0], robot.cables, robot.vectors[COLUMNS:],
            robot.room[_HEIGHT], robot.body, robot.kinds[PLATFORM], robot.force, out,
        )  # fmt: skip
    return _any_rates(robot, state, command, brakes, out)
