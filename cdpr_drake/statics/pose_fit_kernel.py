"""Numba kernels that fit a platform's pose to cable lengths, near a guess.

Levenberg-Marquardt on l_i(X) - l_i. Steps are a rotation vector about Po in W and a translation;
the rotation is a unit quaternion, multiplied by the step's, so that it stays a rotation. Poses are
arrays (quaternion wxyz, position), as the state of a floating body begins.

Source: servoing thesis, algorithm 2, there with the quaternion's norm as a seventh equation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.motion_type import keep_free
from cdpr_drake.geometry.pulley_kernel import pulley_jacobian, pulley_line
from cdpr_drake.geometry.rotation_kernel import quaternion_of_matrix, solve_damped, turn_pose

FITS = 1
"""A pose with these lengths, within the tolerance."""

MISFIT = 0
"""The search settled where lengths differ by more than the tolerance."""

UNSETTLED = -1
"""The search did not settle."""

SINGULAR = -2
"""The pose fits, but a direction of motion changes none of the lengths to first order."""

BAD_LENGTHS, BAD_INDEX = -3, -4
"""Lengths that are not finite and above 0, cables that are not there; nothing was searched."""

MAX_STEPS = 60
"""Linear systems that one start may solve."""

SMALL_STEP = 1e-11
"""The search has settled when a step turns by less [rad] and moves by less, relative to the
mean length."""

LAST_STEP, LAST_MISFIT = 1e-7, 1e-6
"""Where the lengths fit so well, relative to their mean, an undamped step so small is the last, as
what is left is its square: it need not be looked at again."""

ROUNDING_STEPS = 1e3
"""Steps up to this many times `SMALL_STEP` may fail to descend by rounding."""

ROUNDING = 1e-15
"""Residuals below this, relative to the mean length, are rounding."""

SINGULAR_PIVOT = 1e-12
"""J'J is singular if a pivot of its factor is smaller, relative to its diagonal."""

WORK_SHAPE = (24, 6)
"""Shape of the work space of `fit_pose`."""

FIRST_DAMPING = 0.03
"""Damping of the first step, against a diagonal of ones, where several poses fit exactly."""

_RESTART_ANGLES = (0.25, 0.6)
_RESTARTS = 6 * len(_RESTART_ANGLES)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _products(J: Array, A: Array, g: Array) -> float:
    """Writes J'J, its lower half, and J'r from columns of J and, last, r; returns r'r."""
    m = J.shape[1]
    square = 0.0
    for i in range(m):
        square += J[6, i] * J[6, i]
    for j in range(6):
        total = 0.0
        for i in range(m):
            total += J[j, i] * J[6, i]
        g[j] = total
        for k in range(j + 1):
            total = 0.0
            for i in range(m):
                total += J[j, i] * J[k, i]
            A[j, k] = total
    return square


@njit(cache=True, error_model="numpy")
def _normal_equations(
    state: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    free: Array,
    J: Array,
    A: Array,
    g: Array,
) -> Any:
    """Writes J'J, its lower half, and J'r; returns the sum of r^2 [m^2] and the largest |r| [m].

    The equations of motions that the platform has not, `free` is `MotionType.packed()`, say that
    they are 0. J is work space, shape (7, number used).
    """
    X = floating_motion(state)[:12]
    largest = 0.0
    for q in range(used.shape[0]):
        i = used[q]
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        r = length - lengths[i]
        largest = max(largest, abs(r))
        J[0, q] = ry * uz - rz * uy
        J[1, q] = rz * ux - rx * uz
        J[2, q] = rx * uy - ry * ux
        J[3, q] = ux
        J[4, q] = uy
        J[5, q] = uz
        J[6, q] = r
    total = _products(J, A, g)
    keep_free(free, X, g, A)
    return total, largest


@njit(cache=True, error_model="numpy")
def _descend(
    state: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    free: Array,
    tolerance: float,
    work: Array,
) -> Any:
    """Descends from one start, `state`, and moves it; returns a code and the number of steps."""
    A, other_A, C, g, other_g = work[0:6], work[6:12], work[12:18], work[18], work[19]
    x, trial = work[20], work[21:24].ravel()
    J = np.empty((7, used.shape[0]))
    scale = 0.0
    for i in used:
        scale += lengths[i]
    scale /= used.shape[0]
    # As many lengths as unknowns: several poses fit exactly, and short steps end at a near one.
    damping = FIRST_DAMPING if used.shape[0] == int(free[0] + free[1]) else 0.0
    cost, largest = _normal_equations(state, cables, used, lengths, free, J, A, g)
    if not np.isfinite(cost):  # a cable cannot run at all
        return UNSETTLED, 0
    settled = False
    for step in range(1, MAX_STEPS + 1):
        pivot = solve_damped(A, g, damping, C, x)
        if settled or largest <= ROUNDING * scale:
            if not largest <= tolerance:
                return MISFIT, step
            return (FITS if pivot > SINGULAR_PIVOT else SINGULAR), step
        if pivot < 0.0:
            damping = max(10.0 * damping, 1e-6)
            continue
        turn = max(abs(x[0]), abs(x[1]), abs(x[2]))
        move = max(abs(x[3]), abs(x[4]), abs(x[5]))
        trial[:13] = state
        turn_pose(trial, x[0], x[1], x[2])
        trial[4] += x[3]
        trial[5] += x[4]
        trial[6] += x[5]
        if (
            damping == 0.0
            and turn < LAST_STEP
            and move < LAST_STEP * scale
            and largest <= min(LAST_MISFIT * scale, tolerance)
        ):
            state[:] = trial[:13]
            return (FITS if pivot > SINGULAR_PIVOT else SINGULAR), step
        before = cost
        trial_cost, trial_largest = _normal_equations(
            trial, cables, used, lengths, free, J, other_A, other_g
        )
        settled = turn < SMALL_STEP and move < SMALL_STEP * scale and damping < 1e-2
        if trial_cost < before:
            state[:] = trial[:13]
            cost, largest = trial_cost, trial_largest
            A, other_A, g, other_g = other_A, A, other_g, g
            damping = 0.1 * damping if damping > 1e-5 else 0.0
        elif not settled:
            near = turn < ROUNDING_STEPS * SMALL_STEP and move < ROUNDING_STEPS * SMALL_STEP * scale
            if near and damping == 0.0:
                settled = True  # lower points than this are there by rounding only
            else:
                damping = max(10.0 * damping, 1e-3)
        if settled:
            damping = 0.0
    return UNSETTLED, MAX_STEPS


