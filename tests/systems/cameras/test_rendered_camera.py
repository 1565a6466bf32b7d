"""Rendered cameras: windows, lenses and flaws of images, against Drake's sensor and OpenCV."""

from functools import cache

import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.models.rendered_camera import add_renderer, make_rgbd_sensor
from cdpr_drake.systems.cameras.scene_picture import (
    SceneCamera,
    draw_image,
    draw_window,
    occupied_window,
)
from cdpr_drake.systems.diagrams.camera import scene_adder
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.vision.image_window import ImageWindow, expected_window, target_box, whole_image
from cdpr_drake.vision.lens_picture import StraightPicture, lens_picture

RENDERED, REGION = "camera.kind=rendered", "camera.region=target"

BARREL = "camera.distortion={kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}"
FISHEYE = "camera.distortion={kind: fisheye, k1: -0.02, k2: 0.005}"
LENSES = pytest.mark.parametrize("lens", [BARREL, FISHEYE], ids=["barrel", "fisheye"])

FEW = 0.002
"""Share of pixels that may differ from the image that is drawn at once: projections are rounded to
other numbers of 32 bits, which edges of a pixel show; less than a ten-thousandth was measured."""

CORNER = 0.01
"""What that may move a corner by [px]; 2e-4 was measured."""

NOWHERE = np.full(4, np.nan)


CORNER_OFFSET = 0.6
"""Largest offset of one corner [px], that of rendered images without a lens."""

MEAN_OFFSET = 0.15
"""Mean over all corners [px]; without a lens 0.1 is held."""


@cache
def built(name, *overrides):
    """A servo with a rendered camera; contexts are made by each test."""
    return build_visual_servo(load_scenario(name, [RENDERED, *overrides]))


def scene(name, *overrides):
    """A servo with a region of interest, its root context, and what gives its query object."""
    servo = built(name, REGION, *overrides)
    context = servo.make_context()
    block = servo.cable_robot
    query = block.GetOutputPort("query_object")
    return servo, context, lambda: query.Eval(block.GetMyContextFromRoot(context))


def carrier(servo, block=None):
    """The frame that carries the camera, and its pose there."""
    block, mounting = block or servo.cable_robot, servo.mounting
    body = block.plant.world_body() if mounting.is_eye_to_hand() else block.in_plant.body
    return block.plant.GetBodyFrameIdOrThrow(body.index()), mounting.X_BC


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_eye_to_hand"])
def test_an_image_in_parts_is_drake_s_image(name):
    """Beside Drake's RgbdSensor, at the start, tilted with a beam in view, and at the goal."""
    servo = built(name)  # for its poses
    scenario = servo.scenario
    builder = DiagramBuilder()
    block = builder.AddSystem(CableRobot(servo.robot, add_to_scene=scene_adder(scenario)))
    add_renderer(block.scene_graph)
    mounting, pinhole = servo.mounting, servo.pinhole
    parent = carrier(servo, block)[0]
    cameras = [
        builder.AddSystem(make(parent, mounting.X_BC, pinhole))
        for make in (make_rgbd_sensor, SceneCamera)
    ]
    for camera in cameras:
        builder.Connect(block.GetOutputPort("query_object"), camera.get_input_port(0))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = block.GetOutputPort("query_object")
    start = scenario.initial_pose.transform()
    tilted = start @ pose_from_angles(np.zeros(3), np.array([0.6, 0.5, 0.0]))
    areas = []
    for X_WP in (start, tilted, servo.desired_platform_pose()):
        block.in_plant.set_pose(block.plant.GetMyMutableContextFromRoot(context), X_WP)
        at_once, parts = (
            camera.GetOutputPort("color_image").Eval(camera.GetMyContextFromRoot(context)).data
            for camera in cameras
        )
        assert parts.shape == at_once.shape
        assert np.min(at_once) < 60  # something dark is in it
        differs = np.max(np.abs(parts.astype(int) - at_once), axis=2) > 1
        assert np.mean(differs) < FEW
        scene_now = query.Eval(block.GetMyContextFromRoot(context))
        X_WC = RigidTransform(scene_now.GetPoseInWorld(parent)) @ mounting.X_BC
        used = occupied_window(scene_now, X_WC, pinhole)
        areas.append(used.width * used.height / (pinhole.width * pinhole.height))
    if name == "acrobot_pbvs":
        assert areas[0] < 0.1 < areas[2] < 0.6


