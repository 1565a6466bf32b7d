"""Proofs that platform and cables stay clear of convex shapes, or do not: two numba kernels.

Shapes are hulls of points with a radius, as `geometry.convex_shapes.packed` has them. Notation and
**Expansion** are those of `box_verdicts_kernel`: the point b of P is at p + delta + R b, whose turn
is off b = R_0 b by sum delta_k b^k and s^2 |b| / 2 at most, so axis by axis by no more than

  eps_a(b) = sum h_k |b^k_a| + s^2 |b| / 2  over the angles.

Let rho be the distance that hulls must keep: that which is asked for, and both radii.

**Inside.** All poses are inside if a plane keeps each pair of hulls more than rho apart. Its normal
may be anything; it is n_0, of the nearest points at the middle of the box with the platform swept
by the half widths of the position, or n(delta) = R R_0' n_0, which turns with the platform:

  n_0: the least of n_0.(p + b) - sum h_k |n_0.b^k| - s^2 |b| / 2 over b, less sum h_a |n_0a|, less
  the largest n_0.c of the other hull;
  n(delta): n(delta).(R b) = n_0.b for all delta, and n(delta).(c - p - delta) is at most
  n_0.(c - p) + sum h_k |(a_k x n_0).(c - p)| + s^2 |c - p| / 2 + sum h_a |n_0a| + s |h|, a_k the
  axes of the angles, h over the position.

If only the position varies, n_0 is as good as any: poses at which the hulls meet are a convex set,
and what is swept is convex.

**Outside.** All poses are outside if at the corners delta of a box of the half widths h_a + eps_a +
slack, eps_a the largest of all b, some point of the platform, turned as at the middle, is within
rho + slack of the other hull. For suppose that at some pose of the box the two are more than rho
apart. Then some unit n has n.(x - y) > rho for all their points x and y. A mean of the corners is
delta + sum eps_a sign(n_a) e_a + slack n, and the same mean of the pairs of points there has, at
the pose itself, n.(x - y) <= (rho + slack) - sum eps_a |n_a| - slack + n.(R b - R_0 b) <= rho.

**Cables.** The poses of an anchor point B at which the cable from A to B comes within rho of a hull
are a convex set: those in the shadow that it casts. So corners decide again, B's box enlarged by
eps_a and what B may be off; what A may be off is taken from rho. Inside, a plane keeps A, and all
that B can be, from the hull.

**Rounding** as there; what is found of nearest points has no part in the first proof, and in the
second the distance of the two points that were found counts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_distance_kernel import convex_gap
from cdpr_drake.proofs.box_expansion_kernel import (
    ANCHOR,
    EXIT,
    INSIDE,
    OPEN,
    OUTSIDE,
    ROUNDING,
    turn_axes,
)
from cdpr_drake.proofs.box_pair_clearance_kernel import dot
from cdpr_drake.proofs.box_pulleys_kernel import see_pulleys, straight_points

SLACK = 1e-9
"""Share of all coordinates by which boxes are enlarged: more than nearest points are known to."""


@njit(cache=True, error_model="numpy")
def _turn_rates(axes: Array, half: Array, b: Array, rates: Array) -> float:
    """Writes h_k b^k, shape (3, 3), of an arm in W; returns s^2 |b| / 2, rounded up."""
    for k in range(3):
        rates[k, 0] = half[3 + k] * (axes[k, 1] * b[2] - axes[k, 2] * b[1])
        rates[k, 1] = half[3 + k] * (axes[k, 2] * b[0] - axes[k, 0] * b[2])
        rates[k, 2] = half[3 + k] * (axes[k, 0] * b[1] - axes[k, 1] * b[0])
    s = half[3] + half[4] + half[5]
    return (0.5 * s * s + ROUNDING) * np.sqrt(dot(b, b))


@njit(cache=True, error_model="numpy")
def _spread(axes: Array, half: Array, b: Array, rates: Array, eps: Array) -> None:
    """Raises eps to the eps_a of an arm in W, shape (3,)."""
    rest = _turn_rates(axes, half, b, rates)
    for a in range(3):
        eps[a] = max(eps[a], abs(rates[0, a]) + abs(rates[1, a]) + abs(rates[2, a]) + rest)


@njit(cache=True, error_model="numpy")
def _sweep(points: Array, half: Array, swept: Array) -> None:
    """Writes the corners of each point's box, shape (8 k, 3)."""
    for k in range(points.shape[0]):
        for corner in range(8):
            for a in range(3):
                side = half[a] if corner & (1 << a) else -half[a]
                swept[8 * k + corner, a] = points[k, a] + side


