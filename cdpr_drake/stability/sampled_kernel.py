"""The sampled verdict: the smallest eigenvalue of the criterion over random perturbations."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import factor, smallest_eigenvalue
from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CASE_TYPE,
    ROWS_TYPE,
    WORK_TYPE,
    CaseArrays,
    PoseRows,
    Work,
    evaluate,
    new_work,
    prepare,
)
from cdpr_drake.stability.criterion_known_object_kernel import (
    evaluate_quick,
    is_quick,
    pack_quick,
    quick_size,
)
from cdpr_drake.stability.perturbation_samples_kernel import draw_into, draw_room, pose_key
from cdpr_drake.stability.stability_case import IBVS


@shared(
    types.float64(
        CASE_TYPE, ROWS_TYPE, types.int64, WORK_TYPE, VECTOR, VECTOR, MATRIX, types.int64,
        types.int64, types.boolean, types.boolean, types.int64[::1],
    )
)  # fmt: skip
@njit(cache=True, error_model="numpy")
def sample_pose(
    case: CaseArrays,
    rows: PoseRows,
    n: int,
    w: Work,
    q: Array,
    d: Array,
    room: Array,
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
        q: Of `pack_quick`.
        d: Work space of a perturbation, shape (18 + 6 m,).
        room: Of `draw_room`.
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
    quick = is_quick(case)
    # Out of the loop, where each mention of a tuple's array would be counted.
    m, local, planar = case.A.shape[0], case.scheme == IBVS, case.planar
    radii, directions, S, F = case.radii, case.directions, w.S, w.F
    for number in range(draws):
        draw_into(key, number, radii, directions, planar, inside, m, room, d)
        if quick:
            evaluate_quick(q, m, local, planar, d, S)
        elif not evaluate(case, rows, n, w, d):
            return -np.inf
        if not factor(S, margin, F):  # worse than the worst so far, up to rounding
            found = smallest_eigenvalue(w.S, w.K)
            if found < margin:
                margin = found
                for i in range(len(worst) - 1, 0, -1):
                    worst[i] = worst[i - 1]
                if len(worst) > 0:
                    worst[0] = number
            if first_only and margin <= 0.0:
                break
    return margin


@njit(cache=True, error_model="numpy", nogil=True)
def sampled_margins(
    first: int,
    past: int,
    case: CaseArrays,
    rows: PoseRows,
    draws: int,
    seed: int,
    inside: bool,
    first_only: bool,
    margins: Array,
) -> None:
    """margins <- `sample_pose` of every pose; minus infinity where a matrix is singular."""
    w, q, room = new_work(case), np.empty(quick_size()), draw_room(case.A.shape[0])
    d, none = np.empty(18 + 6 * case.A.shape[0]), np.empty(0, np.int64)
    for n in range(first, past):
        margins[n] = -np.inf
        if prepare(case, rows, n, w):
            if is_quick(case):
                pack_quick(
                    case.A, case.B, case.C, case.t, w.R, w.p, w.LM, w.Li, case.scheme == IBVS, q
                )
            margins[n] = sample_pose(
                case,
                rows,
                n,
                w,
                q,
                d,
                room,
                draws,
                seed,
                inside,
                first_only,
                none,
            )
