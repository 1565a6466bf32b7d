"""Benchmarks of cameras with a lens beside cameras without one, and of cables in images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import (
    TimingRow,
    interleaved,
    processor_seconds,
    seconds_per_call,
)
from cdpr_drake.arrays import Array
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.cable_detection import find_sags
from cdpr_drake.vision.cable_pictures import draw_cables
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.lens_picture import StraightPicture, lens_picture, without_lens
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.texture_pictures import drawn_image

LENSES = {
    "brown_conrady": LensDistortion("brown_conrady", (-0.25, 0.06, 0.001, -0.0008)),
    "fisheye": LensDistortion("fisheye", (-0.02, 0.005)),
}

TAG_SIZE = 0.06

X_CO = pose_from_angles(np.array([0.02, -0.03, 0.25]), np.array([np.pi - 0.2, 0.1, 0.3]))
"""Pose of the tag in the camera [m]."""


def camera_rows(quick: bool) -> list[TimingRow]:
    """All rows; the quick form repeats less."""
    repeats, calls = (3, 20) if quick else (7, 400)
    pinhole = load_camera("ids_kowa").pinhole(640, 480)
    rows = []
    for name, lens in LENSES.items():
        camera = replace(pinhole, distortion=lens)
        rows.append(projected_row(name, (pinhole, camera), repeats, calls))
        rows.append(rendered_row(name, (pinhole, camera), repeats, max(calls // 20, 2)))
    return [*rows, cables_row(repeats, max(calls // 40, 2))]


def cables_row(repeats: int, calls: int) -> TimingRow:
    """The search for eight cables in an image, beside that for a tag in one of the same size."""
    robot = load_robot("acrobot_small")
    mount = robot.camera_mount("overview")
    camera = load_camera(mount.model)
    pinhole, cables = camera.pinhole(camera.width, camera.height), robot.cable_set()
    X_WE, X_WP = mount.pose.transform(), RigidTransform([0.1, 0.02, 0.3])
    lengths = cable_paths(X_WP, cables).lengths + np.tile([-1e-4, 0.01], cables.count // 2)
    plain = np.full((pinhole.height, pinhole.width, 3), 157, np.uint8)
    image = draw_cables(
        plain, np.full(plain.shape[:2], np.inf), cable_curves(cables, "elastic", X_WP, lengths, 65),
        0.5 * robot.diameters(), X_WE, pinhole,
    )  # fmt: skip
    tag = TagTarget(0, TAG_SIZE)
    drawn = drawn_image(tag, X_CO, pinhole)
    found, search = interleaved(
        [
            lambda: seconds_per_call(lambda: find_sags(image, cables, X_WP, X_WE, pinhole), calls),
            lambda: seconds_per_call(lambda: tag.find(drawn), calls),
        ],
        repeats,
    )
    return TimingRow(
        "eight cables in an image", 1e3 * found, "ms/image", "search for an AprilTag", 1e3 * search,
        found / search, ratio_means="of the search for a tag in an image as large",
    )  # fmt: skip


def projected_row(
    name: str, cameras: tuple[Pinhole, Pinhole], repeats: int, calls: int
) -> TimingRow:
    """An image of a projected camera with a lens, read and solved, beside one without, by processor
    time of this one thread."""
    ideal, distorted = interleaved(
        [lambda one=one: processor_seconds(_image(one), calls) for one in cameras],  # type: ignore[misc]
        repeats,
    )
    return TimingRow(
        f"projected image, {name}", 1e3 * distorted, "ms/image", "without a lens", 1e3 * ideal,
        distorted / ideal, ratio_means="of the time without a lens; pose solver included",
    )  # fmt: skip


def _image(pinhole: Pinhole) -> Callable[[], Array]:
    """Takes an image of a tag, reads it and finds its pose."""
    camera = ProjectedCamera(
        TagTarget(0, TAG_SIZE), CameraMounting(RigidTransform()), pinhole, 25.0, pixel_noise=0.1
    )
    read = {"X_WP": X_CO.inverse(), "X_WO": RigidTransform()}.__getitem__
    frames = camera.no_frames()
    return lambda: camera.next_frames(frames, camera.image(read, 0.0, frames))


def rendered_row(
    name: str, cameras: tuple[Pinhole, Pinhole], repeats: int, calls: int
) -> TimingRow:
    """What a lens adds to a rendered image once it is drawn, looked up and straightened again,
    beside the search for a tag in it."""
    pinhole, camera = cameras
    tag, straight = TagTarget(0, TAG_SIZE), StraightPicture(camera)
    wide = drawn_image(tag, X_CO, without_lens(camera))
    plain = drawn_image(tag, X_CO, pinhole)
    added, search = interleaved(
        [
            lambda: seconds_per_call(lambda: straight.picture(lens_picture(wide, camera)), calls),
            lambda: seconds_per_call(lambda: tag.find(plain), calls),
        ],
        repeats,
    )
    share = wide.shape[0] * wide.shape[1] / (plain.shape[0] * plain.shape[1])
    return TimingRow(
        f"rendered image, what {name} adds", 1e3 * added, "ms/image", "search for an AprilTag",
        1e3 * search,
        added / search,
        ratio_means=f"of the search for a tag; besides, {share:.2f} times the pixels are drawn",
    )  # fmt: skip
