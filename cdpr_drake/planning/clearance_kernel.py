"""Numba kernels: what a platform and its cables stay off, and what its camera sees, with slopes.

The derivative of a distance is that of its two nearest points as if they were fixed to the bodies
that they lie on (envelope theorem): along the line that joins them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_distance_kernel import convex_distance
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.pulley_kernel import pulley_geometry
from cdpr_drake.planning.cable_derivatives_kernel import cross, dot, exit_derivative
from cdpr_drake.workspaces.cable_distance_kernel import segments_shares

TOUCHING = 1e-16
"""Added to squared distances of segments, which have no derivative where they cross [m^2]."""


@njit(cache=True, error_model="numpy")
def cable_ends(X: Any, cables: Array, A: Array, B: Array, E: Array) -> None:
    """Writes tangent and anchor points, shape (m, 3) [m], and dA'/dB, shape (m, 3, 3)."""
    for i in range(cables.shape[0]):
        _, _, tx, ty, tz, _, _, _, rx, ry, rz = pulley_geometry(X, cables[i])
        A[i, 0], A[i, 1], A[i, 2] = tx, ty, tz
        B[i, 0], B[i, 1], B[i, 2] = X[9] + rx, X[10] + ry, X[11] + rz
        exit_derivative(X, cables[i], E[i])


@njit(cache=True, error_model="numpy")
def add_cable_slope(X: Any, B: Array, E: Array, share: float, n: Any, slope: Array) -> None:
    """slope += derivative of n' p by turn and move, p at a share of the way from A' to B.

    Args:
        X: Pose of the platform.
        B: Anchor point, shape (3,) [m].
        E: dA'/dB, shape (3, 3).
        share: Of p, 0 at A', 1 at B.
        n: A vector in W, which is fixed.
        slope: Shape (18,), changed.
    """
    r = (B[0] - X[9], B[1] - X[10], B[2] - X[11])
    g = (
        share * n[0] + (1.0 - share) * (E[0, 0] * n[0] + E[1, 0] * n[1] + E[2, 0] * n[2]),
        share * n[1] + (1.0 - share) * (E[0, 1] * n[0] + E[1, 1] * n[1] + E[2, 1] * n[2]),
        share * n[2] + (1.0 - share) * (E[0, 2] * n[0] + E[1, 2] * n[1] + E[2, 2] * n[2]),
    )
    turn = cross(r, g)
    for j in range(3):
        slope[j] += turn[j]
        slope[3 + j] += g[j]


@njit(cache=True, error_model="numpy")
def cable_gaps(
    points: Array, cables: Array, pairs: np.ndarray, values: Array, slopes: Array
) -> None:
    """Writes the distances of the centre lines of pairs of cables.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        pairs: Cables, shape (p, 2), whole numbers.
        values: Gets the distances, shape (N, p) [m].
        slopes: Gets their derivatives by the seeds, shape (N, p, 18).
    """
    m = cables.shape[0]
    A, B, E = np.empty((m, 3)), np.empty((m, 3)), np.empty((m, 3, 3))
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        cable_ends(X, cables, A, B, E)
        for row in range(pairs.shape[0]):
            i, j = pairs[row, 0], pairs[row, 1]
            x, y = segments_shares(A[i], B[i], A[j], B[j])
            d = (
                A[i, 0] + x * (B[i, 0] - A[i, 0]) - A[j, 0] - y * (B[j, 0] - A[j, 0]),
                A[i, 1] + x * (B[i, 1] - A[i, 1]) - A[j, 1] - y * (B[j, 1] - A[j, 1]),
                A[i, 2] + x * (B[i, 2] - A[i, 2]) - A[j, 2] - y * (B[j, 2] - A[j, 2]),
            )
            distance = np.sqrt(dot(d, d) + TOUCHING)
            n = (d[0] / distance, d[1] / distance, d[2] / distance)
            values[k, row] = distance
            slopes[k, row] = 0.0
            add_cable_slope(X, B[i], E[i], x, n, slopes[k, row])
            add_cable_slope(X, B[j], E[j], y, (-n[0], -n[1], -n[2]), slopes[k, row])


