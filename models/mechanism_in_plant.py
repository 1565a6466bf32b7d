"""Puts a mechanism into a MultibodyPlant: its bodies, gravity, home positions and cables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, FrameIndex, JointIndex

from cdpr_drake.arrays import Array
from cdpr_drake.errors import Problems, RobotFileError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.drake_parsing import drake_refusals, named_files, parse_models
from cdpr_drake.models.mechanism_schema import WORLD, EndPulley, Mechanism, MechanismCable
from cdpr_drake.schema.input_files import input_path, input_text, inputs_held
from cdpr_drake.schema.yaml_files import compose_yaml

DIRECTIVES = (".dmd.yaml", ".dmd.yml")
MOST_NAMES = 40
"""So many names that exist are said after a wrong one."""

_WORLD_INSTANCE = "WorldModelInstance::"


@dataclass(frozen=True, eq=False)
class MechanismInPlant:
    """A mechanism in a plant.

    Attributes:
        plant: The plant.
        mechanism: What was added.
        name: Prefix of its models' names; empty: none.
        frames: Index of each of its frames, and of the world's, by scoped name without prefix.
    """

    plant: MultibodyPlant
    mechanism: Mechanism
    name: str
    frames: dict[str, int]

    def frame(self, name: str) -> Any:
        """A frame by its scoped name, or by its own where only one bears it.

        Raises:
            RobotFileError: There is none, or there are several; lists those that there are.
        """
        return self.plant.get_frame(FrameIndex(self.frames[one_of(self.frames, name)]))

    def routes(self) -> CableRoutes:
        """The cables, on the frames of the plant.

        Raises:
            RobotFileError: Frames are not there; a line for each, with the cable's key.
            CableModelError: A number is not accepted.
        """
        mechanism, routes, problems = self.mechanism, [], Problems(RobotFileError)
        materials, stiffness = mechanism.materials(), mechanism.stiffness()
        for i, cable in enumerate(mechanism.cables):
            points = []
            for key, where, point in cable.route():
                try:
                    points.append((self.frame(where), np.asarray(point, float)))
                except RobotFileError as problem:
                    problems.add(f"cables[{i}].{key}: {problem}")
            material, load = materials[i], materials[i].breaking_load
            radius, axis = _pulley(mechanism.pulley, cable, "")
            anchor_radius, anchor_axis = _pulley(mechanism.anchor_pulley, cable, "anchor_")
            routes.append(
                CableRoute(
                    points=points,
                    stiffness=float(stiffness[i]),
                    name=cable.name,
                    retardation=material.retardation_time,
                    linear_weight=material.linear_density * mechanism.gravity,
                    breaking_load=np.inf if load is None else load,
                    pulley_radius=radius,
                    swivel_axis=axis,
                    anchor_pulley_radius=anchor_radius,
                    anchor_swivel_axis=anchor_axis,
                )
            )
        problems.raise_any()
        made = CableRoutes.of(self.plant, routes)
        return made.with_cables(replace(made.ends, down=mechanism.down()))

    def finalize(self) -> None:
        """Finalizes the plant.

        Raises:
            RobotFileError: Drake refuses it, as a loop of joints.
        """
        file = Path(self.mechanism.mechanism).name
        with drake_refusals(f"mechanism: found {file}, whose plant Drake does not finish"):
            self.plant.Finalize()

    def home_positions(self) -> Array:
        """Positions of the finalized plant at home, shape (nq,)."""
        plant = self.plant
        return np.array(plant.GetPositions(plant.CreateDefaultContext()))


def _pulley(common: EndPulley | None, cable: MechanismCable, end: str) -> tuple[float, Array]:
    """Radius and swivel axis of a cable's pulley at one end."""
    both = common or EndPulley(radius=0.0)
    radius, axis = getattr(cable, f"{end}pulley_radius"), getattr(cable, f"{end}swivel_axis")
    axis = np.asarray(both.swivel_axis if axis is None else axis, float)
    return float(both.radius if radius is None else radius), axis / np.linalg.norm(axis)


def add_mechanism(plant: MultibodyPlant, mechanism: Mechanism, name: str = "") -> MechanismInPlant:
    """Adds a mechanism's bodies to a plant, with its gravity, and its home as default positions.

    Gravity is that of the whole plant. Drake's parser may have added some models already where a
    later one is refused: a plant that raised is for nothing.

    Args:
        plant: The plant, not yet finalized; with a SceneGraph, shapes are added too.
        mechanism: The mechanism, from `load_mechanism`.
        name: Put before the names of its models, for several in one plant.

    Returns:
        What gives its `routes()`, and `home_positions()` when the plant is finalized.

    Raises:
        RobotFileError: Drake refuses the file, or a name of `home` is not there.
    """
    before = plant.num_frames(), set(map(int, plant.GetJointIndices())), plant.num_bodies()
    file = Path(mechanism.mechanism)
    with drake_refusals(f"mechanism: found {file.name}, which Drake refuses"):
        held = inputs_held() is not None
        placed = input_path(file, named_files(file, mechanism.packages)) if held else file
        root = str(placed).removesuffix(str(file))  # empty where nothing is held
        packages = {
            key: root + folder for key, folder in mechanism.packages.items()
            if Path(root + folder).is_dir()
        }  # fmt: skip
        parser, text, kind = Parser(plant, name), None, ""
        if file.name.lower().endswith(DIRECTIVES):
            text, kind = absolute_directives(file, placed.parent), DIRECTIVES[0].lstrip(".")
        parse_models(parser, placed, text, kind, packages)
        plant.mutable_gravity_field().set_gravity_vector(mechanism.gravity_vector())
        frames = {WORLD: int(plant.world_frame().index())}
        for index in range(before[0], plant.num_frames()):
            frame = plant.get_frame(FrameIndex(index))
            if not frame.name().startswith("__"):
                frames[_plain(frame.scoped_name().get_full(), name)] = index
    _set_joints(plant, mechanism, name, before[1])
    _set_bodies(plant, mechanism, name, before[2])
    return MechanismInPlant(plant, mechanism, name, frames)