@pytest.mark.parametrize("kind", ["tag", "dots", "circles", "tag_bundle"])
def test_a_window_has_the_marks_of_the_whole_image(kind):
    """For every kind of target, of which the two tags of the bundle are both in the window."""
    more = [f"target.kind={kind}"]
    if kind == "circles":
        more += ["controller.scheme=circles"]
    if kind == "tag_bundle":
        tags = ", ".join(
            f"{{tag_id: {k}, size: 0.03, pose: {{position: [{0.05 * k - 0.02}, 0, 0]}}}}"
            for k in range(2)
        )
        more += [f"target.tags=[{tags}]"]
    servo, _, query = scene("acrobot_pbvs", *more)
    (parent, X_BC), target, pinhole = carrier(servo), servo.target, servo.pinhole
    X_CO = servo.X_CO(servo.scenario.initial_pose.transform(), 0.0)
    window = expected_window(target_box(target, X_CO, pinhole), NOWHERE, pinhole)
    whole = target.find(draw_window(query(), parent, X_BC, pinhole, whole_image(pinhole)))
    part = target.find(draw_window(query(), parent, X_BC, pinhole, window))
    part = part.reshape(-1, 2 if target.mark == "corners" else 5)
    part[:, :2] += [window.u, window.v]
    np.testing.assert_allclose(part.ravel()[:2], whole[:2], atol=CORNER)
    np.testing.assert_allclose(part.ravel(), whole, rtol=1e-3, atol=CORNER)


JUMP = (
    "target.motion={waypoints: [{time: 0.1, pose: {position: [0.2209, -0.197, 0]}}, "
    "{time: 0.10001, pose: {position: [0.10, -0.05, 0]}}]}"
)
"""A window beside a target that jumps has nothing; the image of the same moment does."""

RUNS = {
    "rests": ([], 0.24, (6, 1), True),
    "jumps": ([JUMP], 0.24, (6, 2), True),
    "jumps behind a barrel lens": ([JUMP, BARREL], 0.24, (6, 2), True),
    "jumps behind a fisheye lens": ([JUMP, FISHEYE], 0.24, (6, 2), True),
    "never in view": (["target.pose.position=[9, 9, 0]"], 0.12, (3, 3), False),
    # With an image that is shifted by more than a window's margin.
    "measured off": (["perturbations.image_bias=[70, -40]"], 0.12, (3, 1), True),
}
"""Changes, time, images and whole ones among them, and if the last one shows the target."""


@pytest.mark.parametrize("case", RUNS)
def test_a_run_draws_windows_after_a_whole_image_with_the_target(case):
    changes, time, images, found = RUNS[case]
    servo, context, _ = scene("acrobot_pbvs", *changes)
    Simulator(servo.diagram, context).AdvanceTo(time - 1e-6)
    assert servo.images(context) == images
    own = servo.measurement.GetMyContextFromRoot(context)
    assert servo.measurement.GetOutputPort("found").Eval(own)[0] == float(found)


def by_opencv(camera, p_CK):
    """Pixels of points in C, shape (2, n), by OpenCV's own projection."""
    D = np.array(camera.distortion.coefficients, float)
    K, points = camera.matrix(), np.ascontiguousarray(p_CK.T)[:, np.newaxis]
    if camera.distortion.kind == "fisheye":
        uv, _ = cv2.fisheye.projectPoints(points, np.zeros(3), np.zeros(3), K, D[:4])
    else:
        uv, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, D)
    return uv.reshape(-1, 2).T


@LENSES
def test_windows_are_cut_out_of_the_whole_straight_picture(lens):
    servo, _context, query_of = scene("acrobot_pbvs", lens)
    (parent, X_BC), camera, query = carrier(servo), servo.pinhole, query_of()
    straight = StraightPicture(camera)
    drawn = draw_image(query, parent, X_BC, straight.wide)
    whole = straight.picture(lens_picture(drawn, camera))
    every = whole_image(straight.wide)
    for window in (
        ImageWindow(160, 120, 200, 160), ImageWindow(0, 0, 96, 64),
        ImageWindow(every.width - 104, every.height - 80, 104, 80),
    ):  # fmt: skip
        part = straight.window(
            window, lambda some: draw_window(query, parent, X_BC, straight.wide, some)
        )
        wanted = window.cut(whole, every)
        assert part.shape == wanted.shape
        assert np.mean(np.max(np.abs(part.astype(int) - wanted), axis=2) > 1) < FEW


@LENSES
@pytest.mark.parametrize("bias", [None, [70, -40]], ids=["", "measured off"])
def test_a_run_finds_in_windows_what_opencv_projects(lens, bias):
    """The first image is drawn whole, those after it are windows; with an image that is measured
    off by more than a window's margin, too."""
    more = [] if bias is None else [f"perturbations.image_bias={bias}"]
    servo, context, _ = scene("acrobot_pbvs", lens, *more)
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


