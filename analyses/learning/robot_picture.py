"""Pictures of a robot with its task, rendered by Drake: what `render` of an environment gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydrake.geometry import Cylinder, GeometryId, QueryObject, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.rendered_camera import add_renderer, check_rendering
from cdpr_drake.models.robot_in_plant import platform_shape
from cdpr_drake.models.scene import add_frame
from cdpr_drake.systems.cameras.scene_picture import draw_image
from cdpr_drake.vision.pinhole import Pinhole

if TYPE_CHECKING:
    from cdpr_drake.analyses.learning.robot_task import RobotTask

WIDTH, HEIGHT = 480, 360
"""Of a picture [px]."""

VIEW = np.radians(40.0)
"""Angle that it sees along its height [rad]."""

FROM = np.array([0.45, -1.0, 0.45])
"""From which side of the frame's middle it is seen, in W."""

MARGIN = 1.0
"""So much of the ball round the frame is in the picture; corners are off its rim."""

CABLE_SHARE = 0.004
"""Radius at which cables are drawn, of the frame's half diagonal."""

PLATFORM_COLOR = np.array([0.15, 0.35, 0.65, 1.0])
CABLE_COLOR = np.array([0.1, 0.1, 0.1, 1.0])
GOAL_COLOR = np.array([0.1, 0.6, 0.3, 0.35])
"""Of where something shall be: pale, so that one sees through it."""


def add_shown_body(plant: MultibodyPlant, name: str) -> RigidBody:
    """A body that is placed for each picture."""
    return plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 1.0))


class RobotPicture:
    """The frame, the platform, straight cables, and what a task shows beside them.

    Attributes:
        shape: Of a picture: height, width, 3.
    """

    def __init__(self, task: RobotTask) -> None:
        """Of any robot of a task.

        Raises:
            RenderingError: This machine cannot render.
        """
        check_rendering()
        robot = task.robot
        self._task, cables = task, robot.cable_set()
        self._exits, self._anchors = cables.p_WA.T, cables.p_PB
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        add_renderer(scene_graph)
        add_frame(plant, robot)
        self._platform = add_shown_body(plant, "platform")
        X_PShape, shape = platform_shape(robot)
        plant.RegisterVisualGeometry(self._platform, X_PShape, shape, "platform", PLATFORM_COLOR)
        self._shown = task.add_bodies(plant)
        middle = 0.5 * (robot.frame.upper + robot.frame.lower)
        half = 0.5 * float(np.linalg.norm(robot.frame.upper - robot.frame.lower))
        self._radius = CABLE_SHARE * half
        self._rods = [add_shown_body(plant, f"cable_{k}") for k in range(len(self._exits))]
        rod = Cylinder(self._radius, half)
        self._shapes: list[GeometryId] = [
            plant.RegisterVisualGeometry(body, RigidTransform(), rod, body.name(), CABLE_COLOR)
            for body in self._rods
        ]
        plant.Finalize()
        self._plant, self._scene = plant, scene_graph
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._pinhole = Pinhole.from_view_angles(
            WIDTH, HEIGHT, 2.0 * np.arctan(np.tan(VIEW / 2.0) * WIDTH / HEIGHT), VIEW
        )
        self.shape = (HEIGHT, WIDTH, 3)
        self._X_WC = _looking_at(middle, MARGIN * half / float(np.sin(VIEW / 2.0)))

    def draw(self, row: int) -> np.ndarray:
        """The picture of a robot as it is now, of `shape`, 8 bits."""
        own = self._plant.GetMyContextFromRoot(self._context)
        X_WP = pose_from_row(self._task.batch.poses[row])
        self._plant.SetFreeBodyPose(own, self._platform, X_WP)
        for body, X in zip(self._shown, self._task.places(row), strict=True):
            self._plant.SetFreeBodyPose(own, body, X)
        scene: SceneGraph = self._scene
        of_scene = scene.GetMyMutableContextFromRoot(self._context)
        source = self._plant.get_source_id()
        anchors = (X_WP @ self._anchors).T
        broken = self._task.batch.broken[row]
        for k, (start, end) in enumerate(zip(self._exits, anchors, strict=True)):
            if broken[k]:
                end = start + self._radius * np.array([0.0, 0.0, -1.0])
            length = max(float(np.linalg.norm(end - start)), self._radius)
            X = RigidTransform(_along(end - start), 0.5 * (start + end))
            self._plant.SetFreeBodyPose(own, self._rods[k], X)
            rod = Cylinder(self._radius, length)
            scene.ChangeShape(of_scene, source, self._shapes[k], rod)
        query: QueryObject = scene.get_query_output_port().Eval(of_scene)
        image = draw_image(query, scene.world_frame_id(), self._X_WC, self._pinhole)
        return np.ascontiguousarray(image[:, :, :3])


def _looking_at(place: Array, distance: float) -> RigidTransform:
    """X_WC of a camera that sees a place in its middle, upright [m]."""
    back = FROM / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    R = RotationMatrix(np.column_stack([right, np.cross(-back, right), -back]))
    return RigidTransform(R, place + distance * back)


def _along(direction: Array) -> RotationMatrix:
    """A rotation that turns z to a direction, which may be zero."""
    size = float(np.linalg.norm(direction))
    if size == 0.0:
        return RotationMatrix()
    return RotationMatrix.MakeFromOneVector(direction / size, 2)
