"""The two cameras of a robot that handles a box, rendered or projected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.rendered_camera import add_renderer
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.camera_settings import PROJECTED
from cdpr_drake.systems.cameras.scene_picture import SceneCamera
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.pick_and_place.handling_step import camera_poses
from cdpr_drake.systems.pick_and_place.pick_and_place_state_machine import PickAndPlaceStateMachine
from cdpr_drake.systems.pick_and_place.tag_cameras import AttentiveDetector, AttentiveProjection
from cdpr_drake.systems.pick_and_place.workpiece import tag_pose
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import COVERED_IN, OBJECT_TAG
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole

NAMES = ("object", "goal")

GOAL_SEED = 7919
"""Added to the seed, so that the pixel noise of the second camera is its own."""


@dataclass(frozen=True)
class _View:
    """One of the cameras: what it is, where on the platform, and what it looks for."""

    number: int
    pinhole: Pinhole
    X_PC: RigidTransform
    target: TagTarget

    @property
    def name(self) -> str:
        return NAMES[self.number]


def pinholes(scenario: PickAndPlaceScenario, robot: Robot) -> tuple[Pinhole, Pinhole]:
    """Intrinsic parameters of the cameras that look at the box and at the goal."""
    own = scenario.camera
    first = robot.camera_mount(own.mount).model
    second = first if scenario.goal_camera is None else scenario.goal_camera.model
    one, other = (load_camera(model).pinhole(own.width, own.height) for model in (first, second))
    return one, other


def add_cameras(
    builder: DiagramBuilder,
    scenario: PickAndPlaceScenario,
    block: CableRobot,
    *,
    machine: PickAndPlaceStateMachine,
    X_WG: RigidTransform,
) -> list[TargetMeasurement]:
    """Adds the cameras of box and goal, and connects them with the machine.

    Raises:
        RenderingError: They are rendered and EGL is missing.
    """
    places = camera_poses(scenario, block.robot, believed=False)
    targets = (scenario.workpiece.tag.target(), scenario.goal.tag.target())
    lenses = pinholes(scenario, block.robot)
    views = [_View(k, lenses[k], places[k], targets[k]) for k in range(2)]
    if scenario.camera.kind == PROJECTED:
        added = [_project(builder, scenario, block, view, X_WG) for view in views]
    else:
        added = _render(builder, scenario, block, views)
    for view, camera in zip(views, added, strict=True):
        builder.Connect(machine.GetOutputPort("enabled"), camera.GetInputPort("enabled"))
        seen = "X_CT" if view.number else "X_CO"
        builder.Connect(camera.GetOutputPort("X_CO"), machine.GetInputPort(seen))
        builder.Connect(camera.GetOutputPort("found"), machine.GetInputPort(f"{view.name}_found"))
    return added


def _render(
    builder: DiagramBuilder,
    scenario: PickAndPlaceScenario,
    block: CableRobot,
    views: list[_View],
) -> list[TargetMeasurement]:
    """Cameras of the scene, or one where there is no second, and what searches their images."""
    add_renderer(block.scene_graph)
    frame = block.plant.GetBodyFrameIdOrThrow(block.in_plant.body.index())
    images, detectors = [], []
    for view in views:
        if view.number == 0 or scenario.goal_camera is not None:
            camera = SceneCamera(frame, view.X_PC, view.pinhole)
            builder.AddNamedSystem(f"{view.name}_camera", camera)
            builder.Connect(
                block.GetOutputPort("query_object"), camera.GetInputPort("query_object")
            )
            images.append(camera.GetOutputPort("color_image"))
        rate = scenario.handling.rate
        detector = AttentiveDetector(view.target, view.pinhole, rate, view.number)
        builder.AddNamedSystem(f"{view.name}_detector", detector)
        builder.Connect(images[-1], detector.GetInputPort("color_image"))
        detectors.append(detector)
    return detectors


def _project(
    builder: DiagramBuilder,
    scenario: PickAndPlaceScenario,
    block: CableRobot,
    view: _View,
    X_WG: RigidTransform,
) -> TargetMeasurement:
    """A camera that projects its tag."""
    half = 0.5 * float(scenario.workpiece.size[2])
    goal = view.number == 1
    tag = scenario.goal.tag if goal else scenario.workpiece.tag
    camera = AttentiveProjection(
        view.target,
        CameraMounting(view.X_PC),
        view.pinhole,
        scenario.handling.rate,
        number=view.number,
        box=scenario.workpiece.size,
        X_WO=X_WG @ tag_pose(tag, -half) if goal else None,
        X_BO=tag_pose(tag, half),
        pixel_noise=scenario.camera.pixel_noise,
        seed=scenario.seed + GOAL_SEED * view.number,
    )
    builder.AddNamedSystem(f"{view.name}_camera", camera)
    builder.Connect(block.GetOutputPort("X_WP"), camera.GetInputPort("X_WP"))
    builder.Connect(block.GetOutputPort("X_WB"), camera.GetInputPort("X_WB"))
    cover = scenario.cover
    if cover is not None and (COVERED_IN[cover.phase] == OBJECT_TAG) != goal:
        builder.Connect(block.GetOutputPort("tag_occluded"), camera.GetInputPort("tag_occluded"))
    else:
        never = builder.AddNamedSystem(f"{view.name}_shown", ConstantVectorSource(np.zeros(1)))
        builder.Connect(never.get_output_port(), camera.GetInputPort("tag_occluded"))
    return camera
