"""Textured squares through the blocks: rendered, followed, with quality, late, in a window."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.texture_pictures import drawn_image
from cdpr_drake.vision.textured_target import TexturedTarget

CAMERA = Pinhole.from_view_angles(320, 240, np.radians(60.0), np.radians(46.8))
X_CO = pose_from_angles(np.array([0.0, 0.005, 0.15]), np.array([np.pi, 0.1, 0.3]))

RENDERED_OFFSET = 0.1
"""Of a corner in an image that Drake renders, against its projection [px]; measured up to 0.06 on a
square of 80 px: what it draws is neither averaged over pixels nor as sharp as the picture."""

DRAWN_OFFSET = 0.05
"""The same in an image drawn with averages."""

CHANGES = ["duration=0.2", "integration.engine=compiled", "log_rate=25"]


def image_block(image):
    picture = ImageRgba8U(CAMERA.width, CAMERA.height)
    picture.mutable_data[:, :, :3] = image
    return ConstantValueSource(Value(picture))


@pytest.fixture(scope="module")
def target():
    return TexturedTarget("stones", 0.06)


@pytest.mark.parametrize(("latency", "bias"), [(0, None), (2, np.array([1.5, -2.0]))])
def test_it_is_found_once_by_features_and_then_followed(target, latency, bias):
    """With what it is measured off and late, too: quality comes with its image."""
    builder = DiagramBuilder()
    source = builder.AddSystem(image_block(drawn_image(target, X_CO, CAMERA)))
    detector = builder.AddSystem(TargetDetector(target, CAMERA, 25.0, latency, bias))
    builder.Connect(source.get_output_port(), detector.GetInputPort("color_image"))
    simulator = Simulator(builder.Build())
    context = detector.GetMyContextFromRoot(simulator.get_context())
    ports = [detector.GetOutputPort(name) for name in ("found", "quality", "corners")]
    expected = CAMERA.project(X_CO @ target.points).T + (0.0 if bias is None else bias)
    for image in range(latency + 2):
        simulator.AdvanceTo(image / 25.0)
        simulator.AdvancePendingEvents()
        found, quality, corners = (port.Eval(context) for port in ports)
        if image < latency:
            assert found[0] == 0.0
            assert np.all(np.isnan(quality))
            continue
        assert found[0] == 1.0
        assert quality[-1] == float(image > latency)
        np.testing.assert_allclose(corners.reshape(4, 2), expected, atol=DRAWN_OFFSET)


@pytest.mark.parametrize("region", ["whole", "target"])
def test_a_servo_sees_it_in_rendered_images(region):
    """Where the true platform's camera has it, row by row."""
    scenario = load_scenario("acrobot_pbvs_textured", [*CHANGES, f"camera.region={region}"])
    run = run_scenario(scenario)
    log, servo = run.log, run.servo
    seen = np.flatnonzero(log["found"][:, 0])
    assert len(seen) >= len(log["time"]) - 1
    assert log["quality"][seen[0], -1] == 0.0
    assert np.all(log["quality"][seen[1:], -1] == 1.0)
    start = servo.X_CO(scenario.initial_pose.transform(), 0.0)
    exact = servo.pinhole.project(start @ servo.target.points).T.ravel()
    assert np.max(np.abs(log["corners_px"][seen[0]] - exact)) < RENDERED_OFFSET


def test_a_projected_camera_tells_no_quality():
    servo = build_visual_servo(
        load_scenario("acrobot_pbvs_textured", ["camera.kind=projected", "duration=0.1"])
    )
    camera = servo.measurement
    quality = camera.GetOutputPort("quality").Eval(
        camera.GetMyContextFromRoot(servo.make_context())
    )
    assert np.all(np.isnan(quality))


def test_an_unknown_texture_is_refused():
    with pytest.raises(ScenarioError, match=r"target\.texture: found bricks.*stones"):
        load_scenario("acrobot_pbvs_textured", ["target.texture=bricks"])
