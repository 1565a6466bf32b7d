"""The links and joints of CASPR that a plant of Drake is, with cables between its bodies.

CASPR has no fixed turn between a link and the one that carries it: with all coordinates zero, the
frames of all links are parallel. So each link gets a frame in the origin of its joint, with axes
along those of W when Drake's coordinates are zero, and axes of joints are given in these. Joints
become chains of moves and turns; massless bodies between two joints with one origin become part of
a chain, and chains the kinds of joints that CASPR has for them.

Source: drake.mit.edu, MultibodyPlant and its joints; github.com/darwinlau/CASPR, src/Model/Bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    BodyIndex,
    JointActuatorIndex,
    JointIndex,
    PlanarJoint,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RpyFloatingJoint,
    UniversalJoint,
    WeldJoint,
)
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr_trees import (
    KINDS,
    CasprJoint,
    CasprLink,
    Step,
    euler_xyz,
)
from cdpr_drake.geometry.cable_routes import WORLD_BODY

ROUNDING = 1e-14
"""Components of directions that differ by less from -1, 0 or 1 are those, and lengths by less from
zero [m]: products of a few rotation matrices are off by some 1e-16."""

WRITTEN = {kind: steps for kind, steps in KINDS.items() if kind not in ("P_Y", "P_Z", "P_YZ")}
"""Joints that CASPR still has; it moves along y or z by `P_AXIS`."""

_E = np.eye(3)


@dataclass(frozen=True, eq=False)
class _Motion:
    """A step of a chain: its direction with all coordinates zero, and its coordinate."""

    turns: bool
    axis: Array
    initial: float
    limits: tuple[float, float] = (-np.inf, np.inf)
    actuated: bool = False

    def along_positive(self) -> _Motion:
        """The same about a positive axis of the frame, where it is about a negative one."""
        axis = np.where(np.abs(self.axis - np.round(self.axis)) < ROUNDING, np.round(self.axis),
                        self.axis) + 0.0  # fmt: skip
        if np.sum(axis != 0.0) == 1 and np.sum(axis) < 0.0:
            low, high = self.limits
            return _Motion(self.turns, -axis + 0.0, -self.initial + 0.0, (-high, -low),
                           self.actuated)  # fmt: skip
        return _Motion(self.turns, axis, self.initial, self.limits, self.actuated)


@dataclass(eq=False)
class LinksOfPlant:
    """A plant's bodies as links of CASPR.

    Attributes:
        links: The links; the first has number 1.
        host: Number of the link that each body is part of, by its index; 0: the world.
        X_LB: Poses of the bodies in their links, by their index.
        lost: What of the plant is not held, in words.
    """

    links: list[CasprLink] = field(default_factory=list)
    host: dict[int, int] = field(default_factory=lambda: {WORLD_BODY: 0})
    X_LB: dict[int, RigidTransform] = field(default_factory=lambda: {WORLD_BODY: RigidTransform()})
    lost: list[str] = field(default_factory=list)


def links_of_plant(plant: MultibodyPlant, context: Context, touched: set[int]) -> LinksOfPlant:
    """The links of CASPR that a finalized plant is.

    Args:
        plant: The plant.
        context: One of it, at the positions that become q_initial.
        touched: Indices of the bodies with points of cables.

    Raises:
        RobotFileError: CASPR has no joint of a kind that is there; names it.
    """
    made = LinksOfPlant()
    joints = [plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices()]
    leaving: dict[int, list[Any]] = {}
    for joint in joints:
        leaving.setdefault(int(joint.parent_body().index()), []).append(joint)
    driven = {
        int(plant.get_joint_actuator(JointActuatorIndex(i)).joint().index())
        for i in plant.GetJointActuatorIndices()
    }
    waiting = list(leaving.get(WORLD_BODY, []))
    while waiting:
        joint = waiting.pop(0)
        child = int(joint.child_body().index())
        parent = int(joint.parent_body().index())
        X_LF = made.X_LB[parent] @ joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_MB = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
        if isinstance(joint, WeldJoint):
            made.host[child] = made.host[parent]
            made.X_LB[child] = X_LF @ joint.X_FM() @ X_MB
            waiting = leaving.get(child, []) + waiting
            continue
        chain = list(_motions(plant, joint, X_LF.rotation(), context, int(joint.index()) in driven))
        X_LB = RigidTransform(X_LF.rotation(), np.zeros(3)) @ X_MB
        inner = child
        while (following := _only_massless(plant, leaving, inner, X_LB, touched)) is not None:
            X_LF_inner = X_LB @ following.frame_on_parent().GetFixedPoseInBodyFrame()
            chain += _motions(
                plant, following, X_LF_inner.rotation(), context, int(following.index()) in driven
            )
            X_LB = RigidTransform(X_LF_inner.rotation(), np.zeros(3)) @ (
                following.frame_on_child().GetFixedPoseInBodyFrame().inverse()
            )
            inner = int(following.child_body().index())
        number = _add_links(made, plant, inner, made.host[parent], X_LF.translation(), chain)
        made.host[inner], made.X_LB[inner] = number, X_LB
        waiting = leaving.get(inner, []) + waiting
    _add_masses(made, plant)
    _tell_apart(made)
    if any(np.any(joint.default_damping_vector()) for joint in joints if joint.num_velocities()):
        made.lost.append("damping of joints")
    if plant.num_force_elements() > 1:
        made.lost.append("springs and other force elements")
    return made


def _only_massless(
    plant: MultibodyPlant,
    leaving: dict[int, list[Any]],
    body: int,
    X_LB: RigidTransform,
    touched: set[int],
) -> Any:
    """The joint that goes on from a body without mass, in the origin of its link; None: none."""
    following = leaving.get(body, [])
    if len(following) != 1 or body in touched or plant.get_body(BodyIndex(body)).default_mass():
        return None
    joint = following[0]
    if isinstance(joint, WeldJoint):
        return None
    p_LF = X_LB.multiply(joint.frame_on_parent().GetFixedPoseInBodyFrame().translation())
    return joint if np.max(np.abs(p_LF)) < ROUNDING else None


def _motions(
    plant: MultibodyPlant, joint: Any, R_LF: RotationMatrix, context: Context, actuated: bool
) -> Iterator[_Motion]:
    """A joint as moves and turns, the outermost first, along axes of its link's frame."""
    A = R_LF.matrix()
    start = joint.position_start()
    q = [
        float(value) for value in plant.GetPositions(context)[start : start + joint.num_positions()]
    ]
    limits = [
        (float(low), float(high))
        for low, high in zip(
            joint.position_lower_limits(), joint.position_upper_limits(), strict=True
        )
    ]

    def step(turns: bool, axis: Array, k: int) -> _Motion:
        return _Motion(turns, A @ axis, q[k], limits[k], actuated).along_positive()

    def free(turns: bool, values: Array) -> Iterator[_Motion]:
        for axis, value in zip(_E, values, strict=True):
            yield _Motion(turns, axis, float(value), actuated=actuated)

    if isinstance(joint, RevoluteJoint):
        yield step(True, joint.revolute_axis(), 0)
    elif isinstance(joint, PrismaticJoint):
        yield step(False, joint.translation_axis(), 0)
    elif isinstance(joint, UniversalJoint):
        yield step(True, _E[0], 0)
        yield step(True, _E[1], 1)
    elif isinstance(joint, PlanarJoint):
        yield step(False, _E[0], 0)
        yield step(False, _E[1], 1)
        yield step(True, _E[2], 2)
    elif isinstance(joint, BallRpyJoint) and R_LF.IsNearlyIdentity(ROUNDING):
        for k in (2, 1, 0):
            yield step(True, _E[k], k)
    elif isinstance(joint, BallRpyJoint | QuaternionFloatingJoint | RpyFloatingJoint):
        X_FM = joint.frame_on_child().CalcPose(context, joint.frame_on_parent())
        if not isinstance(joint, BallRpyJoint):
            yield from free(False, A @ X_FM.translation())
        yield from free(True, euler_xyz(A @ X_FM.rotation().matrix() @ A.T))
    else:
        raise RobotFileError(
            f"joint {joint.name()}: found a {type(joint).__name__}; accepted by CASPR: joints that "
            "move along and turn about axes, one after the other"
        )


