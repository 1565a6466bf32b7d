"""Machines on cables between any bodies: plants with points of cables, plausible numbers.

All bodies have mass and three moments of inertia, so that other engines take them too. Cables have
no damping, weight and pulleys; default positions of a plant are the machine's home.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    ModelInstanceIndex,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
    UniversalJoint,
    WeldJoint,
)

from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot

STIFFNESS = 1e4
"""E S of all cables [N]: soft, so that accelerations a decimetre from home are of sane size."""

X, Y, Z = np.eye(3)

shipped = cache(load_robot)
"""Robots that nobody here changes."""

Points = dict[str, list[tuple[Any, Any]]]
"""Points of each cable by its name: (body, p) from its exit point to its anchor point."""


def add_body(plant: MultibodyPlant, name: str, mass: float, size: Any, com: Any) -> Any:
    """A solid box of that size, turned in its body's frame, with its centre of mass at com."""
    own = SpatialInertia.SolidBoxWithMass(mass, *size)
    turned = own.ReExpress(RollPitchYaw(0.3, -0.2, 0.4).ToRotationMatrix())
    instance = ModelInstanceIndex(plant.num_model_instances() - 1)
    return plant.AddRigidBody(name, instance, turned.Shift(-np.array(com, float)))


def frame_of(plant: MultibodyPlant, body: Any, name: str, p: Any, angles: Any = (0, 0, 0)) -> Any:
    """A frame on a body, where a joint is."""
    X_BF = RigidTransform(RollPitchYaw(np.array(angles, float)), np.array(p, float))
    return plant.AddFrame(FixedOffsetFrame(name, body, X_BF))


def add_hinge(
    plant: MultibodyPlant, name: str, parent: Any, p: Any, body: Any, axis: Any, angle: float,
    angles: Any = (0, 0, 0), driven: bool = True,
) -> Any:  # fmt: skip
    """A revolute joint at p of a parent, the child's origin there, at an angle by default."""
    F = frame_of(plant, parent, f"{name}_frame", p, angles)
    joint = plant.AddJoint(RevoluteJoint(name, F, body.body_frame(), axis))
    joint.set_default_angle(angle)
    if driven:
        plant.AddJointActuator(name, joint)
    return joint


def _robot_points(robot: Any, body: Any, plant: MultibodyPlant) -> Points:
    return {
        cable.name: [(plant.world_body(), A), (body, B)]
        for cable, A, B in zip(
            robot.cables, robot.exit_points().T, robot.anchor_points().T, strict=True
        )
    }


def acrobot_arm(plant: MultibodyPlant) -> Points:
    """ACROBOT, fully constrained, with a driven arm of two joints below its platform."""
    in_plant = add_robot(plant, shipped("acrobot_fully_constrained"))
    plant.AddModelInstance("arm")
    upper = add_body(plant, "upper", 0.35, (0.03, 0.03, 0.16), (0.0, 0.004, -0.08))
    lower = add_body(plant, "lower", 0.25, (0.025, 0.03, 0.14), (0.003, 0.0, -0.07))
    add_hinge(plant, "shoulder", in_plant.body, (0.03, -0.02, -0.035), upper, Y, 0.6, (0, 0, 0.2))
    add_hinge(plant, "elbow", upper, (0.0, 0.0, -0.16), lower, Y, -0.9, (0.1, 0, 0))
    return _robot_points(in_plant.robot, in_plant.body, plant)


