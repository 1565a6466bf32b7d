"""A plant on cables in MuJoCo's MJCF: its bodies and joints, and a spatial tendon for each cable.

A tendon runs by sites on bodies, and is a spring that only pulls, of E S / l0 above its unstrained
length l0. So both engines have the same machine, whose accelerations can be compared.

MuJoCo has its own coordinates: joints count body by body from the root, a ball and a free body turn
by a quaternion and by velocities in the body's frame, and a free body's translation comes first.

Source: MuJoCo's XML reference, `tendon/spatial`, and its chapter on computation, "Kinematic tree".
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    ForceElementIndex,
    JointActuatorIndex,
    PrismaticSpring,
    RevoluteSpring,
    UniformGravityFieldElement,
    WeldJoint,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError, RobotFileError
from cdpr_drake.formats.robot_exports import xml_words
from cdpr_drake.geometry import tree_kernel as kind
from cdpr_drake.geometry.cable_routes import WORLD_BODY, CableRoutes
from cdpr_drake.models.plant_rest import scoped_joint
from cdpr_drake.models.plant_tree import JOINTS, joint_of_bodies, unknown_joint

LEAST_INERTIA = 1e-15
"""MuJoCo takes no moving body of less mass or moment of inertia [kg, kg m^2]."""

SAME = 1e-12
"""Share by which the largest moment of inertia of a flat body may exceed the sum of the others, by
rounding; MuJoCo wants it not to."""

FAR = 1e10
"""For a limit that is not there where the other one is [rad, m]."""

_AXES = dict(zip("xyz", np.eye(3), strict=True))

_PARTS = {
    kind.WELD: (),
    kind.REVOLUTE: (("", "hinge", None),),
    kind.PRISMATIC: (("", "slide", None),),
    kind.PLANAR: ((".x", "slide", "x"), (".y", "slide", "y"), (".turn", "hinge", "z")),
    kind.UNIVERSAL: ((".x", "hinge", "x"), (".y", "hinge", "y")),
    kind.BALL: (("", "ball", None),),
    kind.FLOATING: (
        (".x", "slide", "x"), (".y", "slide", "y"), (".z", "slide", "z"), (".turn", "ball", None),
    ),
}  # fmt: skip
"""Joints of MuJoCo that are one of a plant: end of the name, type, and axis in M where it is not
the plant's joint that has one."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """Where the coordinates of a joint are in both engines.

    Attributes:
        joint: The joint.
        kind: Of `geometry.tree_kernel`.
        free: Whether it is MuJoCo's free joint.
        qpos: Where its coordinates begin in MuJoCo.
        qvel: Where its velocities begin there.
    """

    joint: Any
    kind: int
    free: bool
    qpos: int
    qvel: int

    @property
    def positions(self) -> tuple[slice, slice]:
        """Where they are, in the plant and in MuJoCo."""
        q, n = self.joint.position_start(), self.joint.num_positions()
        turned = 1 if self.kind == kind.BALL else 0
        return slice(q, q + n), slice(self.qpos, self.qpos + n + turned)

    @property
    def velocities(self) -> tuple[slice, slice]:
        """Where they are, in the plant and in MuJoCo."""
        v, n = self.joint.velocity_start(), self.joint.num_velocities()
        return slice(v, v + n), slice(self.qvel, self.qvel + n)

    @property
    def R_MB(self) -> Any:
        """Of the body in the joint's frame on it."""
        X_BM = self.joint.frame_on_child().GetFixedPoseInBodyFrame()
        return X_BM.rotation().inverse()

    @property
    def X_WF(self) -> Any:
        """Of the joint's frame on a parent that is the world."""
        return self.joint.frame_on_parent().GetFixedPoseInBodyFrame()

    def turn(self, q: Array) -> Any:
        """R_FM of a ball or a floating body."""
        if self.kind == kind.BALL:
            return RollPitchYaw(q[0], q[1], q[2]).ToRotationMatrix()
        return RotationMatrix(Quaternion(q[:4] / np.linalg.norm(q[:4])))


