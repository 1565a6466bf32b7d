"""Draws cables into rendered images, as they hang, as thick as they are, behind what hides them.

The renderer's geometries have one shape each, and its lines are a pixel wide or nothing: a cable of
two millimetres at a metre and a half is thinner than a pixel. So a cable's curve is drawn into the
image afterwards, by the share of each pixel that it covers, where the depth of the scene is larger
than its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.pinhole import Pinhole

CABLE_COLOR = np.array([35.0, 35.0, 38.0])
"""Red, green and blue of a dark rope, of 255."""

FINER = 8
"""Parts of a pixel, across and down, in which covered shares are counted."""

SHIFT = 6
"""Binary digits after the point of coordinates, as OpenCV's drawing takes them."""

STEP = 1.0
"""Distance of points of a curve in the image at most [px]: as fine is it asked what hides it."""

IN_FRONT = 0.01
"""By so much more than the scene's depth that of a cable may be before it is hidden [m]: where it
is tied it is in the surface of the platform."""


def draw_cables(
    image: np.ndarray,
    depth: Array,
    curves: Sequence[Array],
    radii: Array,
    X_WC: RigidTransform,
    pinhole: Pinhole,
) -> np.ndarray:
    """An image with cables in it, shape (height, width, 3), 8 bits a channel.

    Args:
        image: The scene without cables, shape (height, width, 3 or 4), 8 bits a channel.
        depth: Depth of what is in it, shape (height, width) [m]; infinite for nothing.
        curves: Points of each cable in W, shape (3, n) [m].
        radii: Of the cables, shape (m,) [m].
        X_WC: Pose of the camera, z forward, y down [m].
        pinhole: Its intrinsic parameters; without a lens.
    """
    drawn = image[:, :, :3].astype(float)
    X_CW = X_WC.inverse()
    for curve, radius in zip(curves, radii, strict=True):
        for uv, width in _visible_runs(X_CW @ curve, depth, float(radius), pinhole):
            _draw_line(drawn, uv, width)
    return np.asarray(np.clip(np.round(drawn), 0.0, 255.0), np.uint8)


def _visible_runs(
    p_CK: Array, depth: Array, radius: float, pinhole: Pinhole
) -> list[tuple[Array, float]]:
    """Pieces of a cable that nothing hides: pixels, shape (2, n) [px], and widths [px]."""
    p_CK = _finer(p_CK, pinhole)
    uv = pinhole.project(p_CK)
    column, row = np.round(np.nan_to_num(uv, nan=-1.0)).astype(int)
    inside = (
        np.isfinite(uv[0])
        & (column >= 0)
        & (column < pinhole.width)
        & (row >= 0)
        & (row < pinhole.height)
    )
    seen = inside.copy()
    seen[inside] = p_CK[2, inside] < depth[row[inside], column[inside]] + IN_FRONT
    ends = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(int)))
    focal = float(np.sqrt(pinhole.fx * pinhole.fy))
    runs = []
    for first, last in ends.reshape(-1, 2):
        if last - first > 1:
            width = 2.0 * radius * focal / float(np.mean(p_CK[2, first:last]))
            runs.append((uv[:, first:last], width))
    return runs


def _finer(p_CK: Array, pinhole: Pinhole) -> Array:
    """Points along the same curve, in the image at most about `STEP` apart, shape (3, n) [m]."""
    lengths = np.linalg.norm(np.diff(p_CK, axis=1), axis=0)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    nearest = max(float(np.min(p_CK[2])), 0.1)
    count = int(np.ceil(along[-1] * max(pinhole.fx, pinhole.fy) / (nearest * STEP))) + 2
    at = np.linspace(0.0, along[-1], count)
    return np.array([np.interp(at, along, row) for row in p_CK])


def _draw_line(drawn: Array, uv: Array, width: float) -> None:
    """Draws a line of a width [px] through pixels uv, shape (2, n) [px], in place."""
    margin = int(np.ceil(width)) + 2
    low = np.maximum(np.floor(np.min(uv, axis=1)).astype(int) - margin, 0)
    high = np.minimum(
        np.ceil(np.max(uv, axis=1)).astype(int) + margin + 1, [drawn.shape[1], drawn.shape[0]]
    )
    columns, rows = high - low
    if columns <= 0 or rows <= 0:
        return
    # OpenCV's lines are a fine pixel wider than it is told.
    thick = max(round(FINER * width) - 1, 1)
    fine = np.zeros((FINER * rows, FINER * columns), np.uint8)
    # Pixel k spans fine pixels FINER k to FINER (k + 1) - 1; its middle is between them.
    points = FINER * (uv - low[:, np.newaxis] + 0.5) - 0.5
    whole = np.round(points.T * 2**SHIFT).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(fine, [whole], False, 255, thick, cv2.LINE_8, SHIFT)
    share = cv2.resize(fine, (int(columns), int(rows)), interpolation=cv2.INTER_AREA) / 255.0
    share = np.minimum(share * (FINER * width / (thick + 1)), 1.0)[:, :, np.newaxis]
    part = drawn[low[1] : high[1], low[0] : high[0]]
    part[:] = (1.0 - share) * part + share * CABLE_COLOR
