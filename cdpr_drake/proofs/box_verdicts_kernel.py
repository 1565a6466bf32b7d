"""Verdicts on many boxes of poses: proofs that all of a box is in a workspace, or none of it.

Two numba kernels for `kernel_calls.over_rows`: `judge_boxes` for wrenches that cables can give,
`judge_clearances` for what cables meet. They assemble the proofs of `box_expansion_kernel`,
`box_pulleys_kernel`, `box_inside_kernel`, `box_outside_kernel`, `box_clearance_kernel` and
`box_pair_clearance_kernel`; notation and proof of all of them stand here.

A box is a pose (position, angles of R = Rx Ry Rz) and half widths h_k of each of its six numbers;
delta stands for the deviation from the pose, |delta_k| <= h_k. Exit and anchor points may be off by
r_A and r_B in any direction, each by itself. Cables run straight from their exit points, or over
pulleys at the frame, at the platform, or both, whose radii and axes are taken as they are.

**Expansion.** Cable i has the anchor's arm b_i in W, the vector v_i = p + b_i - a_i of length l_i,
u_i = v_i / l_i, and the scaled column g_i = -(b_i x v_i, v_i), so that W t = V tau with tau = t /
l: V is a polynomial where W is not. With s the sum of the half widths of the angles,

  b_i(delta) = b_i + sum_k delta_k b_i^k + e_b,  |e_b| <= E_b = s^2 |b_i| / 2 + r_B
  v_i(delta) = v_i + sum_k delta_k v_i^k + e_v,  |e_v| <= E_v = s^2 |b_i| / 2 + r_A + r_B

since every second derivative of R b by angles is at most |b|. With x = sum delta_k v^k, |x| <= D_v,
and |sum delta_k b^k| <= D_b, the forces of g_i are off their first order by at most E_v, the
moments by D_b D_v + E_b (|v| + D_v) + (|b| + D_b) E_v + E_b E_v; without turns and errors by
nothing. The length is l + u.x + lambda with -E_v <= lambda <= D_v^2 / (2 (l - D_v)) + E_v, for l >
D_v. What is demanded, V tau = d, is expanded likewise: the weight's arm turns.

**Pulleys at the frame.** A cable leaves its pulley at the tangent point A' = A + T(x), x = B - A,
and all of the above holds with v = B - A' = x - T(x), since the free part is a line through B. Of
the plane of the pulley let e point to B, n be the axis, u the free part's direction, m the normal
of u in the plane at A', y = n x e; L the free length, rho B's distance from the axis, o that of A'.
A turn of u in the plane by a / L and of the plane by b / rho, a = m.dx, b = y.dx, move A' by

  dT = -(r / L) u a + (o / rho) y b,   so   dv = N dx,   N = 1 + (r / L) u m' - (o / rho) y y',

and with f = u.dx, cos and sin those of `geometry.pulley_kernel`, once more differentiated,

  d2T = -m (r a^2 / L^2 + o cos b^2 / rho^2)
      + u (2 r f a / L^2 + r^2 a^2 / L^3 - r cos b^2 / (rho L) - o sin b^2 / rho^2)
      - y (2 r sin a b / (rho L) + 2 o (e.dx) b / rho^2),

of which, for |dx| = 1 and o <= 2 r, `box_pulleys_kernel._bend` bounds the components. So v^k is N
times that of the point B, D_v and the rest of x are multiplied by |N|, and half the bound on d2T
times the square of a bound on |x - x_0| is added to E_v. L and rho are bounded from below within
the box, as both are by convex functions. T is never longer than 2 r: where that is better, or the
cable might not run, A is taken for A', which is off by 2 r + r_A; then a box may be outside, as is
every pose at which a cable cannot run, but not inside.

**Pulleys at the platform** are the same in P: B' = B + S(R'(A' - p) - B). Both ends together solve
A' = A + T(B' - A) and that. By the above |dT| <= a |dx| with a = max(r / L, 2 r / rho), and c
likewise of S. With M_A and M_B, by how much a point of W at A' moves in P, and a point of P at B'
in W, a box in which a c < 1 has one solution for each pose, and between two poses

  |A' moved| <= ((1 + a) r_A + a (M_B + (1 + c) r_B + c M_A)) / (1 - a c),
  |B' moved in P| <= (1 + c) r_B + c (|A' moved| + M_A).

These stand for r_A and r_B about the tangent points at the middle, the ends of the free part. That
at the middle is found by alternation; what a last round still moves it, over 1 - a c, is added.
Proofs of interference take the same bounds for pulleys at the frame.

**Inside.** Take any tau_0, tau_k and any P, and let tau^ = tau_0 + sum delta_k tau_k. The residual
rho = d - V tau^ is at most rho_bar in each row: its order 0, |delta_k| times its order 1, the
products delta_j delta_k of V^j tau_k (of each pair j, k both together), the remainders above times
|tau^|, and rounding. If no row of a bound on |1 - V P|, which is |1 - V_0 P| + sum h_k |V^k P| +
the remainders times |P|, sums to more than kappa < 1, V P is regular, and tau = tau^ + P (V P)^-1
rho solves V tau = d exactly. It differs from tau^ by at most |P| (rho_bar + kappa / (1 - kappa) max
rho_bar) =: |P| y. So t_i = l_i tau_i differs from l_i tau_0i by at most

  sum_k h_k |l tau_k + tau_0 u.v^k| + (sum h_k |u.v^k|) (sum h_k |tau_k|)
    + |lambda| |tau^| + (l + D_v + E_v) (|P| y),

and where that leaves all tensions within their bounds, every pose of the box is feasible, and W is
regular there. For a polytope of wrenches the proof is made for each vertex: what is demanded may be
any of their means, and the mean of tensions within bounds is within bounds. For wrench closure
positive tensions are shown to balance nothing; those from `box_judges.CLOSURE_SHARE` to 1
serve to find some.

How tau_0, tau_k and P are found has no part in the proof. t_0 is the analytic centre of the
feasible tensions; with D the tensions' distances from their bounds there as the barrier has them,
P = D^2 W' (W D^2 W')^-1 moves tensions by as much as they have room, and the first order vanishes.

**Outside.** Take any c(delta) = c_0 + sum delta_k c_k. If c.d > sum_i max(lower q_i, upper q_i) for
all delta, q_i = c.g_i / l_i, no tensions within the bounds give d. f_i = c.g_i is expanded as g_i
above; q = q_0 + sum delta_k q^k + R_q with q^k = (f^k - q_0 u.v^k) / l and

  |R_q| <= (R_f + |sum delta_k q^k| |u.x| + (|q_0| + |sum delta_k q^k|) |lambda|) / (l - D_v - E_v).

Where a bound shows the sign of q_i, its tension is known, and its first order is added to that of
c.d before absolute values are taken; otherwise it counts with the largest value it could have. c_0
is the normal of the facet beyond which the wrench lies farthest, tilted by so little that the signs
of the n - 1 cables that it is normal to are sure, and c_k turns it with them. For closure c_0 is
the centre of the cone {c: W'c < 0}, c_k keeps products with it as they are, and f_i < 0 is shown:
no positive tensions balance anything.

**Interference.** n(delta) = n_0 + sum delta_k n_k separates two things if n(delta) times any point
of one less any point of the other exceeds (the distance that is asked for, and what points are off
by) times a bound on |n(delta)|. Points of cables follow the pose by m_k: of an anchor point the
axes of W and b^k, which leaves s^2 |b| / 2; of an exit point v = a - p seen from the platform minus
the axes and -a_k x v, a_k the axes of the angles, which leaves s^2 |v| / 2 + s |h|, h over the
position. For two cables the difference of points is linear in the place on each, so four corners
decide: exit or anchor point of one less that of the other, Q + sum delta_k m_k, m_k the difference
of theirs. For a cable and a box, seen from the box, one end of the cable rests and the other
moves: of the cable two ends decide, of the box the corner where n(delta) points, or, where a
component of n may change its sign, both corners. Then n(delta).(Q + sum delta_k m_k) is

  n_0.Q + sum delta_k (n_k.Q + n_0.m_k) + sum delta_j delta_k n_k.m_j,

bounded term by term. Where a length f next to the resting end is left out, the part begins at that
end + f u(delta); u, the direction of the cable q of length l, is off its first order by at most
|d|^2 (1 / l^2 + (l + |d|) / (l - |d|)^3), |d| what ends move against each other. Nothing else than
n_0, n_k is chosen: from the nearest points at the middle, so that n stays normal to cables and
edges.

A box is outside if some point of a cable and some point of what it meets, at shares of their
lengths that may follow delta, are too near for all delta: their distance is at most that at the
middle, plus sum h_k |w_k| with w_k = x B^k - y D^k + x_k (B - A) - y_k (D - C) the rates at which
it changes, plus |h| sum h_k |x_k - y_k| over the position, plus what the angles move either anchor
point times sum h_k |x_k|, or |y_k|, for cables A to B and C to D, nearest at x and y. Of a box the
point need only stay within, axis by axis; what the end is off beside m_k moves it by its share.

**Rounding.** All that enters a proof is computed from coordinates by at most a few dozen additions
and products, each wrong by 1.1e-16 of its result. `box_expansion_kernel.ROUNDING` times the sum of
the absolute values of everything that is added is put on every bound; it is more than a thousand
times that of a sum of so many terms. The numbers that a proof is made with (tau, P, c) may be
anything and need no bound.

Source: Krawczyk's and Neumann's arguments as in Rump, Verification methods, Acta Numerica 2010; for
workspaces with intervals: Gouttefarde, Daney and Merlet, Interval-analysis-based determination of
the wrench-feasible workspace of parallel cable-driven robots, 2011.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_clearance_kernel import judge_box
from cdpr_drake.proofs.box_expansion_kernel import (
    ANCHOR,
    EXIT,
    INSIDE,
    NUMBERS,
    OPEN,
    OUTSIDE,
    ROUNDING,
    expand,
    expand_demand,
    turn_axes,
)
from cdpr_drake.proofs.box_inside_kernel import proves_inside
from cdpr_drake.proofs.box_outside_kernel import (
    central_direction,
    follow_cone,
    proves_open_cone,
    proves_outside,
)
from cdpr_drake.proofs.box_pair_clearance_kernel import judge_pair, swing
from cdpr_drake.proofs.box_pulleys_kernel import see_pulleys, straight_points
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from cdpr_drake.workspaces.wrench_facets_kernel import facet_normals, margin_along

FREE = 1e-9
"""A column counts as normal to a facet, or on its negative side, up to this."""


@njit(cache=True, nogil=True, error_model="numpy")
def judge_boxes(
    first: int, past: int, closure: bool, poses: Array, halves: Array, cables: Array,
    rows: np.ndarray, scale: Array, load: Array, corners: Array, lower: Array, upper: Array,
    errors: Array, terms: Array, starts: Array, verdicts: np.ndarray, stretch: Array,
) -> None:  # fmt: skip
    """Writes verdicts and which half width should be cut.

    Args:
        first: First box.
        past: One past the last.
        closure: Whether wrench closure is asked for; then load and corners must be zero.
        poses: Shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        cables: `CableSet.packed()`, shape (m, 17).
        rows: Components that are balanced, shape (n,).
        scale: By which they are divided, shape (n,).
        load: Centre of mass in P (3) [m], weight in W (3) [N].
        corners: Wrenches on the platform beside the weight, all of which must be resisted, scaled,
            shape (c, n).
        lower: Smallest tensions, shape (m,).
        upper: Largest tensions, shape (m,).
        errors: r_A, r_B [m], shape (2,).
        terms: Of `wedge_terms(n)`.
        starts: Of `wedge_terms(n)`.
        verdicts: Gets `INSIDE`, `OPEN` or `OUTSIDE`, shape (k,).
        stretch: Gets for each half width how much it is in the way, shape (k, 6).
    """
    m, n = cables.shape[0], rows.shape[0]
    points, off, turns = np.empty((m, 6)), np.empty((m, 4)), np.empty((m, 3, 3))
    pulleys = straight_points(cables, errors, points, off)
    arm, blamed = 0.0, np.zeros(NUMBERS)
    for i in range(m):
        arm += np.sqrt(points[i, 3] ** 2 + points[i, 4] ** 2 + points[i, 5] ** 2) / m
    g, gk, W = np.empty((n, m)), np.empty((NUMBERS, n, m)), np.empty((n, m))
    lengths, rest = np.empty((NUMBERS + 1, m)), np.empty((3 + n, m))
    d, base, d_rest = np.empty((NUMBERS + 1, n)), np.empty(n), np.empty(n)
    work, some = np.empty(workspace_shape(n, m)), np.empty(NUMBERS)
    count = 1
    for k in range(n - 1):
        count = count * (m - k) // (k + 1)
    normals, wedge, chosen = np.empty((count, n)), np.empty((n + 1, 20)), np.empty(n, np.int64)
    demands, still, c = np.empty((corners.shape[0], n)), np.zeros((n + 2, n)), np.empty(n)
    ck = np.empty((NUMBERS, n))
    for box in range(first, past):
        verdicts[box] = OPEN
        stretch[box] = halves[box]
        half = halves[box]
        inside = True
        if pulleys:
            inside = see_pulleys(poses[box], half, cables, errors, True, points, off, turns)
        for k in range(3):
            blamed[k] = half[k] if pulleys else 0.0
            blamed[3 + k] = half[3 + k] * arm if pulleys else half[3 + k]
            if pulleys:
                stretch[box, 3 + k] = blamed[3 + k]
        if not expand(poses[box], half, points, rows, scale, off, turns, g, gk, lengths, rest):
            continue
        turning = expand_demand(poses[box], half, load, rows, scale, d)
        for k in range(n):
            base[k] = d[0, k]
            d_rest[k] = turning / scale[k] if rows[k] < 3 else 0.0
        for corner in range(corners.shape[0]):
            for k in range(n):
                demands[corner, k] = base[k] - corners[corner, k]
                d[0, k] = demands[corner, k]
            if inside:
                inside = proves_inside(
                    half, g, gk, lengths, rest, d, d_rest, lower, upper, closure, blamed, work, some
                )
                if not inside:
                    stretch[box] = some
        if inside:
            verdicts[box] = INSIDE
            continue
        for i in range(m):
            for k in range(n):
                W[k, i] = g[k, i] / lengths[0, i]
        facet_normals(W, terms, starts, wedge, chosen, normals)
        if closure:
            if _cone_inside(W, normals, c):
                central_direction(W, c)
                follow_cone(c, half, W, gk, lengths, ck)
                if proves_open_cone(c, ck, half, g, gk, rest, some):
                    verdicts[box] = OUTSIDE
                else:
                    stretch[box] = some
            continue
        least, worst = 0.0, 0
        for number in range(count):
            up, down, most, lowest = margin_along(normals[number], W, lower, upper, demands, still)
            if up < least:
                least, worst = up, most
                for k in range(n):
                    c[k] = normals[number, k]
            if down < least:
                least, worst = down, lowest
                for k in range(n):
                    c[k] = -normals[number, k]
        if least < 0.0:
            for k in range(n):
                d[0, k] = demands[worst, k]
            if proves_outside(c, half, g, gk, lengths, rest, d, d_rest, lower, upper, some):
                verdicts[box] = OUTSIDE
            else:
                stretch[box] = some


@njit(cache=True, error_model="numpy")
def _cone_inside(W: Array, normals: Array, c: Array) -> bool:
    """Writes the sum of all normals that no column of W has a positive product with."""
    n, m = W.shape
    c[:] = 0.0
    found = False
    for number in range(normals.shape[0]):
        high = low = size = 0.0
        for k in range(n):
            size += normals[number, k] ** 2
        for i in range(m):
            q = 0.0
            for k in range(n):
                q += normals[number, k] * W[k, i]
            high, low = max(high, q), min(low, q)
        if size == 0.0 or (high > FREE and low < -FREE):
            continue
        found = True
        sign = 1.0 if high <= FREE else -1.0
        for k in range(n):
            c[k] += sign * normals[number, k]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def judge_clearances(
    first: int, past: int, poses: Array, halves: Array, cables: Array, radius: Array,
    pairs: np.ndarray, bodies: Array, fixtures: Array, obstacles: Array, limits: Array,
    verdicts: np.ndarray, stretch: Array,
) -> None:  # fmt: skip
    """Writes verdicts and which half width should be cut.

    Args:
        first: First box.
        past: One past the last.
        poses: Shape (k, 6) [m, rad].
        halves: Half widths, shape (k, 6) [m, rad].
        cables: `CableSet.packed()`, shape (m, 17).
        radius: Of the cables, shape (m,) [m].
        pairs: Cables that are compared, shape (p, 2).
        bodies: Boxes of the platform, in P, shape (b, 15).
        fixtures: Boxes of the frame, in W, shape (f, 15).
        obstacles: Boxes in W, shape (o, 15).
        limits: Clearance, lengths next to exit and next to anchor points that are not compared,
            r_A, r_B, shape (5,) [m].
        verdicts: Gets `INSIDE`, `OPEN` or `OUTSIDE`, shape (k,).
        stretch: Gets for each half width how much it is in the way, shape (k, 6).
    """
    m = cables.shape[0]
    points, bounds, turns = np.empty((m, 6)), np.empty((m, 4)), np.empty((m, 3, 3))
    pulleys = straight_points(cables, limits[3:], points, bounds)
    R, axes, moved = np.empty((3, 3)), np.empty((3, 3)), np.empty((bodies.shape[0], 15))
    B, b, seen = np.empty((m, 3)), np.empty((m, 3)), np.empty((m, 3))
    arm, far, off, gain = np.empty(m), np.empty(m), np.empty(m), np.zeros(m)
    n, nk, Q, q, work, blame = (
        np.empty(3), np.empty((NUMBERS, 3)), np.empty(3), np.empty(3), np.empty(NUMBERS),
        np.zeros(NUMBERS),
    )  # fmt: skip
    moves, spare = np.empty((2, m, NUMBERS, 3)), np.empty((NUMBERS, 3))
    margin = np.empty(m)
    around = _limits(fixtures), _limits(obstacles)
    clearance, exit_free, anchor_free = limits[0], limits[1], limits[2]
    for box in range(first, past):
        half = halves[box]
        runs = True
        if pulleys:
            runs = see_pulleys(poses[box], half, cables, limits[3:], False, points, bounds, turns)
        size = np.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2)
        s = half[3] + half[4] + half[5]
        numbers = NUMBERS if s > 0.0 else 3
        turn_axes(poses[box, 3:], R, axes)
        extent = size
        for i in range(m):
            square = distance = coordinates = 0.0
            for k in range(3):
                b[i, k] = R[k, 0] * points[i, 3] + R[k, 1] * points[i, 4] + R[k, 2] * points[i, 5]
                B[i, k] = poses[box, k] + b[i, k]
                seen[i, k] = points[i, k] - poses[box, k]
                square += b[i, k] ** 2
                distance += seen[i, k] ** 2
                coordinates += abs(points[i, k]) + abs(points[i, 3 + k]) + abs(poses[box, k])
            arm[i], far[i] = np.sqrt(square), np.sqrt(distance)
            off[i] = 0.5 * s * s * arm[i]
            _write_moves(axes, b[i], 1.0, moves[0, i])
            _write_moves(axes, seen[i], -1.0, moves[1, i])
            if pulleys:  # what a tangent point is off, by what the anchor point moves
                change = bounds[i, EXIT] + bounds[i, ANCHOR] - limits[3] - limits[4]
                gain[i] = change / (size + s * arm[i])
            extent = max(extent, coordinates)
        reach = shifted = 0.0
        for each in (bodies, fixtures, obstacles):
            for row in range(each.shape[0]):
                coordinates = 0.0
                for k in range(9, 15):
                    coordinates += abs(each[row, k])
                extent = max(extent, coordinates)
        _turned(R, bodies, moved)
        for i in range(m):
            margin[i] = _surely_far(
                points[i, :3], B[i], size + swing(moves[0, i], half, numbers), off[i],
                bounds[i, EXIT], bounds[i, ANCHOR], exit_free, clearance + radius[i], extent,
            )  # fmt: skip
        inward, outward, verdict = -1.0, np.inf, INSIDE if runs else OPEN  # missed by
        for j in range(6):
            stretch[box, j] = half[j]
        for kind in range(4):
            count = pairs.shape[0]
            if kind > 0:
                count = m * (moved, fixtures, obstacles)[kind - 1].shape[0]
            for number in range(count):
                if kind == 0:
                    i, o = pairs[number, 0], pairs[number, 1]
                    error = max(bounds[i, EXIT], off[i] + bounds[i, ANCHOR])
                    error += max(bounds[o, EXIT], off[o] + bounds[o, ANCHOR])
                    apart, reach = clearance + radius[i] + radius[o], arm[i] + arm[o]
                    shifted = max(gain[i], gain[o])
                    found, missing = judge_pair(
                        points[i, :3], B[i], points[o, :3], B[o], moves[0, i], moves[0, o], half,
                        numbers, apart, error, extent, n, nk, Q, spare, blame,
                    )  # fmt: skip
                elif kind == 1:
                    i, o = number % m, number // m
                    reach, shifted = far[i], gain[i]
                    found, missing = judge_box(
                        b[i], seen[i], moves[1, i], half, numbers, moved[o], anchor_free,
                        clearance + radius[i], bounds[i, ANCHOR], bounds[i, EXIT],
                        s * (0.5 * s * far[i] + size), extent, n, nk, Q, q, work, blame,
                    )  # fmt: skip
                else:
                    i, o = number % m, number // m
                    if _apart(points[i, :3], B[i], around[kind - 2][o], margin[i]):
                        continue
                    reach, shifted = arm[i], gain[i]
                    found, missing = judge_box(
                        points[i, :3], B[i], moves[0, i], half, numbers,
                        (fixtures, obstacles)[kind - 2][o], exit_free if kind == 2 else 0.0,
                        clearance + radius[i], bounds[i, EXIT], bounds[i, ANCHOR], off[i], extent,
                        n, nk, Q, q, work, blame,
                    )  # fmt: skip
                if found == OUTSIDE:
                    verdict = OUTSIDE
                    break
                if found == OPEN:
                    verdict = OPEN
                    # A box that is outside needs a single proof, the one that is nearest.
                    nearer = -missing < outward if missing < 0.0 else outward == np.inf
                    if nearer and (missing < 0.0 or missing > inward):
                        if missing < 0.0:
                            outward = -missing
                        else:
                            inward = missing
                        for k in range(3):
                            stretch[box, k] = blame[k] + shifted * half[k]
                            rest = half[3 + k] * (0.5 * s + shifted) * reach
                            stretch[box, 3 + k] = blame[3 + k] + rest
            if verdict == OUTSIDE:
                break
        verdicts[box] = verdict


@njit(cache=True, error_model="numpy")
def _limits(boxes: Array) -> Array:
    """Least and largest coordinates of boxes, shape (o, 6)."""
    found = np.empty((boxes.shape[0], 6))
    for row in range(boxes.shape[0]):
        for k in range(3):
            wide = 0.0
            for a in range(3):
                wide += abs(boxes[row, 3 * k + a]) * boxes[row, 12 + a]
            found[row, k], found[row, 3 + k] = boxes[row, 9 + k] - wide, boxes[row, 9 + k] + wide
    return found


@njit(cache=True, error_model="numpy")
def _surely_far(
    A: Array, B: Array, size: float, bend: float, exit_off: float, anchor_off: float, free: float,
    apart: float, extent: float,
) -> float:  # fmt: skip
    """A distance at the middle at which `judge_box` says inside at once; infinite: there is none.

    It is larger than needed by more than roundings, so it changes no verdict.
    """
    length = 0.0
    for k in range(3):
        length += (B[k] - A[k]) ** 2
    change = size + exit_off + anchor_off + bend + ROUNDING * extent
    shortest = np.sqrt(length) - change
    if not shortest > 0.0:
        return np.inf
    need = size + max(exit_off, anchor_off) + bend + apart + free * change / shortest
    return (1.0 + ROUNDING) * need + 10.0 * ROUNDING * extent


@njit(cache=True, error_model="numpy")
def _apart(A: Array, B: Array, limits: Array, margin: float) -> bool:
    """Whether a cable at the middle is farther than that from a box along an axis."""
    for k in range(3):
        if limits[k] - max(A[k], B[k]) > margin or min(A[k], B[k]) - limits[3 + k] > margin:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _write_moves(axes: Array, arm: Array, sign: float, moves: Array) -> None:
    """Writes how sign (p + R b), b seen as an arm in W, follows a pose, shape (6, 3)."""
    for k in range(3):
        for a in range(3):
            moves[k, a] = sign if a == k else 0.0
        moves[3 + k, 0] = sign * (axes[k, 1] * arm[2] - axes[k, 2] * arm[1])
        moves[3 + k, 1] = sign * (axes[k, 2] * arm[0] - axes[k, 0] * arm[2])
        moves[3 + k, 2] = sign * (axes[k, 0] * arm[1] - axes[k, 1] * arm[0])


@njit(cache=True, error_model="numpy")
def _turned(R: Array, boxes: Array, out: Array) -> None:
    """Writes boxes of P in the axes of W, seen from Po."""
    for row in range(boxes.shape[0]):
        for i in range(3):
            out[row, 9 + i], out[row, 12 + i] = 0.0, boxes[row, 12 + i]
            for k in range(3):
                out[row, 9 + i] += R[i, k] * boxes[row, 9 + k]
            for j in range(3):
                out[row, 3 * i + j] = 0.0
                for k in range(3):
                    out[row, 3 * i + j] += R[i, k] * boxes[row, 3 * k + j]
