"""A robot whose cables are rigid links: universal, prismatic and spherical joint, UPS.

That is how simulators of rigid bodies without cables model a cable robot. Per cable, a guide turns
about the exit point A on a universal joint and carries, on a prismatic joint, a rod whose end B is
held to the platform by a ball constraint, the spherical joint that closes the loop. A tension pulls
the rod into the guide. Compare it with straight cables, to which it tends as the rods get lighter.

Source: Gazebo thesis 5.4, 5.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    JointIndex,
    ModelInstanceIndex,
    PrismaticJoint,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
)
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError, RobotFileError
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_in_plant import RobotInPlant, add_robot
from cdpr_drake.models.robot_schema import Robot

_ROD_COLOR = np.array([0.3, 0.3, 0.3, 1.0])


@dataclass(frozen=True)
class UpsInPlant:
    """Where a robot with rods went in a plant; made by `add_ups_robot`.

    Attributes:
        in_plant: The robot's platform in the plant.
        rods: Model instance of guides and rods.
        X_WA: Poses of the guides at the home pose, z along the cable, one per cable [m].
        universal: Universal joints, in cable order.
        prismatic: Prismatic joints, in cable order; their coordinate is the length |A B| [m].
    """

    in_plant: RobotInPlant
    rods: ModelInstanceIndex
    X_WA: tuple[RigidTransform, ...]
    universal: tuple[JointIndex, ...]
    prismatic: tuple[JointIndex, ...]

    def set_pose(self, plant_context: Context, X_WP: RigidTransform) -> None:
        """Puts platform and rods at rest where their ends meet, at a pose of the platform [m]."""
        plant = self.in_plant.plant
        self.in_plant.set_pose(plant_context, X_WP)
        p_WB = X_WP.multiply(self.in_plant.robot.anchor_points())
        for X_WA, universal, prismatic, p in zip(
            self.X_WA, self.universal, self.prismatic, p_WB.T, strict=True
        ):
            x, y, z = X_WA.inverse().multiply(p)
            length = float(np.linalg.norm([x, y, z]))
            # Rx(a) Ry(b) z = (sin b, -sin a cos b, cos a cos b)
            angles = [np.arctan2(-y, z), np.arcsin(x / length)]
            joint = plant.get_joint(universal)
            joint.set_angles(plant_context, angles)
            joint.set_angular_rates(plant_context, np.zeros(2))
            slide = plant.get_joint(prismatic)
            slide.set_translation(plant_context, length)
            slide.set_translation_rate(plant_context, 0.0)

    def gaps(self, plant_context: Context) -> Array:
        """Distances between the rods' ends and the anchor points, shape (m,) [m]."""
        plant, robot = self.in_plant.plant, self.in_plant.robot
        p_WB = self.in_plant.pose(plant_context).multiply(robot.anchor_points())
        ends = [
            plant.EvalBodyPoseInWorld(
                plant_context, plant.get_joint(index).child_body()
            ).translation()
            for index in self.prismatic
        ]
        return np.asarray(np.linalg.norm(p_WB - np.array(ends).T, axis=0))


def rod_masses(robot: Robot) -> Array:
    """Mass of each cable between exit and anchor point at the home pose, shape (m,) [kg]."""
    cables = robot.cable_set().without_pulleys()
    lengths = cable_lengths(robot.home.transform(), cables.p_WA, cables.p_PB)
    return np.array([material.linear_density for material in robot.materials()]) * lengths


def add_ups_robot(plant: MultibodyPlant, robot: Robot, masses: Array) -> UpsInPlant:
    """Adds a robot with rods in place of cables to a plant that is not finalized.

    Rods are thin and as long as the cables at the home pose; guides have no mass, the platform is
    that of `add_robot`. Each prismatic joint has an actuator of the name of its cable, whose
    positive force lengthens: actuate with the negative tensions.

    Args:
        plant: Discrete MultibodyPlant: a continuous one has no ball constraints.
        robot: The robot, spatial.
        masses: Of the rods, positive, shape (m,) [kg]; see `rod_masses`.

    Raises:
        RobotFileError: The robot is not of type 3R3T, for which this model is made.
        CableModelError: A mass is not positive, or there is not one for each cable.
    """
    masses = np.asarray(masses, float)
    if masses.shape != (len(robot.cables),) or not np.all(masses > 0.0):
        raise CableModelError(
            f"masses of rods: found {masses.tolist()}; accepted: {len(robot.cables)} numbers > 0 "
            "[kg]"
        )
    if not robot.motion_type().is_free:
        raise RobotFileError(
            f"robot {robot.name}: motion: found {robot.motion}; accepted for rods in place of "
            "cables: 3R3T"
        )
    in_plant = add_robot(plant, robot)
    # Of their own, so that the platform's state keeps a port of its own.
    instance = plant.AddModelInstance(f"{plant.GetModelInstanceName(in_plant.model_instance)}_rods")
    X_WP = robot.home.transform()
    p_WA, p_PB, diameters = robot.exit_points(), robot.anchor_points(), robot.diameters()
    poses, universal, prismatic = [], [], []
    for i, cable in enumerate(robot.cables):
        along = X_WP.multiply(p_PB[:, i]) - p_WA[:, i]
        length = float(np.linalg.norm(along))
        X_WA = RigidTransform(RotationMatrix.MakeFromOneVector(along / length, 2), p_WA[:, i])
        massless = SpatialInertia(0.0, np.zeros(3), UnitInertia.SolidSphere(1.0))
        guide = plant.AddRigidBody(f"guide_{cable.name}", instance, massless)
        # The rod's frame lies at its end B, its body behind it towards A.
        unit = UnitInertia.ThinRod(length, np.array([0.0, 0.0, 1.0]))
        about_middle = SpatialInertia(float(masses[i]), np.zeros(3), unit)
        end = about_middle.Shift(np.array([0.0, 0.0, length / 2.0]))
        rod = plant.AddRigidBody(f"rod_{cable.name}", instance, end)
        exit_frame = plant.AddFrame(
            FixedOffsetFrame(f"exit_{cable.name}", plant.world_frame(), X_WA, instance)
        )
        turn = UniversalJoint(f"turn_{cable.name}", exit_frame, guide.body_frame())
        slide = PrismaticJoint(
            f"slide_{cable.name}", guide.body_frame(), rod.body_frame(), np.array([0.0, 0.0, 1.0])
        )
        universal.append(plant.AddJoint(turn).index())
        joint = plant.AddJoint(slide)
        joint.set_default_translation(length)
        prismatic.append(joint.index())
        plant.AddJointActuator(cable.name, joint)
        plant.AddBallConstraint(in_plant.body, p_PB[:, i], rod, np.zeros(3))
        if plant.geometry_source_is_registered():
            X_RodMiddle = RigidTransform([0.0, 0.0, -length / 2.0])
            shape = Cylinder(float(diameters[i]) / 2.0, length)
            plant.RegisterVisualGeometry(rod, X_RodMiddle, shape, "rod", _ROD_COLOR)
        poses.append(X_WA)
    return UpsInPlant(in_plant, instance, tuple(poses), tuple(universal), tuple(prismatic))
