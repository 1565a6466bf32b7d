"""Distances of straight cables and of platforms from convex shapes, exact and signed: a kernel."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_distance_kernel import convex_distance
from cdpr_drake.geometry.pulley_kernel import pulley_geometry

CABLE_SOLID, PLATFORM = 3, 4
"""Columns of `cable_distance_kernel.many_clearances` that convex shapes have a part in."""


@njit(cache=True, error_model="numpy")
def enclosing_balls(points: Array, starts: np.ndarray, radii: Array, balls: Array) -> None:
    """Writes a ball round each shape of `convex_shapes.packed`: middle and radius, shape (s, 4)."""
    for s in range(starts.shape[0] - 1):
        square = 0.0
        for a in range(3):
            low, high = np.inf, -np.inf
            for k in range(starts[s], starts[s + 1]):
                low, high = min(low, points[k, a]), max(high, points[k, a])
            balls[s, a] = 0.5 * (low + high)
        for k in range(starts[s], starts[s + 1]):
            far = 0.0
            for a in range(3):
                far += (points[k, a] - balls[s, a]) ** 2
            square = max(square, far)
        balls[s, 3] = np.sqrt(square) + radii[s]


@njit(cache=True, error_model="numpy")
def move_points(X: Array, points: Array, out: Array) -> None:
    """Writes points of P, shape (k, 3), as those of W; X is R_WP row by row (9) and p_WP (3)."""
    for k in range(points.shape[0]):
        for i in range(3):
            out[k, i] = X[9 + i]
            for j in range(3):
                out[k, i] += X[3 * i + j] * points[k, j]


@njit(cache=True, nogil=True, error_model="numpy")
def many_convex_clearances(
    first: int, past: int, positions: Array, rotations: Array, cables: Array, radius: Array,
    body_points: Array, body_starts: np.ndarray, body_radii: Array, points: Array,
    starts: np.ndarray, radii: Array, works: Array, out: Array,
) -> None:  # fmt: skip
    """Lowers the clearances of many poses by convex shapes, for `kernel_calls.over_rows`.

    Args:
        first: First pose.
        past: One past the last.
        positions: p_WP, shape (k, 3) [m].
        rotations: R_WP, shape (k, 3, 3).
        cables: `CableSet.packed()`, shape (m, 17).
        radius: Radius of the cables, shape (m,) [m].
        body_points: Of the platform's shapes, in P, `convex_shapes.packed`, and the next two.
        body_starts: Where each begins.
        body_radii: Their radii [m].
        points: Of the shapes that stand around, in W, and the next two.
        starts: Where each begins.
        radii: Their radii [m].
        works: As large as the largest `convex_work` that is needed.
        out: As `many_clearances` wrote it, shape (k, 5) [m]; rows of NaN stay.
    """
    m, count = cables.shape[0], starts.shape[0] - 1
    work, X, cable = np.empty_like(works), np.empty(12), np.empty((2, 3))
    p, q, n = np.empty(3), np.empty(3), np.empty(3)
    moved, balls = np.empty_like(body_points), np.empty((count, 4))
    enclosing_balls(points, starts, radii, balls)
    body_balls = np.empty((body_starts.shape[0] - 1, 4))
    for pose in range(first, past):
        if np.isnan(out[pose, CABLE_SOLID]):
            continue
        for i in range(3):
            for j in range(3):
                X[3 * i + j] = rotations[pose, i, j]
            X[9 + i] = positions[pose, i]
        motion = (X[0], X[1], X[2], X[3], X[4], X[5], X[6], X[7], X[8], X[9], X[10], X[11])
        move_points(X, body_points, moved)
        enclosing_balls(moved, body_starts, body_radii, body_balls)
        for i in range(m):
            _, _, tx, ty, tz, _, _, _, rx, ry, rz = pulley_geometry(motion, cables[i])
            cable[0, 0], cable[0, 1], cable[0, 2] = tx, ty, tz
            cable[1, 0], cable[1, 1], cable[1, 2] = X[9] + rx, X[10] + ry, X[11] + rz
            for s in range(count):
                gap = convex_distance(cable, points[starts[s] : starts[s + 1]], p, q, n, work)
                gap -= radius[i] + radii[s]
                out[pose, CABLE_SOLID] = min(out[pose, CABLE_SOLID], gap)
        for b in range(body_starts.shape[0] - 1):
            body = moved[body_starts[b] : body_starts[b + 1]]
            for s in range(count):
                square = 0.0
                for a in range(3):
                    square += (body_balls[b, a] - balls[s, a]) ** 2
                if np.sqrt(square) - body_balls[b, 3] - balls[s, 3] >= out[pose, PLATFORM]:
                    continue  # farther than another that was seen
                gap = convex_distance(body, points[starts[s] : starts[s + 1]], p, q, n, work)
                gap -= body_radii[b] + radii[s]
                out[pose, PLATFORM] = min(out[pose, PLATFORM], gap)
