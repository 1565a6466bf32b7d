"""Numba kernel for a whole loop of dynamic control: computed torque, tensions, motion, log.

It calls what the blocks of the same loop in a diagram call, `control.tracking_wrench`,
`tensions.update_tensions` and the steps of this room, and it does so at the same instants in the
same order: at each instant the log is written before the controller acts, instants are whole
multiples of a period, and the motion is integrated from each instant to the next. So its numbers
are those of the diagram.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.control import tracking_wrench
from cdpr_drake.dynamics.advance_kernel import advance_explicitly
from cdpr_drake.dynamics.explicit_kernel import METHODS, SEMI_IMPLICIT
from cdpr_drake.dynamics.robot_arrays import RobotArrays
from cdpr_drake.dynamics.robot_kernel import GOOD
from cdpr_drake.tensions import FEASIBLE, update_tensions
from cdpr_drake.trajectories import MOTION_SIZE

TIME, STEPS, ROWS = range(3)
"""Entries of `TrackingMemory.clock`: time [s], control steps and rows of the log so far."""

MET, MISSED = range(2)
"""Entries of `TrackingMemory.verdicts`: 1 while the last request was met, requests not met."""


class TrackingArrays(NamedTuple):
    """What a controller of tensions works with; made by `pack_tracking`.

    Attributes:
        periods: Time between control steps and between rows of the log, shape (2,) [s].
        stretches: The desired motion, `PoseTrajectory.stretches`.
        dynamics: `PlatformDynamics.packed`.
        gains: `TaskGains.packed`.
        height: Height of the plane of a planar platform [m].
        cables: `CableSet.packed` of the believed cables, shape (m, 13).
        bounds: Smallest, largest and wanted tensions, shape (3, m) [N].
        row_scale: As `TensionMethod.kernel`, shape (n,).
        method: `TensionMethod.compiled`.
        room: Work space of `tensions.workspace_shape`.
        W: Work space: wrench matrix, shape (n, m).
        t: Work space: tensions, shape (m,) [N].
        desired: Work space: desired motion, shape (19,).
        wrench: Work space: F_P_W that is asked for, shape (6,) [N m, N].
        still: Zeros, shape (m,): tensions are constant from step to step, and nothing brakes.
    """

    periods: Array
    stretches: Array
    dynamics: Array
    gains: Array
    height: float
    cables: Array
    bounds: Array
    row_scale: Array
    method: tuple[int, bool, bool]
    room: Array
    W: Array
    t: Array
    desired: Array
    wrench: Array
    still: Array


class TrackingMemory(NamedTuple):
    """What changes from call to call; made by `start_tracking`.

    Attributes:
        clock: See `TIME`, shape (3,).
        state: State of the robot, shape (k,).
        tensions: Tensions that are commanded, shape (m,) [N].
        verdicts: See `MET`, shape (2,).
        report: See `dynamics.REPORTED`, shape (4,).
    """

    clock: Array
    state: Array
    tensions: Array
    verdicts: Array
    report: Array


class StepNumbers(NamedTuple):
    """How the motion is integrated: number of an explicit method of `METHODS`, largest step [s],
    largest estimated error of a step [m and rad], infinite for any."""

    method: int
    max_step: float
    bound: float


def pack_tracking(
    rates: tuple[float, float],
    stretches: Array,
    dynamics: Array,
    gains: Array,
    *,
    height: float,
    cables: Array,
    bounds: Array,
    row_scale: Array,
    method: tuple[int, bool, bool],
    room: tuple[int, ...],
) -> TrackingArrays:
    """Packs a controller with work space of its own.

    Args:
        rates: Control steps and rows of the log per second [Hz].
        stretches: As in `TrackingArrays`, and so are all that follow but room.
        dynamics: See stretches.
        gains: See stretches.
        height: See stretches.
        cables: See stretches.
        bounds: See stretches.
        row_scale: See stretches.
        method: See stretches.
        room: `tensions.workspace_shape`.
    """
    n, m = len(row_scale), len(cables)
    return TrackingArrays(
        periods=np.array([1.0 / rates[0], 1.0 / rates[1]]),
        stretches=stretches,
        dynamics=dynamics,
        gains=gains,
        height=height,
        cables=cables,
        bounds=bounds,
        row_scale=row_scale,
        method=method,
        room=np.empty(room),
        W=np.empty((n, m)),
        t=np.empty(m),
        desired=np.empty(MOTION_SIZE),
        wrench=np.empty(6),
        still=np.zeros(m),
    )


def start_tracking(state: Array, tracking: TrackingArrays) -> TrackingMemory:
    """Memory at time 0: a robot's state, shape (k,), and the smallest tensions, not met."""
    return TrackingMemory(
        clock=np.zeros(3),
        state=np.array(state, dtype=float),
        tensions=tracking.bounds[0].copy(),
        verdicts=np.zeros(2),
        report=np.zeros(4),
    )


