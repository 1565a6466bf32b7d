"""Regions of interest of a camera with a lens: windows of the straight picture, marks in them."""

import cv2
import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.systems.cameras.scene_picture import draw_image, draw_window
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.vision.image_window import ImageWindow, whole_image
from cdpr_drake.vision.lens_picture import StraightPicture, lens_picture

LENSES = {
    "barrel": "{kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}",
    "fisheye": "{kind: fisheye, k1: -0.02, k2: 0.005}",
}

CORNER_OFFSET = 0.6
"""Largest offset of one corner [px], that of rendered images without a lens."""

FEW = 0.002
"""Share of pixels that may differ from the picture that is drawn at once, as without a lens."""


def servo_with(lens, *overrides):
    given = ["camera.kind=rendered", "camera.region=target", f"camera.distortion={LENSES[lens]}"]
    servo = build_visual_servo(load_scenario("acrobot_pbvs", [*given, *overrides]))
    return servo, servo.make_context()


def by_opencv(camera, p_CK):
    """Pixels of points in C, shape (2, n), by OpenCV's own projection."""
    D = np.array(camera.distortion.coefficients, float)
    K, points = camera.matrix(), np.ascontiguousarray(p_CK.T)[:, np.newaxis]
    if camera.distortion.kind == "fisheye":
        uv, _ = cv2.fisheye.projectPoints(points, np.zeros(3), np.zeros(3), K, D[:4])
    else:
        uv, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, D)
    return uv.reshape(-1, 2).T


@pytest.mark.parametrize("lens", LENSES)
def test_windows_are_cut_out_of_the_whole_straight_picture(lens):
    servo, context = servo_with(lens)
    block, mounting, camera = servo.cable_robot, servo.mounting, servo.pinhole
    query = block.GetOutputPort("query_object").Eval(block.GetMyContextFromRoot(context))
    parent = block.plant.GetBodyFrameIdOrThrow(block.in_plant.body.index())
    straight = StraightPicture(camera)
    drawn = draw_image(query, parent, mounting.X_BC, straight.wide)
    whole = straight.picture(lens_picture(drawn, camera))
    every = whole_image(straight.wide)
    for window in (
        ImageWindow(160, 120, 200, 160), ImageWindow(0, 0, 96, 64),
        ImageWindow(every.width - 104, every.height - 80, 104, 80),
    ):  # fmt: skip
        part = straight.window(
            window, lambda some: draw_window(query, parent, mounting.X_BC, straight.wide, some)
        )
        wanted = window.cut(whole, every)
        assert part.shape == wanted.shape
        assert np.mean(np.max(np.abs(part.astype(int) - wanted), axis=2) > 1) < FEW


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("bias", [None, [70, -40]], ids=["", "measured off"])
def test_a_run_finds_in_windows_what_opencv_projects(lens, bias):
    """The first image is drawn whole, those after it are windows; with an image that is measured
    off by more than a window's margin, too."""
    more = [] if bias is None else [f"perturbations.image_bias={bias}"]
    servo, context = servo_with(lens, *more)
    Simulator(servo.diagram, context).AdvanceTo(0.2 - 1e-6)
    assert servo.images(context) == (5, 1)
    measurement = servo.measurement
    own = measurement.GetMyContextFromRoot(context)
    found = measurement.find_marks(own)
    assert found is not None
    plant = servo.cable_robot.plant
    X_WP = servo.cable_robot.in_plant.pose(plant.GetMyContextFromRoot(context))
    X_CO = servo.X_CO(X_WP, context.get_time())
    truth = by_opencv(servo.pinhole, X_CO @ servo.target.points)
    assert np.max(np.abs(found.reshape(4, 2).T - truth)) < CORNER_OFFSET


@pytest.mark.parametrize("lens", LENSES)
def test_what_is_not_in_the_window_is_looked_for_in_the_whole_image(lens):
    jump = "{time: 0.1, pose: {position: [0.2209, -0.197, 0]}}"
    there = "{time: 0.10001, pose: {position: [0.10, -0.05, 0]}}"
    servo, context = servo_with(lens, f"target.motion={{waypoints: [{jump}, {there}]}}")
    Simulator(servo.diagram, context).AdvanceTo(0.24 - 1e-6)
    assert servo.images(context) == (6, 2)
