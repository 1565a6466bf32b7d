"""The searched verdict: local searches for the perturbation with the smallest eigenvalue.

Every search takes the gradient of v' Pi v for the eigenvector v of the smallest eigenvalue, goes to
the perturbation of the bounded set that the gradient likes least (Frank and Wolfe), and comes back
half-way as long as the eigenvalue does not fall. Near the identity the eigenvalue is almost concave
over the perturbation, so full steps mostly succeed, and a search ends after a few. Searches start
at the worst random draws of the sampled verdict and at perturbations that are steepest for random
vectors v. Since the draws themselves count, the margin is never above the sampled one.

Source: Frank and Wolfe, An algorithm for quadratic programming, 1956.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.linear_algebra_kernel import copy_vector, smallest_eigenpair
from cdpr_drake.numerics.shared_kernels import VECTOR, shared
from cdpr_drake.stability.criterion_at_pose_kernel import (
    CASE_TYPE,
    ROWS_TYPE,
    WORK_TYPE,
    CaseArrays,
    PoseRows,
    Work,
    new_work,
    prepare,
)
from cdpr_drake.stability.criterion_gradient_kernel import (
    gradient,
    gradient_known_object,
    steepest_into,
)
from cdpr_drake.stability.criterion_known_object_kernel import (
    evaluate_any,
    is_quick,
    pack_quick,
    quick_size,
)
from cdpr_drake.stability.perturbation_samples_kernel import (
    SINGLE,
    draw_into,
    draw_room,
    mixed,
    pose_key,
)
from cdpr_drake.stability.sampled_kernel import sample_pose
from cdpr_drake.stability.stability_case import IBVS

HALVINGS = 4
"""How often a step is halved before a search ends."""

LEAST_DESCENT = 1e-6
"""A search ends when a step lowers the eigenvalue by less than this."""


@njit(cache=True, error_model="numpy", inline="always")
def _gradient_any(
    case: CaseArrays, rows: PoseRows, n: int, w: Work, quick: bool, d: Array, v: Array, g: Array
) -> None:
    """Calls `gradient_known_object` if `quick`, else `gradient`, which then is never compiled."""
    if quick:
        gradient_known_object(
            case.A, case.B, case.C, case.t, w.R, w.p, w.L, w.Lid, w.M, case.scheme == IBVS, d, v, g
        )
    else:
        gradient(case, rows, n, w, d, v, g)


@shared(
    types.float64(
        CASE_TYPE, ROWS_TYPE, types.int64, WORK_TYPE, VECTOR, VECTOR, types.int64, types.float64
    )
)  # fmt: skip
@njit(cache=True, error_model="numpy")
def descend(
    case: CaseArrays,
    rows: PoseRows,
    n: int,
    w: Work,
    q: Array,
    d: Array,
    steps: int,
    enough: float,
) -> float:
    """Smallest eigenvalue that a search from d finds; d <- where.

    It ends early once the eigenvalue is not above `enough`.
    """
    quick, m = is_quick(case), case.A.shape[0]
    # Half-way between errors of two points lies one of both: no step back.
    whole = case.directions[0] == SINGLE or case.directions[1] == SINGLE
    halvings = 0 if whole else HALVINGS
    v, g = np.empty(6), np.empty_like(d)
    goal, trial = np.empty_like(d), np.empty_like(d)
    if not evaluate_any(case, rows, n, w, q, quick, d):
        return -np.inf
    value = smallest_eigenpair(w.S, w.K, w.F, v)
    for _ in range(steps):
        if value <= enough:
            break
        _gradient_any(case, rows, n, w, quick, d, v, g)
        steepest_into(m, case.planar, case.radii, case.directions, g, goal)
        share, found = 1.0, value
        for _ in range(halvings + 1):
            for i in range(len(d)):
                trial[i] = d[i] + share * (goal[i] - d[i])
            if not evaluate_any(case, rows, n, w, q, quick, trial):
                copy_vector(trial, d)
                return -np.inf
            found = smallest_eigenpair(w.S, w.K, w.F, v)
            if found < value - LEAST_DESCENT:
                break
            share *= 0.5
        if not found < value - LEAST_DESCENT:
            break
        copy_vector(trial, d)
        value = found
    return value


@njit(cache=True, error_model="numpy", inline="always")
def search_pose(
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
    from_draws: int,
    from_vectors: int,
    steps: int,
) -> float:
    """Smallest eigenvalue found at pose n; arguments as `sample_pose` and `searched_margins`.

    d <- the perturbation that has it; unchanged where none lowers the eigenvalue below 1.
    """
    worst = np.empty(max(from_draws, 1), np.int64)
    at, g, v = np.empty_like(d), np.empty_like(d), np.empty(6)
    margin = sample_pose(case, rows, n, w, q, at, room, draws, seed, inside, first_only, worst)
    key = pose_key(seed, rows.bits[n])
    if margin == -np.inf:
        copy_vector(at, d)
        return margin
    if worst[0] >= 0:
        draw_into(
            key, worst[0], case.radii, case.directions, case.planar, inside, case.A.shape[0], room,
            d,
        )  # fmt: skip
    enough = 0.0 if first_only else -np.inf
    if margin <= enough:
        return margin
    quick, m = is_quick(case), case.A.shape[0]
    for number in range(from_draws):
        if worst[number] < 0:
            break
        draw_into(
            key, worst[number], case.radii, case.directions, case.planar, inside,
            case.A.shape[0], room, at,
        )  # fmt: skip
        found = descend(case, rows, n, w, q, at, steps, enough)
        if found < margin:
            margin = found
            copy_vector(at, d)
        if margin <= enough or margin == -np.inf:
            return margin
    for number in range(from_vectors):
        state = mixed(key + np.uint64(number + 1))
        for i in range(6):
            state = mixed(state + np.uint64(i + 1))
            v[i] = np.float64(np.int64(state >> np.uint64(33))) / 1073741824.0 - 1.0
        square = 0.0
        for i in range(6):
            square += v[i] * v[i]
        for i in range(6):
            v[i] /= np.sqrt(square)
        at[:] = 0.0
        evaluate_any(case, rows, n, w, q, quick, at)
        _gradient_any(case, rows, n, w, quick, at, v, g)
        steepest_into(m, case.planar, case.radii, case.directions, g, at)
        found = descend(case, rows, n, w, q, at, steps, enough)
        if found < margin:
            margin = found
            copy_vector(at, d)
        if margin <= enough or margin == -np.inf:
            return margin
    return margin


@njit(cache=True, error_model="numpy", nogil=True)
def searched_margins(
    first: int,
    past: int,
    case: CaseArrays,
    rows: PoseRows,
    draws: int,
    seed: int,
    inside: bool,
    first_only: bool,
    from_draws: int,
    from_vectors: int,
    steps: int,
    margins: Array,
    found_at: Array,
) -> None:
    """margins <- `search_pose` of every pose; minus infinity where a matrix is singular.

    Args:
        case: The case.
        rows: The poses.
        draws: Number of draws.
        seed: Start of the random numbers.
        inside: Whether magnitudes of draws fill the balls.
        first_only: Whether to stop at the first unstable perturbation.
        from_draws: Searches that start at draws.
        from_vectors: Searches that start at random vectors.
        steps: Steps of a search at most.
        margins: Output, shape (N,).
        found_at: Output, perturbations that have these margins, shape (N, 18 + 6 m), or (0, ...);
            zeros where no perturbation lowers the eigenvalue below 1.
    """
    w, q, room = new_work(case), np.empty(quick_size()), draw_room(case.A.shape[0])
    d = np.empty(18 + 6 * case.A.shape[0])
    for n in range(first, past):
        d[:] = 0.0
        margins[n] = -np.inf
        if prepare(case, rows, n, w):
            if is_quick(case):
                pack_quick(
                    case.A, case.B, case.C, case.t, w.R, w.p, w.LM, w.Li, case.scheme == IBVS, q
                )
            margins[n] = search_pose(
                case, rows, n, w, q, d, room, draws, seed, inside, first_only, from_draws,
                from_vectors, steps,
            )  # fmt: skip
        if found_at.shape[0] > 0:
            copy_vector(d, found_at[n])
