"""What the camera of a visual servo sees, and the camera itself, rendered or projected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydrake.geometry import FrameId, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.arrays import Array
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.scene import add_plates
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.camera_settings import PROJECTED, REGION, CameraSettings
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.region_camera import RegionCamera
from cdpr_drake.systems.cameras.scene_picture import SceneCamera, SpoiledImages
from cdpr_drake.systems.cameras.scene_target import SceneTarget
from cdpr_drake.systems.cameras.target_measurement import TargetDetector, TargetMeasurement
from cdpr_drake.systems.cameras.targets import TargetSettings
from cdpr_drake.systems.robots.assembly import NamedPorts, RobotBlock, SceneAdder, fill_scene
from cdpr_drake.systems.worlds.adding import WorldInScene
from cdpr_drake.systems.worlds.settings import WorldSettings
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

if TYPE_CHECKING:  # a workspace is drawn by `add_pictured_robot`, and has no servo
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario, VisualServoSettings


def scene_adder(
    settings: VisualServoSettings | None, world: WorldInScene | None = None, *,
    drawn: bool = False,
) -> SceneAdder:  # fmt: skip
    """Puts a servo's target into a robot's block, which gets a port X_WO if it is in the world.

    For use as `add_to_scene` of `CableRobot`.

    Args:
        settings: The servo; None: there is no target.
        world: What else is round the robot.
        drawn: True if nobody needs X_WO of a target that stands.
    """

    def add(
        builder: DiagramBuilder, robot: RobotInPlant, scene_graph: SceneGraph
    ) -> Callable[[], None] | None:
        if settings is not None:
            _add_target(settings, builder, robot, scene_graph, drawn)
        return None if world is None else world.add(builder, robot, scene_graph)

    return add


@dataclass(frozen=True, eq=False, kw_only=True)
class PicturedRobot(NamedPorts):
    """A robot in a plant that is posed and drawn; it has no cables, and nothing touches it.

    Attributes:
        in_plant: Its platform in the plant.
        plant: The plant.
        scene_graph: Its scene.
    """

    in_plant: RobotInPlant
    plant: MultibodyPlant
    scene_graph: SceneGraph


def add_pictured_robot(
    builder: DiagramBuilder, robot: Robot, scenario: Scenario | None = None,
    world: WorldSettings | None = None,
) -> PicturedRobot:  # fmt: skip
    """Adds a robot with all that is to be seen of a run.

    All of it is Drake's own, unless a target moves: pydrake frees no diagram with a system that is
    written in Python.

    Args:
        builder: Where plant and scene graph are added.
        robot: The robot.
        scenario: A visual servo, whose target and world are shown; None: there is none.
        world: The world of a scenario of another kind.
    """
    section = world if scenario is None else scenario.world
    around = None if section is None else WorldInScene(section, robot, contact=False)
    floor = section is None or section.ground is None
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    in_plant = fill_scene(
        builder, robot, plant, scene_graph, floor=floor,
        add_to_scene=scene_adder(scenario, around, drawn=True),
    )  # fmt: skip
    ports = {
        "query_object": scene_graph.get_query_output_port(),
        "body_velocities": plant.get_body_spatial_velocities_output_port(),
    }
    return PicturedRobot({}, ports, in_plant=in_plant, plant=plant, scene_graph=scene_graph)


def _add_target(
    settings: VisualServoSettings,
    builder: DiagramBuilder,
    robot: RobotInPlant,
    scene_graph: SceneGraph,
    drawn: bool,
) -> None:
    """Puts target and known tag of a servo into a scene."""
    known, target = settings.estimator.known_tag, settings.target
    if known is not None:
        add_plates(robot.plant, known.target().plates(), known.pose.transform(), "known_tag")
    path, is_carried = target.path(), target.carrier == "platform"
    if is_carried or (drawn and not path.is_moving()):
        body = robot.body if is_carried else None
        add_plates(robot.plant, target.target().plates(), path.at(0.0), "target", body)
        return
    builder.ExportOutput(add_target(builder, scene_graph, target), "X_WO")


def add_target(
    builder: DiagramBuilder,
    scene_graph: SceneGraph,
    settings: TargetSettings,
    *,
    name: str = "target",
) -> OutputPort:
    """Adds a target that stands or moves in the world; returns its pose X_WO [m]."""
    plates, motion = settings.target().plates(), settings.path()
    target = builder.AddNamedSystem(name, SceneTarget(scene_graph, plates, motion))
    builder.Connect(
        target.GetOutputPort("geometry_pose"), scene_graph.get_source_pose_port(target.source_id)
    )
    return target.GetOutputPort("X_WO")


def add_camera(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: CameraSettings,
    *,
    target: Target,
    mounting: CameraMounting,
    pinhole: Pinhole,
    X_WO: OutputPort | None = None,
    seed: int = 0,
    image_bias: Array | None = None,
    name: str = "",
) -> TargetMeasurement:
    """Adds a camera that measures a target.

    Args:
        builder: The builder that has the robot.
        robot: The robot.
        settings: The camera.
        target: What it looks at.
        mounting: Where it is, and the target, if that is on the platform.
        pinhole: Its intrinsic parameters.
        X_WO: Pose of a target in the world [m]; only a projected camera needs it.
        seed: Seed of the noise of a projected camera, or of spoiled images.
        image_bias: Shift (u, v) of all that is measured, shape (2,) [px]; none if None.
        name: Put before the names of the blocks "camera" and, if whole images are rendered,
            "detector". The input X_BC of a camera that turns is left open.

    Returns:
        The system with the ports of `TargetMeasurement`.

    Raises:
        RenderingError: The camera is rendered and EGL is missing.
    """
    prefix = f"{name}_" if name else ""
    if settings.kind == PROJECTED:
        camera = projected_camera(
            settings, target, mounting, pinhole, seed=seed, image_bias=image_bias
        )
        projected = builder.AddNamedSystem(prefix + "camera", camera)
        builder.Connect(robot.GetOutputPort("X_WP"), projected.GetInputPort("X_WP"))
        if X_WO is not None and not mounting.is_eye_to_hand():
            builder.Connect(X_WO, projected.GetInputPort("X_WO"))
        return projected
    add_renderer(robot.scene_graph)
    if settings.region == REGION:
        return add_region_camera(
            builder,
            robot,
            settings,
            target=target,
            mounting=mounting,
            pinhole=pinhole,
            image_bias=image_bias,
            name=prefix + "camera",
        )
    spoiled = None if settings.flaws is None else SpoiledImages(
        flaws=settings.flaws.flaws(),
        rate=settings.rate,
        seed=seed,
        frame=robot.plant.GetBodyFrameIdOrThrow(robot.in_plant.body.index()),
        body=int(robot.in_plant.body_index),
    )  # fmt: skip
    sensor = add_sensor(builder, robot, mounting, pinhole, spoiled, name=prefix + "camera")
    detector = TargetDetector(target, pinhole, settings.rate, settings.latency_frames, image_bias)
    builder.AddNamedSystem(prefix + "detector", detector)
    builder.Connect(sensor.GetOutputPort("color_image"), detector.GetInputPort("color_image"))
    return detector


def add_region_camera(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: CameraSettings,
    *,
    target: Target,
    mounting: CameraMounting,
    pinhole: Pinhole,
    image_bias: Array | None,
    name: str,
) -> RegionCamera:
    """Adds a camera that draws a window round a target, to a robot whose scene has a renderer."""
    camera = RegionCamera(
        target,
        pinhole,
        settings.rate,
        parent=_camera_frame(robot, mounting),
        X_BC=mounting.X_BC,
        latency_frames=settings.latency_frames,
        image_bias=image_bias,
        turns=mounting.turns,
    )
    builder.AddNamedSystem(name, camera)
    builder.Connect(robot.GetOutputPort("query_object"), camera.GetInputPort("query_object"))
    return camera


def projected_camera(
    settings: CameraSettings,
    target: Target,
    mounting: CameraMounting,
    pinhole: Pinhole,
    *,
    seed: int = 0,
    image_bias: Array | None = None,
) -> ProjectedCamera:
    """The projected camera of some settings; arguments as for `add_camera`."""
    return ProjectedCamera(
        target,
        mounting,
        pinhole,
        settings.rate,
        latency_frames=settings.latency_frames,
        pixel_noise=settings.pixel_noise,
        seed=seed,
        image_bias=image_bias,
        focus=(settings.focus_zoom, settings.focus_period) if settings.focus_zoom > 0.0 else None,
        fault=settings.fault,
    )


def add_sensor(
    builder: DiagramBuilder,
    robot: RobotBlock | PicturedRobot,
    mounting: CameraMounting,
    pinhole: Pinhole,
    spoiled: SpoiledImages | None = None,
    *,
    name: str = "camera",
) -> SceneCamera:
    """Adds the rendering camera to a robot whose scene graph has a renderer."""
    frame = _camera_frame(robot, mounting)
    camera = SceneCamera(frame, mounting.X_BC, pinhole, spoiled, mounting.turns)
    sensor = builder.AddNamedSystem(name, camera)
    if sensor.HasInputPort("body_velocities"):
        builder.Connect(
            robot.GetOutputPort("body_velocities"), sensor.GetInputPort("body_velocities")
        )
    builder.Connect(robot.GetOutputPort("query_object"), sensor.GetInputPort("query_object"))
    return sensor


def _camera_frame(robot: RobotBlock | PicturedRobot, mounting: CameraMounting) -> FrameId:
    """Geometry frame of what carries the camera: the platform, or the world."""
    body = robot.plant.world_body() if mounting.is_eye_to_hand() else robot.in_plant.body
    return robot.plant.GetBodyFrameIdOrThrow(body.index())
