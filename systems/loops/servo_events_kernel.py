"""Numba kernel of a visual servo's loop: from event to event, as `ServoLoop` goes in Python.

It calls what the blocks call: the robot, its cables, the pose of a plane and the servo's law by the
addresses of their machine code, all else as a part of itself. So nothing is computed by a second
law, and compiling it takes little.

Everything stands in arrays of one table, see `numerics.array_addresses`; the first numbers below
are rows of it. Poses are columns, as in `geometry.drake_pose_kernel`, or rows where a block's state
keeps them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, ideal_rates
from cdpr_drake.geometry.drake_pose_kernel import (
    compose,
    invert,
    pack_rows,
    pose_of_floating,
    project,
    square_sum,
    unpack_rows,
)
from cdpr_drake.geometry.poses import exponential_of, rotation_vector_of_matrix
from cdpr_drake.numerics.kernel_calls import (
    call_at_address,
    integers_at,
    matrix_at,
    vector_at,
)
from cdpr_drake.numerics.normal_numbers_kernel import standard_normals
from cdpr_drake.servoing.packed_features_kernel import CENTER, MARKS
from cdpr_drake.servoing.servo_law import SWITCHES, TASK
from cdpr_drake.servoing.servo_step_kernel import task_at
from cdpr_drake.vision.pinhole import (
    crossing_diagonals,
    images_of,
    is_pictured,
    normalize_points,
)
from cdpr_drake.vision.target import VISIBLE_BORDER

(
    WHOLE, NUMBERS, CLOCKS, RUN, LIMIT, SEED, COLUMNS, ROBOT, RULE, PRESENT, COMMAND, CALM,
    MEMORY, CABLES, ROOM, OUTPUT, POINTS, OUTLINE, CAMERA, BIAS, FIXED, FRAMES, KINDS, ESTIMATES,
    BEGINS, SERVO, FRESH, RESULT, MODES, OFFSETS, TIMES, ROWS,
) = range(32)  # fmt: skip
"""Rows of the table."""

(
    REACH, OUTPUTS_OF, PLANAR_POSE, SERVO_STEP, PLATFORM, STATE, EYE_TO_HAND, USES_CENTER,
    DIAGONALS, USES_MARKS, FEATURES, SIZE, LOGGED, ROOM_FOR,
) = range(14)  # fmt: skip
"""Whole numbers: four addresses; sizes of the platform's and the robot's state; what the target and
the features are; numbers of a mark; rows of the log, and how many there is room for."""

CONTROL, LOGGING, IMAGE = range(3)
"""Clocks, rows (period [s], next time [s], whether it strikes now)."""

(
    CONTROL_PERIOD, RATE, NOISE, POSITION, ROTATION, HOLD, LOST, EARLIEST, FREE_ROTATION, LOWER,
) = range(10)  # fmt: skip
UPPER = LOWER + 3
"""Numbers: of camera and of `StopRules`."""

TIME, REACHED_SINCE, LOST_SINCE, JUDGED, OUTCOME = range(5)
"""How the run stands."""

MOUNT, UNMOUNT, OBJECT, BELIEVED, UNBELIEVED, DESIRED = range(6)
"""Poses that stay: X_BC and its inverse, X_WO or X_PO, believed X_PC and its inverse, X_CdO."""

INTEGRATION, CONSECUTIVE, FIRST = range(3)
"""Kinds of estimators, as `ControlIntegration`, `ConsecutiveImages`, `FirstImage`."""

UPDATED, DUE, RESET, POSE, EXTRA = 0, 1, 2, 3, 15
"""Where what is in an estimator's memory, as in `PoseEstimator`."""

(
    C_POSE, C_CAMERA, C_FOUND, C_MARKS, C_ERROR, C_GAIN, C_TWIST, C_VELOCITIES, C_MODE, C_CABLES,
    C_LENGTHS, C_ESTIMATES,
) = range(12)  # fmt: skip
"""Where the log's quantities begin; from the last on those of each estimator."""

