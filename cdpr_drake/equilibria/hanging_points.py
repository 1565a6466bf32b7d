"""Where a point on inextensible cables rests, in closed form.

The taut cables put it on spheres. Their differences are planes; in what these have in common, the
spheres are one, of which the lowest and the highest point are at rest.
"""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

COINCIDE = 1e-9
"""Points nearer than this, relative to lengths, are one; centres nearer to a line lie on it."""


def hanging_points(centers: Array, radii: Array, down: Array) -> list[tuple[Array, Array]]:
    """Points at rest on k taut cables, and shares of the weight.

    Args:
        centers: Where the cables end in the space of motions, shape (d, k) [m].
        radii: How far the point is from each, shape (k,) [m].
        down: Weight in that space, shape (d,) [N].

    Returns:
        Points, shape (d,) [m], and tensions per distance, shape (k,) [N/m], of any sign: none
        where cables cannot all be taut, or the centres lie on one line or plane too many.
    """
    d, k = centers.shape
    if k > d or np.any(radii <= 0.0):
        return []
    first, size = centers[:, 0], float(np.max(radii))
    N = (centers[:, 1:] - first[:, None]).T
    right = 0.5 * (np.sum(N * N, axis=1) + radii[0] ** 2 - radii[1:] ** 2)
    if k > 1:
        U, s, V = np.linalg.svd(N)
        if s[-1] < COINCIDE * size:
            return []
        foot = V[: k - 1].T @ ((U.T @ right) / s)
        left = V[k - 1 :].T
    else:
        foot, left = np.zeros(d), np.eye(d)
    square = radii[0] ** 2 - foot @ foot
    if square < 0.0:
        return []
    along = left @ (left.T @ down)
    length = float(np.linalg.norm(along))
    if length < COINCIDE * np.linalg.norm(down):
        return []  # all of a circle is level: no cables of its axis balance a weight along it
    points = []
    for sign in (1.0, -1.0):
        point = first + foot + sign * np.sqrt(square) * along / length
        lines = point[:, None] - centers
        tight, _, rank, _ = np.linalg.lstsq(lines, down, rcond=COINCIDE)
        if rank == k and np.max(np.abs(lines @ tight - down)) < 1e-7 * np.linalg.norm(down):
            points.append((point, tight))
    return points