@njit(cache=True, error_model="numpy")
def _fixed_plane(
    n: Array, body: Array, arms: Array, half: Array, axes: Array, other: Array, rates: Array,
    blame: Array,
) -> float:  # fmt: skip
    """Lower bound on how far a plane normal to n keeps a platform from a hull; writes blame."""
    still, least, worst = -np.inf, np.inf, 0
    for k in range(other.shape[0]):
        still = max(still, dot(n, other[k]))
    for k in range(body.shape[0]):
        here = dot(n, body[k]) - _turn_rates(axes, half, arms[k], rates)
        for j in range(3):
            here -= abs(dot(n, rates[j]))
        if here < least:
            least, worst = here, k
    rest = _turn_rates(axes, half, arms[worst], rates)
    s = half[3] + half[4] + half[5]
    least -= still
    for j in range(3):
        blame[j] = half[j] * abs(n[j])
        blame[3 + j] = abs(dot(n, rates[j])) + (rest * half[3 + j] / s if s > 0.0 else 0.0)
        least -= blame[j]
    return least


@njit(cache=True, error_model="numpy")
def _turning_plane(
    n: Array, pose: Array, arms: Array, half: Array, axes: Array, other: Array, rates: Array,
    seen: Array, blame: Array,
) -> float:  # fmt: skip
    """As `_fixed_plane`, for a normal that turns with the platform."""
    mine, most, worst = np.inf, -np.inf, 0
    for k in range(arms.shape[0]):
        mine = min(mine, dot(n, arms[k]))
    for k in range(other.shape[0]):
        for a in range(3):
            seen[a] = other[k, a] - pose[a]
        # (a x n).c = -(a x c).n
        here = dot(n, seen) + _turn_rates(axes, half, seen, rates)
        for j in range(3):
            here += abs(dot(n, rates[j]))
        if here > most:
            most, worst = here, k
    for a in range(3):
        seen[a] = other[worst, a] - pose[a]
    rest = _turn_rates(axes, half, seen, rates)
    s = half[3] + half[4] + half[5]
    size = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    least = mine - most - s * size
    for j in range(3):
        blame[j] = half[j] * abs(n[j]) + (0.5 * s * half[j] * half[j] / size if size > 0.0 else 0.0)
        share = half[3 + j] / s if s > 0.0 else 0.0
        blame[3 + j] = abs(dot(n, rates[j])) + share * (rest + 0.5 * s * size)
        least -= half[j] * abs(n[j])
    return least


@njit(cache=True, error_model="numpy")
def _all_corners_meet(
    ends: Array, still: int, enlarged: Array, other: Array, most: float, moved: Array, p: Array,
    q: Array, n: Array, work: Array,
) -> bool:  # fmt: skip
    """Whether points, of which some rest, come within most of a hull at all corners of a box.

    Args:
        ends: Points at the middle, shape (k, 3) [m].
        still: So many of them, the first, do not move.
        enlarged: Half widths, shape (3,) [m].
        other: Points of the hull, shape (l, 3) [m].
        most: How far they may be apart [m].
        moved: Work space, shape (k, 3).
        p: Work space, shape (3,).
        q: Work space, shape (3,).
        n: Gets the normal at a corner where they do not.
        work: Of `convex_work`.
    """
    for corner in range(8):
        for k in range(ends.shape[0]):
            for a in range(3):
                side = enlarged[a] if corner & (1 << a) else -enlarged[a]
                moved[k, a] = ends[k, a] + (side if k >= still else 0.0)
        convex_gap(moved, other, p, q, n, work)
        square = 0.0
        for a in range(3):
            square += (p[a] - q[a]) ** 2
        if not np.sqrt(square) <= most:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _apart_along_an_axis(low: Array, high: Array, limits: Array, rho: float) -> bool:
    """Whether boxes along the axes, corners low and high, and limits, shape (6,), are rho apart."""
    apart = False
    for a in range(3):
        apart = apart or low[a] - limits[3 + a] > rho or limits[a] - high[a] > rho
    return apart


@njit(cache=True, error_model="numpy")
def _limits(points: Array, starts: np.ndarray, limits: Array) -> float:
    """Writes lower and upper corner of each shape's points, shape (s, 6); largest coordinate."""
    extent = 0.0
    for s in range(starts.shape[0] - 1):
        for a in range(3):
            limits[s, a], limits[s, 3 + a] = np.inf, -np.inf
            for k in range(starts[s], starts[s + 1]):
                limits[s, a] = min(limits[s, a], points[k, a])
                limits[s, 3 + a] = max(limits[s, 3 + a], points[k, a])
                extent = max(extent, abs(points[k, a]))
    return extent


