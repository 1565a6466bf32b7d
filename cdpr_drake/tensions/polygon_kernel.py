"""The polygon of feasible tensions of a robot with two cables more than degrees of freedom."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number
from cdpr_drake.tensions.closed_form_kernel import NOT_FOUND, kernel_line, within
from cdpr_drake.tensions.null_space_kernel import null_space
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, SINGULAR

BARYCENTER, POLYGON_1_NORM, WEIGHTED_VERTICES = range(3)
"""Centre of area, corner of least sum, corners weighted by their exterior angles."""


@njit(cache=True)
def polygon_point(point: int, W: Array, w: Array, lower: Array, upper: Array, t: Array) -> int:
    """Tensions at a point of the feasible polygon; two cables more than degrees of freedom.

    Args:
        point: `BARYCENTER`, `POLYGON_1_NORM` or `WEIGHTED_VERTICES`.
        W: Wrench matrix, shape (n, n + 2).
        w: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        t: Gets the tensions, shape (m,) [N].

    Returns:
        FEASIBLE, SINGULAR, or NOT_FOUND where there is no polygon, or rounding lost it.

    Source: servoing thesis 1.3.4 for the barycenter.
    """
    m = W.shape[1]
    N = np.empty((2, m))
    if not null_space(W, w, t, N):
        return SINGULAR
    vertices = polygon_vertices(t, N, lower, upper)
    count = vertices.shape[1]
    if count > 0:
        if point == BARYCENTER:
            eta = polygon_barycenter(vertices)
        elif point == WEIGHTED_VERTICES:
            eta = polygon_steiner_point(vertices)
        else:
            a = b = 0.0
            for i in range(m):
                a += N[0, i]
                b += N[1, i]
            eta = vertices[:, 0].copy()
            for c in range(1, count):
                if a * vertices[0, c] + b * vertices[1, c] < a * eta[0] + b * eta[1]:
                    eta[0], eta[1] = vertices[0, c], vertices[1, c]
        for i in range(m):
            t[i] += N[0, i] * eta[0] + N[1, i] * eta[1]
        if within(t, lower, upper):
            return FEASIBLE
    return NOT_FOUND


EDGE_ROUNDING = 1e-13
"""A corner is outside an edge if it is beyond by more than this, relative to the tensions."""

SAME_CORNER = 1e-12
"""Corners nearer to each other than this, relative to the polygon, are one."""


@njit(cache=True)
def polygon_vertices(t: Array, N: Array, lower: Array, upper: Array) -> Array:
    """Corners of {eta: lower <= t + N' eta <= upper}, counterclockwise, shape (2, k) [N].

    Cuts a parallelogram, between the bounds of the two cables that meet least obliquely, by the
    bounds of all the others. Empty, shape (2, 0), where no tensions are feasible.

    Args:
        t: A solution of W t + w = 0, shape (m,) [N].
        N: Basis of the null space of W, row by row, shape (2, m).
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].

    Source: Gouttefarde et al., A versatile tension distribution algorithm for n-DOF parallel robots
    driven by n+2 cables, 2015, for the polygon; Sutherland and Hodgman, 1974, for the cutting.
    """
    m = N.shape[1]
    best, a, b = 0.0, 0, 1
    for i in range(m):
        for j in range(i + 1, m):
            area = abs(N[0, i] * N[1, j] - N[1, i] * N[0, j])
            if area > best:
                best, a, b = area, i, j
    size = 0.0
    for i in range(m):
        size = max(size, abs(t[i]), abs(lower[i]), abs(upper[i]))
    rounding = EDGE_ROUNDING * size
    here = np.empty((2, 4 + 2 * m))
    there = np.empty((2, 4 + 2 * m))
    det = N[0, a] * N[1, b] - N[1, a] * N[0, b]
    for corner in range(4):
        u = (upper[a] if corner in (1, 2) else lower[a]) - t[a]
        v = (upper[b] if corner in (2, 3) else lower[b]) - t[b]
        index = corner if det > 0.0 else 3 - corner
        here[0, index] = (u * N[1, b] - v * N[1, a]) / det
        here[1, index] = (v * N[0, a] - u * N[0, b]) / det
    count = 4
    for i in range(m):
        if i in (a, b):
            continue
        for side in (1.0, -1.0):
            bound = upper[i] - t[i] if side > 0.0 else t[i] - lower[i]
            kept = 0
            for c in range(count):
                e = (c + 1) % count
                beyond = side * (N[0, i] * here[0, c] + N[1, i] * here[1, c]) - bound
                next_beyond = side * (N[0, i] * here[0, e] + N[1, i] * here[1, e]) - bound
                if beyond <= rounding:
                    there[0, kept], there[1, kept] = here[0, c], here[1, c]
                    kept += 1
                if (beyond > rounding) != (next_beyond > rounding):
                    share = beyond / (beyond - next_beyond)
                    share = min(max(share, 0.0), 1.0)
                    there[0, kept] = here[0, c] + share * (here[0, e] - here[0, c])
                    there[1, kept] = here[1, c] + share * (here[1, e] - here[1, c])
                    kept += 1
            here, there = there, here
            count = kept
            if count == 0:
                return np.empty((2, 0))
    return here[:, :count].copy()


@njit(cache=True)
def polygon_barycenter(vertices: Array) -> Array:
    """Centre of area of a convex polygon, shape (2,); of length or the point where it is thin.

    Args:
        vertices: Corners in order, shape (2, k), k >= 1; any unit.

    Source: servoing thesis 1.3.4; the surveyor's formula.
    """
    k = vertices.shape[1]
    ox, oy = vertices[0, 0], vertices[1, 0]
    area = 0.0
    cx = cy = 0.0
    extent = 0.0
    for c in range(k):
        e = (c + 1) % k
        ax, ay = vertices[0, c] - ox, vertices[1, c] - oy
        bx, by = vertices[0, e] - ox, vertices[1, e] - oy
        twice = ax * by - ay * bx
        area += twice
        cx += twice * (ax + bx)
        cy += twice * (ay + by)
        extent = max(extent, abs(ax), abs(ay))
    if area > 1e-14 * extent * extent:
        return np.array([ox + cx / (3.0 * area), oy + cy / (3.0 * area)])
    # A segment or a point: the middle of its two farthest corners.
    far, p, q = -1.0, 0, 0
    for c in range(k):
        for e in range(c, k):
            square = (vertices[0, c] - vertices[0, e]) ** 2 + (vertices[1, c] - vertices[1, e]) ** 2
            if square > far:
                far, p, q = square, c, e
    return (vertices[:, p] + vertices[:, q]) / 2.0


@njit(cache=True)
def polygon_steiner_point(vertices: Array) -> Array:
    """Corners of a convex polygon weighted by their exterior angles, shape (2,).

    This point moves continuously with the polygon, also where it loses or gains corners, since a
    corner that vanishes has no exterior angle.

    Args:
        vertices: Corners in order, shape (2, k), k >= 1; any unit.

    Source: Schneider, Convex Bodies: The Brunn-Minkowski Theory, 5.4 (the Steiner point).
    """
    extent = 0.0
    for c in range(vertices.shape[1]):
        extent = max(extent, abs(vertices[0, c] - vertices[0, 0]))
        extent = max(extent, abs(vertices[1, c] - vertices[1, 0]))
    # Corners that coincide count once: the edge between them has any direction.
    kept = np.empty_like(vertices)
    k = 0
    for c in range(vertices.shape[1]):
        before = k - 1 if k > 0 else 0
        apart = abs(vertices[0, c] - kept[0, before]) + abs(vertices[1, c] - kept[1, before])
        if k == 0 or apart > SAME_CORNER * extent:
            kept[:, k] = vertices[:, c]
            k += 1
    while k > 1 and (
        abs(kept[0, k - 1] - kept[0, 0]) + abs(kept[1, k - 1] - kept[1, 0]) <= SAME_CORNER * extent
    ):
        k -= 1
    x = y = total = 0.0
    for c in range(k):
        before, behind = (c - 1) % k, (c + 1) % k
        ax, ay = kept[0, c] - kept[0, before], kept[1, c] - kept[1, before]
        bx, by = kept[0, behind] - kept[0, c], kept[1, behind] - kept[1, c]
        angle = abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))
        x += angle * kept[0, c]
        y += angle * kept[1, c]
        total += angle
    if total == 0.0:
        return vertices[:, 0].copy()
    return np.array([x / total, y / total])


@njit(cache=True)
def barycenter(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Centre of area of the feasible polygon. Arguments as `TensionMethod.kernel`."""
    return polygon_point(as_number(BARYCENTER), W, w, lower, upper, t)


@njit(cache=True)
def polygon_1_norm(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Corner of least sum of the feasible polygon. Arguments as `TensionMethod.kernel`."""
    return polygon_point(as_number(POLYGON_1_NORM), W, w, lower, upper, t)


@njit(cache=True)
def weighted_vertices(
    work: Array, W: Array, w: Array, lower: Array, upper: Array,
    reference: Array, row_scale: Array, t: Array,
) -> int:  # fmt: skip
    """Corners weighted by their exterior angles. Arguments as `TensionMethod.kernel`.

    With one cable to spare the polygon is a segment, of which both ends weigh the same.
    """
    if W.shape[1] == W.shape[0] + 1:
        return kernel_line(work, W, w, lower, upper, reference, row_scale, t)
    return polygon_point(as_number(WEIGHTED_VERTICES), W, w, lower, upper, t)
