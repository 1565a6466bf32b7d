"""The wrenches that cables can give at one pose, as a geometric object."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError, WrenchSetError
from cdpr_drake.workspaces.wrench_facets_kernel import facet_count, facet_normals, wedge_terms

SAME = 1e-9
"""Facets or vertices that differ by less, relative to the size of the set, are the same."""

MOST_CABLES = 16
"""More cables have too many facets to be listed one by one."""


@dataclass(frozen=True, eq=False)
class AvailableWrenches:
    """The zonotope {W t : lower <= t <= upper}.

    Attributes:
        W: Wrench matrix, shape (n, m), rows divided by `row_scale`.
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        row_scale: By which rows were divided so that they have one unit, shape (n,) [m, -].
        normals: Outward unit normals of the facets, shape (f, n).
        offsets: c'x <= offset inside, shape (f,) [N].
        vertices: Shape (v, n), in wrenches as they are, not divided [N m, N].

    Source: Bouchard, Gosselin and Moore, 2010.
    """

    W: Array
    lower: Array
    upper: Array
    row_scale: Array
    normals: Array
    offsets: Array
    vertices: Array

    @property
    def volume(self) -> float:
        """Volume, [N^n] times [m] for each row of moments.

        Source: Shephard, Combinatorial properties of associated zonotopes, 1974: the sum of all
        parallelotopes of n generators.
        """
        n, m = self.W.shape
        widths = self.upper - self.lower
        total = sum(
            abs(float(np.linalg.det(self.W[:, some]))) * float(np.prod(widths[list(some)]))
            for some in map(list, combinations(range(m), n))
        )
        return total * float(np.prod(self.row_scale))

    def margin(self, wrench: Array) -> float:
        """Least distance of a wrench W t, shape (n,), from a facet; negative outside [N]."""
        return float(np.min(self.offsets - self.normals @ (np.asarray(wrench) / self.row_scale)))

    def section(self, rows: tuple[int, ...], at: Array) -> Array:
        """Vertices of the section in which the other rows have the values of `at`.

        Args:
            rows: Rows of W that vary, two or three of them.
            at: A wrench, shape (n,) [N m, N]; its values in `rows` do not matter.

        Returns:
            Vertices, shape (v, len(rows)) [N m, N], counterclockwise if two rows; none if empty.
        """
        free = list(rows)
        held = [row for row in range(len(self.row_scale)) if row not in free]
        x = np.asarray(at, float) / self.row_scale
        A = self.normals[:, free]
        b = self.offsets - self.normals[:, held] @ x[held]
        return _polytope_vertices(A, b) * self.row_scale[free]


def available_wrenches(
    W: Array, lower: Array, upper: Array, row_scale: Array | None = None
) -> AvailableWrenches:
    """What cables can give at one pose.

    Args:
        W: Wrench matrix, shape (n, m), n >= 2, m >= n.
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        row_scale: By which rows are divided to compare them, shape (n,) [m, -]; None: ones.

    Raises:
        TensionProblemError: Sizes do not fit, a number is not finite, or the bounds cross.
        WrenchSetError: The set is flat: W is singular, or too few tensions can change.
    """
    W = np.array(W, float)
    n, m = W.shape
    lower, upper = np.array(lower, float), np.array(upper, float)
    scale = np.ones(n) if row_scale is None else np.array(row_scale, float)
    if not (2 <= n <= m <= MOST_CABLES and lower.shape == upper.shape == (m,)):
        raise TensionProblemError(
            f"W, lower, upper: found shapes {W.shape}, {lower.shape}, {upper.shape}; accepted: "
            f"(n, m), (m,), (m,) with 2 <= n <= m <= {MOST_CABLES}"
        )
    if not all(np.all(np.isfinite(a)) for a in (W, lower, upper)) or np.any(lower > upper):
        raise TensionProblemError(
            "W, lower, upper: found NaN, infinity, or lower above upper; accepted: finite numbers"
        )
    W = W / scale[:, np.newaxis]
    normals = np.empty((facet_count(n, m), n))
    facet_normals(W, *wedge_terms(n), np.empty((n + 1, 20)), np.empty(n, np.int64), normals)
    keep = np.any(normals != 0.0, axis=1)
    chosen = np.array(list(combinations(range(m), n - 1)))[keep]
    normals = normals[keep]
    q = normals @ W
    size = float(np.sum((upper - lower) * np.linalg.norm(W, axis=0))) or 1.0
    # A true facet has n - 1 independent generators that can move, and the set some width across.
    widths = np.abs(q) @ (upper - lower)
    moving = np.all((upper - lower)[chosen] > 0.0, axis=1)
    if len(normals) == 0 or np.any(widths <= SAME * size) or not np.any(moving):
        raise WrenchSetError(
            "available wrenches: found a flat set; accepted: a pose with a regular W, and tensions "
            "that can change"
        )
    normals, q, chosen = normals[moving], q[moving], chosen[moving]
    both = np.concatenate([normals, -normals])
    offsets = np.maximum(lower * np.concatenate([q, -q]), upper * np.concatenate([q, -q])).sum(1)
    points = _corners(W, lower, upper, np.concatenate([q, -q]), np.tile(chosen, (2, 1)), size)
    keys = np.unique(np.round(both / (1e3 * SAME)) + 0.0, axis=0, return_index=True)[1]
    both, offsets = both[np.sort(keys)], offsets[np.sort(keys)]
    # Of candidates, vertices are those whose facets leave no direction free.
    vertices = [
        p
        for p in points
        if np.linalg.matrix_rank(both[offsets - both @ p <= SAME * size], tol=1e-6) == n
    ]
    return AvailableWrenches(W, lower, upper, scale, both, offsets, np.array(vertices) * scale)


def _corners(
    W: Array, lower: Array, upper: Array, q: Array, chosen: np.ndarray, size: float
) -> Array:
    """Corners of the facets, each once, shape (k, n): all vertices and perhaps points between."""
    n = W.shape[0]
    patterns = np.array(np.meshgrid(*[[0.0, 1.0]] * (n - 1))).reshape(n - 1, -1).T
    found = []
    for along, cables in zip(q, chosen, strict=True):
        t = np.where(along > 0.0, upper, lower)
        tensions = np.tile(t, (len(patterns), 1))
        tensions[:, cables] = lower[cables] + patterns * (upper - lower)[cables]
        found.append(tensions @ W.T)
    points = np.concatenate(found)
    keys = np.round(points / (100.0 * SAME * size))
    return np.asarray(points[np.unique(keys, axis=0, return_index=True)[1]], float)


def _polytope_vertices(A: Array, b: Array) -> Array:
    """Vertices of {x : A x <= b}, bounded, two or three unknowns; none where it is empty or flat.

    Three (two) facets meet in each; all triples (pairs) are tried, there are few.
    """
    n = A.shape[1]
    length = np.linalg.norm(A, axis=1)
    size = float(np.max(np.abs(b))) or 1.0
    level = length <= SAME
    if np.any(b[level] < -SAME * size):
        return np.empty((0, n))
    A, b = A[~level] / length[~level, np.newaxis], b[~level] / length[~level]
    choices = np.array(list(combinations(range(len(A)), n)))
    systems = A[choices]
    det = np.linalg.det(systems)
    good = np.abs(det) > 1e-9
    x = np.linalg.solve(systems[good], b[choices[good]][..., np.newaxis])[..., 0]
    inside = np.all(x @ A.T <= b + SAME * size, axis=1)
    return _hull_points(x[inside])


def _hull_points(points: Array) -> Array:
    if len(points) <= points.shape[1]:
        return np.empty((0, points.shape[1]))
    try:
        return np.asarray(points[ConvexHull(points).vertices], float)
    except QhullError:  # flat
        return np.empty((0, points.shape[1]))
