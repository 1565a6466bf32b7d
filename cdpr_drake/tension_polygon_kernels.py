"""Tension methods that pick a point of the feasible polygon, as one numba kernel."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.tension_closed_kernels import MISSED, within
from cdpr_drake.tension_null_space import null_space
from cdpr_drake.tension_polygon import (
    polygon_barycenter,
    polygon_steiner_point,
    polygon_vertices,
)
from cdpr_drake.tension_qp_kernel import FEASIBLE, SINGULAR

POINTS = ("barycenter", "polygon_1_norm", "weighted_vertices")
"""Centre of area, corner of least sum, corners weighted by their exterior angles; by number."""

BARYCENTER, POLYGON_1_NORM, WEIGHTED_VERTICES = range(3)


@njit(cache=True)
def polygon_point(point: int, W: Array, w: Array, lower: Array, upper: Array, t: Array) -> int:
    """Tensions at a point of the feasible polygon; two cables more than degrees of freedom.

    Args:
        point: Place in `POINTS`.
        W: Wrench matrix, shape (n, n + 2).
        w: Wrench, shape (n,) [N m, N].
        lower: Bounds, shape (m,) [N].
        upper: Bounds, shape (m,) [N].
        t: Gets the tensions, shape (m,) [N].

    Returns:
        FEASIBLE, SINGULAR, or MISSED where there is no polygon, or rounding lost it.

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
    return MISSED