@dataclass(frozen=True, eq=False)
class PlantMjcf:
    """A plant on cables as a file of MuJoCo.

    Attributes:
        text: The file. Its keyframe "home" has the plant's default positions.
        left_out: What it does not hold, one sentence each.
        num_positions: Of the plant, nq.
        num_velocities: Of the plant, and of MuJoCo's model, nv.
    """

    text: str
    left_out: tuple[str, ...]
    num_positions: int
    num_velocities: int
    _placed: tuple[_Placed, ...]

    def positions(self, q: Array) -> Array:
        """MuJoCo's qpos of positions of the plant, shape (nq,)."""
        qpos = np.zeros(_num_qpos(self._placed))
        for place in self._placed:
            mine, theirs = place.positions
            qpos[theirs] = _to_qpos(place, q[mine])
        return qpos

    def velocities(self, q: Array, v: Array) -> Array:
        """MuJoCo's qvel of velocities, or its qacc of accelerations, of the plant.

        Args:
            q: Positions of the plant, shape (nq,).
            v: Its velocities, or their rates, shape (nv,).
        """
        qvel = np.zeros(self.num_velocities)
        for place in self._placed:
            mine, theirs = place.velocities
            qvel[theirs] = _to_qvel(place, q[place.positions[0]], v[mine])
        return qvel

    def plant_positions(self, qpos: Array) -> Array:
        """Positions of the plant, shape (nq,), of MuJoCo's qpos."""
        q = np.zeros(self.num_positions)
        for place in self._placed:
            mine, theirs = place.positions
            q[mine] = _from_qpos(place, qpos[theirs])
        return q

    def plant_velocities(self, qpos: Array, qvel: Array) -> Array:
        """Velocities of the plant, or their rates, shape (nv,), of MuJoCo's qvel or qacc."""
        v = np.zeros(self.num_velocities)
        for place in self._placed:
            mine, theirs = place.velocities
            v[mine] = _from_qvel(place, _from_qpos(place, qpos[place.positions[1]]), qvel[theirs])
        return v


def _num_qpos(placed: Iterable[_Placed]) -> int:
    return max((place.positions[1].stop for place in placed), default=0)


def _to_qpos(place: _Placed, q: Array) -> Array:
    if place.kind not in (kind.BALL, kind.FLOATING):
        return q
    R_MB = place.R_MB
    R_FM = place.turn(q)
    if place.free:
        X_WB = place.X_WF @ RigidTransform(R_FM @ R_MB, q[4:7])
        return np.concatenate([X_WB.translation(), X_WB.rotation().ToQuaternion().wxyz()])
    turned = (R_MB.inverse() @ R_FM @ R_MB).ToQuaternion().wxyz()
    return turned if place.kind == kind.BALL else np.concatenate([q[4:7], turned])


def _from_qpos(place: _Placed, qpos: Array) -> Array:
    if place.kind not in (kind.BALL, kind.FLOATING):
        return qpos
    R_MB = place.R_MB
    R = RotationMatrix(Quaternion(qpos[-4:] / np.linalg.norm(qpos[-4:])))
    if place.free:
        X_FB = place.X_WF.inverse() @ RigidTransform(R, qpos[:3])
        turned = (X_FB.rotation() @ R_MB.inverse()).ToQuaternion().wxyz()
        return np.concatenate([turned, X_FB.translation()])
    R_FM = R_MB @ R @ R_MB.inverse()
    if place.kind == kind.BALL:
        return np.asarray(RollPitchYaw(R_FM).vector())
    return np.concatenate([R_FM.ToQuaternion().wxyz(), qpos[:3]])


def _to_qvel(place: _Placed, q: Array, v: Array) -> Array:
    if place.kind not in (kind.BALL, kind.FLOATING):
        return v
    R_FB = (place.turn(q) @ place.R_MB).matrix()
    w_B = R_FB.T @ v[:3]
    if place.kind == kind.BALL:
        return w_B
    moved = place.X_WF.rotation().matrix() @ v[3:6] if place.free else v[3:6]
    return np.concatenate([moved, w_B])


def _from_qvel(place: _Placed, q: Array, qvel: Array) -> Array:
    if place.kind not in (kind.BALL, kind.FLOATING):
        return qvel
    R_FB = (place.turn(q) @ place.R_MB).matrix()
    w_F = R_FB @ qvel[-3:]
    if place.kind == kind.BALL:
        return w_F
    moved = place.X_WF.rotation().matrix().T @ qvel[:3] if place.free else qvel[:3]
    return np.concatenate([w_F, moved])