def _add_links(
    made: LinksOfPlant,
    plant: MultibodyPlant,
    body: int,
    parent: int,
    location: Array,
    chain: list[_Motion],
) -> int:
    """Adds the link of a body, and massless ones before it where one joint does not do."""
    name = plant.get_body(BodyIndex(body)).name()
    parts = list(_kinds(chain))
    for k, (kind, steps, motions) in enumerate(parts):
        ordered = sorted(zip(steps, motions, strict=True), key=lambda pair: pair[0].coordinate)
        limits = np.array([motion.limits for _, motion in ordered])
        limited = bool(np.all(np.isfinite(limits)))
        if not limited and np.any(np.isfinite(limits)):
            made.lost.append(f"limits of {name}, of which one is infinite")
        driven = [motion.actuated for _, motion in ordered]
        if any(driven) and not all(driven):
            made.lost.append(f"motors on some of the joints of {name}")
        made.links.append(
            CasprLink(
                name=name if k == len(parts) - 1 else f"{name} {k + 1}",
                parent=parent,
                location=np.array(location, float),
                joint=CasprJoint(
                    kind=kind,
                    steps=steps,
                    initial=np.array([motion.initial for _, motion in ordered]),
                    lower=limits[:, 0] if limited else None,
                    upper=limits[:, 1] if limited else None,
                    actuated=all(driven),
                ),
                mass=0.0, com=np.zeros(3), end=np.zeros(3), inertia=np.zeros(6),
            )
        )  # fmt: skip
        parent, location = len(made.links), np.zeros(3)
    return parent


