"""Numba kernels that fit a platform's pose to cable lengths, near a guess.

Levenberg-Marquardt on l_i(X) - l_i. Steps are a rotation vector about Po in W and a translation;
the rotation is a unit quaternion, multiplied by the step's, so that it stays a rotation. Poses are
arrays (quaternion wxyz, position), as the state of a floating body begins.

Source: servoing thesis, algorithm 2, there with the quaternion's norm as a seventh equation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange

from cdpr_drake.arrays import Array
from cdpr_drake.cable_kernel import floating_motion
from cdpr_drake.pose_step_kernel import solve_damped, turn_pose
from cdpr_drake.pulley_kernel import pulley_jacobian, pulley_line

FITS = 1
"""A pose with these lengths, within the tolerance."""

MISFIT = 0
"""The search settled where lengths differ by more than the tolerance."""

UNSETTLED = -1
"""The search did not settle."""

SINGULAR = -2
"""The pose fits, but a direction of motion changes none of the lengths to first order."""

MAX_STEPS = 60
"""Linear systems that one start may solve."""

SMALL_STEP = 1e-11
"""The search has settled when a step turns by less [rad] and moves by less, relative to the
mean length."""

NEAR = 1e3
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


@njit(cache=True, error_model="numpy")
def _normal_equations(
    state: Array, cables: Array, used: np.ndarray, lengths: Array, planar: bool, A: Array, g: Array
) -> Any:
    """Writes J'J, its lower half, and J'r; returns the sum of r^2 [m^2] and the largest |r| [m].

    Of a planar robot, the equations of the motions that it has not say that they are 0.
    """
    X = floating_motion(state)
    a00 = a10 = a11 = a20 = a21 = a22 = 0.0  # in registers: twice as fast as adding to the array
    a30 = a31 = a32 = a33 = a40 = a41 = a42 = a43 = a44 = 0.0
    a50 = a51 = a52 = a53 = a54 = a55 = 0.0
    g0 = g1 = g2 = g3 = g4 = g5 = 0.0
    total = largest = 0.0
    for i in used:
        length, ux, uy, uz, rx, ry, rz = pulley_line(X, cables[i])
        r = length - lengths[i]
        total += r * r
        largest = max(largest, abs(r))
        tx = ry * uz - rz * uy
        ty = rz * ux - rx * uz
        tz = rx * uy - ry * ux
        g0, g1, g2 = g0 + tx * r, g1 + ty * r, g2 + tz * r
        g3, g4, g5 = g3 + ux * r, g4 + uy * r, g5 + uz * r
        a00, a10, a11 = a00 + tx * tx, a10 + ty * tx, a11 + ty * ty
        a20, a21, a22 = a20 + tz * tx, a21 + tz * ty, a22 + tz * tz
        a30, a31, a32, a33 = a30 + ux * tx, a31 + ux * ty, a32 + ux * tz, a33 + ux * ux
        a40, a41, a42, a43 = a40 + uy * tx, a41 + uy * ty, a42 + uy * tz, a43 + uy * ux
        a50, a51, a52, a53 = a50 + uz * tx, a51 + uz * ty, a52 + uz * tz, a53 + uz * ux
        a44, a54, a55 = a44 + uy * uy, a54 + uz * uy, a55 + uz * uz
    g[0], g[1], g[2], g[3], g[4], g[5] = g0, g1, g2, g3, g4, g5
    A[0, 0], A[1, 0], A[1, 1], A[2, 0], A[2, 1], A[2, 2] = a00, a10, a11, a20, a21, a22
    A[3, 0], A[3, 1], A[3, 2], A[3, 3] = a30, a31, a32, a33
    A[4, 0], A[4, 1], A[4, 2], A[4, 3], A[4, 4] = a40, a41, a42, a43, a44
    A[5, 0], A[5, 1], A[5, 2], A[5, 3], A[5, 4], A[5, 5] = a50, a51, a52, a53, a54, a55
    if planar:
        for j in (0, 1, 5):
            g[j] = 0.0
            for k in range(6):
                A[j, k] = A[k, j] = 0.0
            A[j, j] = 1.0
    return total, largest


@njit(cache=True, error_model="numpy")
def _descend(
    state: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    planar: bool,
    tolerance: float,
    work: Array,
) -> Any:
    """Descends from one start, `state`, and moves it; returns a code and the number of steps."""
    A, other_A, C, g, other_g = work[0:6], work[6:12], work[12:18], work[18], work[19]
    x, trial = work[20], work[21:24].ravel()
    scale = 0.0
    for i in used:
        scale += lengths[i]
    scale /= used.shape[0]
    # As many lengths as unknowns: several poses fit exactly, and short steps end at a near one.
    damping = FIRST_DAMPING if used.shape[0] == (3 if planar else 6) else 0.0
    cost, largest = _normal_equations(state, cables, used, lengths, planar, A, g)
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
        before = cost
        trial_cost, trial_largest = _normal_equations(
            trial, cables, used, lengths, planar, other_A, other_g
        )
        settled = turn < SMALL_STEP and move < SMALL_STEP * scale and damping < 1e-2
        if trial_cost < before:
            state[:] = trial[:13]
            cost, largest = trial_cost, trial_largest
            A, other_A, g, other_g = other_A, A, other_g, g
            damping = 0.1 * damping if damping > 1e-5 else 0.0
        elif not settled:
            near = turn < NEAR * SMALL_STEP and move < NEAR * SMALL_STEP * scale
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
    planar: bool,
    tolerance: float,
    state: Array,
    work: Array,
) -> Any:
    """Fits a pose to lengths, from a guess and, where that misses, from turned guesses.

    Args:
        guess: Pose to start from, shape (7,).
        cables: `CableSet.packed()`, shape (m, 13).
        used: Indices of the cables to fit, at least as many as degrees of freedom.
        lengths: Lengths of all cables, shape (m,) [m].
        planar: Whether only x, y and the turn about z move.
        tolerance: Largest accepted residual [m].
        state: Result, shape (13,): the pose, then zeros.
        work: Work space of `WORK_SHAPE`.

    Returns:
        Code (`FITS` and others) and the number of steps. `state` is the pose found or, where
        none fits, the one that fits best from the guess itself.
    """
    state[:7] = guess
    state[7:] = 0.0
    code, steps = _descend(state, cables, used, lengths, planar, tolerance, work)
    if code == FITS:
        return code, steps
    other = state.copy()
    for k in range(_RESTARTS):
        axis = k % 6 // 2
        if planar and axis != 2:
            continue
        angle = _RESTART_ANGLES[k // 6] * (1.0 if k % 2 == 0 else -1.0)
        other[:7] = guess
        other[7:] = 0.0
        turn_pose(
            other,
            angle if axis == 0 else 0.0,
            angle if axis == 1 else 0.0,
            angle if axis == 2 else 0.0,
        )
        found, more = _descend(other, cables, used, lengths, planar, tolerance, work)
        steps += more
        if found == FITS:
            state[:] = other
            return found, steps
    return code, steps


@njit(cache=True)
def lengths_at(state: Array, cables: Array, lengths: Array, J: Array) -> None:
    """Writes all lengths, shape (m,) [m], and the Jacobian, shape (m, 6), at a state (13,)."""
    pulley_jacobian(floating_motion(state), cables, lengths, J)


@njit(cache=True, parallel=True)
def fit_poses(
    guesses: Array,
    cables: Array,
    used: np.ndarray,
    lengths: Array,
    planar: bool,
    tolerance: float,
    poses: Array,
    codes: np.ndarray,
    steps: np.ndarray,
) -> None:
    """`fit_pose` for many: guesses (k, 7), used (k, n_used), lengths (k, m); writes the rest."""
    for k in prange(guesses.shape[0]):
        state, work = np.empty(13), np.empty(WORK_SHAPE)
        codes[k], steps[k] = fit_pose(
            guesses[k], cables, used[k], lengths[k], planar, tolerance, state, work
        )
        poses[k] = state[:7]