VIEW_ROWS = 5
"""Rows of a point in a view: right, left, lower, upper edge, and how near it is."""


@njit(cache=True, error_model="numpy")
def view_gaps(
    points: Array, camera: Array, slopes_of_view: Array, marks: Array, values: Array, slopes: Array
) -> None:
    """Writes how far points of W are within a camera's view.

    Args:
        points: Points of a motion, shape (N, 19).
        camera: R_PC, row by row, and p_PC, shape (12,).
        slopes_of_view: Tangents of half of the view's angles along x and y of C, shape (2,).
        marks: p_WQ, shape (q, 3) [m].
        values: Gets tan z - x, tan z + x, the same of y, and z, with (x, y, z) = p_CQ, shape
            (N, 5 q) [m].
        slopes: Gets their derivatives by the seeds, shape (N, 5 q, 18).
    """
    c, seen = np.empty((3, 6)), np.empty(3)
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        for q in range(marks.shape[0]):
            d = (marks[q, 0] - X[9], marks[q, 1] - X[10], marks[q, 2] - X[11])
            for j in range(3):
                seen[j] = 0.0
                axis = (0.0, 0.0, 0.0)
                for i in range(3):  # the axis j of C in W
                    part = camera[3 * i + j]
                    axis = (
                        axis[0] + X[i] * part, axis[1] + X[3 + i] * part, axis[2] + X[6 + i] * part,
                    )  # fmt: skip
                    seen[j] -= camera[9 + i] * part
                seen[j] += dot(axis, d)
                turn = cross(axis, d)
                for i in range(3):
                    c[j, i], c[j, 3 + i] = turn[i], -axis[i]
            base = VIEW_ROWS * q
            for side in range(2):
                for row in range(2):
                    sign, at = (-1.0 if row == 0 else 1.0), base + 2 * side + row
                    values[k, at] = slopes_of_view[side] * seen[2] + sign * seen[side]
                    for i in range(18):
                        slopes[k, at, i] = 0.0
                    for i in range(6):
                        slopes[k, at, i] = slopes_of_view[side] * c[2, i] + sign * c[side, i]
            values[k, base + 4] = seen[2]
            for i in range(18):
                slopes[k, base + 4, i] = c[2, i] if i < 6 else 0.0


