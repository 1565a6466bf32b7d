"""Finds a picture anywhere in an image, by features of both (SIFT) that fit one homography."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from cdpr_drake.arrays import Array

RATIO = 0.8
"""A match counts if the next best one is this much farther (Lowe, 7.1)."""

TOLERANCE = 3.0
"""By how much a feature may be off [px]; refinement is another's work."""

FEWEST = 8
"""Features that must agree: by chance, four of any match."""

_ROUNDS, _SURE = 2000, 0.999


def detect(picture: np.ndarray, image: np.ndarray) -> tuple[Array, int] | None:
    """About where a picture is in an image, or None.

    Args:
        picture: The square as it looks, shape (n, n), 8 bits, grey.
        image: Shape (height, width), 8 bits, grey.

    Returns:
        Homography of the square, with corners at -1 and 1, to pixels, shape (3, 3); features that
        agree.
    """
    spots, seen = _sift().detectAndCompute(image, None)
    if seen is None or len(seen) < FEWEST:
        return None
    best: dict[int, tuple[float, np.ndarray]] = {}
    for places, descriptors in _features(picture.tobytes(), picture.shape[0]):
        for match, *others in cv2.BFMatcher(cv2.NORM_L2).knnMatch(seen, descriptors, k=2):
            near = others and match.distance < RATIO * others[0].distance
            if near and match.distance < best.get(match.queryIdx, (np.inf,))[0]:
                best[match.queryIdx] = match.distance, places[match.trainIdx]
    if len(best) < FEWEST:
        return None
    here = np.array([place for _, place in best.values()], np.float32)
    there = np.array([spots[number].pt for number in best], np.float32)
    H, agree = cv2.findHomography(
        here, there, cv2.RANSAC, TOLERANCE, maxIters=_ROUNDS, confidence=_SURE
    )
    count = 0 if agree is None else int(np.sum(agree))
    if H is None or count < FEWEST:
        return None
    return np.asarray(H, float), count


def _sift() -> Any:
    return cv2.SIFT_create()


@lru_cache(maxsize=16)
def _features(data: bytes, edge: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """A picture's features as it is, at half and a quarter of its size, which are matched apart.

    A far picture loses its details, and with them the octaves of features that SIFT finds first.

    Returns:
        For each size, places on the square, shape (n, 2), and descriptors, shape (n, 128).
    """
    picture = np.frombuffer(data, np.uint8).reshape(edge, edge)
    found = []
    for part in (1, 2, 4):
        level = cv2.resize(picture, (edge // part, edge // part), interpolation=cv2.INTER_AREA)
        spots, described = _sift().detectAndCompute(level, None)
        if described is not None:
            at = (np.array([spot.pt for spot in spots]) + 0.5) * 2.0 / level.shape[0] - 1.0
            found.append(((at * [1.0, -1.0]).astype(np.float32), described))
    return found
