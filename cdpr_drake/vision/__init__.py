"""What a camera looks at, and how it is found in an image.

A `Target` knows its points in its own frame O (x right, y up, z out of the pattern), the marks
that it leaves in an image, and how to get X_CO back from them. Pixels are (u right, v down) from
the centre of the first pixel; the camera frame C has z forward, x right, y down.

Source: Olson, AprilTag, 2011; OpenCV for detection and pose from points.
"""

from cdpr_drake.vision.apriltag import TAG_COUNT, tag_corners
from cdpr_drake.vision.brightness import gray_image
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.image_window import (
    ImageWindow,
    expected_window,
    target_box,
    union,
    whole_image,
    window_round,
    with_principal_point,
)
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.plates import Plate, picture_png
from cdpr_drake.vision.rings import CircleTarget
from cdpr_drake.vision.tags import TagBundle, TagTarget, tag_plate
from cdpr_drake.vision.target import PointTarget, Target

__all__ = [
    "TAG_COUNT", "CircleTarget", "DotTarget", "ImageWindow", "Pinhole", "Plate", "PointTarget",
    "TagBundle", "TagTarget", "Target", "expected_window", "gray_image", "picture_png",
    "tag_corners", "tag_plate", "target_box", "union", "whole_image", "window_round",
    "with_principal_point",
]  # fmt: skip