def hanging_arm(plant: MultibodyPlant) -> Points:
    """ACROBOT, suspended, with a passive arm on a universal joint and a hinge.

    What cables push where they should pull leaves a robot that is fully constrained where it is;
    this one falls.
    """
    in_plant = add_robot(plant, shipped("acrobot_large"))
    plant.AddModelInstance("arm")
    upper = add_body(plant, "upper", 0.35, (0.03, 0.03, 0.16), (0.0, 0.0, -0.08))
    lower = add_body(plant, "lower", 0.25, (0.025, 0.03, 0.14), (0.0, 0.0, -0.07))
    F = frame_of(plant, in_plant.body, "shoulder_frame", (0.02, 0.0, -0.035), (0, 0, 0.3))
    shoulder = plant.AddJoint(UniversalJoint("shoulder", F, upper.body_frame()))
    shoulder.set_default_angles([0.0, 0.0])
    add_hinge(plant, "elbow", upper, (0.0, 0.0, -0.16), lower, X, 0.0, driven=False)
    return _robot_points(in_plant.robot, in_plant.body, plant)


def planar_arm(plant: MultibodyPlant) -> Points:
    """Two links on hinges in the plane x, z, with a cable that runs from the base over both."""
    W = plant.world_body()
    upper = add_body(plant, "upper", 1.2, (0.4, 0.05, 0.06), (0.2, 0.0, 0.01))
    lower = add_body(plant, "lower", 0.8, (0.35, 0.04, 0.05), (0.17, 0.0, 0.0))
    add_hinge(plant, "shoulder", W, (0.0, 0.0, 0.5), upper, -Y, 0.9, driven=False)
    add_hinge(plant, "elbow", upper, (0.4, 0.0, 0.0), lower, -Y, -1.1, driven=False)
    return {
        "up": [(W, (-0.25, 0.0, 0.9)), (upper, (0.3, 0.0, 0.04))],
        "down": [(W, (0.35, 0.0, 0.1)), (upper, (0.3, 0.0, -0.04))],
        "over": [
            (W, (-0.1, 0.02, 0.75)),
            (upper, (0.1, 0.02, 0.08)),
            (upper, (0.36, 0.02, 0.12)),
            (lower, (0.12, 0.02, 0.11)),
        ],
        "bend": [(upper, (0.1, -0.02, -0.06)), (lower, (0.15, -0.02, -0.06))],
    }


def human_arm(plant: MultibodyPlant) -> Points:
    """An upper arm on a ball and a forearm on a hinge, with muscles from bone to bone."""
    W = plant.world_body()
    upper = add_body(plant, "upper_arm", 2.0, (0.07, 0.08, 0.3), (0.0, 0.01, -0.14))
    fore = add_body(plant, "forearm", 1.4, (0.06, 0.05, 0.26), (0.005, 0.0, -0.12))
    F = frame_of(plant, W, "shoulder_frame", (0.0, 0.0, 1.4), (0.2, 0.1, -0.3))
    M = frame_of(plant, upper, "upper_frame", (0.0, 0.0, 0.01), (0.2, 0.1, -0.3))
    shoulder = plant.AddJoint(BallRpyJoint("shoulder", F, M))
    shoulder.set_default_angles([0.1, -0.15, 0.1])
    add_hinge(plant, "elbow", upper, (0.0, 0.0, -0.3), fore, Y, -1.0, driven=False)
    return {
        "front": [(W, (0.35, 0.05, 1.45)), (upper, (0.05, 0.05, -0.2))],
        "back": [(W, (-0.35, -0.08, 1.35)), (upper, (-0.05, 0.06, -0.2))],
        "left": [(W, (0.05, 0.4, 1.4)), (upper, (-0.05, 0.05, -0.18))],
        "right": [(W, (-0.05, -0.4, 1.35)), (upper, (-0.04, -0.06, -0.22))],
        "biceps": [(W, (0.12, 0.0, 1.42)), (upper, (0.06, 0.0, -0.05)), (fore, (0.04, 0.0, -0.09))],
        "triceps": [(upper, (-0.06, 0.0, -0.1)), (fore, (-0.08, 0.0, 0.03))],
    }


