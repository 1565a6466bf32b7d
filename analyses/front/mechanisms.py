"""Mechanisms, whose cables run between any bodies: at rest, and tensions that hold them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex
from pydrake.systems.framework import Context

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.statics.tension_query import solve_all
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.errors import EquilibriumError, TensionProblemError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.mechanism_in_plant import MechanismInPlant, add_mechanism
from cdpr_drake.models.mechanism_loader import as_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import (
    PRESTRESS,
    Booleans,
    Rest,
    hang,
    rows_of_joints,
    rows_of_motors,
    scoped_joint,
    settle,
)
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.statics.controlled_wrenches import WrenchControl, combination_words, wrench_control
from cdpr_drake.summaries import Summarized, numbers
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionProblem, TensionSolution, TensionStatus
from cdpr_drake.tensions.quadratic_program_kernel import RANK_TOLERANCE
from cdpr_drake.tensions.shortfall import Shortfall, shortfall

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNDERACTUATED = "quadratic_program"
"""The only method where cables do not control all that no motor holds."""

ALL_METHODS = "all"
"""In the place of a method: each that applies."""


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
        return {scoped_joint(plant, one): one for one in joints if one.num_velocities()}

    def positions(self, q: Array) -> dict[str, list[float]]:
        """Positions of each joint, of a free body x, y, z, phi, theta, psi [m, rad]."""
        plant, context = self.plant, self.plant.CreateDefaultContext()
        plant.SetPositions(context, q)
        found = {}
        for name, joint in self.joints().items():
            if joint.type_name() == "quaternion_floating":
                X = plant.EvalBodyPoseInWorld(context, joint.child_body())
                angles = angles_from_rotation(X.rotation())
                found[name] = (np.concatenate([X.translation(), angles]) + 0.0).tolist()
            else:
                start = joint.position_start()
                found[name] = q[start : start + joint.num_positions()].tolist()
        return found

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

    def tension_figure(self, tensions: Mapping[str, Array], title: str) -> Figure:
        """Tensions by method, shape (m,) each [N], with the file's bounds."""
        from cdpr_drake.analyses.statics.static_figures import tension_figure

        names, (low, high) = self.cables.routes.names, self.mechanism.tension_limits()
        bounds = np.full(len(names), low), np.full(len(names), high)
        return tension_figure(names, tensions, bounds, title)

    def held_rows(self, held: str | Iterable[str] | None) -> Booleans:
        """Which velocities motors hold, shape (nv,); None: those with actuators.

        Raises:
            EquilibriumError: There is no such joint.
        """
        named = joint_names(held)
        return rows_of_motors(self.plant) if named is None else rows_of_joints(self.plant, named)


