"""Numba kernels that advance a robot over many steps, and what it has of energy."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import cable_energy, cable_response
from cdpr_drake.dynamics.explicit_kernel import (
    RUNGE_KUTTA_3,
    SEMI_IMPLICIT,
    explicit_step,
    pose_distance,
)
from cdpr_drake.dynamics.plain_step_kernel import plain_step
from cdpr_drake.dynamics.platform_kernel import mass_in_world
from cdpr_drake.dynamics.robot_arrays import (
    COLUMNS,
    COM,
    DRIVE,
    GRAVITY,
    IDEAL,
    LAW,
    PLATFORM,
    SPEEDS,
    TENSIONS,
    RobotArrays,
)
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_DIVERGED, INTEGRATION_OK, lay_out_cables
from cdpr_drake.dynamics.semi_implicit_kernel import semi_implicit_step
from cdpr_drake.geometry.motion_kernel import joint_motion
from cdpr_drake.numerics.linear_algebra_kernel import copy_vector

HALVINGS = 12
"""How often a step may be halved for the sake of the error."""

LARGEST = 1e9
"""Metres, radians and their rates that no platform has, but one whose run has diverged."""

REPORTED = 4
"""Numbers of a report: largest estimated error of a step in position [m] and rotation [rad], steps
that were taken, steps that were taken back."""


@njit(cache=True)
def _is_lost(state: Array) -> bool:
    lost = False
    for value in state:
        lost |= not abs(value) < LARGEST
    return lost


@njit(cache=True, error_model="numpy")
def _first_step(duration: float, max_step: float) -> float:
    return duration / max(np.ceil(duration / max_step - 1e-9), 1.0)


@njit(cache=True, error_model="numpy")
def _judge(robot: RobotArrays, bad: int, bound: float, report: Array) -> tuple[int, bool, float]:
    """Result of a step, whether its error is within the bound, and the error; see `REPORTED`."""
    if bad == INTEGRATION_OK and _is_lost(robot.work[1]):
        bad = INTEGRATION_DIVERGED
    if bad != INTEGRATION_OK:
        return bad, False, np.inf
    distance, angle = pose_distance(robot.work[1], robot.work[2], robot.kinds[PLATFORM])
    error = max(distance, angle)
    if error <= bound:
        report[0], report[1] = max(report[0], distance), max(report[1], angle)
    return bad, error <= bound, error


@njit(cache=True, error_model="numpy")
def _accept(robot: RobotArrays, report: Array) -> None:
    """Makes the step's end the beginning of the next one, with a unit quaternion."""
    y, n = robot.work[0], robot.kinds[PLATFORM]
    copy_vector(robot.work[1], y)
    report[2] += 1.0
    if n == 13:
        per_norm = 1.0 / np.sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3])
        for i in range(4):
            y[i] *= per_norm


@njit(cache=True, error_model="numpy")
def advance_explicitly(
    robot: RobotArrays, method: int, state: Array, command: Array, rate: Array, brakes: Array,
    duration: float, max_step: float, bound: float, report: Array,
) -> int:  # fmt: skip
    """As `advance_robot` by one of the explicit methods."""
    plain, h, time = lay_out_cables(robot), _first_step(duration, max_step), 0.0
    ordinary = plain and robot.kinds[DRIVE] == IDEAL and robot.kinds[PLATFORM] == 13
    whole, least = h, h * 0.5**HALVINGS
    copy_vector(state, robot.work[0])
    while time < duration * (1.0 - 1e-12):
        h = min(h, duration - time)
        if ordinary:
            bad = INTEGRATION_OK
            plain_step(
                robot.work, robot.body, robot.vectors[COLUMNS:], robot.winch[0, 0],
                method == RUNGE_KUTTA_3, h, command, rate, time,
            )  # fmt: skip
        else:
            bad = explicit_step(robot, method, h, command, rate, brakes, time, plain)
        bad, good, error = _judge(robot, bad, bound, report)
        if not good and bound < np.inf and h > least * 1.01:
            h *= 0.5
            report[3] += 1.0
            continue
        if bad != INTEGRATION_OK:
            copy_vector(robot.work[0], state)
            return bad
        if not good:  # the least step; its error is what it is, and is told
            _judge(robot, bad, np.inf, report)
        _accept(robot, report)
        time += h
        if error < bound / 16.0:
            h = min(2.0 * h, whole)
    copy_vector(robot.work[0], state)
    return INTEGRATION_OK


