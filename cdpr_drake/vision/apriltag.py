"""AprilTags of family 36h11: their picture and their detection."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.vision.brightness import gray_image
from cdpr_drake.vision.marks_kernel import crossing_diagonals

TAG_CELLS = 8
"""Cells along the black square, the edge that `size` means."""

BORDERED_CELLS = 10
"""Cells along the picture with its white rim."""

TAG_COUNT = 587
"""Tags in the family 36h11, identities 0..586."""

_CELL_PIXELS = 64

REFINEMENT_OFFSET = 0.44
"""OpenCV's AprilTag refinement reports corners this far to the right and down [px], measured on
drawn tags of 60 to 260 px: it counts from the corner of a pixel, not from its middle."""


def tag_png(tag_id: int) -> bytes:
    """PNG file of a tag with a white rim of one cell, upright as OpenCV draws it."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    picture = cv2.aruco.generateImageMarker(family, tag_id, TAG_CELLS * _CELL_PIXELS)
    rim = _CELL_PIXELS * (BORDERED_CELLS - TAG_CELLS) // 2
    bordered = cv2.copyMakeBorder(picture, rim, rim, rim, rim, cv2.BORDER_CONSTANT, value=255)
    return bytes(cv2.imencode(".png", bordered)[1].tobytes())


def tag_corners(size: float) -> Array:
    """Corners of the black square in the tag frame O, shape (3, 4) [m].

    O lies in the middle of the tag, x right, y up, z out of it. The order is that of OpenCV: upper
    left, upper right, lower right, lower left.

    Args:
        size: Edge of the black square [m].
    """
    h = size / 2.0
    return np.array([[-h, h, h, -h], [h, h, -h, -h], [0.0, 0.0, 0.0, 0.0]])


class TagFinder:
    """Finds AprilTags 36h11 in images, with corners refined to fractions of a pixel."""

    def __init__(self, tag_ids: Sequence[int]) -> None:
        """Looks for tags of these identities, 0..586."""
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self._detector = cv2.aruco.ArucoDetector(family, parameters)
        self._tag_ids = frozenset(tag_ids)

    def __reduce__(self) -> tuple[type[TagFinder], tuple[tuple[int, ...]]]:
        """How it gets into other processes: OpenCV's detector does not, so it is made again."""
        return TagFinder, (tuple(sorted(self._tag_ids)),)

    def find(self, rgb: np.ndarray) -> dict[int, Array]:
        """Corners (u, v), shape (2, 4) [px], order of `tag_corners`, by identity of those seen.

        Args:
            rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
        """
        gray = gray_image(rgb)
        corners, ids, _ = self._detector.detectMarkers(gray)
        if ids is None:
            return {}
        return {
            int(tag_id): np.asarray(four.reshape(4, 2).T, float) - REFINEMENT_OFFSET
            for four, tag_id in zip(corners, np.ravel(ids), strict=True)
            if int(tag_id) in self._tag_ids
        }


_NO_CAMERA = np.array([1.0, 1.0, 0.0, 0.0])
"""Numbers of a pinhole that leave pixels as they are."""


def tag_center(corners: Array) -> Array:
    """Image of the tag's middle, (2,) [px]: where the diagonals of the corners, (2, 4), meet."""
    middle = np.empty(2)
    crossing_diagonals(np.ravel(corners.T), _NO_CAMERA, middle)
    return middle
