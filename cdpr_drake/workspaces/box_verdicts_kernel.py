"""Verdicts on many boxes, as a numba kernel for `numerics.over_rows`.

See the room's docstring for notation and proof.

Verdicts of many boxes on what cables meet, as a numba kernel for `numerics.over_rows`.

See the room's docstring for notation and proof.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from cdpr_drake.workspaces.box_clearance_kernel import judge_box
from cdpr_drake.workspaces.box_expansion_kernel import (
    ANCHOR,
    EXIT,
    INSIDE,
    NUMBERS,
    OPEN,
    OUTSIDE,
    expand,
    expand_demand,
    turn_axes,
)
from cdpr_drake.workspaces.box_inside_kernel import proves_inside
from cdpr_drake.workspaces.box_outside_kernel import (
    central_direction,
    follow_cone,
    proves_open_cone,
    proves_outside,
)
from cdpr_drake.workspaces.box_pair_clearance_kernel import judge_pair
from cdpr_drake.workspaces.box_pulleys_kernel import see_pulleys, straight_points
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
    n, nk, Q, q, blame = (
        np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip
    clearance, exit_free, anchor_free = limits[0], limits[1], limits[2]
    for box in range(first, past):
        half = halves[box]
        runs = True
        if pulleys:
            runs = see_pulleys(poses[box], half, cables, limits[3:], False, points, bounds, turns)
        size = np.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2)
        s = half[3] + half[4] + half[5]
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
            off[i] = s * arm[i] + bounds[i, ANCHOR]
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
                    error = max(bounds[i, EXIT], off[i]) + max(bounds[o, EXIT], off[o])
                    apart, reach = clearance + radius[i] + radius[o], arm[i] + arm[o]
                    shifted = max(gain[i], gain[o])
                    found, missing = judge_pair(
                        points[i, :3], B[i], points[o, :3], B[o], half[:3], apart, error, extent,
                        n, nk, Q, blame,
                    )  # fmt: skip
                elif kind == 1:
                    i, o = number % m, number // m
                    reach, shifted = far[i], gain[i]
                    found, missing = judge_box(
                        b[i], seen[i], -1.0, half[:3], moved[o], anchor_free, clearance + radius[i],
                        bounds[i, ANCHOR], s * (far[i] + size) + bounds[i, EXIT], extent, n, nk,
                        Q, q, blame,
                    )  # fmt: skip
                else:
                    i, o = number % m, number // m
                    reach, shifted = arm[i], gain[i]
                    found, missing = judge_box(
                        points[i, :3], B[i], 1.0, half[:3], (fixtures, obstacles)[kind - 2][o],
                        exit_free if kind == 2 else 0.0, clearance + radius[i], bounds[i, EXIT],
                        off[i], extent, n, nk, Q, q, blame,
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
                            stretch[box, 3 + k] = half[3 + k] * reach
            if verdict == OUTSIDE:
                break
        verdicts[box] = verdict


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
