"""Proofs that a cable stays clear of a solid box, or does not, at every pose: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Interference**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
from cdpr_drake.proofs.box_pair_clearance_kernel import (
    FREE_AXIS,
    PARALLEL,
    dot,
    largest_normal,
    least_reach,
    swing,
    write_blame,
)
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_share


@njit(cache=True, error_model="numpy")
def judge_box(
    apex: Array, end: Array, moves: Array, half: Array, numbers: int, box: Array, free: float,
    apart: float, apex_error: float, end_error: float, bend: float, extent: float, n: Array,
    nk: Array, Q: Array, q: Array, work: Array, blame: Array,
) -> tuple[int, float]:  # fmt: skip
    """Verdict on a cable from an apex to end + sum delta_k m_k and a box, both seen from the box.

    Args:
        apex: The end of the cable that rests, shape (3,) [m].
        end: The other at the middle, shape (3,) [m].
        moves: m_k, shape (6, 3); of the position the axes, or minus these.
        half: Half widths of the pose, shape (6,) [m, rad].
        numbers: So many of them, the first, vary: 3 or 6.
        box: Row of `cable_interference.box_row`.
        free: Length next to the apex that is not compared [m].
        apart: How far the cable's axis must be from the box, more than this [m].
        apex_error: How far the apex may be off [m].
        end_error: How far the end may be off [m].
        bend: How far it may be off the m_k beside that [m].
        extent: Bound on all coordinates [m].
        n: Work space, shape (3,).
        nk: Work space, shape (6, 3).
        Q: Work space, shape (3,).
        q: Work space, shape (3,).
        work: Work space, shape (6,).
        blame: Gets how much each half width takes, shape (6,).

    Returns:
        As `judge_pair`.
    """
    square, size = 0.0, np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    size += swing(moves, half, numbers)
    for k in range(3):
        q[k] = end[k] - apex[k]
        square += q[k] * q[k]
        blame[k] = half[k]
    for k in range(3, numbers):
        blame[k] = half[k] * np.sqrt(dot(moves[k], moves[k]))
    length = np.sqrt(square)
    change = size + apex_error + end_error + bend + ROUNDING * extent
    shortest, longest = length - change, length + change
    if longest <= free:
        return INSIDE, 0.0
    if shortest <= 0.0:
        return OPEN, size
    begin = min(free / length, 1.0)
    for k in range(3):
        Q[k] = apex[k] + begin * q[k]
    inner = segment_box_share(Q, end, box)
    share = begin + inner * (1.0 - begin)
    gap = _normal_from(apex, q, share, box, n)
    error = max(apex_error, end_error)
    if gap > size + error + bend + apart + free * change / shortest + ROUNDING * extent:
        return INSIDE, 0.0
    if gap <= apart:
        if shortest <= free:
            return OPEN, -size
        begin = free / shortest
        best = np.inf
        for attempt in range(3):
            if attempt == 0:
                last = max(share, begin)
            else:
                last = _middle_within(apex, q, begin, box) if attempt == 1 else free / length
            turning = free if attempt == 2 else 0.0
            far = ROUNDING * extent + error + last * bend + _farthest(
                apex, q, last, moves, half, numbers, box, turning, shortest, change, size, work
            )  # fmt: skip
            if far < best:
                best = far
                for k in range(numbers):
                    blame[k] = work[k] + (begin - free / length) * (
                        half[k] if k < 3 else half[k] * np.sqrt(dot(moves[k], moves[k]))
                    )
        return (OUTSIDE, 0.0) if best <= apart else (OPEN, apart - best)
    if gap <= FREE_AXIS * extent:
        return OPEN, size
    _turn_past(q, 0.0 < inner < 1.0, moves, numbers, box, n, nk)
    least_end, least_begin = _reaches_past_box(
        apex, q, moves, half, numbers, box, free, shortest, longest, change, size, n, nk, Q, blame
    )
    large = largest_normal(n, nk, half, numbers)
    slip = ROUNDING * extent * (1.0 + 4.0 * large)
    most = min(free / shortest, 1.0)
    end_error += bend
    end_need = (apart + end_error) * large + slip
    begin_need = (apart + apex_error + most * end_error) * large + slip
    missing = max(end_need - least_end, begin_need - least_begin)
    return (INSIDE, 0.0) if missing < 0.0 else (OPEN, missing)


@njit(cache=True, error_model="numpy")
def _reaches_past_box(
    apex: Array, q: Array, moves: Array, half: Array, numbers: int, box: Array, free: float,
    shortest: float, longest: float, change: float, size: float, n: Array, nk: Array, Q: Array,
    blame: Array,
) -> tuple[float, float]:  # fmt: skip
    """Lower bounds on how far beyond a box the moving end, and the first point compared, lie."""
    for k in range(3):
        Q[k] = apex[k] - box[9 + k]
    beyond = 0.0
    for a in range(3):
        side = turning = 0.0
        for k in range(3):
            side += n[k] * box[3 * k + a]
        for k in range(numbers):
            along = 0.0
            for j in range(3):
                along += nk[k, j] * box[3 * j + a]
            turning += half[k] * abs(along)
        if abs(side) > turning * (1.0 + ROUNDING):
            to = box[12 + a] if side > 0.0 else -box[12 + a]
            for k in range(3):
                Q[k] -= to * box[3 * k + a]
        else:
            beyond += box[12 + a] * (abs(side) + turning) * (1.0 + ROUNDING)
    # From here to the point of the cable it is n.Q + share n.(q + sum delta_k m_k).
    still = least_reach(n, nk, half, numbers, Q, moves, True)
    along = least_reach(n, nk, half, numbers, q, moves, False)
    begin = still - beyond + free * along / (longest if along > 0.0 else shortest)
    if along < 0.0 and shortest < free:  # no more than the whole cable is compared
        begin = still - beyond + along
    write_blame(n, nk, half, numbers, Q, moves, True, blame)
    length, turned = np.sqrt(dot(q, q)), 0.0
    for k in range(numbers):
        turned = max(turned, np.sqrt(dot(nk[k], nk[k])))
        across = dot(n, moves[k]) - dot(n, q) * dot(q, moves[k]) / length**2
        blame[k] += free / length * half[k] * (abs(across) + half[k])
    if turned == 0.0:
        most = free * largest_swing(n, q, moves, half, numbers, shortest, change, size)
        begin = max(begin, still - beyond + free * dot(n, q) / length - most)
    for k in range(3):
        Q[k] += q[k]
    last = least_reach(n, nk, half, numbers, Q, moves, False) - beyond
    if last < begin:
        write_blame(n, nk, half, numbers, Q, moves, False, blame)
    return last, begin


@njit(cache=True, error_model="numpy")
def largest_swing(
    x: Array, q: Array, moves: Array, half: Array, numbers: int, shortest: float, change: float,
    size: float,
) -> float:  # fmt: skip
    """Upper bound on how much x.u changes, u the direction of a cable along q; x of length 1.

    Args:
        x: Shape (3,).
        q: The cable at the middle, shape (3,) [m].
        moves: How its end follows the pose, shape (6, 3).
        half: Half widths of the pose, shape (6,) [m, rad].
        numbers: So many of them, the first, vary.
        shortest: Lower bound on its length [m].
        change: Bound on how far its ends move against each other, by errors too [m].
        size: The same without errors [m].
    """
    length = np.sqrt(dot(q, q))
    along = dot(x, q) / length
    first = 0.0
    for k in range(numbers):
        first += half[k] * abs(dot(x, moves[k]) - along * dot(q, moves[k]) / length)
    errors = change - size
    second = change * change * (1.0 / (length * length) + (length + change) / shortest**3)
    return (first + 2.0 * errors) / length * (1.0 + ROUNDING) + second + ROUNDING


@njit(cache=True, error_model="numpy")
def _normal_from(apex: Array, q: Array, share: float, box: Array, n: Array) -> float:
    """Writes the unit vector from a box to a point of a cable, and returns their distance."""
    n[0] = n[1] = n[2] = 0.0
    for a in range(3):
        x = 0.0
        for k in range(3):
            x += (apex[k] + share * q[k] - box[9 + k]) * box[3 * k + a]
        over = abs(x) - box[12 + a]
        if over > 0.0:
            for k in range(3):
                n[k] += (over if x > 0.0 else -over) * box[3 * k + a]
    gap = np.sqrt(dot(n, n))
    if gap > 0.0:
        for k in range(3):
            n[k] /= gap
    return gap


@njit(cache=True, error_model="numpy")
def _farthest(
    apex: Array, q: Array, share: float, moves: Array, half: Array, numbers: int, box: Array,
    free: float, shortest: float, change: float, size: float, blame: Array,
) -> float:  # fmt: skip
    """How far a point of a cable is from a box at most; within the box less than 0.

    Its ends may be off beside; the point is the one at a share of the cable, or for free > 0 the
    one at that distance from the apex.
    """
    outside, depth, length = 0.0, -np.inf, np.sqrt(dot(q, q))
    blame[:] = 0.0
    for a in range(3):
        axis = box[a:9:3]
        x = moved = 0.0
        for k in range(3):
            x += (apex[k] + share * q[k] - box[9 + k]) * axis[k]
        for k in range(numbers):
            moved += share * half[k] * abs(dot(axis, moves[k]))
        if free > 0.0:
            moved = free * largest_swing(axis, q, moves, half, numbers, shortest, change, size)
        over = abs(x) - box[12 + a] + moved
        along = dot(axis, q) / length
        for k in range(numbers):
            part = share * half[k] * abs(dot(axis, moves[k]))
            if free > 0.0:
                across = abs(dot(axis, moves[k]) - along * dot(q, moves[k]) / length)
                part = share * half[k] * (across + 2.0 * half[k] / length)
            if over > 0.0:
                blame[k] = (blame[k] if depth > 0.0 else 0.0) + over * part
            elif over > depth:
                blame[k] = part
        depth = max(depth, over)
        if over > 0.0:
            outside += over * over
    return np.sqrt(outside) if depth > 0.0 else depth


@njit(cache=True, error_model="numpy")
def _middle_within(apex: Array, q: Array, low: float, box: Array) -> float:
    """Share of a cable in the middle of its part within a box, `low` at least."""
    high, least = 1.0, low
    for a in range(3):
        o = v = 0.0
        for k in range(3):
            o += (apex[k] - box[9 + k]) * box[3 * k + a]
            v += q[k] * box[3 * k + a]
        if v != 0.0:
            s, t = (-box[12 + a] - o) / v, (box[12 + a] - o) / v
            low, high = max(low, min(s, t)), min(high, max(s, t))
    return min(max(0.5 * (low + high), least), 1.0)


@njit(cache=True, error_model="numpy")
def _turn_past(
    q: Array, inner: bool, moves: Array, numbers: int, box: Array, n: Array, nk: Array
) -> None:
    """Writes n_k that keep n normal to a cable, and to an edge of the box; no part of the proof."""
    nk[:] = 0.0
    if not inner:
        return
    edge, count = 0, 0
    for a in range(3):
        along = 0.0
        for k in range(3):
            along += n[k] * box[3 * k + a]
        if abs(along) < FREE_AXIS:
            edge, count = a, count + 1
    if count > 1:
        return
    tx, ty, tz = q[0], q[1], q[2]
    if count == 1:
        ax, ay, az = box[edge], box[3 + edge], box[6 + edge]
        tx, ty, tz = n[1] * az - n[2] * ay, n[2] * ax - n[0] * az, n[0] * ay - n[1] * ax
    along = tx * q[0] + ty * q[1] + tz * q[2]
    lengths = np.sqrt((tx * tx + ty * ty + tz * tz) * dot(q, q))
    if not abs(along) > PARALLEL * lengths:
        return
    for k in range(numbers):
        by = -dot(n, moves[k]) / along
        nk[k, 0], nk[k, 1], nk[k, 2] = by * tx, by * ty, by * tz
