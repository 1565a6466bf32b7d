"""Verdicts on many boxes, as a numba kernel for `numerics.over_rows`.

See the room's docstring for notation and proof.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tensions import workspace_shape
from cdpr_drake.workspaces.certificate.expansion_kernel import (
    INSIDE,
    NUMBERS,
    OPEN,
    OUTSIDE,
    expand,
    expand_demand,
)
from cdpr_drake.workspaces.certificate.inside_kernel import proves_inside
from cdpr_drake.workspaces.certificate.outside_kernel import (
    central_direction,
    follow_cone,
    proves_open_cone,
    proves_outside,
)
from cdpr_drake.workspaces.certificate.pulleys_kernel import see_pulleys, straight_points
from cdpr_drake.workspaces.wrenches import facet_normals, margin_along

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
