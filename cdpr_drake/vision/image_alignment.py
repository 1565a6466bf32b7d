"""Lays a picture over an image to a fraction of a pixel, from where it about is.

A homography H takes places on the picture's square to pixels. The square has x to the right and y
up, its corners at (-1, 1), (1, 1), (1, -1), (-1, -1), the order of a tag's.

First points: corners of the picture as it would look are followed into the image (Lucas and
Kanade), and RANSAC takes those that move as a plane. Then all pixels: Gauss-Newton steps on what is
left of brightness (Baker and Matthews), with the gradient of the predicted image, which has no
noise, brightness and contrast free, and weights (Tukey) that leave out what is covered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from cdpr_drake.arrays import Array

CORNERS = np.array([[-1.0, 1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0]])
"""Corners of the square, in the order of a tag's: upper left, upper right, lower right, lower
left."""

LARGEST = 320.0
"""Edge of a square in an image [px] from which on it is read at half the resolution, and so on: no
more accuracy would be won than the picture's own pixels have."""

REACH = 32
"""Pixels round the expected square in which points are followed."""

RIM = 3.0
"""Pixels along the rim of the square that are not read: smoothed edges show what is beside it."""

POINTS, FEWEST_POINTS = 150, 8
"""Most points that are followed, and fewest that must agree on a homography."""

POINT_TOLERANCE = 1.5
"""By how much a followed point may be off [px]."""

ROUNDS, SETTLED = 12, 2e-3
"""Most Gauss-Newton steps, and the motion of a corner in one that ends them [px]."""

PIXELS = 8000
"""About the most pixels that are compared, those with the steepest brightness: the others tell
little of where they are."""

TUKEY = 4.685
"""Standard deviations beyond which a pixel is covered by something, by Tukey's function."""

UNCOVERED = 0.4
"""Share of the pixels that is not covered, at least: the spread of what is left is told by as many
of the smallest."""

_UNIT = 0.5244
"""The same share of normal numbers lies between this and its negative."""

_PAIRS = 100
"""Pairs of pixels that are tried for a first contrast and brightness."""

MIDDLE_GRAY, LEAST_GAIN = 128.0, 0.2
"""Gray whose brightness is free, and least contrast of an image over the picture's."""

LEAST_SPREAD = 3.0
"""Spread of what is left that is always borne with, of 255: pixels are whole numbers, and what
draws smooths."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where a picture lies in an image, and how well that is known.

    Attributes:
        H: Homography of the square to pixels, shape (3, 3), its last number 1.
        corners: The square's corners in the image, shape (2, 4) [px].
        covariance: Of the corners (u, v), one after the other, shape (8, 8) [px^2], as if pixels
            erred independently.
        share: Share of the pixels that were compared that look like the picture, 0..1.
        correlation: Of those pixels with the picture, -1..1.
        points: Points that were followed and agree; 0 where there were too few.
    """

    H: Array
    corners: Array
    covariance: Array
    share: float
    correlation: float
    points: int

    def deviation(self) -> float:
        """Largest standard deviation of a corner along u or v [px]."""
        return float(np.sqrt(np.max(np.diag(self.covariance))))


def align(picture: np.ndarray, image: np.ndarray, H: Array) -> Alignment | None:
    """Where a picture is, from about where it is; None where it is not there.

    What comes back may be wrong where H was: its share and correlation say so.

    Args:
        picture: The square as it looks, shape (n, n), 8 bits, grey.
        image: Shape (height, width), 8 bits, grey.
        H: Homography of the square to pixels, shape (3, 3), off by at most some tens of pixels.
    """
    halvings = _halvings(H)
    down = np.linalg.matrix_power(_HALF, halvings)
    small = _reduced(image, halvings)
    with np.errstate(all="ignore"):
        found = _align(picture, small, down @ H)
    return None if found is None else _at_full_size(found, np.linalg.inv(down), 2.0**halvings)


_HALF = np.array([[0.5, 0.0, -0.25], [0.0, 0.5, -0.25], [0.0, 0.0, 1.0]])
"""Pixels of an image to those of one with half its resolution."""