R_TIME, R_FAILED, R_MORE = range(3)
"""What `run_events` returns: the time is reached or the run over, the robot cannot move on, or the
log needs room."""

RUNNING, CONVERGED, TARGET_LOST, DIVERGED = 0.0, 1.0, 2.0, 4.0
"""As `Outcome`."""

NOW = 1e-9

_V, _M = types.float64[::1], types.float64[:, ::1]
_TABLE = types.int64[:, ::1]
REACH_TYPES = types.int64(_TABLE, _V, _V, _V, _M, types.float64, _V)
OUTPUTS_TYPES = types.int64(_V, _V, _V, _M, _V, _M)
POSE_TYPES = types.boolean(_M, _M, _V, _M, _V)
STEP_TYPES = types.void(_TABLE, _V, _V, types.float64, _V, _V)


@intrinsic
def _reach(typing: Any, at: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any) -> Any:
    return REACH_TYPES.return_type(types.int64, *REACH_TYPES.args), call_at_address(REACH_TYPES)


@intrinsic
def _cables_do(typing: Any, at: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any) -> Any:
    kind = OUTPUTS_TYPES
    return kind.return_type(types.int64, *kind.args), call_at_address(kind)


@intrinsic
def _planar_pose(typing: Any, at: Any, a: Any, b: Any, c: Any, d: Any, e: Any) -> Any:
    return POSE_TYPES.return_type(types.int64, *POSE_TYPES.args), call_at_address(POSE_TYPES)


@intrinsic
def _servo_step(typing: Any, at: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any) -> Any:
    return STEP_TYPES.return_type(types.int64, *STEP_TYPES.args), call_at_address(STEP_TYPES)


@njit(cache=True)
def next_strike(now: float, period: float) -> float:
    """As `loop_state.next_time`."""
    count = math.ceil(now / period)
    later = count * period
    return float(later if later > now else (count + 1) * period)


@njit(cache=True)
def _copy_pose(source: Array, target: Array) -> None:
    for i in range(12):
        target[i] = source[i]


@njit(cache=True)
def _moved(X: Array, twist: Array, elapsed: float) -> None:
    """X <- X @ exponential(twist elapsed)."""
    step, turn, moved, before = np.empty(6), np.empty(12), np.empty(12), np.empty(12)
    for i in range(6):
        step[i] = twist[i] * elapsed
    E = exponential_of(step)
    for i in range(3):
        for j in range(4):
            turn[3 * j + i] = E[i, j]
    _copy_pose(X, before)
    compose(before, turn, moved)
    _copy_pose(moved, X)


@njit(cache=True)
def _remember(kind: int, X_WP: Array, X_CO: Array, X_PC: Array, memory: Array) -> None:
    """What an image estimator keeps of an image that was taken at X_WP."""
    memory[EXTRA] = 1.0
    if kind == CONSECUTIVE:
        pack_rows(X_CO, memory, EXTRA + 1)
        return
    X_WC, X_WO = np.empty(12), np.empty(12)
    compose(X_WP, X_PC, X_WC)
    compose(X_WC, X_CO, X_WO)
    pack_rows(X_WO, memory, EXTRA + 1)


@njit(cache=True)
def _see(kind: int, X_WP: Array, X_CO: Array, fixed: Array, memory: Array) -> None:
    """Estimate X_WP and memory of an image estimator by an image, as `_seen` of its block."""
    if memory[EXTRA] == 0.0:
        _remember(kind, X_WP, X_CO, fixed[BELIEVED], memory)
        return
    kept, X_OC, X_WO, X_WC = np.empty(12), np.empty(12), np.empty(12), np.empty(12)
    unpack_rows(memory, EXTRA + 1, kept)
    if kind == CONSECUTIVE:
        compose(X_WP, fixed[BELIEVED], X_WC)
        compose(X_WC, kept, X_WO)
    else:
        _copy_pose(kept, X_WO)
    invert(X_CO, X_OC)
    compose(X_WO, X_OC, X_WC)
    compose(X_WC, fixed[UNBELIEVED], X_WP)
    if kind == CONSECUTIVE:
        _remember(kind, X_WP, X_CO, fixed[BELIEVED], memory)


