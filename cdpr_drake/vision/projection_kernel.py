"""Numba kernels of the pinhole camera: images of points, and whether they are in the picture.

A pose X_CO comes as its matrix (3, 4), column by column, shape (12,) [-, m], a camera as
`Pinhole.numbers`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

FX, FY, CX, CY, WIDTH, HEIGHT = range(6)
"""Numbers of a camera [px]."""


@njit(cache=True)
def images_of(points: Array, X: Array, camera: Array, uv: Array) -> None:
    """Writes images of points, shape (3, k) [m], to uv, shape (2, k) [px]; NaN behind the camera.

    Source: servoing thesis (1.41).
    """
    for k in range(points.shape[1]):
        a, b, c = points[0, k], points[1, k], points[2, k]
        z = X[2] * a + X[5] * b + X[8] * c + X[11]
        if z > 0.0:
            uv[0, k] = camera[CX] + camera[FX] * (X[0] * a + X[3] * b + X[6] * c + X[9]) / z
            uv[1, k] = camera[CY] + camera[FY] * (X[1] * a + X[4] * b + X[7] * c + X[10]) / z
        else:
            uv[0, k] = uv[1, k] = np.nan


@njit(cache=True)
def is_faced(X: Array) -> bool:
    """Whether z of O points to the camera's side of its plane."""
    return X[6] * X[9] + X[7] * X[10] + X[8] * X[11] < 0.0


@njit(cache=True)
def is_pictured(points: Array, X: Array, camera: Array, border: float) -> bool:
    """Whether O turns its face to the camera, with all points, shape (3, k) [m], in the picture, a
    border [px] off its rim."""
    if not is_faced(X):
        return False
    uv = np.empty((2, points.shape[1]))
    images_of(points, X, camera, uv)
    low = -0.5 + border
    for k in range(points.shape[1]):
        u, v = uv[0, k], uv[1, k]
        if not (low < u < camera[WIDTH] - 0.5 - border):
            return False
        if not (low < v < camera[HEIGHT] - 0.5 - border):
            return False
    return True
