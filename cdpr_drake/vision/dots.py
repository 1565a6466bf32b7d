"""Four dots on a square as a target, one of them larger, so that they can be told apart."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.vision.apriltags import tag_corners
from cdpr_drake.vision.blob_detection import Blob, find_dark_blobs
from cdpr_drake.vision.pinhole import Pinhole, crossing_diagonals
from cdpr_drake.vision.target import Plate, PointTarget, blank_picture, draw_disc, picture_png

DOT_SHARE = 0.13
"""Radius of three dots, per edge of the square."""

FIRST_SHARE = 0.19
"""Radius of the first one, at the upper left."""

PLATE_SHARE = 1.7
"""Edge of the white plate, per edge of the square."""

AREA_FACTOR = 1.4
"""By so much a dot's area may be off on the plate; those of the two kinds differ by 2.1, and a dot
is not so small that its area scales as that at its centre."""

LEAST_TURN = 1e-3
"""Share of the largest corner's triangle below which a corner counts as flat."""

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
        best, best_off = None, np.inf
        for four in combinations(blobs, 4):
            square = _square(four)
            if square is not None and square[1] < best_off:
                best, best_off = square
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
    """Centres in order from the larger dot on, and how far the dots' areas are from those of a
    square in space.

    Four points are images of a square's corners under one homography from its plane, which at the
    corners scales areas by |det H| / w^3, with w its denominator there. So areas are compared on
    the plate and not in the image, where those of equal dots that are near and tilted differ by
    more than those of the two kinds of dots.
    """
    centers = np.array([blob.center for blob in four])
    # With v down, growing angles go from upper left to upper right, as `tag_corners` does.
    turned = np.argsort(np.arctan2(*(centers - centers.mean(axis=0)).T[::-1]))
    around, areas = centers[turned], np.array([four[k].area() for k in turned])
    scales = _corner_scales(around)
    if scales is None:
        return None
    on_plate = areas / scales
    first = int(np.argmax(on_plate))
    shares = np.array([FIRST_SHARE, DOT_SHARE, DOT_SHARE, DOT_SHARE])
    off = np.log(np.roll(on_plate, -first) / (np.pi * shares**2))
    worst = float(np.max(np.abs(off)))
    return None if worst > np.log(AREA_FACTOR) else (np.roll(around, -first, axis=0).ravel(), worst)


def _corner_scales(corners: Array) -> Array | None:
    """Areas at the images of a unit square's corners, per area there, shape (4,) [px^2].

    Source of the homography: Heckbert, Fundamentals of texture mapping and image warping, 1989.

    Args:
        corners: Images in the order around, shape (4, 2) [px].

    Returns:
        None where the corners are not those of a convex figure.
    """
    sides = np.roll(corners, -1, axis=0) - corners
    turns = sides[:, 0] * np.roll(sides[:, 1], -1) - sides[:, 1] * np.roll(sides[:, 0], -1)
    if np.min(turns) <= LEAST_TURN * np.max(np.abs(turns)):
        return None
    p0, p1, p2, p3 = corners
    one, two, rest = p1 - p2, p3 - p2, p0 - p1 + p2 - p3
    area = one[0] * two[1] - one[1] * two[0]
    g = (rest[0] * two[1] - rest[1] * two[0]) / area
    h = (one[0] * rest[1] - one[1] * rest[0]) / area
    H = np.column_stack([[*(p1 - p0 + g * p1), g], [*(p3 - p0 + h * p3), h], [*p0, 1.0]])
    return np.asarray(abs(np.linalg.det(H)) / np.array([1.0, 1.0 + g, 1.0 + g + h, 1.0 + h]) ** 3)
