"""Draws what a camera sees of a target, without a renderer: each pixel the mean of samples."""

from __future__ import annotations

import cv2
import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.vision import Pinhole, Target, tag_corners

SAMPLES = 4
"""Along a pixel."""


def drawn_image(
    target: Target, X_CO: RigidTransform, pinhole: Pinhole, *, ground: int = 150
) -> np.ndarray:
    """An image of a target's plates on a plain ground, shape (height, width, 3), 8 bits.

    Args:
        target: What is drawn; its plates do not hide each other.
        X_CO: Its pose in the camera [m]; all corners of its plates lie before the camera.
        pinhole: The camera.
        ground: Gray of what is round it, 0..255.
    """
    size = (SAMPLES * pinhole.width, SAMPLES * pinhole.height)
    samples = np.full(size[::-1], ground, np.uint8)
    for plate in target.plates():
        picture = cv2.imdecode(np.frombuffer(plate.png, np.uint8), cv2.IMREAD_GRAYSCALE)
        # The last pixel's middle is not its rim: what is beyond is that pixel, too.
        n, wider = picture.shape[0], 4
        fine = cv2.resize(picture, (wider * n, wider * n), interpolation=cv2.INTER_LINEAR)
        edge = wider * n
        source = np.array([[0, 0], [edge, 0], [edge, edge], [0, edge]], np.float32) - 0.5
        rim = pinhole.project(X_CO @ plate.X_OT @ tag_corners(plate.width)).T
        place = ((rim + 0.5) * SAMPLES - 0.5).astype(np.float32)
        H = cv2.getPerspectiveTransform(source, place)
        where = cv2.warpPerspective(np.full_like(fine, 255), H, size, flags=cv2.INTER_NEAREST)
        drawn = cv2.warpPerspective(fine, H, size, borderMode=cv2.BORDER_REPLICATE)
        cv2.copyTo(drawn, where, samples)
    gray = cv2.resize(samples, (pinhole.width, pinhole.height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(gray, cv2.COLOR_GRAY2RGB))
