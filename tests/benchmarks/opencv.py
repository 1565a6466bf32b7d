"""The search for a textured square in an image against OpenCV's search for an AprilTag."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.texture_pictures import drawn_image
from cdpr_drake.vision.textured_target import TexturedTarget
from tests.benchmarks.ratios import Ratio, per_call, ratios

CALLS = 10


def benchmark() -> Iterator[Ratio]:
    """A square of 259 px in an image of 640 x 480 px, and a tag of the same size."""
    scenario = load_scenario("acrobot_pbvs_textured")
    mount = load_robot(scenario.robot).camera_mount("onboard")
    pinhole, X_CO = load_camera(mount.model).pinhole(640, 480), scenario.desired.transform()
    square, tag = TexturedTarget("stones", scenario.target.size), TagTarget(0, scenario.target.size)
    marks = square.project(X_CO, pinhole, 0.0, np.random.default_rng(0))
    assert marks is not None
    image, tag_image = (drawn_image(target, X_CO, pinhole) for target in (square, tag))
    yield from ratios({
        "textured square, tracked": per_call(lambda: square.follow(image, marks + 1.0), CALLS),
        "textured square, searched in the whole image": per_call(
            lambda: square.follow(image, None), CALLS
        ),
        "AprilTag of the same size, by OpenCV": per_call(lambda: tag.find(tag_image), CALLS),
    })  # fmt: skip
