"""Of a parsed plant: what is the frame, what the platform, and which joints are between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    Joint,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    WeldJoint,
)
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.formats.draft import RobotDraft
from cdpr_drake.formats.platform_motion import moved_by_joints, set_motion
from cdpr_drake.models.foreign_text import fail

FLOATING = ("quaternion_floating", "rpy_floating")
"""Types of the joints that Drake gives free bodies."""


@dataclass
class CarriedBodies:
    """Bodies of a plant, by what they are to a robot on cables.

    Attributes:
        platform: The body whose frame is P.
        composite: Bodies that move as one with it, itself included: welded to it, or carried by a
            joint that was fixed where it stands.
        carrying: Joints between frame and platform, from the frame on; empty: it is free.
        fixed: Joints that were fixed, from the platform to what it carries.
        frame: Bodies that stand still.
        others: Bodies that are neither.
        remarks: What was fixed or not kept.
    """

    platform: RigidBody
    composite: list[RigidBody] = field(default_factory=list)
    carrying: list[Joint] = field(default_factory=list)
    fixed: list[Joint] = field(default_factory=list)
    frame: list[RigidBody] = field(default_factory=list)
    others: list[RigidBody] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def _joints_to(plant: MultibodyPlant) -> dict[int, list[Joint]]:
    """Joints from the world to each body, by the body's index, the world's end first."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    ways: dict[int, list[Joint]] = {int(plant.world_body().index()): []}
    grown = True
    while grown:
        grown = False
        for joint in joints:
            ends = int(joint.parent_body().index()), int(joint.child_body().index())
            for here, there in (ends, ends[::-1]):
                if here in ways and there not in ways:
                    ways[there] = [*ways[here], joint]
                    grown = True
    return ways


def _moving(way: Sequence[Joint]) -> list[Joint]:
    return [joint for joint in way if not isinstance(joint, WeldJoint)]


def find_carried(
    path: Path,
    plant: MultibodyPlant,
    exits: dict[str, RigidBody],
    anchors: dict[str, RigidBody],
) -> CarriedBodies:
    """Finds frame and platform from the bodies that have exit and anchor points, by cables' names.

    Raises:
        RobotFileError: Anchor points are on bodies that move in each other, exit points on bodies
            that joints move, or the platform is fixed; names the joint.
    """
    ways = _joints_to(plant)
    where = {name: _moving(ways[int(body.index())]) for name, body in anchors.items()}
    first = next(iter(anchors))
    for name, way in where.items():
        if way != where[first]:
            joints = [joint for joint in (*way, *where[first])
                      if (joint in way) != (joint in where[first])]  # fmt: skip
            raise moved_by_joints(
                path, "anchor points", f"{anchors[first].name()} and {anchors[name].name()} "
                f"on either side of {_joint_words(joints)}",
            )  # fmt: skip
    moving = where[first]
    if not moving:
        welds = ways[int(anchors[first].index())]
        raise fail(
            path, "platform", f"fixed joint {welds[0].name()}" if welds else "the world",
            "a platform that can move against the frame",
        )  # fmt: skip
    last = moving[-1]
    ends = last.parent_body(), last.child_body()
    platform = ends[0] if last in ways[int(ends[0].index())] else ends[1]
    frees = []
    for name, body in exits.items():
        way = _moving(ways[int(body.index())])
        if way and (len(way) > 1 or way[0].type_name() not in FLOATING or way == moving):
            on = "the platform" if way == moving else _joint_words(way)
            raise moved_by_joints(path, f"exit point of {name}", f"{body.name()}, on {on}")
        if way and way[0] not in frees:
            frees.append(way[0])
    found = CarriedBodies(platform=platform)
    found.carrying = [joint for joint in moving if joint not in frees]
    if len(frees) > 1:
        names = ", ".join(_far_body(joint, ways).name() for joint in frees)
        found.remarks.append(f"Links fixed to nothing in the file were fixed there: {names}.")
    for index in sorted(ways):
        body, way = plant.get_body(BodyIndex(index)), _moving(ways[index])
        if way[: len(moving)] == moving:
            found.composite.append(body)
            found.fixed += [j for j in way[len(moving) :] if j not in found.fixed]
        elif not way or (len(way) == 1 and way[0] in frees):
            found.frame.append(body)
        else:
            found.others.append(body)
    for joint in found.fixed:
        carried = _far_body(joint, ways)
        found.remarks.append(
            f"Joint {joint.name()}, {joint.type_name()}, to {carried.name()} was fixed where it "
            "stands; what it carries counts as part of the platform."
        )
    return found


def _far_body(joint: Joint, ways: dict[int, list[Joint]]) -> RigidBody:
    """The body behind a joint, as seen from the world."""
    child = joint.child_body()
    return child if joint in ways[int(child.index())] else joint.parent_body()


def _joint_words(joints: Sequence[Joint]) -> str:
    return ", ".join(f"{joint.type_name()} joint {joint.name()}" for joint in joints)


def set_carried_motion(
    path: Path, plant: MultibodyPlant, context: Context, found: CarriedBodies, draft: RobotDraft
) -> None:
    """Gives a draft the motion type of the platform.

    Raises:
        RobotFileError: No motion type has its joints, or a body of its own weight is between them.
    """
    if [joint.type_name() in FLOATING for joint in found.carrying] == [True]:
        draft.motion = "3R3T"
        return
    along: list[Array] = []
    about: list[Array] = []
    other = False
    for joint in found.carrying:
        R = joint.frame_on_parent().CalcPoseInWorld(context).rotation().matrix()
        if isinstance(joint, PrismaticJoint):
            along.append(R @ joint.translation_axis())
        elif isinstance(joint, RevoluteJoint):
            about.append(R @ joint.revolute_axis())
        elif isinstance(joint, PlanarJoint):
            along += [R[:, 0], R[:, 1]]
            about.append(R[:, 2])
        else:
            other = True
    words = _joint_words(found.carrying)
    set_motion(path, draft, words, [] if other else along, about,
               plant.EvalBodyPoseInWorld(context, found.platform).translation())  # fmt: skip
    others = {body.index() for body in found.others}
    between = {
        body.name(): body.default_mass()
        for joint in found.carrying
        for body in (joint.parent_body(), joint.child_body())
        if body.index() in others and body.default_mass() > 0.0
    }
    if between:
        name, mass = next(iter(between.items()))
        raise fail(path, f"link {name}", f"{mass:g} kg between the joints of the platform",
                   "links without mass there; a mechanism file takes such bodies")  # fmt: skip


def set_composite_inertia(
    plant: MultibodyPlant, context: Context, found: CarriedBodies, draft: RobotDraft
) -> None:
    """Gives a draft mass, centre of mass and inertia of all bodies that move as one."""
    indices = [body.index() for body in found.composite]
    inertia = plant.CalcSpatialInertia(context, found.platform.body_frame(), indices)
    draft.mass = float(inertia.get_mass())
    com = np.asarray(inertia.get_com(), float)
    if not draft.mass > 0.0:
        return
    about = inertia.Shift(com).CalcRotationalInertia()
    draft.center_of_mass = com
    draft.inertia = np.array([*about.get_moments(), *about.get_products()])
    parts = sorted((body for body in found.composite if body.default_mass() > 0.0),
                   key=lambda body: body.index() != found.platform.index())  # fmt: skip
    if len(parts) > 1:
        words = ", ".join(f"{body.name()} {body.default_mass():g} kg" for body in parts)
        draft.remarks.append(f"The platform is the sum of links fixed to each other: {words}.")