def absolute_directives(file: Path, folder: Path | None = None) -> str:
    """Model directives with URIs instead of paths relative to their file.

    Drake takes URIs alone there; what else is wrong it says itself. `folder` is where Drake finds
    what the file names beside itself; None: where the file is.

    Raises:
        YamlTextError: It is no YAML.
        OSError: It cannot be read.
    """
    root = compose_yaml(input_text(file))
    for key, items in root.value if isinstance(root, yaml.MappingNode) else ():
        for item in items.value if key.value == "directives" else ():
            for kind, content in item.value if isinstance(item, yaml.MappingNode) else ():
                if kind.value not in ("add_model", "add_directives"):
                    continue
                for name, node in content.value if isinstance(content, yaml.MappingNode) else ():
                    if name.value == "file" and "://" not in str(node.value):
                        node.value = ((folder or file.parent) / str(node.value)).absolute().as_uri()
    return "" if root is None else yaml.serialize(root)


def _plain(scoped: str, prefix: str) -> str:
    """A scoped name without the world's instance and without a mechanism's prefix."""
    scoped = scoped.removeprefix(_WORLD_INSTANCE)
    return scoped.removeprefix(f"{prefix}::") if prefix else scoped


def one_of(known: dict[str, Any], name: str) -> str:
    """The scoped name that a name stands for: itself, or the only one that ends in it.

    Raises:
        RobotFileError: There is none, or there are several; lists those that there are.
    """
    if name in known:
        return name
    found = [scoped for scoped in known if scoped.rpartition("::")[2] == name]
    if len(found) == 1:
        return found[0]
    names = found or sorted(known, key=lambda scoped: (scoped != WORLD, scoped))
    more = f", and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    several = f", which {len(found)} bear" if found else ""
    accepted = ", ".join(names[:MOST_NAMES]) or "none, since there are none"
    raise RobotFileError(f"found {name}{several}; accepted: one of {accepted}{more}")


def _set_joints(plant: MultibodyPlant, mechanism: Mechanism, prefix: str, before: set[int]) -> None:
    """Default positions of the joints that `home` names."""
    joints = {}
    for index in plant.GetJointIndices():
        joint = plant.get_joint(JointIndex(index))
        if int(index) not in before and joint.num_positions():
            instance = plant.GetModelInstanceName(joint.model_instance())
            joints[_plain(f"{instance}::{joint.name()}", prefix)] = joint
    for name, values in mechanism.home.joints.items():
        try:
            joint = joints[one_of(joints, name)]
        except RobotFileError as problem:
            raise RobotFileError(f"home.joints.{name}: {problem}") from problem
        n, words = joint.num_positions(), ", ".join(f"{value:g}" for value in values)
        if len(values) != n:
            raise RobotFileError(
                f"home.joints.{name}: found {len(values)} numbers; accepted: {n} [rad, m]"
            )
        if not np.all(np.isfinite(values)):
            raise RobotFileError(f"home.joints.{name}: found {words}; accepted: finite numbers")
        low, high = joint.position_lower_limits(), joint.position_upper_limits()
        if np.any(values < low) or np.any(values > high):
            limits = " and ".join(f"{a:g}..{b:g}" for a, b in zip(low, high, strict=True))
            raise RobotFileError(
                f"home.joints.{name}: found {words}; accepted: within the joint's limits, {limits}"
            )
        joint.set_default_positions(np.asarray(values, float))


def _set_bodies(plant: MultibodyPlant, mechanism: Mechanism, prefix: str, before: int) -> None:
    """Default poses of the free bodies that `home` names."""
    joints = (plant.get_joint(JointIndex(index)) for index in plant.GetJointIndices())
    carried = {int(joint.child_body().index()) for joint in joints}
    bodies = {}
    for index in range(before, plant.num_bodies()):
        if index not in carried:
            body = plant.get_body(BodyIndex(index))
            bodies[_plain(body.scoped_name().get_full(), prefix)] = body
    for name, pose in mechanism.home.bodies.items():
        try:
            body = bodies[one_of(bodies, name)]
        except RobotFileError as problem:
            raise RobotFileError(
                f"home.bodies.{name}: {problem}, which no joint carries"
            ) from problem
        plant.SetDefaultFloatingBaseBodyPose(body, pose.transform())