class Still:
    """A servo at its start, of which images can be taken with a velocity of the platform."""

    def __init__(self, *overrides, name="acrobot_pbvs"):
        self.servo = built(name, *overrides)
        self.context = self.servo.make_context()
        self.block = self.servo.cable_robot
        self.camera = self.servo.diagram.GetSubsystemByName("camera")

    def place(self, X_WP, V_WP=None):
        """Puts the platform somewhere, with a twist in W."""
        plant = self.block.plant
        context = plant.GetMyMutableContextFromRoot(self.context)
        self.block.in_plant.set_pose(context, X_WP)
        if V_WP is not None:
            plant.SetFreeBodySpatialVelocity(context, self.block.in_plant.body, V_WP)

    def image(self):
        """The image of now, shape (height, width, 4)."""
        port = self.camera.GetOutputPort("color_image")
        return np.array(port.Eval(self.camera.GetMyContextFromRoot(self.context)).data)

    def expected(self, X_WP):
        """Where corners are in the image of a pose, shape (2, 4) [px]."""
        X_CO = self.servo.X_CO(X_WP, 0.0)
        return self.servo.pinhole.project(X_CO @ self.servo.target.points)


@LENSES
def test_a_rendered_tag_is_where_the_lens_projects_it(lens):
    still = Still(lens)
    start = still.servo.scenario.initial_pose.transform()
    goal = still.servo.desired_platform_pose()
    offsets = []
    for X_WP in (start, goal):
        still.place(X_WP)
        found = still.servo.measurement.find_in(still.image())
        assert found is not None
        offsets.append(found.reshape(4, 2).T - still.expected(X_WP))
    assert np.max(np.abs(offsets)) < CORNER_OFFSET
    assert np.max(np.abs(np.mean(offsets, axis=(0, 2)))) < MEAN_OFFSET


def test_a_lens_that_is_ignored_bends_edges_of_a_large_tag():
    """Why pictures are straightened: lines that are fitted to bent edges meet off the corners."""
    still = Still(BARREL, "perturbations.camera_distortion={kind: none}")
    X_WP = still.servo.desired_platform_pose()
    still.place(X_WP)
    found = still.servo.measurement.find_in(still.image()).reshape(4, 2).T
    assert np.min(np.abs(found - still.expected(X_WP))) > 1.5


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_circles", "acrobot_pbvs_textured"])
def test_poses_of_targets_are_found_through_a_lens(name):
    still = Still(BARREL, name=name)
    X_WP = still.servo.desired_platform_pose()
    still.place(X_WP)
    measurement = still.servo.measurement
    frames = measurement.next_frames(measurement.no_frames(), measurement.find_in(still.image()))
    assert frames[0] == 1.0
    distance, angle = pose_error(measurement.pose_of(frames), still.servo.X_CO(X_WP, 0.0))
    assert distance < 1e-3
    if name != "acrobot_circles":  # circles do not show their rotation
        assert angle < np.radians(0.6)


def test_a_rolling_shutter_shows_rows_at_their_times():
    """The tag moves in the image by ten pixels while it is read out; corners are as their rows."""
    readout = 0.03
    still = Still(f"camera.flaws={{readout: {readout}, renders: 24}}")
    X_WP = still.servo.desired_platform_pose()
    V_WP = SpatialVelocity([0.0, 0.0, 0.4], [0.03, 0.02, 0.0])
    still.place(X_WP, V_WP)
    found = still.servo.target.find(still.image()).reshape(4, 2).T
    R = X_WP.rotation().inverse()
    V_P = np.concatenate([R @ V_WP.rotational(), R @ V_WP.translational()])
    expected = np.empty((2, 4))
    for k in range(4):
        row = found[1, k]
        for _ in range(5):
            when = -readout * (1.0 - row / (still.servo.pinhole.height - 1))
            expected[:, k] = still.expected(X_WP @ exponential(V_P * when))[:, k]
            row = expected[1, k]
    at_once = still.expected(X_WP)
    assert np.max(np.abs(found - expected)) < CORNER_OFFSET
    assert np.max(np.abs(found - at_once)) > 3.0
    still.place(X_WP, SpatialVelocity(np.zeros(6)))
    resting = still.servo.target.find(still.image()).reshape(4, 2).T
    assert np.max(np.abs(resting - at_once)) < CORNER_OFFSET


def test_a_camera_in_the_world_sees_the_platform_where_it_was():
    still = Still("camera.flaws={exposure: 0.02, renders: 4}", name="acrobot_eye_to_hand")
    X_WP = still.servo.scenario.initial_pose.transform()
    v = np.array([0.2, 0.1, 0.0])
    still.place(X_WP, SpatialVelocity(np.zeros(3), v))
    found = still.servo.target.find(still.image()).reshape(4, 2).T
    X_WP_before = X_WP.__class__(X_WP.rotation(), X_WP.translation() - 0.01 * v)
    middle = still.expected(X_WP_before)
    assert np.max(np.abs(found - middle)) < 1.0
    assert np.max(np.abs(found - still.expected(X_WP))) > np.max(np.abs(found - middle))


def test_images_with_flaws_are_the_same_by_the_same_seed():
    flaws = "camera.flaws={noise: 3, defocus: 0.7}"
    one, same, other, clean = (
        Still(*more).image() for more in ((flaws,), (flaws,), (flaws, "seed=8"), ())
    )
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)
    assert np.any(one != clean)
