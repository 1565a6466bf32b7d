"""The sampled verdict: the smallest eigenvalue of the criterion over random perturbations."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from cdpr_drake.arrays import Array
from cdpr_drake.perturbation_draws import draw_into, pose_key
from cdpr_drake.stability_kernel import factor
from cdpr_drake.stability_pose import (
    CaseArrays,
    PoseRows,
    Work,
    evaluate,
    new_work,
    prepare,
    smallest_eigenvalue,
)


@njit(cache=True)
def sample_pose(
    case: CaseArrays,
    rows: PoseRows,
    n: int,
    w: Work,
    d: Array,
    draws: int,
    seed: int,
    inside: bool,
    first_only: bool,
    worst: np.ndarray,
) -> float:
    """Smallest eigenvalue over the draws at pose n, which `prepare` has seen; at most 1.

    Args:
        case: The case.
        rows: The poses.
        n: Number of the pose.
        w: Work space.
        d: Work space of a perturbation, shape (18 + 6 m,).
        draws: Number of draws.
        seed: Start of the random numbers.
        inside: Whether magnitudes fill the balls.
        first_only: Whether to stop at the first unstable draw.
        worst: Output, numbers of the last draws that were worse than all before, the worst first,
            filled up with -1.
    """
    margin = 1.0
    worst[:] = -1
    key = pose_key(seed, rows.bits[n])
    for number in range(draws):
        draw_into(key, number, case.radii, case.directions, case.planar, inside, case.A.shape[0], d)
        if not evaluate(case, rows, n, w, d):
            return -np.inf
        if not factor(w.S, margin, w.F):  # worse than the worst so far, up to rounding
            found = smallest_eigenvalue(w.S)
            if found < margin:
                margin = found
                for i in range(len(worst) - 1, 0, -1):
                    worst[i] = worst[i - 1]
                if len(worst) > 0:
                    worst[0] = number
            if first_only and margin <= 0.0:
                break
    return margin


@njit(cache=True, parallel=True)
def sampled_margins(
    case: CaseArrays,
    rows: PoseRows,
    draws: int,
    seed: int,
    inside: bool,
    first_only: bool,
    margins: Array,
) -> None:
    """margins <- `sample_pose` of every pose; minus infinity where a matrix is singular."""
    for n in prange(rows.poses.shape[0]):
        w = new_work(case)
        d = np.empty(18 + 6 * case.A.shape[0])
        margins[n] = -np.inf
        if prepare(case, rows, n, w):
            margins[n] = sample_pose(
                case, rows, n, w, d, draws, seed, inside, first_only, np.empty(0, np.int64)
            )