@njit(cache=True)
def _upcoming(
    table: np.ndarray, e: int, now: float, found: float, X_CO: Array, twist: Array, after: Array
) -> None:
    """after <- memory of estimator e after a step now, as `PoseEstimator.upcoming`."""
    kind, memory = integers_at(table, KINDS)[e], matrix_at(table, ESTIMATES)[e]
    for i in range(memory.shape[0]):
        after[i] = memory[i]
    X_WP = np.empty(12)
    unpack_rows(memory, POSE, X_WP)
    elapsed = now - memory[UPDATED]
    if kind == INTEGRATION:
        if elapsed != 0.0:
            _moved(X_WP, twist, elapsed)
    elif found != 0.0:
        _see(kind, X_WP, X_CO, matrix_at(table, FIXED), after)
    after[UPDATED], after[DUE] = now, now + vector_at(table, NUMBERS)[CONTROL_PERIOD]
    pack_rows(X_WP, after, POSE)


@njit(cache=True)
def _estimate(kind: int, memory: Array, now: float, twist: Array, X_WP: Array) -> None:
    """X_WP <- what an estimator says now, of its memory after the step that was due."""
    unpack_rows(memory, POSE, X_WP)
    elapsed = now - memory[UPDATED]
    if kind == INTEGRATION and elapsed != 0.0:
        _moved(X_WP, twist, elapsed)


