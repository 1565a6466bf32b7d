"""The part of an image that has to be looked at: where a target will be, from where it was."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

MARGIN = 8
"""Pixels that a window has around where the target is expected, at least: two of the tiles in which
AprilTags are searched, so that the rim of a tag is told from it as in the whole image."""

MOTION_SHARE = 0.5
"""What is added to that, per pixel that a side of the target's box moved by between the last two
images: they tell the next one to 0.6 px at most as long as a servo runs smoothly, and to the motion
itself where the target stops at once."""

EDGE_SHARE = 0.04
"""What is added instead where only one image tells, per longer edge of the box."""

GRID = 8
"""Windows begin and end at multiples of this [px], as those of real cameras do. It is a multiple of
the tiles of four pixels in which AprilTags are searched, so that these are those of the image. With
four, a renderer would have to make room for an image of another size more often than it gains by
pixels."""


@dataclass(frozen=True)
class ImageWindow:
    """A rectangle of pixels of an image.

    Attributes:
        u: First column.
        v: First row.
        width: Columns.
        height: Rows.
    """

    u: int
    v: int
    width: int
    height: int

    def pinhole(self, camera: Pinhole) -> Pinhole:
        """The camera that sees this window of the image of `camera` only."""
        return replace(
            camera,
            width=self.width,
            height=self.height,
            cx=camera.cx - self.u,
            cy=camera.cy - self.v,
        )

    def cut(self, picture: np.ndarray, drawn: ImageWindow) -> np.ndarray:
        """This window of a picture, shape (height, width, ...), of a larger window `drawn`."""
        u, v = self.u - drawn.u, self.v - drawn.v
        return np.ascontiguousarray(picture[v : v + self.height, u : u + self.width])


def whole_image(camera: Pinhole) -> ImageWindow:
    """All of an image."""
    return ImageWindow(0, 0, camera.width, camera.height)


def target_box(target: Target, X_CO: RigidTransform, camera: Pinhole) -> Array:
    """Least and largest (u, v) of a target's outline in the image, shape (4,) [px]; NaN where it
    reaches behind the camera."""
    uv = camera.project(X_CO @ target.outline)
    return np.concatenate([np.min(uv, axis=1), np.max(uv, axis=1)])


def expected_window(now: Array, before: Array, camera: Pinhole) -> ImageWindow | None:
    """Where a target will be in the next image, or None where that is not in the image.

    Every side of its box is taken to move on as it did.

    Args:
        now: Box of the last image, as `target_box` gives it, shape (4,) [px].
        before: That of the image before it; NaN where there is none, and then none has moved.
        camera: The camera.
    """
    if not np.all(np.isfinite(now)):
        return None
    known = np.all(np.isfinite(before))
    motion = now - before if known else np.zeros(4)
    box = now + motion
    # Both boxes are within: what stops between two images is where it was.
    low, high = np.minimum(box, now)[:2], np.maximum(box, now)[2:]
    if known:
        margin = MARGIN + MOTION_SHARE * float(np.max(np.abs(motion)))
    else:
        margin = MARGIN + EDGE_SHARE * float(np.max(high - low))
    return window_round(np.concatenate([low, high]), margin, whole_image(camera))


def window_round(box: Array, margin: float, within: ImageWindow) -> ImageWindow | None:
    """The least window on the grid round a box and a margin, as far as it lies in another window.

    Args:
        box: Least and largest (u, v), shape (4,) [px].
        margin: Margin [px].
        within: The other window; its rim counts as grid.

    Returns:
        None where they do not meet.
    """
    least = np.array([within.u, within.v])
    most = least + np.array([within.width, within.height])
    first = np.clip(np.floor((box[:2] - margin) / GRID) * GRID, least, most)
    last = np.clip(np.ceil((box[2:] + margin + 1.0) / GRID) * GRID, least, most)
    return _between(first, last) if np.all(last > first) else None


def union(one: ImageWindow, other: ImageWindow) -> ImageWindow:
    """The least window that has both."""
    first = np.minimum([one.u, one.v], [other.u, other.v])
    last = np.maximum(
        [one.u + one.width, one.v + one.height],
        [other.u + other.width, other.v + other.height],
    )
    return _between(first, last)


def with_principal_point(window: ImageWindow, camera: Pinhole) -> ImageWindow:
    """The least window on the grid that has another one and the principal point inside."""
    center = np.array([camera.cx, camera.cy]) + 0.5
    first = np.array([window.u, window.v])
    last = first + np.array([window.width, window.height])
    first = np.minimum(first, np.ceil(center / GRID - 1.0) * GRID)
    last = np.maximum(last, np.floor(center / GRID + 1.0) * GRID)
    return _between(first, np.minimum(last, [camera.width, camera.height]))


def _between(first: Array, last: Array) -> ImageWindow:
    (u, v), (width, height) = first, last - first
    return ImageWindow(int(u), int(v), int(width), int(height))
