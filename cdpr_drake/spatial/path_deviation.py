"""How far a path leaves the straight line, the measure of a servo's quality in the theses."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def distances_from_line(points: Array, start: Array, end: Array) -> Array:
    """Distances of points, shape (n, d), from the line through start and end, shape (d,), as (n,).

    Any dimension and unit. Where start and end coincide, the distances from that point.
    """
    offset = points - start
    along = end - start
    length = float(np.linalg.norm(along))
    if length > 0.0:
        u = along / length
        offset = offset - np.outer(offset @ u, u)
    return np.asarray(np.linalg.norm(offset, axis=1), float)