@njit(cache=True, error_model="numpy")
def obstacle_gaps(
    points: Array, cables: Array, bodies: Array, body_starts: np.ndarray, body_radii: Array,
    obstacles: Array, starts: np.ndarray, radii: Array, work: Array, values: Array, slopes: Array,
) -> None:  # fmt: skip
    """Writes signed distances of cables and of the platform's bodies from obstacles.

    Args:
        points: Points of a motion, shape (N, 19).
        cables: `CableSet.packed()`, shape (m, 17).
        bodies: Points of the platform's bodies in P, `convex_shapes.packed`, shape (k, 3) [m].
        body_starts: Where each begins, shape (b + 1,).
        body_radii: Radii, shape (b,) [m].
        obstacles: Points of the obstacles in W, shape (l, 3) [m].
        starts: Where each begins, shape (o + 1,).
        radii: Radii, shape (o,) [m].
        work: Of `convex_distance_kernel.convex_work` for the largest of all.
        values: Gets the distances, for each obstacle those of the cables, then of the bodies, shape
            (N, o (m + b)) [m].
        slopes: Gets their derivatives by the seeds, shape (N, o (m + b), 18).
    """
    m, b = cables.shape[0], body_radii.shape[0]
    A, B, E = np.empty((m, 3)), np.empty((m, 3)), np.empty((m, 3, 3))
    moved, segment = np.empty((bodies.shape[0], 3)), np.empty((2, 3))
    p, q, n = np.empty(3), np.empty(3), np.empty(3)
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        cable_ends(X, cables, A, B, E)
        for i in range(bodies.shape[0]):
            x, y, z = bodies[i, 0], bodies[i, 1], bodies[i, 2]
            moved[i, 0] = X[9] + X[0] * x + X[1] * y + X[2] * z
            moved[i, 1] = X[10] + X[3] * x + X[4] * y + X[5] * z
            moved[i, 2] = X[11] + X[6] * x + X[7] * y + X[8] * z
        slopes[k] = 0.0
        for o in range(radii.shape[0]):
            corners = obstacles[starts[o] : starts[o + 1]]
            for i in range(m):
                row = o * (m + b) + i
                if not np.isfinite(A[i, 0]):
                    values[k, row] = np.nan
                    continue
                along, length = 0.0, 0.0
                for j in range(3):
                    segment[0, j], segment[1, j] = A[i, j], B[i, j]
                gap = convex_distance(segment, corners, p, q, n, work)
                for j in range(3):
                    along += (p[j] - A[i, j]) * (B[i, j] - A[i, j])
                    length += (B[i, j] - A[i, j]) ** 2
                values[k, row] = gap - radii[o]
                normal = (n[0], n[1], n[2])
                add_cable_slope(X, B[i], E[i], along / length, normal, slopes[k, row])
            for body in range(b):
                row = o * (m + b) + m + body
                own = moved[body_starts[body] : body_starts[body + 1]]
                gap = convex_distance(own, corners, p, q, n, work)
                values[k, row] = gap - radii[o] - body_radii[body]
                turn = cross((p[0] - X[9], p[1] - X[10], p[2] - X[11]), (n[0], n[1], n[2]))
                for j in range(3):
                    slopes[k, row, j], slopes[k, row, 3 + j] = turn[j], n[j]


@njit(cache=True, error_model="numpy")
def plane_gaps(
    points: Array, body: Array, obstacle: Array, planes: Array,
    values: Array, slopes: Array, columns: Array,
) -> None:  # fmt: skip
    """Writes on which sides of planes the corners of a body and of an obstacle are.

    Args:
        points: Points of a motion, shape (N, 19).
        body: Corners of the body in P, shape (k, 3) [m].
        obstacle: Corners of the obstacle in W, shape (l, 3) [m].
        planes: Normal n and offset d [m] of a plane each, shape (N, 4).
        values: Gets n' p - d of the body's corners, d - n' o of the obstacle's, n' n, shape
            (N, k + l + 1) [m, m, -].
        slopes: Gets their derivatives by the seeds, shape (N, k + l + 1, 18).
        columns: Gets those by n and d, shape (N, k + l + 1, 4).
    """
    count = body.shape[0]
    last = count + obstacle.shape[0]
    for k in range(points.shape[0]):
        X = floating_motion(points[k])[:12]
        n, d = (planes[k, 0], planes[k, 1], planes[k, 2]), planes[k, 3]
        slopes[k] = 0.0
        for i in range(count):
            x, y, z = body[i, 0], body[i, 1], body[i, 2]
            r = (
                X[0] * x + X[1] * y + X[2] * z, X[3] * x + X[4] * y + X[5] * z,
                X[6] * x + X[7] * y + X[8] * z,
            )  # fmt: skip
            p = (X[9] + r[0], X[10] + r[1], X[11] + r[2])
            values[k, i] = dot(n, p) - d
            turn = cross(r, n)
            for j in range(3):
                slopes[k, i, j], slopes[k, i, 3 + j] = turn[j], n[j]
                columns[k, i, j] = p[j]
            columns[k, i, 3] = -1.0
        for i in range(obstacle.shape[0]):
            o = (obstacle[i, 0], obstacle[i, 1], obstacle[i, 2])
            values[k, count + i] = d - dot(n, o)
            for j in range(3):
                columns[k, count + i, j] = -o[j]
            columns[k, count + i, 3] = 1.0
        values[k, last] = dot(n, n)
        for j in range(3):
            columns[k, last, j] = 2.0 * n[j]
        columns[k, last, 3] = 0.0
