"""Numba kernel for a robot that is left to itself: its states at even instants, in one call."""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_kernel import advance_explicitly
from cdpr_drake.dynamics.explicit_kernel import RUNGE_KUTTA_3
from cdpr_drake.dynamics.robot_arrays import SPEEDS, RobotArrays
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, robot_rates


@njit(cache=True)
def free_run(
    robot: RobotArrays, state: Array, command: Array, step: float, max_step: float, states: Array,
    tensions: Array, report: Array,
) -> int:  # fmt: skip
    """Writes what a robot does whose command stays as it is, by the explicit method of third order.

    Args:
        robot: The robot.
        state: At the first instant, shape (n,); becomes that of the last one.
        command: Shape (m,), zero speeds where winches stand still.
        step: Between instants [s].
        max_step: Largest step of the method [s].
        states: Shape (k, n).
        tensions: At the drums, shape (k, m) [N].
        report: As of `advance_robot`.

    Returns:
        As `advance_robot`; behind an instant at which it fails nothing is written.
    """
    brakes, rate = 0.0 * command, 0.0 * command
    speeds = robot.kinds[SPEEDS]
    for k in range(states.shape[0]):
        if k > 0:
            bad = advance_explicitly(
                robot, RUNGE_KUTTA_3, state, command, rate, brakes, step, max_step, 1e300, report
            )
            if bad != INTEGRATION_OK:
                return bad
        bad = robot_rates(robot, state, command, brakes, False, robot.work[3])  # leaves tensions
        if bad != INTEGRATION_OK:
            return bad
        states[k] = state
        for i in range(command.shape[0]):
            tensions[k, i] = robot.force[speeds + i]
    return INTEGRATION_OK