def export_plant_mjcf(
    plant: MultibodyPlant,
    routes: CableRoutes,
    unstrained_lengths: Array,
    path: Path | str | None = None,
) -> PlantMjcf:
    """A plant and its cables in MJCF.

    It holds bodies with their inertia, joints with damping, springs and limits, motors with their
    reflected inertia, gravity, and cables over eyelets as undamped springs that only pull; all by
    the plant's default parameters. MuJoCo's limits are soft, and a continuous plant has none.
    A floating body is a free joint where it floats in the world about its own origin undamped, else
    three slides and a ball.

    Args:
        plant: The plant, finalized.
        routes: The cables.
        unstrained_lengths: l0 of each, shape (m,) [m].
        path: Where the file is written; None: nowhere.

    Returns:
        The file, what it leaves out, and how coordinates of both engines belong together.

    Raises:
        CableModelError: MuJoCo has no such joint or mechanism, or a body that moves has no mass or
            no moment of inertia; names it. Or the lengths are not accepted.
        RobotFileError: The file cannot be written.
    """
    l0 = np.array(unstrained_lengths, dtype=float)
    if l0.shape != (routes.count,) or not np.all(np.isfinite(l0) & (l0 > 0.0)):
        raise CableModelError(
            f"unstrained_lengths: found {unstrained_lengths}; accepted: {routes.count} numbers > 0 "
            "[m]"
        )
    writer = _Writer(plant, routes)
    made = writer.written(l0)
    if path is not None:
        try:
            Path(path).write_text(made.text, encoding="utf-8")
        except OSError as problem:
            raise RobotFileError(f"{path}: cannot be written: {problem.strerror}") from problem
    return made


