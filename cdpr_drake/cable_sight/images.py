"""Images of cables: points of their curves as a camera in the world sees them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision import Pinhole


def even_points(curve: Array, count: int) -> Array:
    """Points evenly along a curve without its ends, shape (3, count) [m].

    Args:
        curve: Points, shape (3, n) [m].
        count: How many.
    """
    steps = np.linalg.norm(np.diff(curve, axis=1), axis=0)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = along[-1] * (np.arange(count) + 0.5) / count
    return np.array([np.interp(wanted, along, row) for row in curve])


def cable_images(
    curves: Sequence[Array],
    X_WE: RigidTransform,
    pinhole: Pinhole,
    count: int,
    noise: float,
    random: np.random.Generator,
) -> Array:
    """Pixels of points of cables, shape (m, 2, count) [px]; NaN where they are not in the image.

    What hides a cable, as the platform may, is not modelled.

    Args:
        curves: Curves of the cables in W, shape (3, n) each [m].
        X_WE: The camera E in W [m].
        pinhole: Its intrinsic parameters.
        count: Points of each cable.
        noise: Standard deviation of each coordinate [px].
        random: Where the noise comes from.
    """
    found = np.full((len(curves), 2, count), np.nan)
    X_EW = X_WE.inverse()
    for k, curve in enumerate(curves):
        found[k] = pinhole.project(X_EW @ even_points(curve, count))
    found += noise * random.standard_normal(found.shape)
    size = np.array([[pinhole.width], [pinhole.height]]) - 1.0
    outside = np.any(~((found >= 0.0) & (found <= size)), axis=1)
    found[np.broadcast_to(outside[:, np.newaxis], found.shape)] = np.nan
    return found
