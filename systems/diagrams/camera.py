"""What the camera of a visual servo sees, and the camera itself, rendered or projected."""

from __future__ import annotations

from collections.abc import Callable

from pydrake.geometry import SceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import RgbdSensor

from cdpr_drake.models.rendered_camera import add_renderer, make_rgbd_sensor
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.scene import add_plates
from cdpr_drake.systems.cameras.camera_mounting import Sight
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.cameras.target_detector import TargetDetector
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.targets import make_target
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


def scene_adder(scenario: Scenario) -> Callable[[DiagramBuilder, RobotInPlant, SceneGraph], None]:
    """Puts a scenario's target into a robot's block, which gets a port X_WO if it is in the world.

    For use as `add_to_scene` of `CableRobot`.
    """

    def add(builder: DiagramBuilder, robot: RobotInPlant, scene_graph: SceneGraph) -> None:
        known = scenario.estimator.known_tag
        if known is not None:
            add_plates(robot.plant, known.target().plates(), known.pose.transform(), "known_tag")
        plates, motion = make_target(scenario.target).plates(), scenario.target.path()
        if scenario.target.carrier == "platform":
            add_plates(robot.plant, plates, motion.at(0.0), "target", robot.body)
            return
        target = builder.AddNamedSystem("target", SceneTarget(scene_graph, plates, motion))
        builder.Connect(
            target.GetOutputPort("geometry_pose"),
            scene_graph.get_source_pose_port(target.source_id),
        )
        builder.ExportOutput(target.GetOutputPort("X_WO"), "X_WO")

    return add


def add_camera(
    builder: DiagramBuilder,
    scenario: Scenario,
    block: CableRobot,
    target: Target,
    pinhole: Pinhole,
    sight: Sight,
) -> TargetMeasurement:
    """Adds the scenario's camera; returns the system with the ports of `TargetMeasurement`."""
    settings = scenario.camera
    if settings.kind == "projected":
        camera = ProjectedCamera(
            target,
            sight,
            pinhole,
            settings.rate,
            settings.latency_frames,
            settings.pixel_noise,
            scenario.seed,
            scenario.perturbations.image_bias,
        )
        projected = builder.AddNamedSystem("camera", camera)
        builder.Connect(block.GetOutputPort("X_WP"), projected.GetInputPort("X_WP"))
        if not sight.is_eye_to_hand():
            builder.Connect(block.GetOutputPort("X_WO"), projected.GetInputPort("X_WO"))
        return projected
    add_renderer(block.scene_graph)
    sensor = add_sensor(builder, block, sight, pinhole)
    detector = builder.AddNamedSystem(
        "detector",
        TargetDetector(
            target,
            pinhole,
            settings.rate,
            settings.latency_frames,
            scenario.perturbations.image_bias,
        ),
    )
    builder.Connect(sensor.color_image_output_port(), detector.GetInputPort("color_image"))
    return detector


def add_sensor(
    builder: DiagramBuilder, block: CableRobot, sight: Sight, pinhole: Pinhole
) -> RgbdSensor:
    """Adds the rendering camera, named "camera", to a robot's block that has a renderer."""
    body = block.plant.world_body() if sight.is_eye_to_hand() else block.in_plant.body
    frame = block.plant.GetBodyFrameIdOrThrow(body.index())
    sensor = builder.AddNamedSystem("camera", make_rgbd_sensor(frame, sight.X_BC, pinhole))
    builder.Connect(block.GetOutputPort("query_object"), sensor.query_object_input_port())
    return sensor
