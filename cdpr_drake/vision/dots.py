"""Four dots on a square as a target, one of them larger, so that they can be told apart."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.apriltag import tag_corners
from cdpr_drake.vision.dark_blobs import Blob, find_dark_blobs
from cdpr_drake.vision.marks_kernel import crossing_diagonals
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.plates import Plate, blank_picture, draw_disc, picture_png
from cdpr_drake.vision.target import PointTarget

DOT_SHARE = 0.13
"""Radius of three dots, per edge of the square."""

FIRST_SHARE = 0.19
"""Radius of the first one, at the upper left."""

PLATE_SHARE = 1.7
"""Edge of the white plate, per edge of the square."""

_CANDIDATES = 8


class DotTarget(PointTarget):
    """Four dark dots on a white plate; the marks are the dots' centres, the larger one first.

    The order is that of `tag_corners`. The centre of a dot's image is taken for the image of its
    centre, which is exact where the plate is parallel to the image.
    """

    def __init__(self, size: float) -> None:
        """For dots at the corners of a square with edge `size` [m]."""
        self.points = tag_corners(size)
        self.outline = PLATE_SHARE * self.points
        self.size = 8
        self._edge = size

    def find(self, rgb: np.ndarray) -> Array | None:
        """As the base class says."""
        blobs = [blob for blob in find_dark_blobs(rgb) if blob.holes == 0][:_CANDIDATES]
        best, best_skew = None, 0.2
        for four in combinations(blobs, 4):
            square = _square(four)
            if square is not None and square[1] < best_skew:
                best, best_skew = square
        return best

    def center(self, marks: Array, X_CO: RigidTransform, pinhole: Pinhole) -> Array:
        """Where the diagonals meet in the image, at unit focal length, shape (2,) [-]."""
        middle = np.empty(2)
        crossing_diagonals(marks, pinhole.numbers, middle)
        return middle

    def plates(self) -> list[Plate]:
        """What it looks like."""
        width = PLATE_SHARE * self._edge
        picture = blank_picture()
        cells = len(picture)
        for k, point in enumerate(self.points.T):
            share = FIRST_SHARE if k == 0 else DOT_SHARE
            middle = (0.5 + point[0] / width) * cells, (0.5 - point[1] / width) * cells
            draw_disc(picture, middle, share * self._edge / width * cells, 0)
        return [Plate(RigidTransform(), picture_png(picture), width)]


def _square(four: tuple[Blob, ...]) -> tuple[Array, float] | None:
    """Centres in order from the larger dot on, and how far they are from a parallelogram."""
    areas = np.array([blob.area() for blob in four])
    order = np.argsort(-areas)
    if areas[order[0]] < 1.3 * areas[order[1]] or areas[order[1]] > 3.0 * areas[order[3]]:
        return None
    centers = np.array([blob.center for blob in four])
    middle = centers.mean(axis=0)
    # With v down, growing angles go from upper left to upper right, as `tag_corners` does.
    angles = np.arctan2(*(centers - middle).T[::-1])
    around = centers[np.argsort(angles)]
    first = int(np.argmin(np.linalg.norm(around - centers[order[0]], axis=1)))
    a, b, c, d = np.roll(around, -first, axis=0)
    skew = float(np.linalg.norm(a + c - b - d)) / max(float(np.linalg.norm(c - a)), 1e-9)
    return np.concatenate([a, b, c, d]), skew