class _Writer:
    """Writes one plant."""

    def __init__(self, plant: MultibodyPlant, routes: CableRoutes) -> None:
        problem = unknown_joint(plant, range(plant.num_bodies()), "MJCF")
        if problem:
            raise CableModelError(problem)
        if plant.num_constraints():
            raise CableModelError(
                f"constraints: found {plant.num_constraints()} in the plant; accepted by MJCF: a "
                "tree of joints"
            )
        self.plant, self.routes = plant, routes
        self.joints = joint_of_bodies(plant)
        self.children: dict[int, list[int]] = {}
        for body, joint in sorted(self.joints.items()):
            self.children.setdefault(int(joint.parent_body().index()), []).append(body)
        bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
        self.body_names = _unique(
            {i: (body.name(), body.scoped_name().get_full()) for i, body in enumerate(bodies)}
        )
        self.joint_names = _unique(
            {i: (joint.name(), scoped_joint(plant, joint)) for i, joint in self.joints.items()}
        )
        self.left_out: list[str] = []
        self.placed: list[_Placed] = []
        self.springs = self._springs()
        self.armatures: dict[int, float] = {}
        self.actuators = [
            plant.get_joint_actuator(JointActuatorIndex(i)) for i in plant.GetJointActuatorIndices()
        ]
        for actuator in self.actuators:
            body = int(actuator.joint().child_body().index())
            inertia = self.armatures.get(body, 0.0) + actuator.default_reflected_inertia()
            self.armatures[body] = inertia

    def written(self, l0: Array) -> PlantMjcf:
        plant, routes = self.plant, self.routes
        root = ET.Element("mujoco", model="plant")
        ET.SubElement(root, "compiler", angle="radian", autolimits="true")
        gravity = plant.gravity_field().gravity_vector()
        ET.SubElement(root, "option", gravity=_words(gravity), timestep="0.0001", integrator="RK4")
        world = ET.SubElement(root, "worldbody")
        ET.SubElement(world, "light", pos="0 0 10", dir="0 0 -1")
        self._fill(world, WORLD_BODY)
        tendons = ET.SubElement(root, "tendon")
        for i, name in enumerate(map(xml_words, routes.names)):
            spatial = ET.SubElement(
                tendons, "spatial", name=name, stiffness=_words(routes.ends.stiffness[i] / l0[i]),
                springlength=_words([0.0, l0[i]]),
            )  # fmt: skip
            for k in range(routes.first[i], routes.first[i + 1]):
                ET.SubElement(spatial, "site", site=self._site(i, k))
        motors = ET.SubElement(root, "actuator")
        for actuator in self.actuators:
            body = int(actuator.joint().child_body().index())
            motor = ET.SubElement(
                motors, "motor", name=f"motor_{self.joint_names[body]}",
                joint=self.joint_names[body], gear="1",
            )  # fmt: skip
            limit = actuator.effort_limit()
            if np.isfinite(limit):
                motor.set("forcerange", _words([-limit, limit]))
            if actuator.has_controller():
                self.left_out.append(f"the controller of actuator {actuator.name()}")
        self._name_what_is_missing()
        nq, nv = plant.num_positions(), plant.num_velocities()
        made = PlantMjcf("", tuple(self.left_out), nq, nv, tuple(self.placed))
        q = plant.GetPositions(plant.CreateDefaultContext())
        if self.placed:
            home = ET.SubElement(root, "keyframe")
            ET.SubElement(home, "key", name="home", qpos=_words(made.positions(q)))
        ET.indent(root, "  ")
        return replace(made, text=ET.tostring(root, encoding="unicode") + "\n")

    def _site(self, cable: int, point: int) -> str:
        return f"{xml_words(self.routes.names[cable])}_{point - self.routes.first[cable]}"

    def _fill(self, element: ET.Element, index: int) -> None:
        """Writes the sites on a body and the bodies that it carries, root first."""
        for i in range(self.routes.count):
            for k in range(self.routes.first[i], self.routes.first[i + 1]):
                if self.routes.bodies[k] == index:
                    p = _words(self.routes.p_BQ[:, k])
                    ET.SubElement(element, "site", name=self._site(i, k), pos=p)
        for child in self.children.get(index, []):
            self._body(element, child)

    def _body(self, parent: ET.Element, index: int) -> None:
        body, joint = self.plant.get_body(BodyIndex(index)), self.joints[index]
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_BM = joint.frame_on_child().GetFixedPoseInBodyFrame()
        if isinstance(joint, WeldJoint):
            X_PF = X_PF @ joint.X_FM()
        X_PB = X_PF @ X_BM.inverse()
        element = ET.SubElement(
            parent, "body", name=self.body_names[index], pos=_words(X_PB.translation()),
            quat=_quaternion(X_PB.rotation()),
        )  # fmt: skip
        if not self.plant.is_gravity_enabled(body.model_instance()):
            element.set("gravcomp", "1")
        moving = JOINTS[type(joint)][0] != kind.WELD
        if moving:
            self._joint(element, index, joint, X_BM)
        inertia = _Inertia.of(body)
        if moving and not self._heavy(index):
            raise CableModelError(
                f"body {self.body_names[index]}: found mass {inertia.mass:g} kg and moments "
                f"{', '.join(f'{value:g}' for value in inertia.moments)} kg m^2; accepted by MJCF: "
                f"all above {LEAST_INERTIA:g} on a body that moves, or on one welded to it"
            )
        if inertia.mass > 0.0:
            ET.SubElement(
                element, "inertial", pos=_words(inertia.com), quat=_quaternion(inertia.R_BI),
                mass=_words(inertia.mass), diaginertia=_words(inertia.moments),
            )  # fmt: skip
        self._fill(element, index)

    def _heavy(self, index: int) -> bool:
        """Whether a body or one that is welded to it has mass and three moments."""
        inertia = _Inertia.of(self.plant.get_body(BodyIndex(index)))
        if min(inertia.mass, *inertia.moments) >= LEAST_INERTIA:
            return True
        welded = (
            child for child in self.children.get(index, [])
            if isinstance(self.joints[child], WeldJoint)
        )  # fmt: skip
        return any(self._heavy(child) for child in welded)

    def _joint(self, element: ET.Element, index: int, joint: Any, X_BM: Any) -> None:
        number, axis_of = JOINTS[type(joint)]
        damping = np.asarray(joint.default_damping_vector(), dtype=float)
        free = (
            number == kind.FLOATING
            and int(joint.parent_body().index()) == WORLD_BODY
            and not np.any(X_BM.translation())
            and not np.any(damping)
        )
        velocities = sum(place.joint.num_velocities() for place in self.placed)
        self.placed.append(_Placed(joint, number, free, _num_qpos(self.placed), velocities))
        name = self.joint_names[index]
        if free:
            ET.SubElement(element, "freejoint", name=name)
            return
        if number == kind.FLOATING:  # its rotation comes first in the plant
            damping = np.concatenate([damping[3:], damping[:3]])
        low, high = joint.position_lower_limits(), joint.position_upper_limits()
        limited = np.isfinite(low) | np.isfinite(high)
        for k, (end, what, axis) in enumerate(_PARTS[number]):
            part = ET.SubElement(
                element, "joint", name=name + end, type=what, pos=_words(X_BM.translation()),
                damping=_words(damping[k]),
            )  # fmt: skip
            if what == "ball":
                if np.any(limited):
                    self.left_out.append(f"limits of joint {name}, whose angles are others")
                continue
            a = _AXES[axis] if axis else axis_of(joint)
            part.set("axis", _words(X_BM.rotation().multiply(a)))
            if limited[k]:
                part.set("range", _words(np.clip([low[k], high[k]], -FAR, FAR)))
            if index in self.armatures:
                part.set("armature", _words(self.armatures[index]))
            if index in self.springs:
                stiffness, rest = self.springs[index]
                part.set("stiffness", _words(stiffness))
                part.set("springref", _words(rest))

    def _springs(self) -> dict[int, tuple[float, float]]:
        """Stiffness and rest position of springs at joints, by the body that the joint carries."""
        found: dict[int, tuple[float, float]] = {}
        for i in range(self.plant.num_force_elements()):
            element = self.plant.get_force_element(ForceElementIndex(i))
            if isinstance(element, UniformGravityFieldElement):
                continue
            if isinstance(element, RevoluteSpring):
                k, rest = element.default_stiffness(), element.default_nominal_angle()
            elif isinstance(element, PrismaticSpring):
                k, rest = element.stiffness(), element.nominal_position()
            else:
                self.left_out.append(f"force element {i}, a {type(element).__name__}")
                continue
            body = int(element.joint().child_body().index())
            before, at = found.get(body, (0.0, 0.0))
            both = before + k  # two springs side by side are one
            found[body] = (both, (before * at + k * rest) / both if both > 0.0 else 0.0)
        return found

    def _name_what_is_missing(self) -> None:
        ends = self.routes.ends
        for values, what in (
            (ends.pulley_radius, "pulleys at exit points; the cables run from the points"),
            (ends.anchor_pulley_radius, "pulleys at anchor points; the cables run to the points"),
            (ends.retardation, "damping of the cables, which MuJoCo would give to slack ones too"),
            (ends.linear_weight, "weight of the cables"),
            (np.where(np.isfinite(ends.breaking_load), 1.0, 0.0), "breaking loads of the cables"),
        ):
            if np.any(values > 0.0):
                self.left_out.append(what)
        if self.plant.geometry_source_is_registered():
            self.left_out.append("shapes of the bodies, and contact")