def _around(platform: Any, center: Any, half: Any, exits: Any) -> Any:
    """Eight cables in the manner of ACROBOT: low exits to high anchors, high to low, crossed."""
    a, b, h = half
    low = [(a, -b, h), (-a, -b, h), (-a, b, h), (a, b, h)]
    high = [(-a, b, -h), (a, b, -h), (a, -b, -h), (-a, -b, -h)]
    x, y, z = exits
    corners = [(x, y), (-x, y), (-x, -y), (x, -y)]
    cx, cy = center
    for k, (cornerx, cornery) in enumerate(corners):
        yield (cx + cornerx, cy + cornery, 0.0), (platform, low[k])
        yield (cx + 0.9 * cornerx * (-1), cy + 1.1 * cornery, z), (platform, high[k])


def two_platforms(plant: MultibodyPlant) -> Points:
    """Two platforms on eight cables each; two exit blocks serve both, two cables join them."""
    W = plant.world_body()
    left = add_body(plant, "left", 3.5, (0.18, 0.17, 0.07), (0.01, 0.0, 0.03))
    right = add_body(plant, "right", 2.5, (0.18, 0.17, 0.07), (0.0, -0.01, 0.03))
    half = (0.09, 0.085, 0.035)
    for body, x, height, yaw in ((left, -0.55, 0.5, 0.1), (right, 0.55, 0.6, -0.1)):
        pose = RigidTransform(RollPitchYaw(0.0, 0.0, yaw), [x, 0.0, height])
        plant.SetDefaultFloatingBaseBodyPose(body, pose)
    points: Points = {}
    for body, x in ((left, -0.55), (right, 0.55)):
        for k, (A, end) in enumerate(_around(body, (x, 0.0), half, (0.5, 0.5, 1.2)), 1):
            points[f"{body.name()} {k}"] = [(W, A), end]
    # The blocks of the left one between both, high up, serve the right one too.
    for mine, other in (("right 2", "left 4"), ("right 8", "left 6")):
        points[mine][0] = points[other][0]
    # Two cables of the right one start at the left one instead of the floor.
    points["right 3"][0] = (left, (0.09, 0.085, -0.035))
    points["right 5"][0] = (left, (0.09, -0.085, -0.035))
    return points


def _bases(plant: MultibodyPlant) -> tuple[Any, list[Any]]:
    W = plant.world_body()
    platform = add_body(plant, "platform", 4.0, (0.3, 0.3, 0.1), (0.0, 0.01, 0.02))
    pose = RigidTransform(RollPitchYaw(0.0, 0.0, 0.1), [0.0, 0.0, 0.8])
    plant.SetDefaultFloatingBaseBodyPose(platform, pose)
    bases = []
    for k, (x, y) in enumerate(((1.5, 1.5), (-1.5, 1.5), (-1.5, -1.5), (1.5, -1.5)), 1):
        slide = add_body(plant, f"slide_{k}", 3.0, (0.4, 0.3, 0.1), (0.0, 0.0, 0.1))
        base = add_body(plant, f"base_{k}", 12.0, (0.4, 0.4, 0.6), (0.0, 0.0, 0.3))
        F = frame_of(plant, W, f"rail_{k}", (x, y, 0.0), (0, 0, 0.2 * k))
        for name, at, body, axis in (
            (f"x_{k}", F, slide, X),
            (f"y_{k}", slide.body_frame(), base, Y),
        ):
            joint = plant.AddJoint(PrismaticJoint(name, at, body.body_frame(), axis))
            plant.AddJointActuator(name, joint)
        mast = add_body(plant, f"mast_{k}", 2.0, (0.06, 0.06, 1.6), (0.0, 0.0, 0.8))
        X_BM = RigidTransform(RollPitchYaw(0.0, 0.0, -0.2 * k), [0.0, 0.0, 0.2])
        plant.AddJoint(WeldJoint(f"foot_{k}", base.body_frame(), mast.body_frame(), X_BM))
        bases.append(mast)
    return platform, bases


