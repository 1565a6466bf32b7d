"""Mechanisms, whose cables run between any bodies, in a plant where verbs ask about them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.mechanism_in_plant import MechanismInPlant, add_mechanism
from cdpr_drake.models.mechanism_loader import as_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import Booleans, rows_of_joints, rows_of_motors, scoped_joint
from cdpr_drake.schema.typed_yaml import closest


@dataclass(frozen=True, eq=False)
class PlacedMechanism:
    """A mechanism in a plant of its own.

    Attributes:
        mechanism: The mechanism.
        cables: Its cables.
        context: Of the plant, at the positions that were asked for.
        geometry: Geometry of the cables, as `CableSet.geometry_words`.
    """

    mechanism: Mechanism
    cables: PlantCables
    context: Context
    geometry: str

    @property
    def plant(self) -> MultibodyPlant:
        """The plant."""
        return self.cables.plant

    def joints(self) -> dict[str, Any]:
        """Its joints that move, by scoped name; those of free bodies bear the bodies' names."""
        plant = self.plant
        joints = (plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices())
        return {scoped_joint(plant, joint): joint for joint in joints if joint.num_velocities()}

    def positions(self, q: Array) -> dict[str, list[float]]:
        """Positions of each joint, of a free body x, y, z, phi, theta, psi [m, rad]."""
        plant, context = self.plant, self.plant.CreateDefaultContext()
        plant.SetPositions(context, q)
        positions = {}
        for name, joint in self.joints().items():
            if joint.type_name() == "quaternion_floating":
                X = plant.EvalBodyPoseInWorld(context, joint.child_body())
                angles = angles_from_rotation(X.rotation())
                positions[name] = (np.concatenate([X.translation(), angles]) + 0.0).tolist()
            else:
                start = joint.position_start()
                positions[name] = q[start : start + joint.num_positions()].tolist()
        return positions

    def rows(self) -> tuple[tuple[str, ...], Array]:
        """What each velocity's force is, in words, and whether it is a moment, shape (nv,)."""
        words = [""] * self.plant.num_velocities()
        turns = np.zeros(len(words), dtype=bool)
        for name, joint in self.joints().items():
            for k in range(joint.num_velocities()):
                suffix, row = joint.velocity_suffix(k), joint.velocity_start() + k
                turns[row] = suffix.startswith("w")
                kind, along = ("moment", "about") if turns[row] else ("force", "along")
                axis = f" {along} {suffix[1:]} of" if suffix[1:] else " at"
                words[row] = f"{kind}{axis} {name}"
        return tuple(words), turns

    def held_rows(self, held: str | Iterable[str] | None) -> Booleans:
        """Which velocities motors hold, shape (nv,); None: those with actuators.

        Raises:
            EquilibriumError: There is no such joint.
        """
        names = joint_names(held)
        return rows_of_motors(self.plant) if names is None else rows_of_joints(self.plant, names)


def joint_names(names: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """Names of joints; a single name stands for itself, None for None."""
    return (names,) if isinstance(names, str) else None if names is None else tuple(names)


def place_mechanism(
    mechanism: Mechanism | str | Path,
    joints: Mapping[str, float | Sequence[float]] | None = None,
    *,
    model: str = "elastic",
    pulleys: bool = True,
) -> PlacedMechanism:
    """Builds a plant of a mechanism alone, at its home except for some joints.

    Args:
        mechanism: The mechanism, or its name or path.
        joints: Positions of joints by name, instead of their home positions [rad, m].
        model: A name of `cables.CABLE_MODELS`.
        pulleys: Whether the cables run over its pulleys.

    Raises:
        RobotFileError: The file is not accepted, or there is no such joint.
        EquilibriumError: The model is unknown, or a position is no number.
    """
    if model not in CABLE_MODELS:
        raise EquilibriumError(f"model: {model!r} is unknown; {closest(model, CABLE_MODELS)}")
    loaded = deepcopy(as_mechanism(mechanism))
    for name, value in (joints or {}).items():
        try:
            loaded.home.joints[name] = np.atleast_1d(np.asarray(value, float))
        except (TypeError, ValueError) as problem:
            raise EquilibriumError(
                f"joints: found {value!r} for {name}; accepted: numbers [rad, m]"
            ) from problem
    plant = MultibodyPlant(0.0)
    added: MechanismInPlant = add_mechanism(plant, loaded)
    added.finalize()
    routes = added.routes()
    cables = PlantCables(plant, routes if pulleys else routes.without_pulleys(), model)
    words = routes.ends.geometry_words(pulleys)
    return PlacedMechanism(loaded, cables, plant.CreateDefaultContext(), words)
