"""Builds a robot's moving platform into a MultibodyPlant."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common.eigen_geometry import Quaternion_
from pydrake.geometry import Box, Shape
from pydrake.math import RigidTransform, RigidTransform_, RotationMatrix_
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    Frame,
    JointIndex,
    ModelInstanceIndex,
    PlanarJoint,
    PrismaticJoint,
    RigidBody,
    RotationalInertia,
    SpatialInertia,
    UniformGravityFieldElement,
    UnitInertia,
)
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.errors import DivergedError, RobotFileError
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.geometry.poses import floating_pose_into
from cdpr_drake.models.platform_schema import SHAPE_INERTIA
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot

_LOG = logging.getLogger(__name__)

_PLATFORM_COLOR = np.array([0.25, 0.45, 0.75, 1.0])

_PLANE, _LINE = "plane", "line"
"""Names of the joints."""

SAME_MASS = 1e-6
"""How far masses of one platform may be apart, relative: what files in decimals round away."""


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
        if self.robot.joint().is_floating:
            return int(self.body.floating_velocities_start_in_v())
        return int(self._joint().velocity_start())

    def _joint(self) -> PlanarJoint | PrismaticJoint:
        for name in (_PLANE, _LINE):
            if self.plant.HasJointNamed(name, self.model_instance):
                joint = self.plant.GetJointByName(name, self.model_instance)
                assert isinstance(joint, (PlanarJoint, PrismaticJoint))
                return joint
        raise AssertionError("the platform has a joint unless it floats")

    def set_pose(self, plant_context: Context, X_WP: RigidTransform) -> None:
        """Puts the platform at rest at X_WP [m]; what its joint cannot do is left out."""
        plant, moves = self.plant, self.robot.joint()
        if moves.is_floating:
            plant.SetFreeBodyPose(plant_context, self.body, X_WP)
        else:
            q, joint = moves.coordinates(X_WP), self._joint()
            if isinstance(joint, PlanarJoint):
                joint.set_pose(plant_context, q[:2], float(q[2]))
            else:
                joint.set_translation(plant_context, float(q[0]))
        nv = plant.num_velocities(self.model_instance)
        plant.SetVelocities(plant_context, self.model_instance, np.zeros(nv))

    def set_default_pose(self, X_WP: RigidTransform) -> None:
        """Puts the platform of default contexts at X_WP [m]; what its joint cannot do is left out.

        Drake's `plant.SetDefaultFreeBodyPose` does the same for a body in space.
        """
        moves = self.robot.joint()
        if moves.is_floating:
            self.plant.SetDefaultFloatingBaseBodyPose(self.body, X_WP)
            return
        q, joint = moves.coordinates(X_WP), self._joint()
        if isinstance(joint, PlanarJoint):
            joint.set_default_translation(q[:2])
            joint.set_default_rotation(float(q[2]))
        else:
            joint.set_default_translation(float(q[0]))

    def pose(self, plant_context: Context) -> RigidTransform:
        """X_WP of the platform [m]."""
        return self.plant.EvalBodyPoseInWorld(plant_context, self.body)


def carried_bodies(in_plant: RobotInPlant) -> tuple[str, ...]:
    """Names of the bodies with mass that joints hang on a platform, of a finalized plant."""
    plant, platform = in_plant.plant, in_plant.body
    joints = [plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices()]
    own = [j.index() for j in joints if j.child_body().index() == platform.index()]
    bodies = (plant.get_body(i) for i in plant.GetBodiesKinematicallyAffectedBy(own))
    return tuple(
        body.scoped_name().get_full()
        for body in bodies
        if body.index() != platform.index() and body.default_mass() > 0.0
    )


def pose_from_state(robot: Robot, state: Any) -> Any:
    """As `pose_on_joint`, of a robot; repeated callers make the joint once."""
    return pose_on_joint(robot.joint(), state)


def pose_on_joint(joint: PlatformJoint, state: Any) -> Any:
    """X_WP from the platform's state as the plant's port gives it, shape (13,), (6,) or (2,).

    A RigidTransform, or one of AutoDiffXd where the state is an array of these.

    Raises:
        DivergedError: The quaternion is zero, or its square no finite number.
    """
    if np.asarray(state).dtype == object:
        return _pose_of_any(joint, state)
    if not joint.is_floating:
        return joint.pose_at(state)
    matrix = np.empty((3, 4))
    if not 0.0 < floating_pose_into(np.array(state[:7]), matrix) < math.inf:
        words = ", ".join(f"{number:.3g}" for number in state[:4])
        raise DivergedError(f"the platform's quaternion ({words}) is no orientation")
    return RigidTransform.MakeUnchecked(matrix)


def _pose_of_any(joint: PlatformJoint, state: Any) -> Any:
    if joint.is_floating:
        q = state[:4] / np.sqrt(np.sum(state[:4] * state[:4]))
        return RigidTransform_[AutoDiffXd](Quaternion_[AutoDiffXd](q), state[4:7])
    if joint.is_line:
        zero = AutoDiffXd(0.0)
        X_FM = RigidTransform_[AutoDiffXd](np.array([state[0], zero, zero]))
    else:
        R = RotationMatrix_[AutoDiffXd].MakeZRotation(state[2])
        X_FM = RigidTransform_[AutoDiffXd](
            R, np.array([state[0], state[1], AutoDiffXd(joint.height)])
        )
    X_MP = RigidTransform(joint.R_PM.inverse(), np.zeros(3))
    return joint.X_WF.cast[AutoDiffXd]() @ X_FM @ X_MP.cast[AutoDiffXd]()


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


def add_robot(
    plant: MultibodyPlant, robot: Robot | str | Path, name: str | None = None
) -> RobotInPlant:
    """Adds the moving platform of `robot` to a plant that is not finalized.

    A body in space gets a floating body with quaternion, as do a point mass in space and a beam,
    whose spin nothing excites; a body or point mass in a plane a planar joint named "plane", a
    point mass on a line a prismatic one named "line", in the frames of `PlatformJoint`. Without
    collision geometry: the platform passes through what it meets, unless `systems.add_contact` is
    called. The cables are a system of their own, `systems.CableForces`. The plant's gravity is set
    to the robot's, with a warning in the log if that changes it for other bodies, or from a value
    that was set before; the default pose is the robot's home pose.

    Args:
        plant: Continuous MultibodyPlant; registered with a SceneGraph, it also shows the platform.
        robot: The robot, by name, path, or itself.
        name: Name of the model instance; the robot's where None.

    Returns:
        Handles to the platform in the plant.

    Raises:
        RobotFileError: It is a Mechanism, which `add_mechanism` takes, or there is none of that
            name.
    """
    robot = as_robot(robot, "add_robot")
    instance = plant.AddModelInstance(name or robot.name)
    body = plant.AddRigidBody("platform", instance, platform_inertia(robot))
    _set_gravity(plant, robot)
    moves = robot.joint()
    if moves.is_floating:
        plant.SetDefaultFloatingBaseBodyPose(body, robot.home.transform())
    else:
        _add_joint(plant, body, moves, moves.coordinates(robot.home.transform()))
    if plant.geometry_source_is_registered():
        X_PShape, shape = platform_shape(robot)
        plant.RegisterVisualGeometry(body, X_PShape, shape, "platform", _PLATFORM_COLOR)
    return RobotInPlant(robot, plant, instance, body.index())


def _set_gravity(plant: MultibodyPlant, robot: Robot) -> None:
    """Gives a plant a robot's gravity; warns where that was another one for a reason."""
    before = np.array(plant.gravity_field().gravity_vector())
    usual = np.array([0.0, 0.0, -UniformGravityFieldElement.kDefaultStrength])
    others = plant.num_bodies() > 2  # besides the world and this platform
    after = robot.gravity_vector()
    if not np.array_equal(before, after) and (others or not np.array_equal(before, usual)):
        _LOG.warning(
            "gravity of the whole plant: was (%g, %g, %g), is now that of %s, (%g, %g, %g) m/s^2",
            *before, robot.name, *after,
        )  # fmt: skip
    plant.mutable_gravity_field().set_gravity_vector(after)