def joint_names(given: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """Names of joints, of which one may be given as itself; None: None."""
    if given is None:
        return None
    return (given,) if isinstance(given, str) else tuple(given)


def place_mechanism(
    mechanism: Mechanism | str | Path,
    joints: Mapping[str, float | Sequence[float]] | None = None,
    *,
    model: str = "elastic",
    pulleys: bool = True,
) -> PlacedMechanism:
    """A mechanism in a plant of its own, at home but for some joints.

    Args:
        mechanism: The mechanism, or its name or path.
        joints: Positions of joints by name, before those of its home [rad, m].
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


@dataclass(frozen=True, eq=False, repr=False)
class MechanismAtRest(Summarized):
    """A mechanism at rest on its cables.

    Attributes:
        placed: The mechanism, where it was asked for.
        rest: Where it is at rest, tensions, lengths, and what judges stability.
        lengths: Of the cables under load, shape (m,) [m].
    """

    placed: PlacedMechanism
    rest: Rest
    lengths: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cables."""
        return self.placed.cables.routes.names

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, ascending; of what falls away NaN, shape (k,) [Hz]."""
        squared = self.rest.squared_frequencies
        floor = -1e-9 * float(np.max(np.abs(squared), initial=0.0))
        clipped = np.where(squared > floor, np.maximum(squared, 0.0), np.nan)
        return np.asarray(np.sqrt(clipped) / (2.0 * np.pi))

    def held(self) -> dict[str, list[float]]:
        """Forces that motors hold joints with, by joint [N, N m]."""
        found = {}
        for name, joint in self.placed.joints().items():
            rows = slice(joint.velocity_start(), joint.velocity_start() + joint.num_velocities())
            if np.any(self.rest.held[rows]):
                found[name] = self.rest.held[rows].tolist()
        return found

    def as_dict(self) -> dict[str, Any]:
        """For JSON; SI units, angles in radians; frequencies of what falls away are null."""
        rest = self.rest
        return {
            "mechanism": self.placed.mechanism.name,
            "model": self.placed.cables.model,
            "geometry": self.placed.geometry,
            "stability": rest.stability,
            "positions": self.placed.positions(rest.positions),
            "cables": list(self.names),
            "tensions_n": rest.tensions.tolist(),
            "lengths_m": self.lengths.tolist(),
            "unstrained_lengths_m": rest.unstrained_lengths.tolist(),
            "held": self.held(),
            "residual": rest.residual,
            "frequencies_hz": [None if np.isnan(f) else float(f) for f in self.frequencies],
            "notes": list(rest.notes),
        }

    def plot(self) -> Figure:
        """Tensions with the file's bounds."""
        name, geometry = self.placed.mechanism.name, self.placed.geometry
        title = f"{name} at rest, {geometry}: {self.rest.stability}"
        return self.placed.tension_figure({"at rest": self.rest.tensions}, title)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        rest, frequencies = self.rest, self.frequencies
        held = [f"{name} {numbers(force)}" for name, force in self.held().items()]
        slowest = "unstable" if np.any(np.isnan(frequencies)) else numbers(frequencies[:3])
        return f"{self.placed.mechanism.name} at rest: {rest.stability}", [
            ("geometry", self.placed.geometry),
            ("tensions [N]", numbers(rest.tensions)),
            ("unstrained [m]", numbers(rest.unstrained_lengths)),
            ("held", "; ".join(held) or "nothing"),
            ("frequencies [Hz]", slowest),
            *(("note", words) for words in rest.notes),
        ]


@verb()
def hang_mechanism(
    mechanism: Mechanism | str | Path,
    lengths: Array | Sequence[float] | None = None,
    *,
    joints: Mapping[str, float | Sequence[float]] | None = None,
    model: str = "elastic",
    pulleys: bool = True,
    yields: str = PRESTRESS,
    free: str | Iterable[str] | None = None,
    held: str | Iterable[str] | None = None,
    prestress: Array | float | None = None,
    limits: tuple[float, float] | None = None,
) -> MechanismAtRest:
    """A mechanism at rest: tensions that hold it, or where it comes to rest on given lengths.

    Args:
        mechanism: The mechanism, or its name or path.
        lengths: Unstrained lengths, shape (m,) [m], on which it comes to rest from its home; None:
            tensions are looked for that hold it at home.
        joints: Positions of joints by name, before those of its home [rad, m].
        model: A name of `cables.CABLE_MODELS` that is extensible; without lengths a straight one.
        pulleys: Whether the cables run over its pulleys.
        yields: prestress: positions stay, and tensions are as near to the prestress as they can
            be; pose: positions change so that tensions get there.
        free: Joints that settle; None: those that neither cables nor motors act on.
        held: Joints that motors hold; None: those with actuators.
        prestress: Wanted tensions, shape (m,) or one for all [N]; None: as small as they can be.
        limits: Smallest and largest tension [N]; None: those of the file. A smallest one of 0 asks
            for `plant_rest.LEAST_SHARE` of the weight a cable, where that is possible.

    Raises:
        EquilibriumError: Lengths and what chooses tensions, an unknown model or joint, or no rest.
        InfeasibleTensionError: No tensions within the limits hold it; names the joint.
        CdprError: The file is not accepted, or a cable cannot run.
    """
    if lengths is not None:
        given = {"prestress": prestress, "limits": limits, "free": free}
        found = [name for name, value in given.items() if value is not None]
        found += ["yields"] if yields != PRESTRESS else []
        if found:
            raise EquilibriumError(f"{', '.join(found)}: found with lengths; accepted: without")
    placed = place_mechanism(mechanism, joints, model=model, pulleys=pulleys)
    cables, context = placed.cables, placed.context
    if lengths is None:
        low, high = placed.mechanism.tension_limits(limits)
        rest = hang(
            cables, context, yields=yields, free=joint_names(free), held=joint_names(held),
            prestress=prestress, lower=low if low > 0.0 else None, upper=high,
        )  # fmt: skip
    else:
        rest = settle(cables, context, np.asarray(lengths, float), held=joint_names(held))
    cables.plant.SetPositions(context, rest.positions)
    return MechanismAtRest(placed, rest, cables.outputs(context, rest.unstrained_lengths)[2])


@dataclass(frozen=True, eq=False, repr=False)
class MechanismTensions(Summarized):
    """Tensions that hold a mechanism where it is.

    Attributes:
        placed: The mechanism, where it was asked for.
        rows: What has to be balanced, in words: what no motor holds, n of them.
        solutions: The answer of each method; none where `control` is there.
        control: Where the cables do not control all of that: what they can do; else None.
        shortfall: By how much tensions miss what has to be balanced; None where some balance it.
    """

    placed: PlacedMechanism
    rows: tuple[str, ...]
    solutions: tuple[TensionSolution, ...]
    control: WrenchControl | None
    shortfall: Shortfall | None

    @property
    def status(self) -> str:
        """The verdict: feasible, infeasible or missed; of several methods the first one's."""
        if self.control is None:
            return str(self.solutions[0].status)
        none = self.control.tensions is None
        return str(TensionStatus.INFEASIBLE if none else TensionStatus.FEASIBLE)

    @property
    def tensions(self) -> Array:
        """Shape (m,) [N]; NaN where none hold it; of several methods the first one's."""
        if self.control is None:
            return self.solutions[0].tensions
        none = np.full(self.placed.cables.routes.count, np.nan)
        return none if self.control.tensions is None else self.control.tensions

    def uncontrolled(self) -> list[tuple[str, float]]:
        """Combinations of forces that no tensions change, and what of each nothing balances."""
        if self.control is None:
            return []
        pairs = zip(self.control.free.T, self.control.unbalanced, strict=True)
        return [(combination_words(twist, self.rows), float(off)) for twist, off in pairs]

    def as_dict(self) -> dict[str, Any]:
        """For JSON, keys as of `TensionsAtPose`."""
        names, n = self.placed.cables.routes.names, len(self.rows)
        found = {
            "mechanism": self.placed.mechanism.name,
            "geometry": self.placed.geometry,
            "cables": list(names),
            "redundancy": len(names) - n,
            "rows": list(self.rows),
            "infeasible_by": None if self.shortfall is None else self.shortfall.as_dict(names),
        }
        if self.control is None:
            return {**found, "solutions": [one.as_dict() for one in self.solutions]}
        return {
            **found,
            "method": UNDERACTUATED,
            "rank": self.control.rank,
            "status": self.status,
            "tensions_n": None if self.control.tensions is None else self.tensions.tolist(),
            "uncontrolled": [
                {"combination": words, "unbalanced": off} for words, off in self.uncontrolled()
            ],
        }

    def plot(self) -> Figure:
        """Tensions by each method, with the file's bounds."""
        found = {one.method: one.tensions for one in self.solutions}
        name, geometry = self.placed.mechanism.name, self.placed.geometry
        title = f"Tensions of {name}, {geometry}: {self.status}"
        return self.placed.tension_figure(found or {UNDERACTUATED: self.tensions}, title)

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        name, cables = self.placed.mechanism.name, self.placed.cables.routes.names
        missed = [] if self.shortfall is None else self.shortfall.rows(cables, self.rows)
        if self.control is None:
            return f"Tensions of {name} [N], {self.placed.geometry}", [
                (one.method, f"{one.status}: {numbers(one.tensions)}") for one in self.solutions
            ] + missed
        title = (
            f"{name}: cables control {self.control.rank} of {len(self.rows)} rows: {self.status}"
        )
        rows = [("not controlled", words) for words, _ in self.uncontrolled()]
        return title, [
            ("geometry", self.placed.geometry), ("tensions [N]", numbers(self.tensions)), *rows,
            *missed,
        ]  # fmt: skip


@verb()
def solve_mechanism_tensions(
    mechanism: Mechanism | str | Path,
    method: str = UNDERACTUATED,
    *,
    joints: Mapping[str, float | Sequence[float]] | None = None,
    pulleys: bool = True,
    held: str | Iterable[str] | None = None,
    limits: tuple[float, float] | None = None,
    reference: Array | float | None = None,
    length_scale: float | None = None,
) -> MechanismTensions:
    """Tensions that hold a mechanism at its home, or a proof that there are none.

    W t + w = 0 on the rows that no motor holds, W = -J_l' with the length Jacobian J_l, w the
    generalized force of gravity and of the plant's springs.

    Args:
        mechanism: The mechanism, or its name or path.
        method: A name of `TENSION_METHODS`, or all.
        joints: Positions of joints by name, before those of its home [rad, m].
        pulleys: True: cables run over the mechanism's pulleys. False: pulleys are ignored.
        held: Joints that motors hold; None: those with actuators.
        limits: Smallest and largest tension [N]; None: those of the file.
        reference: Desired tensions, one for all cables or shape (m,) [N], for reference_program.
        length_scale: By which methods that relax divide moments [m]; None: root mean square of the
            cables' lever arms.

    Returns:
        Tensions and the verdict on them; where the cables do not control every row, as with a
        passive joint that no cable acts on, what no tensions change.

    Raises:
        TensionProblemError: The method is not accepted, motors hold all, or a number makes no
            sense.
        EquilibriumError: There is no such joint.
        CdprError: The file is not accepted, or a cable cannot run.
    """
    placed = place_mechanism(mechanism, joints, pulleys=pulleys)
    cables, context = placed.cables, placed.context
    words, turns = placed.rows()
    rows = np.flatnonzero(~placed.held_rows(held))
    if not len(rows):
        raise TensionProblemError(
            "held: found all joints held by motors; accepted: some that cables hold"
        )
    W = -cables.length_jacobian(context).T[rows]
    wrench = cables.other_forces(context)[rows]
    low, high = placed.mechanism.tension_limits(limits)
    m, names = cables.routes.count, tuple(words[row] for row in rows)
    lower, upper = np.full(m, low), np.full(m, high)
    scale = _row_scale(W, turns[rows], length_scale)
    singular = np.linalg.svd(W, compute_uv=False)
    if len(rows) > m or int(np.sum(singular > RANK_TOLERANCE * singular[0])) < len(rows):
        if method not in (UNDERACTUATED, ALL_METHODS):
            raise TensionProblemError(
                f"method: found {method} where cables do not control every row of "
                f"{placed.mechanism.name}; accepted: {UNDERACTUATED}"
            )
        control = wrench_control(W, wrench, lower, upper, scale)
        return MechanismTensions(placed, names, (), control, control.shortfall())
    wanted = None if reference is None else np.broadcast_to(np.asarray(reference, float), (m,))
    problem = TensionProblem(W, wrench, lower, upper, wanted, scale)
    every = method == ALL_METHODS
    solutions = tuple(solve_all(problem)) if every else (distribute(problem, method),)
    none = any(one.status == TensionStatus.INFEASIBLE for one in solutions)
    return MechanismTensions(placed, names, solutions, None, shortfall(problem) if none else None)


def _row_scale(W: Array, turns: Array, length_scale: float | None) -> Array:
    """What makes moments and forces comparable, shape (n,) [m, -].

    Raises:
        TensionProblemError: The length is not above 0.
    """
    if length_scale is None:
        arms = W[turns][W[turns] != 0.0]
        length_scale = float(np.sqrt(np.mean(arms**2))) if len(arms) else 1.0
    if not (np.isfinite(length_scale) and length_scale > 0.0):
        raise TensionProblemError(f"length_scale: found {length_scale:g}; accepted: above 0 [m]")
    return np.where(turns, length_scale, 1.0)
