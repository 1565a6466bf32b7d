"""A textured square as a target."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.apriltags import tag_corners
from cdpr_drake.vision.blob_detection import gray_image
from cdpr_drake.vision.image_alignment import CORNERS, Alignment, align, homography, is_square_seen
from cdpr_drake.vision.target import Plate, PointTarget, picture_png
from cdpr_drake.vision.texture_detection import detect
from cdpr_drake.vision.texture_pictures import texture_picture

LEAST_DIAGONAL = 34.0
"""Diagonals of a square's image from which on it is looked for [px]: an edge of 24."""

LEAST_SHARE = 0.35
"""Of the pixels in view that have to look like the picture: what covers more, hides it."""

LEAST_VIEW = 0.3
"""Of the square that has to be within the image."""

LEAST_CORRELATION = 0.93
"""Of those pixels with the picture: 0.95 and more where it lies right, in noise too, below 0.6
where it lies wrong, and between where what covers half of it has pulled it aside."""

WHOLE_SHARE, LEAST_WHOLE_CORRELATION = 0.9, 0.88
"""Where so much looks like the picture, nothing can have pulled it aside, and less correlation is
enough: images that do not average, as rendered ones, differ from a far picture by what lies between
their pixels."""

LARGEST_DEVIATION = 0.5
"""Standard deviation of a corner with which the square counts as found [px]."""

QUALITY = ("deviation_px", "correlation", "share", "points", "followed")
"""What is told beside the marks: largest standard deviation of a corner's coordinate, correlation
of the image with the picture, share of the pixels that look like it, points that were followed and
agree, and 1 where it was found from where it had been, 0 where by features in all of the image."""


@dataclass(frozen=True, eq=False)
class TextureFinding:
    """Where a textured square was found in an image, and how well.

    Attributes:
        marks: Its corners (u, v) in the order of a tag's, shape (8,) [px].
        alignment: How its picture lies in the image.
        followed: Whether it was found from where it had been, not by features in all of the image.
    """

    marks: Array
    alignment: Alignment
    followed: bool

    def quality(self) -> Array:
        """The numbers that `QUALITY` names, shape (5,)."""
        a = self.alignment
        return np.array([a.deviation(), a.correlation, a.share, a.points, self.followed], float)


class TexturedTarget(PointTarget):
    """A square with a texture, without a rim; its marks are its corners, as a tag's."""

    quality = QUALITY

    def __init__(self, texture: str, size: float) -> None:
        """For one of `TEXTURES` on a square of edge `size` [m]."""
        self.points = self.outline = tag_corners(size)
        self.size = 8
        self._texture, self._edge = texture, size

    @property
    def picture(self) -> np.ndarray:
        """How it looks, shape (n, n), 8 bits, grey."""
        return texture_picture(self._texture)

    def find(self, rgb: np.ndarray) -> Array | None:
        """As the base class says, by features."""
        found = self.look(rgb)
        return None if found is None else found.marks

    def follow(self, rgb: np.ndarray, before: Array | None) -> Array | None:
        """As the base class says."""
        found = self.look(rgb, before)
        return None if found is None else np.concatenate([found.marks, found.quality()])

    def look(self, rgb: np.ndarray, before: Array | None = None) -> TextureFinding | None:
        """Marks and all that is known of them, or None where it is not found, or not well enough.

        Corners may lie outside the image: what is seen of the square says where they are.

        Args:
            rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
            before: Marks in the image before, shape (8,) [px]; None: it was not seen.
        """
        gray = gray_image(rgb)
        if before is not None and is_square_seen(before.reshape(4, 2).T, LEAST_DIAGONAL):
            found = align(self.picture, gray, homography(CORNERS, before.reshape(4, 2).T))
            if found is not None and _is_good(found, gray.shape):
                return TextureFinding(found.corners.T.ravel(), found, True)
        anywhere = detect(self.picture, gray)
        if anywhere is None:
            return None
        found = align(self.picture, gray, anywhere[0])
        if found is None or not _is_good(found, gray.shape):
            return None
        return TextureFinding(found.corners.T.ravel(), found, False)

    def plates(self) -> list[Plate]:
        """What it looks like."""
        return [Plate(RigidTransform(), picture_png(self.picture), self._edge)]


def _is_good(found: Alignment, shape: tuple[int, ...]) -> bool:
    """Whether what lies over the image looks like it, and shows well enough where it is."""
    whole = found.share >= WHOLE_SHARE
    return (
        is_square_seen(found.corners, LEAST_DIAGONAL)
        and found.share >= LEAST_SHARE
        and found.correlation >= (LEAST_WHOLE_CORRELATION if whole else LEAST_CORRELATION)
        and found.deviation() <= LARGEST_DEVIATION
        and view_share(found.corners, shape) >= LEAST_VIEW
    )


def view_share(corners: Array, shape: tuple[int, ...]) -> float:
    """Share of a square's image that lies within the image, 0..1.

    Args:
        corners: Its corners, shape (2, 4) [px].
        shape: Height and width of the image.
    """
    square = corners.T.astype(np.float32)
    height, width = shape[:2]
    rim = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32) - 0.5
    return float(cv2.intersectConvexConvex(square, rim)[0]) / max(cv2.contourArea(square), 1.0)
