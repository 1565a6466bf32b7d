"""Windows of rendered images are cut out of the whole image, and the target is found in them."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.rendered_camera import add_renderer, make_rgbd_sensor
from cdpr_drake.systems.cameras.scene_picture import SceneCamera, draw_window, occupied_window
from cdpr_drake.systems.diagrams.camera import scene_adder
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.vision.image_window import expected_window, target_box, whole_image

REGION = ["camera.kind=rendered", "camera.region=target"]

FEW = 0.002
"""Share of pixels that may differ from the image that is drawn at once: projections are rounded to
other numbers of 32 bits, which edges of a pixel show; less than a ten-thousandth was measured."""

CORNER = 0.01
"""What that may move a corner by [px]; 2e-4 was measured."""

NOWHERE = np.full(4, np.nan)


def scene(name, *overrides):
    """A servo with a region of interest, its root context, and what gives its query object."""
    servo = build_visual_servo(load_scenario(name, [*REGION, *overrides]))
    context = servo.make_context()
    block = servo.cable_robot
    query = block.GetOutputPort("query_object")
    return servo, context, lambda: query.Eval(block.GetMyContextFromRoot(context))


def carrier(servo):
    block, mounting = servo.cable_robot, servo.mounting
    body = block.plant.world_body() if mounting.is_eye_to_hand() else block.in_plant.body
    return block.plant.GetBodyFrameIdOrThrow(body.index()), mounting.X_BC


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_eye_to_hand"])
def test_an_image_in_parts_is_drake_s_image(name):
    """Beside Drake's RgbdSensor, at the start, tilted with a beam in view, and at the goal."""
    scenario = load_scenario(name, ["camera.kind=rendered"])
    servo = build_visual_servo(scenario)  # for its poses
    builder = DiagramBuilder()
    block = builder.AddSystem(CableRobot(servo.robot, add_to_scene=scene_adder(scenario)))
    add_renderer(block.scene_graph)
    mounting, pinhole = servo.mounting, servo.pinhole
    body = block.plant.world_body() if mounting.is_eye_to_hand() else block.in_plant.body
    parent = block.plant.GetBodyFrameIdOrThrow(body.index())
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


def images_after(servo, context, time):
    Simulator(servo.diagram, context).AdvanceTo(time)
    return servo.images(context)


def test_a_run_draws_its_first_image_whole_and_windows_after_that():
    servo, context, _ = scene("acrobot_pbvs")
    assert images_after(servo, context, 0.4 - 1e-6) == (10, 1)
    camera = servo.measurement.GetMyContextFromRoot(context)
    assert servo.measurement.GetOutputPort("found").Eval(camera)[0] == 1.0


def test_a_target_that_jumps_is_found_in_the_whole_image():
    """A window beside it has nothing; the image of the same moment does."""
    jump = "{time: 0.1, pose: {position: [0.2209, -0.197, 0]}}"
    there = "{time: 0.10001, pose: {position: [0.10, -0.05, 0]}}"
    servo, context, _ = scene("acrobot_pbvs", f"target.motion={{waypoints: [{jump}, {there}]}}")
    assert images_after(servo, context, 0.24 - 1e-6) == (6, 2)
    camera = servo.measurement.GetMyContextFromRoot(context)
    assert servo.measurement.GetOutputPort("found").Eval(camera)[0] == 1.0


def test_what_is_never_seen_is_looked_for_in_whole_images():
    servo, context, _ = scene("acrobot_pbvs", "target.pose.position=[9, 9, 0]")
    assert images_after(servo, context, 0.12 - 1e-6) == (3, 3)


def test_windows_follow_true_pixels_where_all_is_measured_off():
    """With an image that is shifted by more than a window's margin."""
    servo, context, _ = scene("acrobot_pbvs", "perturbations.image_bias=[70, -40]")
    assert images_after(servo, context, 0.12 - 1e-6) == (3, 1)


def test_a_region_of_a_camera_that_draws_nothing_is_refused():
    with pytest.raises(ScenarioError) as caught:
        load_scenario("acrobot_pbvs", ["camera.kind=projected", "camera.region=target"])
    assert "camera.region: found target with camera.kind projected" in str(caught.value)
    assert "\n" not in str(caught.value)
