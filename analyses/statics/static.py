"""A robot or a mechanism at rest: lengths, tensions, stiffness, vibrations and sag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    OF_MECHANISMS,
    OF_ROBOTS,
    Joints,
    Limits,
    ModelWord,
    Numbers,
    PoseWord,
    SomeNames,
    one_of,
    refuse_arguments,
)
from cdpr_drake.analyses.kinematics import checked_lengths
from cdpr_drake.analyses.statics.robot_at_rest import (
    RobotAtRest,
    frequency_words,
    static_at_lengths,
    static_at_pose,
)
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, ELASTIC
from cdpr_drake.errors import EquilibriumError, accepted_names
from cdpr_drake.models.robot_loader import as_robot, names_mechanism
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.summaries import numbers

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.analyses.mechanisms import PlacedMechanism
    from cdpr_drake.models.plant_rest import Rest

YIELDS = ("prestress", "pose")
"""What gives way where a mechanism cannot keep both."""


@dataclass(frozen=True, eq=False, repr=False)
class MechanismAtRest(Result):
    """A mechanism at rest on its cables.

    Attributes:
        placed: The mechanism in its plant.
        rest: Positions, tensions, unstrained lengths, and what judges stability.
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
        """Forces with which motors hold joints, by joint [N, N m]."""
        forces = {}
        for name, joint in self.placed.joints().items():
            rows = slice(joint.velocity_start(), joint.velocity_start() + joint.num_velocities())
            if np.any(self.rest.held[rows]):
                forces[name] = self.rest.held[rows].tolist()
        return forces

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

    def tables(self) -> list[Table]:
        """A row for each cable."""
        rest, placed = self.rest, self.placed
        title = f"{placed.mechanism.name} at rest: {rest.stability}; {placed.cables.model} cables, "
        numbers_of = zip(self.lengths, rest.unstrained_lengths, rest.tensions, strict=True)
        return [Table(
            title + placed.geometry, ("cable", "length [m]", "unstrained [m]", "tension [N]"),
            [(name, f"{length:.5f}", f"{l0:.5f}", f"{t:.2f}")
             for name, (length, l0, t) in zip(self.names, numbers_of, strict=True)],
        )]  # fmt: skip

    def lines(self) -> list[str]:
        """Positions of joints, forces of motors, vibrations and notes."""
        positions = self.placed.positions(self.rest.positions)
        return [
            *(f"{name} [m, rad]: {numbers(q, 6)}" for name, q in positions.items()),
            *(f"{name} is held with [N, N m]: {numbers(f, 6)}" for name, f in self.held().items()),
            f"natural frequencies [Hz]: {frequency_words(self.frequencies)}",
            *(f"note: {note}" for note in self.rest.notes),
        ]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Tensions with the file's bounds."""
        from cdpr_drake.analyses.tension_figures import tension_figure

        mechanism, geometry = self.placed.mechanism, self.placed.geometry
        lower, upper = (np.full(len(self.names), bound) for bound in mechanism.tension_limits())
        title = f"{mechanism.name} at rest, {geometry}: {self.rest.stability}"
        tensions = {"at rest": self.rest.tensions}
        return {"tensions": lambda: tension_figure(self.names, tensions, (lower, upper), title)}


@verb()
def solve_static(
    robot: ModelWord, pose: PoseWord = None, lengths: Numbers = None,
    model: Annotated[str | None, one_of(CABLE_MODELS, "--cable-model")] = None, *,
    pulleys: bool = True, joints: Joints = None,
    yields: Annotated[str | None, one_of(YIELDS)] = None, prestress: Numbers = None,
    free: SomeNames = None, held: SomeNames = None, limits: Limits = None,
) -> RobotAtRest | MechanismAtRest:  # fmt: skip
    """Computes lengths, tensions, stiffness, vibrations and sag of a robot at rest.

    Tensions of least 2-norm within the robot's bounds hold it at the pose; with lengths it hangs
    at the lowest pose of rest. Tensions hold a mechanism at its home; with lengths it comes to
    rest from there.

    Args:
        robot: Robot or mechanism by name or file.
        pose: Pose X_WP of the platform [m, deg]; default: its home.
        lengths: Instead of a pose: unstrained cable lengths from A to B, l1,...,lm [m].
        model: Cable model; default: the robot file's, or elastic.
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.
        joints: Of a mechanism: position of a joint [rad, m], may be repeated; default: its home.
        yields: Of a mechanism: prestress (joints stay where they are, and tensions are as near to
            the prestress as they can be; default) or pose (joints move until tensions are the
            prestress).
        prestress: Of a mechanism: desired tensions, one for all or t1,...,tm [N]; default: as
            small as they can be.
        free: Of a mechanism: joints that come to rest freely; default: those on which neither
            cables nor motors act.
        held: Of a mechanism: joints that motors hold; default: those with actuators.
        limits: Of a mechanism: smallest and largest tension [N]; default: its own. A smallest one
            of 0 asks for 1 % of the weight per cable, where that is possible.

    Raises:
        EquilibriumError: Pose and lengths, lengths and what chooses tensions, a model, joint or
            lengths that are not accepted; or nothing rests with these lengths.
        InfeasibleTensionError: No tensions within the limits hold it; says by how much, or names
            the joint.
        CdprError: The pose is outside the frame, or an argument is of the other kind.
    """
    if names_mechanism(robot):
        refuse_arguments(OF_ROBOTS, pose=pose)
        if lengths is not None:
            refuse_arguments(
                "found with lengths; accepted: without", prestress=prestress, limits=limits,
                free=free, yields=yields,
            )  # fmt: skip
        from cdpr_drake.analyses.mechanisms import joint_names, place_mechanism
        from cdpr_drake.models.plant_rest import hang, settle

        placed = place_mechanism(robot, dict(joints or {}), model=model or ELASTIC, pulleys=pulleys)
        cables, context, motors = placed.cables, placed.context, joint_names(held)
        if lengths is None:
            low, high = placed.mechanism.tension_limits(limits)
            rest = hang(
                cables, context, yields=yields or YIELDS[0], free=joint_names(free), held=motors,
                prestress=None if prestress is None else np.squeeze(np.asarray(prestress, float)),
                lower=low if low > 0.0 else None, upper=high,
            )  # fmt: skip
        else:
            l0 = checked_lengths(lengths, cables.routes.count, placed.mechanism.name)
            rest = settle(cables, context, l0, held=motors)
        cables.plant.SetPositions(context, rest.positions)
        return MechanismAtRest(placed, rest, cables.outputs(context, rest.unstrained_lengths)[2])
    refuse_arguments(
        OF_MECHANISMS, joints=joints, yields=yields, prestress=prestress, free=free,
        held=held, limits=limits,
    )  # fmt: skip
    if pose is not None and lengths is not None:
        raise EquilibriumError("pose, lengths: found both; accepted: one of them")
    loaded = as_robot(robot, "solve_static")
    model = model or loaded.cable_model or ELASTIC
    if model not in CABLE_MODELS:
        raise EquilibriumError(f"model: found {model!r}; {accepted_names(model, CABLE_MODELS)}")
    if lengths is None:
        return static_at_pose(loaded, as_pose(loaded, pose), model, pulleys)
    l0 = checked_lengths(lengths, len(loaded.cables), loaded.name)
    return static_at_lengths(loaded, l0, model, pulleys)
