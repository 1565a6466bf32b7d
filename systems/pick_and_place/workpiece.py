"""A box with a tag as a body of a plant, the goal's tag, and what stands for the gripper."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    CollisionFilterDeclaration,
    Cylinder,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia

from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.scene import add_plates
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.pick_and_place_settings import PlacedTag, WorkpieceSettings

INSTANCE = "workpiece"
BOX_COLOR = np.array([0.80, 0.62, 0.25, 1.0])
GRIPPER_COLOR = np.array([0.15, 0.15, 0.18, 1.0])

PLATE = 5e-4
"""Height of a tag above what it lies on [m], so that what it lies on does not show through."""

PENETRATION = 1e-4
"""How deep its weight presses a box that stands on four corners [m]: contact's stiffness."""

CORNER_RADIUS = 1e-6
"""Of the spheres at the box's corners [m]; points, as at a platform's, see `worlds.contact`."""

SUPPORTS = 4
STEM_RADIUS = 6e-3


def tag_pose(tag: PlacedTag, height: float) -> RigidTransform:
    """Pose of a tag that lies on a face at a height above the middle of what it is fixed to [m]."""
    turn = RollPitchYaw(0.0, 0.0, float(np.radians(tag.angle_deg)))
    return RigidTransform(turn, [*tag.position, height + PLATE])


def placed_tags(scenario: PickAndPlaceScenario) -> tuple[RigidTransform, RigidTransform]:
    """Poses of the box's tag in B, and of the goal's tag in W, where it truly is [m]."""
    half = 0.5 * float(scenario.workpiece.size[2])
    _, X_WG = scenario.places()
    return tag_pose(scenario.workpiece.tag, half), X_WG @ tag_pose(scenario.goal.tag, -half)


def contact_stiffness(settings: WorkpieceSettings, gravity: float) -> float:
    """Of one of its corners [N/m]."""
    return settings.mass * gravity / (SUPPORTS * PENETRATION)


def contact_dissipation(gravity: float) -> float:
    """Hunt and Crossley's d [s/m], a quarter of what damps it critically on its corners."""
    return 0.5 / float(np.sqrt(gravity * PENETRATION))


def add_workpiece(
    robot: RobotInPlant, scene_graph: SceneGraph, settings: WorkpieceSettings, gravity: float
) -> RigidBody:
    """Adds the box, free to move, to the plant of a robot that is not finalized.

    Its corners touch whatever has contact in the plant, but for the platform, which only the
    gripper connects with it.

    Args:
        robot: The platform in its plant.
        scene_graph: The scene graph.
        settings: The box.
        gravity: Acceleration of free fall [m/s^2].
    """
    plant = robot.plant
    instance = plant.AddModelInstance(INSTANCE)
    size = [float(edge) for edge in settings.size]
    inertia = SpatialInertia.SolidBoxWithMass(settings.mass, *size)
    body = plant.AddRigidBody(INSTANCE, instance, inertia)
    plant.SetDefaultFloatingBaseBodyPose(body, settings.pose.transform())
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(*size), INSTANCE, BOX_COLOR)
    add_plates(
        plant, settings.tag.target().plates(), tag_pose(settings.tag, 0.5 * size[2]), "box_tag",
        body,
    )  # fmt: skip
    properties = ProximityProperties()
    stiffness = contact_stiffness(settings, gravity)
    AddContactMaterial(
        dissipation=contact_dissipation(gravity),
        point_stiffness=2.0 * stiffness,
        friction=CoulombFriction(settings.friction, settings.friction),
        properties=properties,
    )
    inner = 0.5 * settings.size - CORNER_RADIUS
    geometries = []
    for number in range(8):
        signs = np.array([(number >> axis & 1) * 2.0 - 1.0 for axis in range(3)])
        geometries.append(
            plant.RegisterCollisionGeometry(
                body, RigidTransform(signs * inner), Sphere(CORNER_RADIUS),
                f"box_corner_{number}", properties,
            )
        )  # fmt: skip
    own = plant.GetCollisionGeometriesForBody(robot.body)
    if own:
        scene_graph.collision_filter_manager().Apply(
            CollisionFilterDeclaration().ExcludeBetween(
                GeometrySet(geometries), GeometrySet(list(own))
            )
        )
    return body


def add_stem(robot: RobotInPlant, tip: np.ndarray) -> None:
    """Shows a gripper, whose tip is in P [m]."""
    shape, X_PStem = stem(tip)
    robot.plant.RegisterVisualGeometry(robot.body, X_PStem, shape, "gripper", GRIPPER_COLOR)


def stem(tip: np.ndarray) -> tuple[Cylinder, RigidTransform]:
    """A gripper from the height of Po down to its tip in P, and its pose in P [m]."""
    length = float(max(abs(tip[2]), 2.0 * STEM_RADIUS))
    return Cylinder(STEM_RADIUS, length), RigidTransform([tip[0], tip[1], tip[2] + 0.5 * length])


def add_goal(
    plant: MultibodyPlant, X_WG: RigidTransform, tag: PlacedTag, X_GT: RigidTransform
) -> None:
    """Shows the goal's tag in the world, where it truly is [m]."""
    add_plates(plant, tag.target().plates(), X_WG @ X_GT, "goal_tag")