def _kinds(chain: list[_Motion]) -> Iterator[tuple[str, tuple[Step, ...], list[_Motion]]]:
    """A chain as joints of CASPR, each as long as can be."""
    rest = _sorted_moves(chain)
    while rest:
        for n in range(min(len(rest), 6), 1, -1):
            found = next((kind for kind in WRITTEN if _is(WRITTEN[kind], rest[:n])), None)
            if found is not None:
                yield found, WRITTEN[found], rest[:n]
                rest = rest[n:]
                break
        else:
            one = rest.pop(0)
            found = next((kind for kind in WRITTEN if _is(WRITTEN[kind], [one])), None)
            if found is not None:
                yield found, WRITTEN[found], [one]
                continue
            x, y, z = (float(value) for value in one.axis / np.linalg.norm(one.axis))
            yield "R_AXIS" if one.turns else "P_AXIS", (Step(one.turns, (x, y, z), 0),), [one]


def _is(steps: tuple[Step, ...], motions: list[_Motion]) -> bool:
    return len(steps) == len(motions) and all(
        step.turns == motion.turns and step.axis == tuple(motion.axis)
        for step, motion in zip(steps, motions, strict=True)
    )


def _sorted_moves(chain: list[_Motion]) -> list[_Motion]:
    """Moves that follow each other in the order of their axes, x first; they commute."""
    found: list[_Motion] = []
    run: list[_Motion] = []
    by_axis: Callable[[_Motion], int] = lambda motion: -int(motion.axis @ (4.0, 2.0, 1.0))  # noqa: E731
    for motion in [*chain, None]:
        if motion is not None and not motion.turns and np.sum(motion.axis != 0.0) == 1:
            run.append(motion)
            continue
        found += sorted(run, key=by_axis)
        run = []
        if motion is not None:
            found.append(motion)
    return found


def _add_masses(made: LinksOfPlant, plant: MultibodyPlant) -> None:
    """Masses and inertias of the bodies of each link, those fixed to it as well."""
    context = plant.CreateDefaultContext()
    sums: dict[int, Any] = {}
    for body, number in made.host.items():
        item = plant.get_body(BodyIndex(body))
        if number == 0 or not item.default_mass():
            continue
        M_BBo_B = item.CalcSpatialInertiaInBodyFrame(context)
        X = made.X_LB[body]
        M = M_BBo_B.ReExpress(X.rotation()).Shift(-X.translation())
        if number in sums:
            sums[number] += M
        else:
            sums[number] = M
    for number, M in sums.items():
        com = M.get_com()
        inertia = M.Shift(com).CalcRotationalInertia()
        link = made.links[number - 1]
        made.links[number - 1] = CasprLink(
            name=link.name, parent=link.parent, location=link.location, joint=link.joint,
            mass=M.get_mass(), com=np.array(com), end=np.array(com),
            inertia=np.array([*inertia.get_moments(), *inertia.get_products()]),
        )  # fmt: skip


def _tell_apart(made: LinksOfPlant) -> None:
    """Names of bodies of several models, each once."""
    known: set[str] = set()
    for k, link in enumerate(made.links):
        name, count = link.name, 2
        while name in known:
            name, count = f"{link.name} {count}", count + 1
        known.add(name)
        if name != link.name:
            made.lost.append(f"the name of the second body {link.name}, which is {name}")
            made.links[k] = CasprLink(**{**link.__dict__, "name": name})
