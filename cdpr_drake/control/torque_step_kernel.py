"""One step of visual servoing by torque as a numba kernel: twist, wrench, tensions, torques."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.control.servo_wrench_kernel import (
    to_platform,
    to_world,
    twist_from_winches,
    wanted_acceleration,
    winch_speed,
)
from cdpr_drake.control.task_space import floating_wrench
from cdpr_drake.control.tension_controller_kernel import (
    TENSION_RATE,
    approach,
    sort_slack,
    take_over,
    winch_torque,
)
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.tensions.control_step_kernel import update_tensions, wrench_matrix_at
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE

PERIOD, SERVO_PERIOD, MU, KAPPA, HEIGHT = range(5)
"""Numbers of a step: time between steps, and between those of the servo [s]; mu [1/s] and kappa
[1/s^2] of `servo_wrench_kernel`; height of the plane of a 2T1R platform [m]."""

STEP_SIZE = 5

(
    BEGUN, SINCE, RELAXED, RELAXED_STEPS, STEPS, LARGEST_RATE, BEFORE, TOWARD, GATHERED, TWIST,
    WRENCH, CABLES,
) = (0, 1, 2, 3, 4, 5, 6, 12, 18, 24, 30, 36)  # fmt: skip
"""Where a memory begins to hold: whether it has begun; when the servo's last twist came [s];
whether the last wrench was infeasible, how many were, of how many; largest rate of wanted tensions
so far [N/s]; the servo's twist before, its last one, int (V_d - V) dt, V (all in P), F_P_W; and of
the cables wanted tensions [N], integrals [N], and 1 where slack, 3 m numbers."""


@njit(cache=True, inline="always")
def _servo_twist(
    step: Array, wanted: Array, time: float, memory: Array, V_d: Array, feed: Array
) -> None:
    """Writes V_d and dV_d/dt in P: straight from the servo's twist before to its last one.

    That is reached when the next one comes, so that V_d is continuous and has a rate.
    """
    news = False
    for k in range(6):
        news = news or memory[TOWARD + k] != wanted[k]
    share = min((time - memory[SINCE]) / step[SERVO_PERIOD], 1.0)
    if news:
        for k in range(6):
            memory[BEFORE + k] += share * (memory[TOWARD + k] - memory[BEFORE + k])
            memory[TOWARD + k] = wanted[k]
        memory[SINCE], share = time, 0.0
    for k in range(6):
        change = memory[TOWARD + k] - memory[BEFORE + k]
        V_d[k] = memory[BEFORE + k] + share * change
        feed[k] = change / step[SERVO_PERIOD] if share < 1.0 else 0.0


@njit(cache=True)
def _begin(measured: Array, bounds: Array, time: float, memory: Array) -> None:
    """The first step: wanted tensions begin where the measured ones are."""
    m = measured.shape[0]
    memory[BEGUN], memory[SINCE] = 1.0, time
    for i in range(m):
        memory[CABLES + i] = min(max(measured[i], bounds[0, i]), bounds[1, i])


@njit(cache=True)
def torque_step(
    method: tuple[int, bool, bool], fallback: tuple[int, bool, bool], step: Array, loops: Array,
    dynamics: Array, no_gains: Array, cables: Array, bounds: Array, row_scale: Array, work: Array,
    pose: Array, wanted: Array, measured: Array, rates: Array, time: float, memory: Array,
    torques: Array,
) -> None:  # fmt: skip
    """One step, from the servo's twist and what winches and sensors tell to motor torques.

    Args:
        method: How tensions are distributed, as `TensionMethod.compiled` gives it.
        fallback: The same of the method that is asked where there are none: `slack_relaxed`.
        step: Numbers of a step, shape (`STEP_SIZE`,).
        loops: Numbers of the tension loop of each cable, which differ in the drum's radius only,
            shape (m, `tension_controller_kernel.LOOP_SIZE`).
        dynamics: `PlatformDynamics.packed` of the believed platform.
        no_gains: Four zeros.
        cables: `CableSet.packed()` of the believed robot, shape (m, 17).
        bounds: Smallest, largest and reference tensions, shape (3, m) [N].
        row_scale: As `TensionMethod.kernel`, shape (n,).
        work: Work space of `quadratic_program_kernel.workspace_shape`.
        pose: Believed X_WP as `geometry.pose_row`, shape (7,) [-, m].
        wanted: The servo's last twist (w, v) of P in P, shape (6,) [rad/s, m/s].
        measured: Tensions, shape (m,) [N].
        rates: Of the unstrained lengths, shape (m,) [m/s].
        time: Time [s].
        memory: See `CABLES`, shape (`CABLES` + 3 m,); changed.
        torques: Gets the motors' torques, shape (m,) [N m], positive pays out.
    """
    m, n = cables.shape[0], row_scale.shape[0]
    if memory[BEGUN] == 0.0:
        _begin(measured, bounds, time, memory)
    tensions = memory[CABLES : CABLES + m]
    gathered = memory[CABLES + m : CABLES + 2 * m]
    slack = memory[CABLES + 2 * m : CABLES + 3 * m]
    was = slack.copy()
    sort_slack(measured, loops[0], slack)

    V_d, feed, V_W, A_W = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    _servo_twist(step, wanted, time, memory, V_d, feed)
    state = np.zeros(13)
    state[:7] = pose
    X = floating_motion(state)
    to_world(X, V_d, V_W)
    W, seen = np.empty((n, m)), state
    if n == 3:
        seen = np.zeros(6)
        seen[0], seen[1] = pose[4], pose[5]
        seen[2] = 2.0 * np.arctan2(pose[3], pose[0])
    wrench_matrix_at(seen, cables, step[HEIGHT], W)
    twist_W = state[7:13]
    twist_from_winches(W, rates, slack, V_W, np.empty((n, n)), np.empty(n), twist_W)
    twist = memory[TWIST : TWIST + 6]
    to_platform(X, twist_W, twist)
    if memory[RELAXED] == 0.0:  # a wrench that cannot be has nothing to gather
        for k in range(6):
            memory[GATHERED + k] += step[PERIOD] * (V_d[k] - twist[k])
    wanted_acceleration(
        X, V_d, feed, twist, memory[GATHERED : GATHERED + 6], step[MU], step[KAPPA], A_W
    )
    desired, F = np.zeros(19), memory[WRENCH : WRENCH + 6]
    desired[0], desired[13:19] = 1.0, A_W
    floating_wrench(state, desired, dynamics, no_gains, F)

    # A cable that does not pull cannot be counted on, whatever it is asked for.
    now, feasible = bounds.copy(), np.zeros(1)
    for i in range(m):
        if slack[i] != 0.0:
            now[0, i], now[1, i], now[2, i] = 0.0, 0.0, 0.0
    target, held = np.empty(m), tensions.copy()
    code = update_tensions(
        method, seen, F, cables, step[HEIGHT], now, row_scale, work, W, target, held, feasible
    )
    memory[STEPS] += 1.0
    memory[RELAXED] = 0.0
    if code != FEASIBLE:
        code = update_tensions(
            fallback, seen, F, cables, step[HEIGHT], now, row_scale, work, W, target, held, feasible
        )
        if code != FEASIBLE:
            memory[RELAXED] = 1.0
            memory[RELAXED_STEPS] += 1.0
    take_over(held, measured, was, slack, bounds[0], loops[0], tensions)
    changed = approach(held, slack, bounds[0], loops[0, TENSION_RATE] * step[PERIOD], tensions)
    memory[LARGEST_RATE] = max(memory[LARGEST_RATE], changed / step[PERIOD])
    for i in range(m):
        torques[i], gathered[i] = winch_torque(
            tensions[i], measured[i], rates[i], winch_speed(W, V_W, i), slack[i] != 0.0,
            gathered[i], step[PERIOD], loops[i],
        )  # fmt: skip
