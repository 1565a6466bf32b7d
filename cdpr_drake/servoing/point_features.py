"""Image points as visual features, and their interaction matrix (IBVS)."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import VisualFeatureError

COLLINEAR_SPREAD = 1e-6
"""Points whose spread across is less than this share of that along count as collinear."""


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
