"""Numba kernels for a robot that is left to itself, and whose platform rubs as it turns.

Where cables are tied to a platform, wire ropes bend and joints turn with friction, and wires that
hang on it rub in themselves: small turns meet a spring, large ones a moment that does not grow. The
moment on the platform is that of Dahl, in P, with z how far the contacts are bent,

    M = -K z,    dz/dt = w - |w| z / a,

so that it comes near K a behind turns much larger than a, and takes per swing of amplitude A >> a
the energy 4 K a A (1 - a / A + ...). Here z goes half a step, the robot a step under M, z another
half.

Source: Dahl, A solid friction model, 1968; that of Bouc and Wen with n = 1 along one direction.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_kernel import advance_explicitly
from cdpr_drake.dynamics.explicit_kernel import RUNGE_KUTTA_3
from cdpr_drake.dynamics.robot_arrays import APPLIED, SPEEDS, RobotArrays
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, robot_rates
from cdpr_drake.geometry.rotation_kernel import quaternion_into

TURN = 7
"""Where the angular velocity begins in the state of a floating platform."""


@njit(cache=True)
def bend_contacts(bent: Array, turning: Array, slip: float, step: float) -> None:
    """Advances z under a constant angular velocity in P, exactly.

    Args:
        bent: z, shape (3,) [rad]; changed.
        turning: Shape (3,) [rad/s].
        slip: a, above 0 [rad].
        step: [s].
    """
    w = np.sqrt(turning[0] ** 2 + turning[1] ** 2 + turning[2] ** 2)
    x = w * step / slip
    way = step
    if x > 1e-9:
        way = -np.expm1(-x) / x * step
    kept = np.exp(-x)
    for i in range(3):
        bent[i] = kept * bent[i] + way * turning[i]


@njit(cache=True)
def _bend(state: Array, bent: Array, slip: float, step: float, R: Array, turning: Array) -> None:
    q = state[:4]
    s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    quaternion_into(q[0], q[1], q[2], q[3], s, R)
    for i in range(3):
        turning[i] = R[0, i] * state[TURN] + R[1, i] * state[TURN + 1] + R[2, i] * state[TURN + 2]
    bend_contacts(bent, turning, slip, step)


@njit(cache=True)
def _rub(body: Array, stiffness: Array, bent: Array, R: Array) -> None:
    """Has M act, in W."""
    for i in range(3):
        moment = 0.0
        for j in range(3):
            moment -= R[i, j] * stiffness[j] * bent[j]
        body[APPLIED + 1 + i] = moment
        body[APPLIED + 4 + i] = 0.0


@njit(cache=True)
def hysteretic_run(
    robot: RobotArrays, state: Array, command: Array, step: float, max_step: float, states: Array,
    tensions: Array, report: Array, stiffness: Array, slip: float, bent: Array,
) -> int:  # fmt: skip
    """As `free_run_kernel.free_run`, of a floating platform that rubs as it turns.

    Args:
        robot: See there; what else acts on its platform is overwritten.
        state: See there.
        command: See there.
        step: See there.
        max_step: See there.
        states: See there.
        tensions: See there.
        report: See there.
        stiffness: K about the axes of P, shape (3,) [N m/rad].
        slip: a, above 0 [rad].
        bent: z at the first instant, shape (3,) [rad]; becomes that of the last one.
    """
    brakes, rate = 0.0 * command, 0.0 * command
    R, turning = np.empty((3, 3)), np.empty(3)
    speeds = robot.kinds[SPEEDS]
    parts = int(np.ceil(step / max_step - 1e-9))
    h = step / parts
    robot.body[APPLIED] = 1.0
    for k in range(states.shape[0]):
        for _ in range(parts if k > 0 else 0):
            _bend(state, bent, slip, 0.5 * h, R, turning)
            _rub(robot.body, stiffness, bent, R)
            bad = advance_explicitly(
                robot, RUNGE_KUTTA_3, state, command, rate, brakes, h, max_step, 1e300, report
            )
            if bad != INTEGRATION_OK:
                return bad
            _bend(state, bent, slip, 0.5 * h, R, turning)
        bad = robot_rates(robot, state, command, brakes, False, robot.work[3])  # leaves tensions
        if bad != INTEGRATION_OK:
            return bad
        states[k] = state
        for i in range(command.shape[0]):
            tensions[k, i] = robot.force[speeds + i]
    return INTEGRATION_OK
