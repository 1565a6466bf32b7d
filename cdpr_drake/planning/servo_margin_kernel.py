"""Numba kernel: the margin of a servo's stability for given perturbations, with slopes."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import smallest_eigenpair
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CaseArrays,
    PoseRows,
    evaluate,
    new_work,
    prepare,
)

STEPS = 4
"""Poses on a line through a pose, at these multiples of a step: a difference exact to its fourth
power."""

MULTIPLES = (-2.0, -1.0, 1.0, 2.0)
WEIGHTS = (1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0)


@njit(cache=True, error_model="numpy")
def servo_margins(
    case: CaseArrays, rows: PoseRows, perturbations: Array, directions: np.ndarray, step: float,
    values: Array, slopes: Array,
) -> None:  # fmt: skip
    """Writes the least eigenvalue of (Pi + Pi') / 2 for each perturbation, and its slopes.

    With v the eigenvector at a pose, the slope is that of v' Pi v, by differences over poses.

    Args:
        case: Of `verdict.packed_case`.
        rows: Of N poses, and behind each its neighbours along the directions, at `MULTIPLES` of the
            step; N (1 + 4 d) in all.
        perturbations: Shape (k, 18 + 6 m).
        directions: Seeds along which neighbours stand, shape (d,), whole numbers.
        step: [rad, m].
        values: Gets the margins, shape (N, k); NaN where a matrix is singular.
        slopes: Gets their derivatives by the seeds, shape (N, k, 18).
    """
    w = new_work(case)
    T, v = np.zeros((6, 6)), np.empty(6)
    d = directions.shape[0]
    every = 1 + STEPS * d
    vectors = np.empty((perturbations.shape[0], 6))
    for k in range(values.shape[0]):
        first = k * every
        slopes[k] = 0.0
        values[k] = np.nan
        if not prepare(case, rows, first, w):
            continue
        for one in range(perturbations.shape[0]):
            vectors[one] = np.nan
            if evaluate(case, rows, first, w, perturbations[one]):
                values[k, one] = smallest_eigenpair(w.S, T, w.F, v)
                for i in range(6):
                    vectors[one, i] = v[i]
        for at in range(d):
            for near in range(STEPS):
                n = first + 1 + STEPS * at + near
                good = prepare(case, rows, n, w)
                for one in range(perturbations.shape[0]):
                    value = np.nan
                    if good and evaluate(case, rows, n, w, perturbations[one]):
                        value = 0.0
                        for i in range(6):
                            for j in range(6):
                                value += vectors[one, i] * w.S[i, j] * vectors[one, j]
                    slopes[k, one, directions[at]] += WEIGHTS[near] * value / step
