"""Numba kernels for one explicit step, of second or third order, with an estimate of its error.

The third order method is Kutta's with the midpoint rule inside it, the one that Drake calls
runge_kutta3, the second order method Heun's with Euler's inside it, runge_kutta2.

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.1 and II.4.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.robot_arrays import RobotArrays
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, robot_rates

RUNGE_KUTTA_2, RUNGE_KUTTA_3, SEMI_IMPLICIT = range(3)
METHODS = {
    "runge_kutta2": RUNGE_KUTTA_2,
    "runge_kutta3": RUNGE_KUTTA_3,
    "semi_implicit": SEMI_IMPLICIT,
}
"""Methods by the name that a scenario gives."""


@njit(cache=True)
def command_at(command: Array, rate: Array, time: float, out: Array) -> None:
    """Writes the command at a time [s] after its beginning, with its constant rate, shape (m,)."""
    for i in range(out.shape[0]):
        out[i] = command[i] + rate[i] * time


@njit(cache=True)
def pose_distance(one: Array, other: Array, n: int) -> tuple[float, float]:
    """Distance [m] and angle [rad], where that is small, between two states' platforms.

    Args:
        one: A state, shape (k,).
        other: Another one.
        n: Numbers of the platform, 13, 6 or 2.
    """
    if n == 2:
        return abs(one[0] - other[0]), 0.0
    if n == 6:
        return (
            np.sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2),
            abs(one[2] - other[2]),
        )
    square, angle = 0.0, 0.0
    for i in range(3):
        square += (one[4 + i] - other[4 + i]) ** 2
    for i in range(4):
        angle += (one[i] - other[i]) ** 2
    return np.sqrt(square), 2.0 * np.sqrt(angle)


@njit(cache=True, inline="always", error_model="numpy")
def explicit_step(
    robot: RobotArrays, method: int, h: float, command: Array, rate: Array, brakes: Array,
    time: float, plain: bool,
) -> int:  # fmt: skip
    """One step from `robot.work[0]` to `robot.work[1]`, and by the lower order to `robot.work[2]`.

    Args:
        robot: The robot, its rows of `work` beyond these for the stages.
        method: `RUNGE_KUTTA_2` or `RUNGE_KUTTA_3`.
        h: Step [s].
        command: The command where its time is zero, shape (m,).
        rate: Its rate, shape (m,).
        brakes: See `robot_rates`.
        time: Time of the command at the beginning of the step [s].
        plain: What `lay_out_cables` says.

    Returns:
        As `robot_rates`, for the worst stage.
    """
    y, new, low = robot.work[0], robot.work[1], robot.work[2]
    k1, k2, k3, stage, now = (
        robot.work[3], robot.work[4], robot.work[5], robot.work[6], robot.command
    )  # fmt: skip
    n = y.shape[0]
    command_at(command, rate, time, now)
    bad = robot_rates(robot, y, now, brakes, plain, k1)
    if bad != INTEGRATION_OK:
        return bad
    if method == RUNGE_KUTTA_2:
        for i in range(n):
            low[i] = y[i] + h * k1[i]
        command_at(command, rate, time + h, now)
        bad = robot_rates(robot, low, now, brakes, plain, k2)
        for i in range(n):
            new[i] = y[i] + 0.5 * h * (k1[i] + k2[i])
        return bad
    for i in range(n):
        stage[i] = y[i] + 0.5 * h * k1[i]
    command_at(command, rate, time + 0.5 * h, now)
    bad = robot_rates(robot, stage, now, brakes, plain, k2)
    if bad != INTEGRATION_OK:
        return bad
    for i in range(n):
        stage[i] = y[i] + h * (2.0 * k2[i] - k1[i])
        low[i] = y[i] + h * k2[i]
    command_at(command, rate, time + h, now)
    bad = robot_rates(robot, stage, now, brakes, plain, k3)
    for i in range(n):
        new[i] = y[i] + h / 6.0 * (k1[i] + 4.0 * k2[i] + k3[i])
    return bad