def _align(picture: np.ndarray, image: np.ndarray, H: Array) -> Alignment | None:
    # What is small has few points to follow, and moves by few pixels.
    followed = _follow(picture, image, H)
    return _refine(picture, image, *((H, 0) if followed is None else followed))


def homography(points: Array, pixels: Array) -> Array:
    """The homography that takes four points to four pixels, shapes (2, 4), last number 1."""
    H = cv2.getPerspectiveTransform(
        np.ascontiguousarray(points.T, np.float32), np.ascontiguousarray(pixels.T, np.float32)
    )
    return np.asarray(H, float)


def mapped(H: Array, points: Array) -> Array:
    """Points, shape (2, n), by a homography, shape (2, n)."""
    x = H[:, :2] @ points + H[:, 2:]
    return np.asarray(x[:2] / x[2])


def is_square_seen(corners: Array, least: float) -> bool:
    """Whether corners, shape (2, 4) [px], are those of a square that is seen from its front.

    Its image is convex, turned as it is, and its diagonals are at least `least` long [px].
    """
    if not np.all(np.isfinite(corners)):
        return False
    edge = np.roll(corners, -1, axis=1) - corners
    following = np.roll(edge, -1, axis=1)
    turns = edge[0] * following[1] - edge[1] * following[0]
    diagonals = np.linalg.norm(corners[:, :2] - corners[:, 2:], axis=0)
    return bool(np.all(turns > 0.0) and np.min(diagonals) >= least)


def _halvings(H: Array) -> int:
    corners = mapped(H, CORNERS)
    edge = float(np.max(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=0)))
    return int(max(0.0, np.ceil(np.log2(edge / LARGEST)))) if np.isfinite(edge) else 0


def _reduced(image: np.ndarray, halvings: int) -> np.ndarray:
    for _ in range(halvings):
        height, width = image.shape[0] // 2, image.shape[1] // 2
        image = cv2.resize(
            image[: 2 * height, : 2 * width], (width, height), interpolation=cv2.INTER_AREA
        )
    return image


def _at_full_size(found: Alignment, up: Array, scale: float) -> Alignment:
    H = up @ found.H
    return Alignment(
        H / H[2, 2], mapped(up, found.corners), scale**2 * found.covariance, found.share,
        found.correlation, found.points,
    )  # fmt: skip


@lru_cache(maxsize=16)
def _levels(data: bytes, edge: int) -> tuple[np.ndarray, ...]:
    """A picture and its halves, quarters, ... down to 16 pixels."""
    level = np.frombuffer(data, np.uint8).reshape(edge, edge).astype(np.float32)
    levels = [level]
    while levels[-1].shape[0] >= 32:
        half = levels[-1].shape[0] // 2
        levels.append(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA))
    return tuple(levels)


@dataclass(frozen=True, eq=False)
class _Prediction:
    """How a picture looks by a homography, in a window of an image.

    Attributes:
        left: First column of the window.
        top: First row.
        gray: Shape (h, w), single precision.
        inside: Where the square is, `RIM` off its edges, shape (h, w).
    """

    left: int
    top: int
    gray: np.ndarray
    inside: np.ndarray