def find_robot(
    plant: MultibodyPlant, robot: Robot | str | Path, name: str | None = None
) -> RobotInPlant:
    """The platform of a robot that something else put into a plant, as model directives do.

    Args:
        plant: The plant, finalized.
        robot: The robot, a body in space (3R3T), by name, path, or itself.
        name: Name of its model instance; the robot's where None.

    Returns:
        Handles to the platform, as `add_robot` gives them. Gravity is that of the plant.

    Raises:
        RobotFileError: There is no such model instance, no free body `platform` in it, its
            mass is another one, or further bodies of the instance move, too.
    """
    robot = as_robot(robot, "find_robot")
    name = name or robot.name
    if not plant.HasModelInstanceNamed(name):
        raise RobotFileError(f"robot {robot.name}: found no model instance {name} in the plant")
    instance = plant.GetModelInstanceByName(name)
    if not robot.joint().is_floating or not robot.motion_type().is_free:
        raise RobotFileError(
            f"robot {robot.name}: motion: found {robot.motion}; accepted by find_robot: 3R3T"
        )
    if not plant.HasBodyNamed("platform", instance):
        raise RobotFileError(f"model instance {name}: found no body platform; accepted: one")
    body = plant.GetBodyByName("platform", instance)
    if not body.is_floating_base_body() or plant.num_velocities(instance) != 6:
        raise RobotFileError(
            f"model instance {name}: found {plant.num_velocities(instance)} velocities; accepted: "
            "6, a free platform and all else welded to the world, as by the exported directives"
        )
    mass = body.default_mass()
    if abs(mass - robot.platform.mass) > SAME_MASS * robot.platform.mass:
        raise RobotFileError(
            f"model instance {name}: found a platform of {mass:g} kg; accepted: "
            f"{robot.platform.mass:g} kg, as robot {robot.name} has"
        )
    return RobotInPlant(robot, plant, instance, body.index())


def _add_joint(plant: MultibodyPlant, body: RigidBody, moves: PlatformJoint, home: Array) -> None:
    """Adds a joint in a plane or along a line; home: its coordinates there."""
    instance = body.model_instance()
    name = _LINE if moves.is_line else _PLANE
    X_WF = moves.X_WF @ RigidTransform([0.0, 0.0, moves.height])
    F = plant.AddFrame(FixedOffsetFrame(name, plant.world_frame(), X_WF, instance))
    M: Frame = body.body_frame()
    if not moves.R_PM.IsExactlyIdentity():
        X_PM = RigidTransform(moves.R_PM, np.zeros(3))
        M = plant.AddFrame(FixedOffsetFrame("joint", M, X_PM, instance))
    if moves.is_line:
        line = plant.AddJoint(PrismaticJoint(name, F, M, [1.0, 0.0, 0.0]))
        line.set_default_translation(float(home[0]))
        return
    plane = plant.AddJoint(PlanarJoint(name, F, M, np.zeros(3)))
    plane.set_default_translation(home[:2])
    plane.set_default_rotation(float(home[2]))
