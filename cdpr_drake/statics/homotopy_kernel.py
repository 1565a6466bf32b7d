"""Follows solutions of the equations of rest while their constants change along a line.

Runge and Kutta's method of fourth order predicts, Newton's corrects; steps that the corrector has
to mend by more than a little are taken again at half their length. The quaternion is scaled to
length one after each step, so that it never goes to infinity.

Source: Sommese and Wampler, The Numerical Solution of Systems of Polynomials, 2005, chapters 2, 7.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute
from cdpr_drake.statics.equilibrium_equations_kernel import rest_equations

FOUND, AWAY, STUCK = 1, 0, -1
"""How a path ends: at a solution, beyond all bounds, or where its steps became too small."""

LARGEST_STEP, SMALLEST_STEP = 0.1, 1e-10
"""Of the path's parameter, which goes from 0 to 1."""

LARGEST_MEND = 1e-4
"""Most that a corrector may change a prediction, relative to it; times `care`."""

MENDED = 1e-9
"""Change below which a corrector has converged, relative; times the size of unknowns that are far
from the constants', since squares of them cancel."""

FARTHEST = 1e8
"""An unknown beyond this is on its way to infinity; constants are about 1."""


@njit(cache=True, error_model="numpy")
def _direction(
    P: Array, dP: Array, x: Array, scale: Array, rows: Array, columns: Array, along: bool,
    F: Array, J: Array, Fs: Array, A: Array, out: Array, pivots: Array, work: Array,
) -> None:  # fmt: skip
    """Writes J^-1 F, or with `along` J^-1 Fs, of the chosen unknowns into out."""
    rest_equations(P, dP, x, F, J, Fs, work)
    last, n = P.shape[0] + 5, len(rows)
    J[last] = 0.0
    F[last], Fs[last] = -1.0, 0.0
    for j in range(4):
        J[last, 3 + j] = scale[j]
        F[last] += scale[j] * x[3 + j]
    for i in range(n):
        for j in range(n):
            A[i, j] = J[rows[i], columns[j]]
        out[i] = Fs[rows[i]] if along else F[rows[i]]
    eliminate(A, n, pivots)
    substitute(A, n, pivots, out)


@njit(cache=True, error_model="numpy")
def _norm(x: Array) -> float:
    most = 0.0
    for value in x:
        most = max(most, abs(value))
    return most


@njit(cache=True, error_model="numpy")
def _normalize(x: Array, scale: Array) -> None:
    """Scales the quaternion to length one and writes what keeps it there."""
    square = 0.0
    for j in range(4):
        square += x[3 + j].real ** 2 + x[3 + j].imag ** 2
    length = np.sqrt(square)
    for j in range(4):
        x[3 + j] /= length
        scale[j] = np.conj(x[3 + j])


@njit(cache=True, error_model="numpy")
def follow(P0: Array, P1: Array, x: Array, rows: Array, columns: Array, care: float) -> Any:
    """Moves x from a solution for the constants P0 to the one for P1 that it leads to.

    Args:
        P0: Constants, see `rest_equations`.
        P1: Constants, same shape.
        x: Unknowns, moved here, shape (k + 7,), complex.
        rows: Equations that hold, whole numbers.
        columns: Unknowns that are not fixed, as many.
        care: 1, or less for shorter steps.

    Returns:
        Code, change by the last correction, ratio of the least pivot to the largest.
    """
    size, n = len(x), len(rows)
    F, Fs = np.zeros(size, np.complex128), np.zeros(size, np.complex128)
    J, A = np.zeros((size, size), np.complex128), np.zeros((n, n), np.complex128)
    pivots, work = np.zeros(n), np.zeros((12, 3), np.complex128)
    scale, slopes = np.zeros(4, np.complex128), np.zeros((4, n), np.complex128)
    trial, step, P, dP = x.copy(), np.zeros(n, np.complex128), P0.copy(), P1 - P0
    s, h, eased, mend = 0.0, 0.01 * care, 0, np.inf
    _normalize(x, scale)
    while s < 1.0:
        h = min(h, 1.0 - s)
        for stage in range(4):
            share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            trial[:] = x
            if stage > 0:
                for j in range(n):
                    trial[columns[j]] -= share * h * slopes[stage - 1, j]
            P[:] = P0 + (s + share * h) * dP
            _direction(
                P, dP, trial, scale, rows, columns, True, F, J, Fs, A, slopes[stage], pivots, work
            )
        trial[:] = x
        for j in range(n):
            mean = slopes[0, j] + 2.0 * slopes[1, j] + 2.0 * slopes[2, j] + slopes[3, j]
            trial[columns[j]] -= h / 6.0 * mean
        P[:] = P0 + (s + h) * dP
        good = False
        for turn in range(3):
            _direction(P, dP, trial, scale, rows, columns, False, F, J, Fs, A, step, pivots, work)
            for j in range(n):
                trial[columns[j]] -= step[j]
            mend = _norm(step) / (1.0 + _norm(trial))
            if not mend < (LARGEST_MEND * care if turn == 0 else LARGEST_MEND * care * care):
                break
            if mend < MENDED * (1.0 + _norm(trial)):
                good = True
                break
        if good:
            x[:] = trial
            s = 1.0 if s + h >= 1.0 else s + h
            _normalize(x, scale)
            eased += 1
            if eased >= 2:
                h, eased = min(2.0 * h, LARGEST_STEP * care), 0
            if _norm(x) > FARTHEST:
                return AWAY, mend, 0.0
        else:
            h, eased = 0.5 * h, 0
            if h < SMALLEST_STEP:
                return STUCK, mend, s
    for _ in range(4):
        _direction(P1, dP, x, scale, rows, columns, False, F, J, Fs, A, step, pivots, work)
        for j in range(n):
            x[columns[j]] -= step[j]
        mend = _norm(step) / (1.0 + _norm(x))
    least, most = np.inf, 0.0
    for j in range(n):
        least, most = min(least, abs(A[j, j])), max(most, abs(A[j, j]))
    return FOUND, mend, least / most


@njit(cache=True, nogil=True)
def follow_many(
    first: int, past: int, P0: Array, P1: Array, X: Array, rows: Array, columns: Array,
    care: Array, ends: Array,
) -> None:  # fmt: skip
    """`follow` for rows of X from `first` to before `past`; writes (code, change, ratio) to ends.

    P1 has one target a row, shape (rows, k + 1, 7), or one for all, shape (1, k + 1, 7).
    """
    for i in range(first, past):
        target = P1[i if len(P1) > 1 else 0]
        code, mend, ratio = follow(P0, target, X[i], rows, columns, care[i])
        ends[i, 0], ends[i, 1], ends[i, 2] = code, mend, ratio
