"""AprilTags of family 36h11: their picture, their detection, and their pose from four corners."""

from __future__ import annotations

import cv2
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.pinhole import Pinhole

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
    """Finds one AprilTag 36h11 in images, with corners refined to fractions of a pixel."""

    def __init__(self, tag_id: int) -> None:
        """Looks for the tag of this identity, 0..586."""
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
        family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self._detector = cv2.aruco.ArucoDetector(family, parameters)
        self._tag_id = tag_id

    def find(self, rgb: np.ndarray) -> Array | None:
        """Corners (u, v) of the tag, shape (2, 4) [px], order of `tag_corners`; None if not seen.

        Args:
            rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
        """
        gray = cv2.cvtColor(rgb[:, :, :3], cv2.COLOR_RGB2GRAY)
        corners, ids, _ = self._detector.detectMarkers(gray)
        if ids is None:
            return None
        for found, tag_id in zip(corners, np.ravel(ids), strict=True):
            if tag_id == self._tag_id:
                return np.asarray(found.reshape(4, 2).T, float) - REFINEMENT_OFFSET
        return None


class TagPoseSolver:
    """Pose of a tag of known size from its four corners in the image."""

    def __init__(self, size: float, pinhole: Pinhole) -> None:
        """For tags of edge `size` [m] seen by the camera `pinhole`."""
        self._points = np.ascontiguousarray(tag_corners(size).T)
        self._K = pinhole.matrix()

    def solve(self, corners: Array) -> RigidTransform | None:
        """X_CO of the tag frame O in the camera frame C [m], or None if OpenCV finds no pose.

        OpenCV's IPPE_SQUARE gives the two poses that a square can have in weak perspective. Each
        is refined by least squares over the reprojection, since IPPE alone turns a noise of e
        pixels on a tag of n pixels into a tilt of sqrt(2 e / n) when the tag faces the camera; the
        pose with the smaller reprojection error is returned. IPPE breaks down where the rotation
        is exactly a half turn, as it is for an upright tag that faces the camera, and may leave
        only the wrong one of its two poses; so OpenCV's iterative method is always asked too.

        Args:
            corners: (u, v) of the corners, shape (2, 4) [px], in the order of `tag_corners`.

        Source: Collins and Bartoli, Infinitesimal plane-based pose estimation, 2014.
        """
        image = np.ascontiguousarray(corners.T)
        best, best_error = None, np.inf
        for method in (cv2.SOLVEPNP_IPPE_SQUARE, cv2.SOLVEPNP_ITERATIVE):
            count, vectors, positions, _ = cv2.solvePnPGeneric(
                self._points, image, self._K, None, flags=method
            )
            for r, p in zip(vectors[:count], positions[:count], strict=True):
                r, p = cv2.solvePnPRefineLM(self._points, image, self._K, None, r, p)
                again = cv2.projectPoints(self._points, r, p, self._K, None)[0].reshape(4, 2)
                error = float(np.sum(np.square(again - image)))
                if error < best_error and p[2, 0] > 0.0:
                    R = RotationMatrix.ProjectToRotationMatrix(cv2.Rodrigues(r)[0])
                    best, best_error = RigidTransform(R, np.ravel(p)), error
        return best


def tag_center(corners: Array) -> Array:
    """Image of the tag's middle, (2,) [px]: where the diagonals of the corners, (2, 4), meet."""
    a, b, c, d = corners.T
    across = np.column_stack([c - a, b - d])
    share = np.linalg.solve(across, b - a)
    return np.asarray(a + share[0] * (c - a), float)