def step_numbers(method: str, max_step: float, accuracy: float | None) -> StepNumbers:
    """Of a name of `METHODS`, a step [s], and a bound of the error or None.

    Raises:
        ValueError: The method is not explicit; commanded tensions have no stiffness to need it.
    """
    number = METHODS[method]
    if number == SEMI_IMPLICIT:
        raise ValueError(f"tracking is integrated explicitly, found {method}")
    return StepNumbers(number, float(max_step), np.inf if accuracy is None else float(accuracy))


@njit(cache=True)
def _write_row(
    time: float, state: Array, wrench: Array, tensions: Array, verdicts: Array, row: Array
) -> None:
    n, m = state.shape[0], tensions.shape[0]
    row[0] = time
    for i in range(n):
        row[1 + i] = state[i]
    for i in range(6):
        row[1 + n + i] = wrench[i]
    for i in range(m):
        row[7 + n + i] = tensions[i]
    row[7 + n + m], row[8 + n + m] = verdicts[MET], verdicts[MISSED]


@njit(cache=True)
def track(
    robot: RobotArrays, steps: StepNumbers, tracking: TrackingArrays, memory: TrackingMemory,
    until: float, rows: Array,
) -> tuple[int, int]:  # fmt: skip
    """Goes on with a loop to a time.

    A controller that acts at the very end acts in the next call, as with Drake's simulator.

    Args:
        robot: A robot of which the tensions are commanded.
        steps: How it is integrated.
        tracking: The controller.
        memory: Where the loop stands; changed. After a step that failed the time is that to which
            it led, and the state that before it.
        until: Where this call ends [s].
        rows: Gets rows of the log: time, state, F_P_W that is asked for, tensions, and `verdicts`,
            those before the controller acts; as many as instants of the log that come, or more,
            shape (r, 9 + k + m).

    Returns:
        `GOOD` or what `advance_robot` says, and the number of rows.
    """
    clock, state, tensions = memory.clock, memory.state, memory.tensions
    verdicts, still = memory.verdicts, tracking.still
    period, log_period = tracking.periods[0], tracking.periods[1]
    written = 0
    while True:
        time = clock[TIME]
        logs, acts = clock[ROWS] * log_period <= time, clock[STEPS] * period <= time
        if logs or acts:
            tracking_wrench(
                time, tracking.stretches, state, tracking.dynamics, tracking.gains,
                tracking.height, tracking.desired, tracking.wrench,
            )  # fmt: skip
        if logs:
            _write_row(time, state, tracking.wrench, tensions, verdicts, rows[written])
            written += 1
            clock[ROWS] += 1.0
        if time >= until:
            return GOOD, written
        if acts:
            code = update_tensions(
                tracking.method, state, tracking.wrench, tracking.cables, tracking.height,
                tracking.bounds, tracking.row_scale, tracking.room, tracking.W, tracking.t,
                tensions, verdicts,
            )  # fmt: skip
            if code != FEASIBLE:
                verdicts[MISSED] += 1.0
            clock[STEPS] += 1.0
        goal = min(clock[STEPS] * period, clock[ROWS] * log_period, until)
        clock[TIME] = goal
        bad = advance_explicitly(
            robot, steps.method, state, tensions, still, still, goal - time, steps.max_step,
            steps.bound, memory.report,
        )  # fmt: skip
        if bad != GOOD:
            return bad, written