@njit(cache=True, error_model="numpy")
def advance_semi_implicitly(
    robot: RobotArrays, state: Array, command: Array, rate: Array, brakes: Array,
    duration: float, max_step: float, bound: float, report: Array,
) -> int:  # fmt: skip
    """As `advance_robot` by the semi-implicit method; of its own, since it compiles longer."""
    plain, h, time = lay_out_cables(robot), _first_step(duration, max_step), 0.0
    whole, least = h, h * 0.5**HALVINGS
    copy_vector(state, robot.work[0])
    while time < duration * (1.0 - 1e-12):
        h = min(h, duration - time)
        bad = semi_implicit_step(robot, h, command, rate, brakes, time, plain)
        bad, good, error = _judge(robot, bad, bound, report)
        if not good and bound < np.inf and h > least * 1.01:
            h *= 0.5
            report[3] += 1.0
            continue
        if bad != INTEGRATION_OK:
            copy_vector(robot.work[0], state)
            return bad
        if not good:
            _judge(robot, bad, np.inf, report)
        _accept(robot, report)
        time += h
        if error < bound / 16.0:
            h = min(2.0 * h, whole)
    copy_vector(robot.work[0], state)
    return INTEGRATION_OK


def advance_robot(
    robot: RobotArrays, method: int, state: Array, command: Array, rate: Array, brakes: Array,
    duration: float, max_step: float, bound: float, report: Array,
) -> int:  # fmt: skip
    """Advances a state, in place.

    Steps are equal parts of the duration. Where the estimated error of one exceeds the bound, it is
    taken back and halved, up to `HALVINGS` times; steps grow again where it is far below.

    Args:
        robot: The robot.
        method: A number of `METHODS`.
        state: Shape (n,); where a step fails it is that before it.
        command: At the beginning, shape (m,).
        rate: By which the command changes, shape (m,) [1/s].
        brakes: 1 where the motor's brake holds, shape (m,).
        duration: For how long [s].
        max_step: Largest step [s].
        bound: Largest estimated error of a step [m and rad]; infinite: any.
        report: See `REPORTED`, shape (4,); what happens is added to it.

    Returns:
        `INTEGRATION_OK`, `INTEGRATION_DIVERGED` where numbers are not finite, or the index of a
        cable that cannot run.
    """
    if method == SEMI_IMPLICIT:
        return int(
            advance_semi_implicitly(
                robot, state, command, rate, brakes, duration, max_step, bound, report
            )
        )
    return int(
        advance_explicitly(
            robot, method, state, command, rate, brakes, duration, max_step, bound, report
        )
    )


@njit(cache=True)
def robot_energy(robot: RobotArrays, state: Array) -> float:
    """Kinetic and potential energy of platform and cables [J], heights from the joint's frame.

    Cables count as `dispatch_kernel.cable_energy` says; commanded tensions have none, nor have
    motors.

    Args:
        robot: The robot.
        state: Shape (n,).
    """
    n, nv = robot.kinds[PLATFORM], robot.kinds[SPEEDS]
    M = robot.matrices[0]
    mass_in_world(state[:n], robot.body, M)
    energy = 0.0
    for i in range(nv):
        for j in range(nv):
            energy += 0.5 * state[n - nv + i] * M[i, j] * state[n - nv + j]
    X = joint_motion(state[:n], robot.room[1])
    body = robot.body
    for i in range(3):
        r = X[9 + i] + X[3 * i] * body[COM] + X[3 * i + 1] * body[COM + 1]
        energy -= body[0] * body[GRAVITY + i] * (r + X[3 * i + 2] * body[COM + 2])
    if robot.kinds[DRIVE] == TENSIONS:
        return energy
    law = robot.kinds[LAW]
    for i in range(robot.cables.shape[0]):
        cable, l0, guess = robot.cables[i], state[n + i], robot.guesses[i]
        cable_response(law, X, cable, l0, guess, robot.inner, robot.D)
        energy += cable_energy(law, X, cable, l0, guess)
    return energy