@njit(cache=True)
def fit_pose(
    guess: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    free: Array,
    tolerance: float,
    state: Array,
    work: Array,
) -> Any:
    """Fits a pose to lengths, from a guess and, where that misses, from turned guesses.

    Args:
        guess: Pose to start from, shape (7,).
        cables: `CableSet.packed()`, shape (m, 17).
        used: Indices of the cables to fit, at least as many as degrees of freedom.
        lengths: Lengths of all cables, shape (m,) [m].
        free: `MotionType.packed()`: which motions the platform has.
        tolerance: Largest accepted residual [m].
        state: Result, shape (13,): the pose, then zeros.
        work: Work space of `WORK_SHAPE`.

    Returns:
        Code (`FITS` and others) and the number of steps. `state` is the pose found or, where
        none fits, the one that fits best from the guess itself.
    """
    state[:7] = guess
    state[7:] = 0.0
    code, steps = _descend(state, cables, used, lengths, free, tolerance, work)
    if code == FITS:
        return code, steps
    other = state.copy()
    for k in range(_RESTARTS):
        axis = k % 6 // 2
        if free[0] == 0.0 or (free[0] == 1.0 and axis != 2):
            continue
        angle = _RESTART_ANGLES[k // 6] * (1.0 if k % 2 == 0 else -1.0)
        other[:7] = guess
        other[7:] = 0.0
        if free[0] == 1.0:
            turn_pose(other, angle * free[2], angle * free[3], angle * free[4])
        else:
            turn_pose(
                other,
                angle if axis == 0 else 0.0,
                angle if axis == 1 else 0.0,
                angle if axis == 2 else 0.0,
            )
        other_code, more = _descend(other, cables, used, lengths, free, tolerance, work)
        steps += more
        if other_code == FITS:
            state[:] = other
            return other_code, steps
    return code, steps


@njit(cache=True)
def lengths_at(state: Array, cables: Array, lengths: Array, J: Array) -> None:
    """Writes all lengths, shape (m,) [m], and the Jacobian, shape (m, 6), at a state (13,)."""
    pulley_jacobian(floating_motion(state)[:12], cables, lengths, J)


@njit(cache=True)
def fit_matrix(
    guess: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    free: Array,
    tolerance: float,
    found: Array,
    residuals: Array,
    J: Array,
) -> Any:
    """`fit_pose` from a pose to a pose as matrices, with what a caller wants to know of it.

    Args:
        guess: Pose to start from as a homogeneous matrix, shape (4, 4).
        cables: As `fit_pose`.
        used: As `fit_pose`; checked here.
        lengths: As `fit_pose`; checked here.
        free: As `fit_pose`.
        tolerance: As `fit_pose`.
        found: Gets the pose, rotation and position, shape (3, 4) [-, m].
        residuals: Gets lengths at the pose less those given, of the cables used [m].
        J: Gets the length Jacobian of the cables used, shape (number used, 6).

    Returns:
        As `fit_pose`; also `BAD_LENGTHS` and `BAD_INDEX`, and then nothing is written.
    """
    m = cables.shape[0]
    for i in range(m):
        if not (lengths[i] > 0.0 and lengths[i] < np.inf):
            return BAD_LENGTHS, 0
    for i in used:
        if i < 0 or i >= m:
            return BAD_INDEX, 0
    start, state, work = np.empty(7), np.empty(13), np.empty(WORK_SHAPE)
    quaternion_of_matrix(guess, start)
    start[4], start[5], start[6] = guess[0, 3], guess[1, 3], guess[2, 3]
    code, steps = fit_pose(start, cables, used, lengths, free, tolerance, state, work)
    X = floating_motion(state)
    for i in range(3):
        for j in range(3):
            found[i, j] = X[3 * i + j]
        found[i, 3] = X[9 + i]
    for q in range(used.shape[0]):
        i = used[q]
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        residuals[q] = length - lengths[i]
        J[q, 0] = ry * uz - rz * uy
        J[q, 1] = rz * ux - rx * uz
        J[q, 2] = rx * uy - ry * ux
        J[q, 3], J[q, 4], J[q, 5] = ux, uy, uz
    return code, steps


@njit(cache=True, nogil=True)
def fit_poses(
    first: int,
    past: int,
    guesses: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    free: Array,
    tolerance: float,
    poses: Array,
    codes: np.ndarray,
    steps: np.ndarray,
) -> None:
    """`fit_pose` for many: guesses (k, 7), used (k, n_used), lengths (k, m); writes the rest.

    Only rows from `first` on, up to the one before `past`.
    """
    for k in range(first, past):
        state, work = np.empty(13), np.empty(WORK_SHAPE)
        codes[k], steps[k] = fit_pose(
            guesses[k], cables, used[k], lengths[k], free, tolerance, state, work
        )
        poses[k] = state[:7]
