"""Proofs that a cable stays clear of a solid box, or does not, at every pose: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Interference**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
from cdpr_drake.workspaces.box_pair_clearance_kernel import (
    FREE_AXIS,
    PARALLEL,
    dot,
    largest_normal,
    least_reach,
    write_blame,
)
from cdpr_drake.workspaces.cable_distance_kernel import segment_box_share


@njit(cache=True, error_model="numpy")
def judge_box(
    apex: Array, end: Array, sign: float, half: Array, box: Array, free: float, apart: float,
    apex_error: float, end_error: float, extent: float, n: Array, nk: Array, Q: Array, q: Array,
    blame: Array,
) -> tuple[int, float]:  # fmt: skip
    """Verdict on a cable from an apex to end + sign delta and a solid box, both seen from the box.

    Args:
        apex: The end of the cable that rests, shape (3,) [m].
        end: The other at the middle, shape (3,) [m].
        sign: 1 or -1: how it moves.
        half: Half widths of the position, shape (3,) [m].
        box: Row of `cable_interference.box_row`.
        free: Length next to the apex that is not compared [m].
        apart: How far the cable's axis must be from the box, more than this [m].
        apex_error: How far the apex may be off [m].
        end_error: How far the end may be off [m].
        extent: Bound on all coordinates [m].
        n: Work space, shape (3,).
        nk: Work space, shape (3, 3).
        Q: Work space, shape (3,).
        q: Work space, shape (3,).
        blame: Gets how much each half width takes, shape (3,).

    Returns:
        As `judge_pair`.
    """
    square, size = 0.0, np.sqrt(dot(half, half))
    for k in range(3):
        q[k] = end[k] - apex[k]
        square += q[k] * q[k]
        blame[k] = half[k]
    length = np.sqrt(square)
    change = size + apex_error + end_error + ROUNDING * extent
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
    if gap > size + error + apart + free * change / shortest + ROUNDING * extent:
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
            far = ROUNDING * extent + error + _farthest(
                apex, q, last, half, box, turning, shortest, change, Q
            )  # fmt: skip
            if far < best:
                best = far
                for k in range(3):
                    blame[k] = Q[k] + (begin - free / length) * half[k]
        return (OUTSIDE, 0.0) if best <= apart else (OPEN, apart - best)
    if gap <= FREE_AXIS * extent:
        return OPEN, size
    _turn_past(q, 0.0 < inner < 1.0, sign, box, n, nk)
    least_end, least_begin = _reaches_past_box(
        apex, q, sign, half, box, free, shortest, longest, change, n, nk, Q, blame
    )
    large = largest_normal(n, nk, half)
    slip = ROUNDING * extent * (1.0 + 4.0 * large)
    most = min(free / shortest, 1.0)
    end_need = (apart + end_error) * large + slip
    begin_need = (apart + apex_error + most * end_error) * large + slip
    missing = max(end_need - least_end, begin_need - least_begin)
    return (INSIDE, 0.0) if missing < 0.0 else (OPEN, missing)


@njit(cache=True, error_model="numpy")
def _reaches_past_box(
    apex: Array, q: Array, sign: float, half: Array, box: Array, free: float, shortest: float,
    longest: float, change: float, n: Array, nk: Array, Q: Array, blame: Array,
) -> tuple[float, float]:  # fmt: skip
    """Lower bounds on how far beyond a box the moving end, and the first point compared, lie."""
    for k in range(3):
        Q[k] = apex[k] - box[9 + k]
    beyond = 0.0
    for a in range(3):
        size = turning = 0.0
        for k in range(3):
            size += n[k] * box[3 * k + a]
        for k in range(3):
            along = 0.0
            for j in range(3):
                along += nk[k, j] * box[3 * j + a]
            turning += half[k] * abs(along)
        if abs(size) > turning * (1.0 + ROUNDING):
            side = box[12 + a] if size > 0.0 else -box[12 + a]
            for k in range(3):
                Q[k] -= side * box[3 * k + a]
        else:
            beyond += box[12 + a] * (abs(size) + turning) * (1.0 + ROUNDING)
    # From here to the point of the cable it is n.Q + share n.(q + sign delta).
    still, along = least_reach(n, nk, half, Q, 0.0), least_reach(n, nk, half, q, sign)
    begin = still - beyond + free * along / (longest if along > 0.0 else shortest)
    if along < 0.0 and shortest < free:  # no more than the whole cable is compared
        begin = still - beyond + along
    write_blame(n, nk, half, Q, 0.0, blame)
    length, turned = np.sqrt(dot(q, q)), 0.0
    for k in range(3):
        turned = max(turned, np.sqrt(dot(nk[k], nk[k])))
        blame[k] += free / length * half[k] * (abs(n[k] - dot(n, q) * q[k] / length**2) + half[k])
    if turned == 0.0:
        swing = free * largest_swing(n, q, half, shortest, change)
        begin = max(begin, still - beyond + free * dot(n, q) / length - swing)
    for k in range(3):
        Q[k] += q[k]
    last = least_reach(n, nk, half, Q, sign) - beyond
    if last < begin:
        write_blame(n, nk, half, Q, sign, blame)
    return last, begin


@njit(cache=True, error_model="numpy")
def largest_swing(x: Array, q: Array, half: Array, shortest: float, change: float) -> float:
    """Upper bound on how much x.u changes, u the direction of a cable along q; x of length 1.

    Args:
        x: Shape (3,).
        q: The cable at the middle, shape (3,) [m].
        half: Half widths of the position of its end, shape (3,) [m].
        shortest: Lower bound on its length [m].
        change: Bound on how far its ends move against each other, by errors too [m].
    """
    length = np.sqrt(dot(q, q))
    along = dot(x, q) / length
    first = square = 0.0
    for k in range(3):
        first += half[k] * abs(x[k] - along * q[k] / length)
        square += half[k] * half[k]
    errors = change - np.sqrt(square)
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
    apex: Array, q: Array, share: float, half: Array, box: Array, free: float, shortest: float,
    change: float, blame: Array,
) -> float:  # fmt: skip
    """How far a point of a cable is from a box at most; within the box less than 0.

    Its ends may be off beside; the point is the one at a share of the cable, or for free > 0 the
    one at that distance from the apex.
    """
    outside, depth, length = 0.0, -np.inf, np.sqrt(dot(q, q))
    blame[0] = blame[1] = blame[2] = 0.0
    for a in range(3):
        axis = box[a:9:3]
        x = moved = 0.0
        for k in range(3):
            x += (apex[k] + share * q[k] - box[9 + k]) * axis[k]
            moved += share * half[k] * abs(axis[k])
        if free > 0.0:
            moved = free * largest_swing(axis, q, half, shortest, change)
        over = abs(x) - box[12 + a] + moved
        along = dot(axis, q) / length
        for k in range(3):
            part = share * half[k] * abs(axis[k])
            if free > 0.0:
                swing = abs(axis[k] - along * q[k] / length)
                part = share * half[k] * (swing + 2.0 * half[k] / length)
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
def _turn_past(q: Array, inner: bool, sign: float, box: Array, n: Array, nk: Array) -> None:
    """Writes n_k that keep n normal to a cable, and to an edge of the box; no part of the proof."""
    for k in range(3):
        nk[k, 0] = nk[k, 1] = nk[k, 2] = 0.0
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
    for k in range(3):
        by = -sign * n[k] / along
        nk[k, 0], nk[k, 1], nk[k, 2] = by * tx, by * ty, by * tz
