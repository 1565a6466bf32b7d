"""Brightness of a color image, which is what targets are found in."""

from __future__ import annotations

import cv2
import numpy as np


def gray_image(rgb: np.ndarray) -> np.ndarray:
    """Brightness of an image, shape (height, width), 8 bits.

    A fourth channel is passed over by the conversion itself: three channels cut out of four are
    not contiguous, and OpenCV copies them first, which takes ten times as long or more.

    Args:
        rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
    """
    code = cv2.COLOR_RGBA2GRAY if rgb.shape[2] == 4 else cv2.COLOR_RGB2GRAY
    return np.asarray(cv2.cvtColor(rgb, code))
