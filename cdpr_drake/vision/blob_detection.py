"""Dark ellipses in images, by which dots and circles are found, and the brightness of an image.

`gray_image` makes of a colour image what all targets are found in. Pixels are (u right, v down).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cdpr_drake.arrays import Array

SMALLEST_AREA = 40.0
"""Smaller blobs are not looked at [px^2]."""

ROUND = 0.06
"""Share of its area by which a blob may differ from the ellipse of the same moments."""

_MARGIN = 3


@dataclass(frozen=True)
class Blob:
    """A dark region whose outline is an ellipse.

    Attributes:
        center: (u, v) of its area, shape (2,) [px].
        moments: Second central moments (n20, n11, n02) of its area, divided by it [px^2].
        hole: The bright ellipse inside it, if it has exactly one; else None.
        holes: Number of holes.
    """

    center: Array
    moments: Array
    hole: Blob | None
    holes: int

    def area(self) -> float:
        """Area of the ellipse [px^2]."""
        n20, n11, n02 = self.moments
        return float(4.0 * np.pi * np.sqrt(max(n20 * n02 - n11 * n11, 0.0)))


def find_dark_blobs(rgb: np.ndarray) -> list[Blob]:
    """Dark ellipses of an image that do not touch its rim, largest first.

    The centre and moments come from grey values, so that they are good to fractions of a pixel.

    Args:
        rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
    """
    gray = gray_image(rgb)
    _, dark = cv2.threshold(gray, 0, 255, cv2.THRESH_BINARY_INV + cv2.THRESH_OTSU)
    contours, hierarchy = cv2.findContours(dark, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if hierarchy is None:
        return []
    blobs = []
    for k, contour in enumerate(contours):
        if hierarchy[0][k][3] >= 0:
            continue  # a hole
        children = _children(hierarchy[0], k)
        holes = [contours[j] for j in children if cv2.contourArea(contours[j]) > SMALLEST_AREA]
        blob = _blob(gray, contour, holes)
        if blob is not None:
            blobs.append(blob)
    return sorted(blobs, key=lambda blob: -blob.area())


def gray_image(rgb: np.ndarray) -> np.ndarray:
    """Brightness of an image, shape (height, width), 8 bits.

    A fourth channel is passed over by the conversion itself: three channels cut out of four are
    not contiguous, and OpenCV copies them first, which takes ten times as long or more.

    Args:
        rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
    """
    code = cv2.COLOR_RGBA2GRAY if rgb.shape[2] == 4 else cv2.COLOR_RGB2GRAY
    return np.asarray(cv2.cvtColor(rgb, code))


def _children(hierarchy: np.ndarray, parent: int) -> list[int]:
    children, child = [], int(hierarchy[parent][2])
    while child >= 0:
        children.append(child)
        child = int(hierarchy[child][0])
    return children


def _blob(gray: np.ndarray, contour: np.ndarray, holes: list[np.ndarray]) -> Blob | None:
    """The blob within an outline, or None where it is too small or no ellipse."""
    if cv2.contourArea(contour) < SMALLEST_AREA or len(holes) > 1:
        return None
    u, v, width, height = cv2.boundingRect(contour)
    low_u, low_v = u - _MARGIN, v - _MARGIN
    high_u, high_v = u + width + _MARGIN, v + height + _MARGIN
    if low_u < 0 or low_v < 0 or high_u > gray.shape[1] or high_v > gray.shape[0]:
        return None
    if not _is_ellipse(contour):
        return None
    patch = gray[low_v:high_v, low_u:high_u].astype(float)
    inside = _mask(patch.shape, contour, (low_u, low_v), _MARGIN)
    # Black and white of this blob: its darkest part and the rim around it.
    black = float(np.percentile(patch[inside], 2))
    white = float(np.max(patch[inside]))
    if white - black < 30.0:
        return None
    darkness = np.clip((white - patch) / (white - black), 0.0, 1.0)
    hole = None
    if holes:
        if not _is_ellipse(holes[0]):
            return None
        within = _mask(patch.shape, holes[0], (low_u, low_v), _MARGIN)
        center, moments = _moments((1.0 - darkness) * within, (low_u, low_v))
        hole = Blob(center, moments, None, 0)
        darkness = np.where(within, 1.0, darkness)
    center, moments = _moments(darkness * inside, (low_u, low_v))
    return Blob(center, moments, hole, len(holes))


def _is_ellipse(contour: np.ndarray) -> bool:
    """Whether an outline encloses what an ellipse with the same moments does."""
    m = cv2.moments(contour)
    if m["m00"] < SMALLEST_AREA / 2.0:
        return False
    determinant = (m["mu20"] * m["mu02"] - m["mu11"] ** 2) / m["m00"] ** 2
    ellipse = 4.0 * np.pi * np.sqrt(max(determinant, 0.0))
    hull = cv2.contourArea(cv2.convexHull(contour))
    return abs(ellipse - m["m00"]) < ROUND * ellipse and m["m00"] > (1.0 - 2.0 * ROUND) * hull


def _mask(
    shape: tuple[int, ...], contour: np.ndarray, corner: tuple[int, int], margin: int
) -> np.ndarray:
    """Pixels within an outline and a margin around it."""
    mask = np.zeros(shape, np.uint8)
    cv2.drawContours(mask, [contour - np.array(corner)], 0, 255, cv2.FILLED)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1, 2 * margin + 1))
    return np.asarray(cv2.dilate(mask, kernel)) > 0


def _moments(weights: np.ndarray, corner: tuple[int, int]) -> tuple[Array, Array]:
    """Centre, shape (2,) [px], and central moments over the area, shape (3,) [px^2]."""
    m = cv2.moments(weights)
    moments = np.array([m["mu20"], m["mu11"], m["mu02"]]) / m["m00"]
    # A pixel is a square: its own moments are not those of the shape.
    moments[[0, 2]] -= 1.0 / 12.0
    return np.array([m["m10"], m["m01"]]) / m["m00"] + corner, moments
