"""The pictures that targets carry."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydrake.math import RigidTransform

PICTURE_PIXELS = 640


@dataclass(frozen=True)
class Plate:
    """A square with a picture on it.

    Attributes:
        X_OT: Pose of its frame T in the object: x right, y up, z out of the picture.
        png: The picture, a PNG file.
        width: Edge [m].
    """

    X_OT: RigidTransform
    png: bytes
    width: float


def blank_picture() -> np.ndarray:
    """A white picture, 8 bits, grey."""
    return np.full((PICTURE_PIXELS, PICTURE_PIXELS), 255, np.uint8)


def draw_disc(picture: np.ndarray, middle: tuple[float, float], radius: float, gray: int) -> None:
    """Draws a disc with smooth edges; positions are from the picture's upper left corner [px]."""
    v, u = np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5
    share = np.clip(radius + 0.5 - np.hypot(u - middle[0], v - middle[1]), 0.0, 1.0)
    picture[:] = np.round((1.0 - share) * picture + share * gray)


def picture_png(picture: np.ndarray) -> bytes:
    """The PNG file of a picture."""
    return bytes(cv2.imencode(".png", picture)[1].tobytes())