@njit(cache=True, nogil=True, error_model="numpy")
def judge_collisions(
    first: int, past: int, poses: Array, halves: Array, body_points: Array,
    body_starts: np.ndarray, body_radii: Array, points: Array, starts: np.ndarray, radii: Array,
    clearance: float, works: Array, verdicts: np.ndarray, stretch: Array,
) -> None:  # fmt: skip
    """Writes verdicts on a platform among convex shapes, and which half width should be cut.

    Args:
        first: First box.
        past: One past the last.
        poses: Shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        body_points: Of the platform's shapes, in P, `convex_shapes.packed`, and the next two.
        body_starts: Where each begins.
        body_radii: Their radii [m].
        points: Of the shapes that stand around, in W, and the next two.
        starts: Where each begins.
        radii: Their radii [m].
        clearance: How far they must be apart, more than this [m].
        works: As large as the `convex_work` of eight times the points of the largest of the
            platform's shapes and the largest of the others.
        verdicts: Gets `INSIDE`, `OPEN` or `OUTSIDE`, shape (k,).
        stretch: Gets for each half width how much it is in the way, shape (k, 6).
    """
    count = body_points.shape[0]
    work, R, axes, rates = (
        np.empty_like(works),
        np.empty((3, 3)),
        np.empty((3, 3)),
        np.empty((3, 3)),
    )
    arms, body, moved = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    swept, limits = np.empty((8 * count, 3)), np.empty((starts.shape[0] - 1, 6))
    p, q, n, eps, wide, seen = (
        np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip
    low, high, blame, other_blame = np.empty(3), np.empty(3), np.empty(6), np.empty(6)
    around = _limits(points, starts, limits)
    for box in range(first, past):
        half, verdict, inward, outward = halves[box], INSIDE, -1.0, np.inf
        turn_axes(poses[box, 3:], R, axes)
        extent, arm = around, 0.0
        for k in range(count):
            for a in range(3):
                arms[k, a] = (
                    R[a, 0] * body_points[k, 0] + R[a, 1] * body_points[k, 1]
                    + R[a, 2] * body_points[k, 2]
                )  # fmt: skip
                body[k, a] = poses[box, a] + arms[k, a]
                extent = max(extent, abs(poses[box, a]) + abs(arms[k, a]) + half[a])
            arm = max(arm, np.sqrt(dot(arms[k], arms[k])))
        for j in range(3):
            stretch[box, j], stretch[box, 3 + j] = half[j], half[3 + j] * arm
        slip, slack = 10.0 * ROUNDING * extent, SLACK * extent
        for b in range(body_starts.shape[0] - 1):
            mine = slice(body_starts[b], body_starts[b + 1])
            for a in range(3):
                eps[a], low[a], high[a] = 0.0, np.inf, -np.inf
            for k in range(body_starts[b], body_starts[b + 1]):
                _spread(axes, half, arms[k], rates, eps)
                for a in range(3):
                    low[a], high[a] = min(low[a], body[k, a]), max(high[a], body[k, a])
            for a in range(3):
                wide[a] = half[a] + eps[a] + slack
                low[a], high[a] = low[a] - wide[a], high[a] + wide[a]
            _sweep(body[mine], half, swept[: 8 * (mine.stop - mine.start)])
            for o in range(starts.shape[0] - 1):
                rho = clearance + body_radii[b] + radii[o]
                if _apart_along_an_axis(low, high, limits[o], rho):
                    continue
                other = points[starts[o] : starts[o + 1]]
                if convex_gap(body[mine], other, p, q, n, work) <= rho:
                    for j in range(3):
                        blame[j] = wide[j] - eps[j]
                        blame[3 + j] = half[3 + j] * arm
                    if _all_corners_meet(
                        body[mine], 0, wide, other, rho + slack - slip, moved[mine], p, q, n, work
                    ):
                        verdict = OUTSIDE
                        break
                    missing = 0.0
                    for a in range(3):
                        missing += (p[a] - q[a]) ** 2
                        blame[a] *= abs(n[a])
                    missing = np.sqrt(missing) - rho
                    if missing < outward:  # one proof is enough: the one that is nearest
                        outward = missing
                        stretch[box] = blame
                    verdict = OPEN
                    continue
                if convex_gap(swept[: 8 * (mine.stop - mine.start)], other, p, q, n, work) == 0.0:
                    convex_gap(body[mine], other, p, q, n, work)
                if dot(n, n) == 0.0:
                    verdict = OPEN
                    continue
                least = _fixed_plane(
                    n, body[mine], arms[mine], half, axes, other, rates, blame
                )  # fmt: skip
                if least <= rho + slip and eps[0] + eps[1] + eps[2] > 0.0:
                    turning = _turning_plane(
                        n, poses[box, :3], arms[mine], half, axes, other, rates, seen, other_blame
                    )  # fmt: skip
                    if turning > least:
                        least = turning
                        blame[:] = other_blame
                if least > rho + slip:
                    continue
                verdict = OPEN
                if outward == np.inf and rho - least > inward:
                    inward = rho - least
                    stretch[box] = blame
            if verdict == OUTSIDE:
                break
        verdicts[box] = verdict


@njit(cache=True, nogil=True, error_model="numpy")
def judge_cables(
    first: int, past: int, poses: Array, halves: Array, cables: Array, radius: Array,
    points: Array, starts: np.ndarray, radii: Array, limits: Array, works: Array,
    verdicts: np.ndarray, stretch: Array,
) -> None:  # fmt: skip
    """Writes verdicts on cables among convex shapes, and which half width should be cut.

    Args:
        first: First box.
        past: One past the last.
        poses: Shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        cables: `CableSet.packed()`, shape (m, 17).
        radius: Of the cables, shape (m,) [m].
        points: Of the shapes that stand around, in W, `convex_shapes.packed`, and the next two.
        starts: Where each begins.
        radii: Their radii [m].
        limits: Clearance, r_A, r_B, shape (3,) [m].
        works: As large as the `convex_work` of nine points and the largest of the shapes.
        verdicts: Gets `INSIDE`, `OPEN` or `OUTSIDE`, shape (k,).
        stretch: Gets for each half width how much it is in the way, shape (k, 6).
    """
    m = cables.shape[0]
    ends, bounds, turns = np.empty((m, 6)), np.empty((m, 4)), np.empty((m, 3, 3))
    pulleys = straight_points(cables, limits[1:], ends, bounds)
    work, R, axes, rates = (
        np.empty_like(works),
        np.empty((3, 3)),
        np.empty((3, 3)),
        np.empty((3, 3)),
    )
    cable, moved, swept = np.empty((2, 3)), np.empty((2, 3)), np.empty((9, 3))
    p, q, n, eps, wide, b = (
        np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip
    blame, shapes = np.empty(6), np.empty((starts.shape[0] - 1, 6))
    around = _limits(points, starts, shapes)
    for box in range(first, past):
        half, inward, outward = halves[box], -1.0, np.inf
        runs = True
        if pulleys:
            runs = see_pulleys(poses[box], half, cables, limits[1:], False, ends, bounds, turns)
        verdict = INSIDE if runs else OPEN
        turn_axes(poses[box, 3:], R, axes)
        for j in range(6):
            stretch[box, j] = half[j]
        for i in range(m):
            extent = around
            for a in range(3):
                b[a] = R[a, 0] * ends[i, 3] + R[a, 1] * ends[i, 4] + R[a, 2] * ends[i, 5]
                cable[0, a], cable[1, a] = ends[i, a], poses[box, a] + b[a]
                extent = max(extent, abs(poses[box, a]) + abs(b[a]) + half[a])
                extent = max(extent, abs(ends[i, a]))
                eps[a] = 0.0
            _spread(axes, half, b, rates, eps)
            arm = np.sqrt(dot(b, b))
            slip, slack = 10.0 * ROUNDING * extent, SLACK * extent
            exit_off, anchor_off = bounds[i, EXIT], bounds[i, ANCHOR]
            for a in range(3):
                wide[a] = half[a] + eps[a] + anchor_off + slack
            _sweep(cable[1:], half, swept[:8])
            swept[8] = cable[0]
            for o in range(starts.shape[0] - 1):
                rho = limits[0] + radius[i] + radii[o]
                other = points[starts[o] : starts[o + 1]]
                if convex_gap(cable, other, p, q, n, work) <= rho:
                    if _all_corners_meet(
                        cable, 1, wide, other, rho - exit_off - slip, moved, p, q, n, work
                    ):
                        verdict = OUTSIDE
                        break
                    missing = 0.0
                    for a in range(3):
                        missing += (p[a] - q[a]) ** 2
                    missing = np.sqrt(missing) - rho
                    verdict = OPEN
                    if missing < outward:
                        outward = missing
                        for a in range(3):
                            stretch[box, a] = half[a] * abs(n[a])
                            stretch[box, 3 + a] = half[3 + a] * arm
                    continue
                if convex_gap(swept, other, p, q, n, work) == 0.0:
                    convex_gap(cable, other, p, q, n, work)
                still = -np.inf
                for k in range(other.shape[0]):
                    still = max(still, dot(n, other[k]))
                rest = _turn_rates(axes, half, b, rates)
                last = dot(n, cable[1]) - rest - anchor_off
                for j in range(3):
                    blame[j] = half[j] * abs(n[j])
                    blame[3 + j] = abs(dot(n, rates[j])) + rest
                    last -= blame[j] + abs(dot(n, rates[j]))
                least = min(last, dot(n, cable[0]) - exit_off) - still
                if dot(n, n) > 0.0 and least > rho + slip:
                    continue
                verdict = OPEN
                if outward == np.inf and rho - least > inward:
                    inward = rho - least
                    stretch[box] = blame
            if verdict == OUTSIDE:
                break
        verdicts[box] = verdict
