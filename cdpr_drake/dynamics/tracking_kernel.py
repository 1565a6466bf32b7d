"""Numba kernel for a whole loop of dynamic control: computed torque, tensions, motion, log.

It calls what the blocks of the same loop in a diagram call, `task_space.tracking_wrench`,
`control_step_kernel.update_tensions` and the steps of `advance_kernel`, and it does so at the same
instants in the same order: at each instant the log is written before the controller acts, instants
are whole multiples of a period, and the motion is integrated from each instant to the next. So its
numbers are those of the diagram.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import tracking_wrench_at
from cdpr_drake.dynamics.advance_events_kernel import BOUND, MAX_STEP, METHOD, robot_at
from cdpr_drake.dynamics.advance_kernel import advance_explicitly
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.numerics.kernel_calls import vector_at
from cdpr_drake.tensions.control_step_kernel import update_tensions_at
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE

TIME, STEPS, ROWS = range(3)
"""Entries of `TrackingMemory.clock`: time [s], control steps and rows of the log so far."""

LAST_REQUEST_MET, REQUESTS_NOT_MET = range(2)
"""Entries of `TrackingMemory.verdicts`: 1 while the last request was met, requests not met."""


LOGS, ACTS, ENDS = 1, 2, 4
"""What is due at an instant: a row of the log, a control step, the end of the call."""


class TrackingMemory(NamedTuple):
    """What changes from call to call; made by `start_tracking`.

    Attributes:
        clock: See `TIME`, shape (3,).
        state: State of the robot, shape (k,).
        tensions: Tensions that are commanded, shape (m,) [N].
        verdicts: See `LAST_REQUEST_MET`, shape (2,).
        report: See `advance_kernel.REPORTED`, shape (4,).
        wrench: Work space: F_P_W that is asked for, shape (6,) [N m, N].
        still: Zeros, shape (m,): tensions are constant from step to step, and nothing brakes.
    """

    clock: Array
    state: Array
    tensions: Array
    verdicts: Array
    report: Array
    wrench: Array
    still: Array


def start_tracking(state: Array, tensions: Array) -> TrackingMemory:
    """Memory at time 0: a robot's state, shape (k,), and tensions before the first step, (m,)."""
    return TrackingMemory(
        clock=np.zeros(3),
        state=np.array(state, dtype=float),
        tensions=np.array(tensions, dtype=float),
        verdicts=np.zeros(2),
        report=np.zeros(4),
        wrench=np.zeros(6),
        still=np.zeros(len(tensions)),
    )


@njit(cache=True)
def _write_row(memory: TrackingMemory, row: Array) -> None:
    n, m = memory.state.shape[0], memory.tensions.shape[0]
    row[0] = memory.clock[TIME]
    for i in range(n):
        row[1 + i] = memory.state[i]
    for i in range(6):
        row[1 + n + i] = memory.wrench[i]
    for i in range(m):
        row[7 + n + i] = memory.tensions[i]
    row[7 + n + m], row[8 + n + m] = (
        memory.verdicts[LAST_REQUEST_MET],
        memory.verdicts[REQUESTS_NOT_MET],
    )


@njit(cache=True)
def track_on(
    robot: np.ndarray, law: np.ndarray, rule: Array, periods: Array, memory: np.ndarray,
    until: float,
) -> tuple[int, int]:  # fmt: skip
    """Moves a robot on to the next instant of `track`, by the tensions in memory.

    Args:
        robot: As `track`.
        law: As `track`, or without rows where the wrench is somebody else's.
        rule: As `track`.
        periods: As `track`.
        memory: `array_addresses` of a `TrackingMemory`, which cost less than its arrays.
        until: As `track`.

    Returns:
        As `track`, and in the place of rows what is due at the instant: the sum of `LOGS`, `ACTS`
        and `ENDS`.
    """
    clock, state, still = vector_at(memory, 0), vector_at(memory, 1), vector_at(memory, 6)
    time = clock[TIME]
    goal = min(clock[STEPS] * periods[0], clock[ROWS] * periods[1], until)
    clock[TIME] = goal
    bad = advance_explicitly(
        robot_at(robot), int(rule[METHOD]), state, vector_at(memory, 2), still, still,
        goal - time, rule[MAX_STEP], rule[BOUND], vector_at(memory, 4),
    )  # fmt: skip
    if bad != INTEGRATION_OK:
        return bad, 0
    if law.shape[0] > 0:
        tracking_wrench_at(law, goal, state, vector_at(memory, 5))
    return INTEGRATION_OK, due(clock, periods, until)


@njit(cache=True)
def due(clock: Array, periods: Array, until: float) -> int:
    """What is due at the time of a clock: the sum of `LOGS`, `ACTS` and `ENDS`."""
    time = clock[TIME]
    logs = LOGS if clock[ROWS] * periods[1] <= time else 0
    acts = ACTS if clock[STEPS] * periods[0] <= time else 0
    return logs + acts + (ENDS if time >= until else 0)


@njit(cache=True)
def track(
    robot: np.ndarray, law: np.ndarray, distribution: np.ndarray, rule: Array, periods: Array,
    memory: TrackingMemory, until: float, rows: Array,
) -> tuple[int, int]:  # fmt: skip
    """Goes on with a loop to a time.

    A controller that acts at the very end acts in the next call, as with Drake's simulator.

    Args:
        robot: `robot_addresses` of a robot of which the tensions are commanded.
        law: `task_space.TrackingStep.table`.
        distribution: `control_step_kernel.TensionStep.table`.
        rule: As of `integrate_explicit`; an explicit method, since no tension is stiff.
        periods: Time between control steps and between rows of the log, shape (2,) [s].
        memory: Where the loop stands; changed. After a step that failed the time is that to which
            it led, and the state that before it.
        until: Where this call ends [s].
        rows: Gets rows of the log: time, state, F_P_W that is asked for, tensions, and `verdicts`,
            those before the controller acts; as many as instants of the log that come, or more,
            shape (r, 9 + k + m).

    Returns:
        `INTEGRATION_OK` or what `advance_robot` says, and the number of rows.
    """
    clock, state, tensions = memory.clock, memory.state, memory.tensions
    wrench, verdicts, still = memory.wrench, memory.verdicts, memory.still
    moved, written = robot_at(robot), 0
    while True:
        time = clock[TIME]
        logs, acts = clock[ROWS] * periods[1] <= time, clock[STEPS] * periods[0] <= time
        if logs or acts:
            tracking_wrench_at(law, time, state, wrench)
        if logs:
            _write_row(memory, rows[written])
            written += 1
            clock[ROWS] += 1.0
        if time >= until:
            return INTEGRATION_OK, written
        if acts:
            code = update_tensions_at(distribution, state, wrench, tensions, verdicts)
            if code != FEASIBLE:
                verdicts[REQUESTS_NOT_MET] += 1.0
            clock[STEPS] += 1.0
        goal = min(clock[STEPS] * periods[0], clock[ROWS] * periods[1], until)
        clock[TIME] = goal
        bad = advance_explicitly(
            moved, int(rule[METHOD]), state, tensions, still, still, goal - time, rule[MAX_STEP],
            rule[BOUND], memory.report,
        )  # fmt: skip
        if bad != INTEGRATION_OK:
            return bad, written