def mobile_bases(plant: MultibodyPlant) -> Points:
    """Four bases that drive along x and y and carry a platform by two cables each."""
    platform, masts = _bases(plant)
    points: Points = {}
    for k, (mast, (x, y)) in enumerate(
        zip(masts, ((1, 1), (-1, 1), (-1, -1), (1, -1)), strict=True), 1
    ):
        points[f"high {k}"] = [(mast, (0.02, 0.03, 1.5)), (platform, (-0.15 * x, 0.15 * y, -0.05))]
        points[f"low {k}"] = [(mast, (0.03, -0.02, 0.1)), (platform, (0.15 * x, -0.15 * y, 0.05))]
    return points


def mobile_masts(plant: MultibodyPlant) -> Points:
    """The same over eyelets on the masts: winches on the bases, eyelets high and low."""
    points = mobile_bases(plant)
    for k in range(1, 5):
        base = plant.GetBodyByName(f"base_{k}")
        mast, p = points[f"high {k}"][0]
        points[f"high {k}"][:1] = [(base, (0.1, 0.1, 0.3)), (mast, (0.04, 0.0, 0.6)), (mast, p)]
        mast, p = points[f"low {k}"][0]
        points[f"low {k}"][:1] = [(base, (-0.1, 0.1, 0.35)), (mast, p)]
    return points


def zoo(plant: MultibodyPlant) -> Points:
    """Bodies on joints of every kind that compiled joints know, in frames that are turned.

    No machine that could stand: for comparisons in any state.
    """
    W = plant.world_body()
    random = np.random.default_rng(5)
    bodies = [W]

    def frames(name: str, parent: Any, body: Any) -> tuple[Any, Any]:
        return tuple(
            frame_of(plant, on, f"{name}_{end}", random.uniform(-0.2, 0.2, 3),
                     random.uniform(-1.0, 1.0, 3))
            for on, end in ((parent, "F"), (body, "M"))
        )  # fmt: skip

    def add(name: str, parent: Any, make: Callable[[Any, Any], Any]) -> Any:
        body = add_body(plant, name, 1.0, (0.2, 0.3, 0.25), random.uniform(-0.05, 0.05, 3))
        plant.AddJoint(make(*frames(name, parent, body)))
        bodies.append(body)
        return body

    plane = add("plane", W, lambda F, M: PlanarJoint("plane", F, M, np.zeros(3)))
    ball = add("ball", plane, lambda F, M: BallRpyJoint("ball", F, M))
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    hinge = add("hinge", ball, lambda F, M: RevoluteJoint("hinge", F, M, axis))
    slide = add("slide", hinge, lambda F, M: PrismaticJoint("slide", F, M, axis))
    fixed = add(
        "fixed", slide,
        lambda F, M: WeldJoint("fixed", F, M, RigidTransform(RollPitchYaw(0.2, 0.4, 0.1), X)),
    )  # fmt: skip
    add("cross", fixed, lambda F, M: UniversalJoint("cross", F, M))
    free = add_body(plant, "free", 1.5, (0.2, 0.3, 0.25), (0.02, 0.0, 0.03))
    plant.SetDefaultFloatingBaseBodyPose(free, RigidTransform([0.0, 0.0, 1.5]))
    add("branch", free, lambda F, M: RevoluteJoint("branch", F, M, axis))
    bodies.append(free)
    points: Points = {}
    for k in range(12):
        count = 2 + k % 3
        on = [bodies[i] for i in random.choice(len(bodies), count, replace=False)]
        points[f"cable {k + 1}"] = [(body, random.uniform(-0.3, 0.3, 3)) for body in on]
    return points


MACHINES: dict[str, Callable[[MultibodyPlant], Points]] = {
    "acrobot_arm": acrobot_arm,
    "hanging_arm": hanging_arm,
    "planar_arm": planar_arm,
    "human_arm": human_arm,
    "two_platforms": two_platforms,
    "mobile_bases": mobile_bases,
    "mobile_masts": mobile_masts,
    "zoo": zoo,
}
"""Machines by name; all but the zoo stand at home on tensions above 0."""

STANDING = tuple(name for name in MACHINES if name != "zoo")
