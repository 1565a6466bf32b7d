"""Builds a robot's moving platform into a MultibodyPlant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.eigen_geometry import Quaternion, Quaternion_
from pydrake.geometry import Box, Shape
from pydrake.math import RigidTransform, RigidTransform_, RotationMatrix, RotationMatrix_
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    ModelInstanceIndex,
    PlanarJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context

from cdpr_drake.models.robot_schema import SHAPE_INERTIA, Robot

_PLATFORM_COLOR = np.array([0.25, 0.45, 0.75, 1.0])


@dataclass(frozen=True)
class RobotInPlant:
    """Where a robot went in a plant; made by `add_robot`, complete once the plant is finalized.

    Attributes:
        robot: The robot.
        plant: The plant that holds its platform.
        model_instance: The robot's model instance, for the plant's ports.
        body_index: The platform's body.
    """

    robot: Robot
    plant: MultibodyPlant
    model_instance: ModelInstanceIndex
    body_index: BodyIndex

    @property
    def body(self) -> RigidBody:
        """The platform."""
        return self.plant.get_body(self.body_index)

    def first_velocity(self) -> int:
        """Index of the platform's first generalized velocity among those of the plant."""
        if self.robot.is_planar():
            joint = self.plant.GetJointByName("plane", self.model_instance)
            return int(joint.velocity_start())
        return int(self.body.floating_velocities_start_in_v())

    def set_pose(self, plant_context: Context, X_WP: RigidTransform) -> None:
        """Puts the platform at rest at X_WP [m]; a planar robot takes x, y and the turn about z."""
        plant = self.plant
        if self.robot.is_planar():
            joint = plant.GetJointByName("plane", self.model_instance)
            assert isinstance(joint, PlanarJoint)
            R = X_WP.rotation().matrix()
            joint.set_pose(
                plant_context, X_WP.translation()[:2], float(np.arctan2(R[1, 0], R[0, 0]))
            )
        else:
            plant.SetFreeBodyPose(plant_context, self.body, X_WP)
        nv = plant.num_velocities(self.model_instance)
        plant.SetVelocities(plant_context, self.model_instance, np.zeros(nv))

    def pose(self, plant_context: Context) -> RigidTransform:
        """X_WP of the platform [m]."""
        return self.plant.EvalBodyPoseInWorld(plant_context, self.body)


def pose_from_state(robot: Robot, state: Any) -> Any:
    """X_WP from the platform's state as the plant's port gives it, shape (13,) or (6,).

    A RigidTransform, or one of AutoDiffXd where the state is an array of these.
    """
    if np.asarray(state).dtype == object:
        return _pose_of_any(robot, state)
    if robot.is_planar():
        assert robot.plane_height is not None
        R = RotationMatrix.MakeZRotation(state[2])
        return RigidTransform(R, np.array([state[0], state[1], robot.plane_height]))
    q = state[:4]
    return RigidTransform(quaternion=Quaternion(q / math.sqrt(q.dot(q))), p=state[4:7])


def _pose_of_any(robot: Robot, state: Any) -> Any:
    if robot.is_planar():
        assert robot.plane_height is not None
        R = RotationMatrix_[AutoDiffXd].MakeZRotation(state[2])
        return RigidTransform_[AutoDiffXd](
            R, np.array([state[0], state[1], AutoDiffXd(robot.plane_height)])
        )
    q = state[:4] / np.sqrt(np.sum(state[:4] * state[:4]))
    return RigidTransform_[AutoDiffXd](Quaternion_[AutoDiffXd](q), state[4:7])


def platform_inertia(robot: Robot) -> SpatialInertia:
    """Spatial inertia about Po in P [kg, m].

    Where the file gives none, that of a solid box, or of the shape if `inertia_of` asks for it.
    """
    platform = robot.platform
    com = robot.center_of_mass()
    if platform.inertia is None and platform.inertia_of == SHAPE_INERTIA:
        assert platform.shape is not None
        own = platform.shape.inertia(platform.mass, robot.box_center())
        about_com = own.Shift(own.get_com())
        # A centre of mass that is given moves the body, not its inertia about it.
        return SpatialInertia(platform.mass, np.zeros(3), about_com.get_unit_inertia()).Shift(-com)
    if platform.inertia is None:
        unit = UnitInertia.SolidBox(*(float(edge) for edge in platform.size))
        about_com = SpatialInertia(platform.mass, np.zeros(3), unit)
    else:
        rotational = RotationalInertia(*(float(value) for value in platform.inertia))
        unit = UnitInertia()
        unit.SetFromRotationalInertia(rotational, platform.mass)
        about_com = SpatialInertia(platform.mass, np.zeros(3), unit)
    return about_com.Shift(-com)


def platform_box(robot: Robot) -> tuple[RigidTransform, Box]:
    """Pose in P and shape of the platform's box [m]."""
    return RigidTransform(robot.box_center()), Box(*(float(edge) for edge in robot.platform.size))


def platform_shape(robot: Robot) -> tuple[RigidTransform, Shape]:
    """Pose in P and shape of the platform as it is drawn [m]: its own, or the box."""
    own = robot.platform.shape
    if own is None:
        return platform_box(robot)
    return own.pose(robot.box_center()), own.shape()


def add_robot(plant: MultibodyPlant, robot: Robot, name: str | None = None) -> RobotInPlant:
    """Adds the moving platform of `robot` to a plant that is not finalized.

    A spatial robot gets a floating body with quaternion; a planar one a joint named "plane"
    (translation along x and y of W, rotation about z). Without collision geometry: the platform
    passes through what it meets. The cables are a system of their own, `systems.CableForces`.
    The plant's gravity is set to the robot's; the default pose is the robot's home pose.

    Args:
        plant: Continuous MultibodyPlant; registered with a SceneGraph, it also shows the platform.
        robot: The robot.
        name: Name of the model instance; the robot's where None.

    Returns:
        Handles to the platform in the plant.
    """
    instance = plant.AddModelInstance(name or robot.name)
    body = plant.AddRigidBody("platform", instance, platform_inertia(robot))
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -robot.gravity])
    if robot.is_planar():
        assert robot.plane_height is not None
        X_WPlane = RigidTransform([0.0, 0.0, robot.plane_height])
        plane = FixedOffsetFrame("plane", plant.world_frame(), X_WPlane, instance)
        joint = PlanarJoint("plane", plant.AddFrame(plane), body.body_frame(), np.zeros(3))
        plant.AddJoint(joint)
        joint.set_default_translation(robot.home.position[:2])
        joint.set_default_rotation(float(np.radians(robot.home.angles_deg[2])))
    else:
        plant.SetDefaultFloatingBaseBodyPose(body, robot.home.transform())
    if plant.geometry_source_is_registered():
        X_PShape, shape = platform_shape(robot)
        plant.RegisterVisualGeometry(body, X_PShape, shape, "platform", _PLATFORM_COLOR)
    return RobotInPlant(robot, plant, instance, body.index())
