"""Pictures of files, as small as they can be without a loss that is seen."""

from __future__ import annotations

import base64
from pathlib import Path

import cv2
import numpy as np

WIDEST = 1500
"""Wider pictures are made so wide [px]."""


def embedded(path: Path) -> str | None:
    """A PNG file as the address of a picture that a page holds itself; None if it is none."""
    content = small_png(path)
    if content is None:
        return None
    return "data:image/png;base64," + base64.b64encode(content).decode("ascii")


def small_png(path: Path) -> bytes | None:
    """What a PNG file holds; None if it is none.

    Pictures wider than `WIDEST` are made smaller, which a page does not show anyway.
    """
    try:
        content = path.read_bytes()
    except OSError:
        return None
    picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        return None
    height, width = picture.shape[:2]
    if width <= WIDEST:
        return content
    size = (WIDEST, round(height * WIDEST / width))
    picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    smaller = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
    return min(content, smaller, key=len)
