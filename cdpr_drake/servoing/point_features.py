"""Image points as visual features, and their interaction matrix (IBVS)."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.errors import VisualFeatureError
from cdpr_drake.servoing.interaction_matrix_kernel import point_into

COLLINEAR_SPREAD = 1e-6
"""Points whose spread across is less than this share of that along count as collinear."""


@njit(cache=True)
def points_interaction(xy: Array, depths: Array) -> Array:
    """L with d(x_1, y_1, x_2, ...)/dt = L @ V_C for points at rest, shape (2 n, 6) [-, 1/m].

    V_C = (w, v) is the camera's twist in C [rad/s, m/s].

    Args:
        xy: Images (x, y) at unit focal length, shape (2, n) [-].
        depths: Z of the points in C, shape (n,) [m].

    Source: servoing thesis (1.43), (1.44), there with twists (translation, rotation).
    """
    n = xy.shape[1]
    L = np.empty((2 * n, 6))
    for k in range(n):
        point_into(xy[0, k], xy[1, k], depths[k], L, 2 * k)
    return L


def check_points(p_OK: Array) -> None:
    """Refuses points that cannot fix six motions, whatever the camera's pose.

    Args:
        p_OK: Points in the object frame, shape (3, n) [m].

    Raises:
        VisualFeatureError: Fewer than three, or all on one line.
    """
    n = p_OK.shape[1]
    if n < 3:
        raise VisualFeatureError(
            f"found {n} image points; accepted: at least 3, which make 6 features for 6 motions"
        )
    spread = np.linalg.svd(p_OK - p_OK.mean(axis=1, keepdims=True), compute_uv=False)
    if spread[1] <= COLLINEAR_SPREAD * spread[0]:
        raise VisualFeatureError(
            f"found {n} image points on one line, whose interaction matrix is singular: the "
            "rotation about that line is not seen; accepted: points that span a plane"
        )


def interaction_rank(L: Array, tolerance: float = 1e-6) -> int:
    """Rank of an interaction matrix, shape (n, k): singular values above a share of the largest.

    Columns are scaled to unit norm first, since those of rotation and translation have different
    units; that leaves the rank as it is.
    """
    norms = np.linalg.norm(L, axis=0)
    values = np.linalg.svd(L / np.where(norms > 0.0, norms, 1.0), compute_uv=False)
    return int(np.sum(values > tolerance * values[0]))
