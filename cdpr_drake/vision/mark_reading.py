"""Marks of targets between an image and the ideal camera: points, and ellipses by their outlines.

The image of an ellipse through a lens is no ellipse. What blob detection knows of it are its
centre and second moments, and these are kept: the outline of the ellipse that has them goes through
the lens point by point, and the moments of what comes out are the mark. What the lens adds beyond
second moments is lost; a test says how little that is.

Source: Steger, On the calculation of arbitrary moments of polygons, 1996, for the moments.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.vision.pinhole import Pinhole

OUTLINE_POINTS = 64
"""Of an ellipse, as a polygon."""

_ANGLES = np.linspace(0.0, 2.0 * np.pi, OUTLINE_POINTS, endpoint=False)
_CIRCLE = np.array([np.cos(_ANGLES), np.sin(_ANGLES)])


def read_marks(marks: Array, mark: str, size: int, camera: Pinhole) -> Array:
    """Marks in ideal pixels, from where they are found in an image; as `Pinhole.read`.

    Args:
        marks: Points or ellipses, then what is told of their quality, which stays, shape (n,).
        mark: "corners" or "ellipses".
        size: Numbers that are marks.
        camera: The camera.
    """
    return moved_marks(marks, mark, size, camera.read)


def found_marks(marks: Array, mark: str, size: int, camera: Pinhole) -> Array:
    """Where in an image marks are found, from where they are read; the inverse of `read_marks`."""
    return moved_marks(marks, mark, size, camera.found_at)


def read_corners(uv: Array, camera: Pinhole) -> Array:
    """Pixels in ideal ones, both of shape (..., 2) [px]; as `Pinhole.read`."""
    if camera.is_ideal:
        return uv
    return np.asarray(camera.read(uv.reshape(-1, 2).T).T.reshape(uv.shape))


def moved_marks(marks: Array, mark: str, size: int, way: Callable[[Array], Array]) -> Array:
    """Marks as `read_marks`, by any map of pixels, shape (2, n) [px]."""
    moved = np.array(marks)
    if mark == "corners":
        moved[:size] = way(moved[:size].reshape(-1, 2).T).T.ravel()
        return moved
    for one in moved[:size].reshape(-1, ELLIPSE_SIZE):
        one[:] = outline_moments(way(ellipse_outline(one)))
    return moved


def ellipse_outline(ellipse: Array) -> Array:
    """Points on an ellipse (u, v, n20, n11, n02), evenly by its angle, shape (2, n) [px]."""
    u, v, n20, n11, n02 = ellipse
    values, axes = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
    # A full ellipse has a quarter of the square of each half axis.
    halves = 2.0 * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.array([[u], [v]]) + axes @ (halves[:, np.newaxis] * _CIRCLE))


def outline_moments(points: Array) -> Array:
    """(u, v, n20, n11, n02): centre [px] and second central moments over the area [px^2].

    Args:
        points: Outline, images of points evenly round an ellipse, shape (2, n) [px].
    """
    # About the first points' mean, so that round-off is that of the outline's size.
    origin = np.mean(points, axis=1)
    x, y = points - origin[:, np.newaxis]
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    area = np.sum(cross) / 2.0
    u = np.sum((x + x1) * cross) / (6.0 * area)
    v = np.sum((y + y1) * cross) / (6.0 * area)
    n20 = np.sum((x * x + x * x1 + x1 * x1) * cross) / (12.0 * area) - u * u
    n02 = np.sum((y * y + y * y1 + y1 * y1) * cross) / (12.0 * area) - v * v
    n11 = np.sum((2.0 * (x * y + x1 * y1) + x * y1 + x1 * y) * cross) / (24.0 * area) - u * v
    # A regular polygon has this share of the second moments of its circle, and so have their affine
    # images.
    share = (2.0 + np.cos(2.0 * np.pi / points.shape[1])) / 3.0
    return np.array([origin[0] + u, origin[1] + v, n20 / share, n11 / share, n02 / share])