def _predict(
    picture: np.ndarray, shape: tuple[int, ...], H: Array, margin: int
) -> _Prediction | None:
    """The prediction in the square's window; None where that is not in the image."""
    corners = mapped(H, CORNERS)
    if not is_square_seen(corners, 12.0):
        return None
    low = np.floor(corners.min(axis=1)).astype(int) - margin
    high = np.ceil(corners.max(axis=1)).astype(int) + margin + 1
    left, top = np.maximum(low, 0)
    right, bottom = np.minimum(high, [shape[1], shape[0]])
    if right - left < 16 or bottom - top < 16:
        return None
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=0)
    levels = _levels(picture.tobytes(), picture.shape[0])
    # The level whose pixels are next smaller than those of the image.
    number = int(np.clip(np.log2(picture.shape[0] / np.mean(edges)), 0, len(levels) - 1))
    level = levels[number]
    n = level.shape[0]
    to_window = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
    from_picture = np.array([[2.0 / n, 0.0, 1.0 / n - 1.0], [0.0, -2.0 / n, 1.0 - 1.0 / n],
                             [0.0, 0.0, 1.0]])  # fmt: skip
    size = (int(right - left), int(bottom - top))
    gray = cv2.warpPerspective(
        level, to_window @ H @ from_picture, size, flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    inside = np.zeros(gray.shape, np.uint8)
    inner = mapped(to_window @ H, CORNERS * (1.0 - 2.0 * RIM / np.min(edges)))
    cv2.fillConvexPoly(inside, np.round(inner.T * 16).astype(np.int32), 1, shift=4)
    return _Prediction(int(left), int(top), gray, inside.astype(bool))


def _window(image: np.ndarray, seen: _Prediction) -> np.ndarray:
    height, width = seen.gray.shape
    return image[seen.top : seen.top + height, seen.left : seen.left + width]


def _follow(picture: np.ndarray, image: np.ndarray, H: Array) -> tuple[Array, int] | None:
    """A better homography from points that are followed, and how many agree."""
    seen = _predict(picture, image.shape, H, REACH)
    if seen is None or np.sum(seen.inside) < 256:
        return None
    window = np.ascontiguousarray(_window(image, seen))
    there, here = window[seen.inside], seen.gray[seen.inside]
    contrast = float(np.std(there) / max(np.std(here), 1e-3))
    same = (seen.gray - np.mean(here)) * contrast + np.mean(there)
    predicted = np.clip(np.round(same), 0, 255).astype(np.uint8)
    spots = cv2.goodFeaturesToTrack(
        predicted, POINTS, 0.02, 3.0, mask=seen.inside.astype(np.uint8), blockSize=5
    )
    if spots is None or len(spots) < FEWEST_POINTS:
        return None
    moved, status, _ = cv2.calcOpticalFlowPyrLK(
        predicted, window, spots, None, winSize=(15, 15), maxLevel=2
    )
    good = status.ravel() == 1
    if np.sum(good) < FEWEST_POINTS:
        return None
    motion, agree = cv2.findHomography(spots[good], moved[good], cv2.RANSAC, POINT_TOLERANCE)
    count = 0 if agree is None else int(np.sum(agree))
    if motion is None or count < FEWEST_POINTS:
        return None
    shift = np.array([[1.0, 0.0, seen.left], [0.0, 1.0, seen.top], [0.0, 0.0, 1.0]])
    better = shift @ motion @ np.linalg.inv(shift) @ H
    return better / better[2, 2], count


def _refine(picture: np.ndarray, image: np.ndarray, H: Array, points: int) -> Alignment | None:
    """Gauss-Newton steps from a homography that is off by at most a pixel or two."""
    N, weights, here, there, left = np.eye(8), np.ones(1), np.ones(1), np.ones(1), np.ones(1)
    gain, offset = 1.0, 0.0
    corners = mapped(H, CORNERS)
    for number in range(ROUNDS):
        seen = _predict(picture, image.shape, H, 2)
        if seen is None or np.sum(seen.inside) < 256:
            return None
        slope_u = cv2.Sobel(seen.gray, cv2.CV_32F, 1, 0, ksize=1)
        slope_v = cv2.Sobel(seen.gray, cv2.CV_32F, 0, 1, ksize=1)
        v, u = _telling(seen.inside, slope_u, slope_v)
        here = seen.gray[v, u].astype(float)
        there = _window(image, seen)[v, u].astype(float)
        # Coordinates about the middle of the square, of a size near one.
        middle, scale = corners.mean(axis=1), 0.5 * float(np.ptp(corners, axis=1).max())
        x = (u + seen.left - middle[0]) / scale
        y = (v + seen.top - middle[1]) / scale
        gx, gy = (
            0.5 * scale * slope_u[v, u].astype(float),
            0.5 * scale * slope_v[v, u].astype(float),
        )
        if number == 0:
            gain, offset = _first_brightness(here - MIDDLE_GRAY, there)
        along = gx * x + gy * y
        J = -gain * np.stack([gx * x, gx * y, gx, gy * x, gy * y, gy, -along * x, -along * y])
        left = there - gain * (here - MIDDLE_GRAY) - offset
        spread = max(float(np.quantile(np.abs(left), UNCOVERED)) / _UNIT, LEAST_SPREAD)
        weights = np.square(np.clip(1.0 - np.square(left / (TUKEY * spread)), 0.0, None))
        # Brightness and contrast move with the rest.
        rows = np.concatenate([J, [here - MIDDLE_GRAY, np.ones_like(here)]])
        weighted = rows * weights
        N = weighted @ rows.T
        try:
            step = np.linalg.solve(N, weighted @ left)
        except np.linalg.LinAlgError:
            return None
        gain, offset = max(gain + step[8], LEAST_GAIN), offset + step[9]
        W = np.append(step[:8], 1.0).reshape(3, 3)
        W[0, 0] += 1.0
        W[1, 1] += 1.0
        about = np.array([[scale, 0.0, middle[0]], [0.0, scale, middle[1]], [0.0, 0.0, 1.0]])
        H = about @ W @ np.linalg.inv(about) @ H
        H = H / H[2, 2]
        moved = mapped(H, CORNERS)
        change, corners = float(np.max(np.abs(moved - corners))), moved
        if not is_square_seen(corners, 12.0) or not change < 20.0:
            return None
        if change < SETTLED:
            break
    good = weights > 0.0
    if np.sum(good) < 128:
        return None
    error = np.sum(weights * np.square(left)) / max(np.sum(weights) - 10.0, 1.0)
    C = error * np.linalg.inv(N)[:8, :8]
    D = _corner_slopes((corners - middle[:, None]) / scale, scale)
    share = float(np.mean(good))
    correlation = float(np.corrcoef(here[good], there[good])[0, 1])
    return Alignment(H, corners, D @ C @ D.T, share, correlation, points)


def _first_brightness(here: Array, there: Array) -> tuple[float, float]:
    """Contrast and brightness by which `UNCOVERED` of the pixels fit best, by pairs of pixels.

    What covers a part would bend a fit to all of them so much that nothing stood out.
    """
    random = np.random.default_rng(0)
    some = random.integers(0, len(here), min(len(here), 600))
    i, j = random.integers(0, len(here), (2, _PAIRS))
    apart = np.abs(here[i] - here[j]) > 0.5 * np.std(here)
    i, j = i[apart], j[apart]
    if len(i) == 0:
        return 1.0, float(np.median(there - here))
    gains = np.clip((there[i] - there[j]) / (here[i] - here[j]), LEAST_GAIN, 1.0 / LEAST_GAIN)
    offsets = 0.5 * (there[i] + there[j] - gains * (here[i] + here[j]))
    left = np.abs(there[some] - gains[:, None] * here[some] - offsets[:, None])
    best = int(np.argmin(np.quantile(left, UNCOVERED, axis=1)))
    return float(gains[best]), float(offsets[best])


def _corner_slopes(xy: Array, scale: float) -> Array:
    """How corners (u, v), one after the other, move with the eight parameters, shape (8, 8)."""
    D = np.zeros((8, 8))
    for k, (x, y) in enumerate(xy.T):
        D[2 * k] = scale * np.array([x, y, 1.0, 0.0, 0.0, 0.0, -x * x, -x * y])
        D[2 * k + 1] = scale * np.array([0.0, 0.0, 0.0, x, y, 1.0, -x * y, -y * y])
    return D


def _telling(inside: np.ndarray, slope_u: np.ndarray, slope_v: np.ndarray) -> tuple[Any, ...]:
    """Rows and columns of the pixels that are compared."""
    steep = np.square(slope_u) + np.square(slope_v)
    each = steep[inside]
    if len(each) <= PIXELS:
        rows, columns = np.nonzero(inside)
        return rows, columns
    # From a part of them: to sort all takes longer than all the rest.
    some = each[:: max(1, len(each) // 4000)]
    least = np.quantile(some, 1.0 - PIXELS / len(each))
    rows, columns = np.nonzero(inside & (steep >= least))
    return rows, columns