@dataclass(frozen=True, eq=False)
class _Inertia:
    """Mass [kg], centre of mass in B [m], principal axes and moments about it [kg m^2]."""

    mass: float
    com: Array
    R_BI: Any
    moments: Array

    @staticmethod
    def of(body: Any) -> _Inertia:
        inertia = body.default_spatial_inertia()
        mass = inertia.get_mass()
        if not mass > 0.0:
            return _Inertia(0.0, np.zeros(3), RotationMatrix(), np.zeros(3))
        com = np.array(inertia.get_com())
        matrix = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
        moments, axes = np.linalg.eigh(matrix)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        moments = np.maximum(moments, 0.0)
        if moments[2] <= (1.0 + SAME) * (moments[0] + moments[1]):
            moments[2] = min(moments[2], moments[0] + moments[1])
        return _Inertia(mass, com, RotationMatrix.ProjectToRotationMatrix(axes), moments)


def _unique(names: dict[int, tuple[str, str]]) -> dict[int, str]:
    """Names without their scope where that is enough to tell them apart; given as both."""
    short = [name for name, _ in names.values()]
    kept = {key: one if short.count(one) == 1 else full for key, (one, full) in names.items()}
    return {key: xml_words(name) for key, name in kept.items()}


def _quaternion(R: Any) -> str:
    return _words(R.ToQuaternion().wxyz())


def _words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.atleast_1d(np.asarray(values, float)))
