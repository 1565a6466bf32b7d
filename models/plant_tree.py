"""The joints of a MultibodyPlant as a table for compiled kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    BodyIndex,
    Joint,
    JointIndex,
    PlanarJoint,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    UniversalJoint,
    WeldJoint,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry import tree_kernel as kernel
from cdpr_drake.geometry.cable_routes import WORLD_BODY


def _no_axis(joint: Any) -> Array:
    return np.zeros(3)


JOINTS: dict[type[Joint], tuple[int, Callable[[Any], Array]]] = {
    WeldJoint: (kernel.WELD, _no_axis),
    RevoluteJoint: (kernel.REVOLUTE, lambda joint: joint.revolute_axis()),
    PrismaticJoint: (kernel.PRISMATIC, lambda joint: joint.translation_axis()),
    PlanarJoint: (kernel.PLANAR, _no_axis),
    QuaternionFloatingJoint: (kernel.FLOATING, _no_axis),
    BallRpyJoint: (kernel.BALL, _no_axis),
    UniversalJoint: (kernel.UNIVERSAL, _no_axis),
}
"""Joints that the kernels know: their kind there, and their axis in F."""


@dataclass(frozen=True, eq=False)
class PlantTree:
    """The bodies of a finalized plant that cables touch, and those that carry them.

    Attributes:
        table: For `geometry.tree_kernel`, shape (n, 32); row 0 is the world.
        rows: Row of each body by its index; bodies that no cable touches or needs are not there.
        num_states: Positions and velocities of the plant, nq + nv.
        num_velocities: Velocities of the plant, nv.
    """

    table: Array
    rows: dict[int, int]
    num_states: int
    num_velocities: int

    @staticmethod
    def of(plant: MultibodyPlant, bodies: Iterable[int]) -> PlantTree:
        """The tree of some bodies.

        Args:
            plant: The plant, finalized.
            bodies: Indices of the bodies with points of cables.

        Raises:
            CableModelError: A joint on the way to the world is of a kind that the kernels do not
                know, or has the carried body for a parent; names it. `unknown_joint` asks before.
        """
        problem = unknown_joint(plant, bodies)
        if problem:
            raise CableModelError(problem)
        joints, nq = joint_of_bodies(plant), plant.num_positions()
        table, rows = [_world_row()], {WORLD_BODY: 0}
        for body in _parents_first(joints, bodies):
            joint = joints[body]
            kind, axis = JOINTS[type(joint)]
            X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
            X_MB = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
            if isinstance(joint, WeldJoint):
                X_PF = X_PF @ joint.X_FM()
            parent = rows[int(joint.parent_body().index())]
            exact = X_PF.IsExactlyIdentity() and X_MB.IsExactlyIdentity()
            if kind == kernel.FLOATING and parent == 0 and exact:
                kind = kernel.FLOATING_PLAIN
            still = kind == kernel.WELD
            q, v = (0, 0) if still else (joint.position_start(), joint.velocity_start())
            table.append(
                np.array(
                    [kind, parent, q, v, nq + v, *_numbers(X_PF), *_numbers(X_MB), *axis(joint)]
                )
            )
            rows[body] = len(table) - 1
        return PlantTree(
            np.array(table), rows, plant.num_multibody_states(), plant.num_velocities()
        )


def _numbers(X: RigidTransform) -> Array:
    return np.concatenate([X.rotation().matrix().ravel(), X.translation()])


def _world_row() -> Array:
    row = np.zeros(kernel.TREE_COLUMNS)
    row[kernel.KIND] = kernel.WORLD
    return row


def joint_of_bodies(plant: MultibodyPlant) -> dict[int, Joint]:
    """The joint that carries each body, by its index; of a finalized plant."""
    joints = (plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices())
    return {int(joint.child_body().index()): joint for joint in joints}


def _parents_first(joints: dict[int, Joint], bodies: Iterable[int]) -> list[int]:
    order: list[int] = []
    for body in bodies:
        chain = []
        while body != WORLD_BODY and body not in order:
            chain.append(body)
            body = int(joints[body].parent_body().index())
        order += reversed(chain)
    return order


def unknown_joint(
    plant: MultibodyPlant, bodies: Iterable[int], by: str = "the compiled joints"
) -> str:
    """Why kernels cannot follow these bodies, in one sentence; empty: they can.

    Args:
        plant: The plant, finalized.
        bodies: Indices of the bodies.
        by: What else it is that knows the same joints, for the sentence.
    """
    joints = joint_of_bodies(plant)
    for body in bodies:
        seen: set[int] = set()
        while body != WORLD_BODY:
            joint = joints.get(body)
            if joint is None or body in seen:
                name = plant.get_body(BodyIndex(body)).scoped_name().get_full()
                return (
                    f"body {name}: found no joint that carries it, since a joint has it for its "
                    f"parent and the world, or what hangs on it, for its child; accepted by {by}: "
                    "parents nearer to the world"
                )
            if type(joint) not in JOINTS:
                known = ", ".join(sorted(kind.__name__ for kind in JOINTS))
                found = type(joint).__name__
                return f"joint {joint.name()}: found a {found}; accepted by {by}: {known}"
            seen.add(body)
            body = int(joint.parent_body().index())
    return ""