@njit(cache=True)
def _take_image(table: np.ndarray, now: float, X_WP: Array) -> None:
    """The delay line after an image of a time [s], as `ProjectedCamera` and `next_frames`."""
    whole, numbers, fixed = (
        integers_at(table, WHOLE),
        vector_at(table, NUMBERS),
        matrix_at(table, FIXED),
    )
    frames, size = vector_at(table, FRAMES), whole[SIZE]
    points, outline = matrix_at(table, POINTS), matrix_at(table, OUTLINE)
    camera, bias = vector_at(table, CAMERA), vector_at(table, BIAS)
    frame, n = 13 + size, size // 2
    for i in range(frames.shape[0] - 1, frame - 1, -1):
        frames[i] = frames[i - frame]
    for i in range(frame):
        frames[i] = 0.0
    X_WC, X_CW, X_WO, X_CO = np.empty(12), np.empty(12), np.empty(12), np.empty(12)
    if whole[EYE_TO_HAND]:
        compose(X_WP, fixed[OBJECT], X_WO)
        compose(fixed[UNMOUNT], X_WO, X_CO)
    else:
        compose(X_WP, fixed[MOUNT], X_WC)
        invert(X_WC, X_CW)
        compose(X_CW, fixed[OBJECT], X_CO)
    if not is_pictured(outline, X_CO, camera, VISIBLE_BORDER):
        return
    uv, image, noise = np.empty((2, n)), np.empty((n, 2)), np.empty(2 * n)
    images_of(points, X_CO, camera, uv)
    if numbers[NOISE] > 0.0:
        standard_normals(integers_at(table, SEED), round(now * numbers[RATE]), noise)
        for i in range(2):
            for k in range(n):
                uv[i, k] = uv[i, k] + numbers[NOISE] * noise[n * i + k]
    flat = np.empty((n, 3))
    for k in range(n):
        for i in range(2):
            image[k, i] = uv[i, k] + bias[i] if bias.shape[0] > 0 else uv[i, k]
            if not math.isfinite(image[k, i]):
                return
        for i in range(3):
            flat[k, i] = points[i, k]
    R, p, rows = np.empty((3, 3)), np.empty(3), np.empty(9)
    if not _planar_pose(whole[PLANAR_POSE], flat, image, camera, R, p):
        return
    for i in range(9):
        rows[i] = R[i // 3, i % 3]
    project(rows, 0, True, X_CO)
    for i in range(3):
        X_CO[9 + i] = p[i]
    frames[0] = 1.0
    for k in range(n):
        for i in range(2):
            frames[1 + 2 * k + i] = image[k, i]
    pack_rows(X_CO, frames, 1 + size)


@njit(cache=True)
def _seen_pose(frames: Array, oldest: int, size: int, X_CO: Array) -> float:
    """X_CO on the camera's port, the identity where nothing is found; whether it is found."""
    found = frames[oldest]
    if found == 0.0:
        for i in range(12):
            X_CO[i] = 1.0 if i in (0, 4, 8) else 0.0
    else:
        unpack_rows(frames, oldest + 1 + size, X_CO)
    return float(found)


@njit(cache=True)
def _is_reached(numbers: Array, X_CO: Array, X_CdO: Array) -> bool:
    """Whether the pose is as desired, as `RunMonitor.judge` and `seen_pose_error` find."""
    apart = np.empty(3)
    for i in range(3):
        apart[i] = X_CO[9 + i] - X_CdO[9 + i]
    if not math.sqrt(square_sum(apart, 0, 3)) <= numbers[POSITION]:
        return False
    if numbers[FREE_ROTATION] != 0.0:
        ax, ay, az, bx, by, bz = X_CdO[2], X_CdO[5], X_CdO[8], X_CO[2], X_CO[5], X_CO[8]
        along = ax * bx + ay * by + az * bz
        apart[0], apart[1], apart[2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        across = math.sqrt(square_sum(apart, 0, 3))
        return bool(math.atan2(across, along) <= numbers[ROTATION])
    back, turn, R = np.zeros(12), np.empty(12), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            back[3 * j + i] = X_CO[3 * i + j]
    compose(back, X_CdO, turn)
    for i in range(3):
        for j in range(3):
            R[i, j] = turn[3 * j + i]
    vector = rotation_vector_of_matrix(R)
    return math.sqrt(square_sum(vector, 0, 3)) <= numbers[ROTATION]


@njit(cache=True)
def _judge(
    numbers: Array, run: Array, state: Array, found: float, X_CO: Array, fixed: Array
) -> None:
    """How the run stands now, as `RunMonitor.judge`."""
    now, reached = run[TIME], False
    if found != 0.0 and now >= numbers[EARLIEST]:
        reached = _is_reached(numbers, X_CO, fixed[DESIRED])
    if not reached:
        run[REACHED_SINCE] = -1.0
    elif run[REACHED_SINCE] < 0.0:
        run[REACHED_SINCE] = now
    if found != 0.0:
        run[LOST_SINCE] = -1.0
    elif run[LOST_SINCE] < 0.0:
        run[LOST_SINCE] = now
    run[JUDGED] = RUNNING
    outside = False
    for i in range(3):
        place = state[4 + i]
        outside = outside or place < numbers[LOWER + i] or place > numbers[UPPER + i]
    if outside:
        run[JUDGED] = DIVERGED
    elif run[LOST_SINCE] >= 0.0 and now - run[LOST_SINCE] >= numbers[LOST]:
        run[JUDGED] = TARGET_LOST
    elif run[REACHED_SINCE] >= 0.0 and now - run[REACHED_SINCE] >= numbers[HOLD]:
        run[JUDGED] = CONVERGED


@njit(cache=True)
def _decide(
    table: np.ndarray, steps: np.ndarray, now: float, frames: Array, oldest: int, X_CO: Array,
    X_WP: Array,
) -> None:  # fmt: skip
    """A step of the servo, as `FeatureServo.decide`: its outputs and its memory."""
    whole, memory, result = (
        integers_at(table, WHOLE),
        vector_at(table, SERVO),
        vector_at(table, RESULT),
    )
    size, k, camera = whole[SIZE], whole[FEATURES], vector_at(table, CAMERA)
    m = result.shape[0] - k - 7
    if frames[oldest] == 0.0:
        fresh, task, switches = vector_at(table, FRESH), memory[TASK], memory[SWITCHES]
        for i in range(memory.shape[0]):
            memory[i] = fresh[i]
        memory[TASK], memory[SWITCHES] = task, switches
        for i in range(m + 6):
            result[i] = 0.0
        result[m + 6 + k] = 0.0
        return
    marks = frames[oldest + 1 : oldest + 1 + size]
    seen = np.empty(MARKS + (size if whole[USES_MARKS] else 0))
    _copy_pose(X_CO, seen)
    seen[CENTER] = seen[CENTER + 1] = 0.0
    if whole[USES_CENTER]:
        if whole[DIAGONALS]:
            crossing_diagonals(marks, camera, seen[CENTER:MARKS])
        else:
            seen[CENTER], seen[CENTER + 1] = X_CO[9] / X_CO[11], X_CO[10] / X_CO[11]
    if whole[USES_MARKS]:
        normalize_points(marks, camera, seen[MARKS:])
    begins = vector_at(table, BEGINS)
    number = task_at(begins, memory, now) if begins.shape[0] > 1 else 0
    _servo_step(whole[SERVO_STEP], steps[number], seen, X_WP, now, memory, result)
    modes, told = integers_at(table, MODES), vector_at(table, FRESH)
    for i in range(modes.shape[0]):
        told[memory.shape[0] + i] = memory[modes[i]]


@njit(cache=True)
def _update(table: np.ndarray, steps: np.ndarray) -> None:
    """Lets look and decide whose time has come, as `ServoLoop._update`."""
    whole, clocks, numbers = (
        integers_at(table, WHOLE),
        matrix_at(table, CLOCKS),
        vector_at(table, NUMBERS),
    )
    run, present, frames = (
        vector_at(table, RUN),
        vector_at(table, PRESENT),
        vector_at(table, FRAMES),
    )
    command, result = vector_at(table, COMMAND), vector_at(table, RESULT)
    fixed, now, size = matrix_at(table, FIXED), run[TIME], whole[SIZE]
    if clocks[IMAGE, 2] != 0.0:
        X_WP = np.empty(12)
        pose_of_floating(present, X_WP)
        _take_image(table, now, X_WP)
    if clocks[CONTROL, 2] != 0.0:
        oldest = frames.shape[0] - 13 - size
        kinds, memories = integers_at(table, KINDS), matrix_at(table, ESTIMATES)
        m = command.shape[0]
        twist, X_CO, X_believed = result[m : m + 6], np.empty(12), np.empty(12)
        after = np.empty(memories.shape[1])
        found = _seen_pose(frames, oldest, size, X_CO)
        for e in range(kinds.shape[0]):
            _upcoming(table, e, now, found, X_CO, twist, after)
            for i in range(after.shape[0]):
                memories[e, i] = after[i]
        _estimate(kinds[0], memories[0], now, twist, X_believed)
        _decide(table, steps, now, frames, oldest, X_CO, X_believed)
        _judge(numbers, run, present, found, X_CO, fixed)
    offsets = vector_at(table, OFFSETS)
    for i in range(command.shape[0]):
        command[i] = result[i] + offsets[i] if offsets.shape[0] > 0 else result[i]


@njit(cache=True)
def _log_pose(X: Array, row: Array, first: int) -> None:
    """A pose as its matrix (3, 4) row by row."""
    for i in range(3):
        for j in range(4):
            row[first + 4 * i + j] = X[3 * j + i]


@njit(cache=True)
def _log_row(table: np.ndarray) -> bool:
    """Writes a row of the log, as `LoopLog.append`; False where a cable cannot run."""
    whole, columns = integers_at(table, WHOLE), integers_at(table, COLUMNS)
    run, present, frames = (
        vector_at(table, RUN),
        vector_at(table, PRESENT),
        vector_at(table, FRAMES),
    )
    result, out, cables = (
        vector_at(table, RESULT),
        matrix_at(table, OUTPUT),
        matrix_at(table, CABLES),
    )
    kinds, memories = integers_at(table, KINDS), matrix_at(table, ESTIMATES)
    command, now, size, n = vector_at(table, COMMAND), run[TIME], whole[SIZE], whole[PLATFORM]
    m, k = command.shape[0], whole[FEATURES]
    row = matrix_at(table, ROWS)[whole[LOGGED]]
    rates, X = np.empty(m), np.empty(12)
    ideal_rates(vector_at(table, LIMIT)[0], command, rates)
    lengths = present[n : n + m]
    if (
        _cables_do(
            whole[OUTPUTS_OF], present[:n], lengths, rates, cables, vector_at(table, ROOM), out
        )
        >= 0
    ):
        return False
    for i in range(out.shape[0]):
        for j in range(m):
            row[columns[C_CABLES] + m * i + j] = out[i, j]
    for j in range(m):
        row[columns[C_LENGTHS] + j] = lengths[j]
        row[columns[C_VELOCITIES] + j] = result[j]
    pose_of_floating(present, X)
    _log_pose(X, row, columns[C_POSE])
    oldest = frames.shape[0] - 13 - size
    X_CO, twist, after = np.empty(12), result[m : m + 6], np.empty(memories.shape[1])
    found = _seen_pose(frames, oldest, size, X_CO)
    _log_pose(X_CO, row, columns[C_CAMERA])
    row[columns[C_FOUND]] = found
    for i in range(size):
        row[columns[C_MARKS] + i] = frames[oldest + 1 + i]
    for i in range(k):
        row[columns[C_ERROR] + i] = result[m + 6 + i]
    for i in range(6):
        row[columns[C_TWIST] + i] = twist[i]
    row[columns[C_GAIN]] = result[m + 6 + k]
    modes, told = integers_at(table, MODES), vector_at(table, FRESH)
    for i in range(modes.shape[0]):
        row[columns[C_MODE] + i] = told[told.shape[0] - modes.shape[0] + i]
    for e in range(kinds.shape[0]):
        for i in range(after.shape[0]):
            after[i] = memories[e, i]
        if now >= memories[e, DUE] - NOW:
            _upcoming(table, e, now, found, X_CO, twist, after)
        _estimate(kinds[e], after, now, twist, X)
        _log_pose(X, row, columns[C_ESTIMATES + e])
    vector_at(table, TIMES)[whole[LOGGED]] = now
    whole[LOGGED] += 1
    return True


@njit(cache=True)
def run_events(table: np.ndarray, robot: np.ndarray, steps: np.ndarray, boundary: float) -> int:
    """Goes on to a time [s], or until the outcome is known, as `ServoLoop.advance_to`.

    Args:
        table: The arrays.
        robot: `robot_addresses` of the robot.
        steps: `step_addresses` of the servo's tasks, shape (tasks, 8, 4).
        boundary: The time [s].

    Returns:
        `R_TIME`; `R_FAILED`: the robot did not get to the time that `RUN` says, from its state and
        its memory as they are; `R_MORE`.
    """
    whole, clocks, run = integers_at(table, WHOLE), matrix_at(table, CLOCKS), vector_at(table, RUN)
    present, memory = vector_at(table, PRESENT), vector_at(table, MEMORY)
    rule, command, calm = vector_at(table, RULE), vector_at(table, COMMAND), matrix_at(table, CALM)
    size = present.shape[0]
    while run[TIME] < boundary:
        if whole[LOGGED] >= whole[ROOM_FOR]:
            return R_MORE
        struck = False
        for c in range(3):
            struck = struck or clocks[c, 2] != 0.0
        if struck:
            _update(table, steps)
        now = boundary
        for c in range(3):
            if clocks[c, 1] < now:
                now = clocks[c, 1]
        run[TIME] = now
        if _reach(whole[REACH], robot, rule, present, command, calm, now, memory) != INTEGRATION_OK:
            return R_FAILED
        for i in range(size):
            present[i] = memory[size + i]
        for c in range(3):
            clocks[c, 2] = 0.0
            if clocks[c, 1] == now:
                clocks[c, 2] = 1.0
                clocks[c, 1] = next_strike(now, clocks[c, 0])
        if clocks[LOGGING, 2] != 0.0 and not _log_row(table):
            return R_FAILED
        if run[JUDGED] != RUNNING and clocks[CONTROL, 2] != 0.0:
            run[OUTCOME] = run[JUDGED]
            return R_TIME
    return R_TIME
