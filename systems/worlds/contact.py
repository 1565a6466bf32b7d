"""Compliant contact of a platform with a world, in Drake's plant.

The platform's four lower corners, under its weight m g, press themselves `penetration` deep into
level ground: each point of contact has the stiffness k = m g / (4 penetration). So a platform that
stands on four corners vibrates with omega = sqrt(g / penetration) whatever its mass, 313 rad/s at
0.1 mm, which a step of a millisecond follows. With hydroelastic contact the modulus is that of
which the whole lower face comes to rest as deep.

Friction rises with the speed of slipping up to `slip_speed`; at its steepest it damps like
1.9 mu N / slip_speed, which is what limits the step of an explicit method, see `contact_step`.

Bodies that move are prescribed: they are bodies of the plant so heavy that what they meet moves
them by less than a nanometre, and `BodyDriver` gives them the accelerations of their motions.

Sources: Hunt and Crossley, Coefficient of restitution interpreted as damping in vibroimpact, 1975;
Drake, Modeling of frictional contact; Elandt et al., A pressure field model for fast, robust
approximation of net contact force and moment between nominally rigid objects, 2019.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactModel, CoulombFriction
from pydrake.multibody.tree import RigidBody, SpatialInertia, UnitInertia

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_in_plant import RobotInPlant, platform_box, platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.numerics.explicit_integration import largest_stable_step
from cdpr_drake.systems.worlds.settings import HYDROELASTIC, ContactSettings
from cdpr_drake.systems.worlds.world import World, WorldBody

STANDARD_GRAVITY = 9.81
"""For robots without gravity, whose platform presses on nothing by itself [m/s^2]."""

CORNERS = 4
"""On which a platform stands."""

CORNER_RADIUS = 1e-6
"""Of the spheres at the platform's corners [m]: points, which Drake's point contact needs as
spheres. A box on a box has one point of contact, which jumps from corner to corner."""

INSET = 2.0
"""By so many penetrations the platform's box lies behind its corners, so that where it stands on
these, the one point of contact that the box would add does not jump about below it."""

IMPACT = 2.0
"""Times its weight with which a platform that is landing may press, and friction is still stable;
beyond that friction is wrong by a jitter within its slip speed, for as long as that lasts."""

STEEPEST = 1.875
"""Largest slope of Drake's friction coefficient over speed, times slip speed over coefficient."""

DRIVEN_MASS = 1e9
"""Of bodies whose motion is prescribed [kg; kg m^2 about every axis]: a force of 1000 N on one that
`BodyDriver` leads moves it by 2.5 nm."""

RESOLUTION = 0.25
"""Length of the triangles of hydroelastic surfaces, of the platform's shortest edge."""


@dataclass(frozen=True)
class ContactLaw:
    """The constants of contact between the platform and everything else.

    Attributes:
        model: `settings.POINT` or `settings.HYDROELASTIC`.
        stiffness: Of one point of contact [N/m].
        modulus: Of hydroelastic contact [Pa].
        dissipation: Hunt and Crossley's d [s/m].
        friction: Coefficient of the platform's surface.
        slip_speed: Speed below which friction is less than its full value [m/s].
        penetration: At rest on four corners [m].
    """

    model: str
    stiffness: float
    modulus: float
    dissipation: float
    friction: float
    slip_speed: float
    penetration: float


def contact_law(settings: ContactSettings, robot: Robot) -> ContactLaw:
    """The law for a robot: stiffness by the platform's weight, critical damping if none is given.

    With k = m g / (4 penetration), damping d k penetration = m g d / 4 at each corner is critical
    for d = 2 / sqrt(g penetration).
    """
    gravity = robot.gravity or STANDARD_GRAVITY
    weight, depth = robot.platform.mass * gravity, settings.penetration
    size = robot.platform.size
    dissipation = settings.dissipation
    if dissipation is None:
        dissipation = 2.0 / float(np.sqrt(gravity * depth))
    return ContactLaw(
        model=settings.model,
        stiffness=weight / (CORNERS * depth),
        modulus=weight * 0.5 * float(np.min(size)) / (float(size[0] * size[1]) * depth),
        dissipation=dissipation,
        friction=settings.friction,
        slip_speed=settings.slip_speed,
        penetration=depth,
    )


def contact_step(robot: Robot, law: ContactLaw, friction: float, integrator: str) -> float:
    """The largest stable step of an explicit method for a platform on its four corners [s].

    Args:
        robot: The robot.
        law: The law.
        friction: Largest friction coefficient of what it may stand on.
        integrator: One of `explicit_integration.explicit_integrators()`.
    """
    J = np.array([_corner_velocities(p) for p in _corners(robot) if p[2] < robot.box_center()[2]])
    normal = law.stiffness * law.penetration
    slipping = STEEPEST * _both(law.friction, friction) * IMPACT * normal / law.slip_speed
    damping = np.diag([slipping, slipping, law.dissipation * normal])
    stiffness = np.diag([0.0, 0.0, law.stiffness])
    K = sum(j.T @ stiffness @ j for j in J)
    D = sum(j.T @ damping @ j for j in J)
    M = platform_inertia(robot).CopyToFullMatrix6()
    A = np.block([
        [np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]
    ])  # fmt: skip
    return largest_stable_step(np.linalg.eigvals(A), integrator)


def _both(one: float, other: float) -> float:
    """Friction coefficient of two surfaces, as Drake combines them."""
    return 2.0 * one * other / (one + other) if one + other > 0.0 else 0.0


def _corners(robot: Robot) -> list[Array]:
    """Corners of the platform's box in P, eight of shape (3,) [m]."""
    half = 0.5 * np.asarray(robot.platform.size, float)
    return [robot.box_center() + half * signs for signs in product((-1.0, 1.0), repeat=3)]


def _corner_velocities(p: Array) -> Array:
    """Maps V_WP = (w, v) to the velocity of a point p of the platform, shape (3, 6)."""
    x, y, z = p
    turn = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.hstack([turn, np.eye(3)])


def add_contact(
    robot: RobotInPlant, scene_graph: SceneGraph, world: World, law: ContactLaw
) -> list[tuple[WorldBody, RigidBody]]:
    """Makes platform and world touch each other in a plant that is not finalized.

    Args:
        robot: The platform in its plant, which is continuous and registered with the scene graph.
        scene_graph: The scene graph.
        world: The world.
        law: The law.

    Returns:
        The bodies of the world that move, each with its body in the plant, in the order of their
        states; see `BodyDriver`.
    """
    plant = robot.plant
    plant.set_contact_model(
        ContactModel.kHydroelasticWithFallback if law.model == HYDROELASTIC else ContactModel.kPoint
    )
    plant.set_stiction_tolerance(law.slip_speed)
    _add_platform(robot, law)
    instance = plant.AddModelInstance(MODEL_INSTANCE)
    plant.set_gravity_enabled(instance, False)
    moving, geometries = [], []
    for body in world.bodies:
        fixed = not body.motion.is_moving()
        parent, X_WB = plant.world_body(), body.motion.at(0.0)
        if not fixed:
            parent = plant.AddRigidBody(f"{body.name}_driven", instance, _driven_inertia())
            plant.SetDefaultFloatingBaseBodyPose(parent, X_WB)
            moving.append((body, parent))
        for number, part in enumerate(body.solids()):
            X_FG = X_WB @ part.X_BG if fixed else part.X_BG
            properties = _properties(law, body.friction)
            if law.model == HYDROELASTIC:
                hint = RESOLUTION * float(np.min(robot.robot.platform.size))
                AddRigidHydroelasticProperties(hint, properties)
            geometries.append(
                plant.RegisterCollisionGeometry(
                    parent, X_FG, part.shape, f"{body.name}_contact_{number}", properties
                )
            )
    _let_pass(scene_graph, geometries)
    return moving


MODEL_INSTANCE = "world_bodies"
"""Of the bodies that move, in the plant."""


def _let_pass(scene_graph: SceneGraph, geometries: list[GeometryId]) -> None:
    """Bodies of the world pass through each other: their motions are prescribed."""
    scene_graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeWithin(GeometrySet(geometries))
    )


def _driven_inertia() -> SpatialInertia:
    sphere = UnitInertia(1.0, 1.0, 1.0)
    return SpatialInertia(DRIVEN_MASS, np.zeros(3), sphere)


def _properties(law: ContactLaw, friction: float) -> ProximityProperties:
    """Both sides of a point of contact are alike: in series they have the law's stiffness."""
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=law.dissipation,
        point_stiffness=2.0 * law.stiffness,
        friction=CoulombFriction(friction, friction),
        properties=properties,
    )
    return properties


def _add_platform(robot: RobotInPlant, law: ContactLaw) -> None:
    plant, body = robot.plant, robot.body
    X_PBox, box = platform_box(robot.robot)
    properties = _properties(law, law.friction)
    if law.model == HYDROELASTIC:
        AddCompliantHydroelasticProperties(
            RESOLUTION * float(np.min(box.size())), law.modulus, properties
        )
        plant.RegisterCollisionGeometry(body, X_PBox, box, "platform_contact", properties)
        return
    inner = box.size() - 2.0 * min(INSET * law.penetration, 0.25 * float(np.min(box.size())))
    plant.RegisterCollisionGeometry(
        body, X_PBox, Box(*inner.tolist()), "platform_contact", properties
    )
    center = robot.robot.box_center()
    for number, corner in enumerate(_corners(robot.robot)):
        inside = corner - CORNER_RADIUS * np.sign(corner - center)
        plant.RegisterCollisionGeometry(
            body, RigidTransform(inside), Sphere(CORNER_RADIUS), f"corner_{number}", properties
        )
