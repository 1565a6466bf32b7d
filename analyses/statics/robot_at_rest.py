"""A robot at rest: at a pose, or where its cables' unstrained lengths let it hang."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.kinematics import pose_numbers
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    counted_lengths,
    drum_tensions,
    tangent_cables,
)
from cdpr_drake.cables.models import CABLE_MODELS, INEXTENSIBLE, STRAIGHT, check_model
from cdpr_drake.cables.states import cable_state
from cdpr_drake.errors import CableModelError, EquilibriumError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose, rigid_platform
from cdpr_drake.statics.equilibrium import (
    Equilibrium,
    Stability,
    anchor_arm,
    classify_equilibrium,
    equilibria,
    equilibrium_near,
    principal_stiffnesses,
    random_starts,
)
from cdpr_drake.statics.stiffness import inextensible_modes, natural_modes, platform_stiffness
from cdpr_drake.summaries import numbers

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STARTS = 40
"""Random poses from which equilibria are searched, in addition to the home pose."""

MOST_TOUCHES, TOUCHING = 20, 1e-10
"""Steps of Newton's method for cables that stiffen, which end where tensions change by less, of the
largest; four or five are usual."""

LARGEST_STRAIN = 0.03
"""Where a robot file gives no breaking load, a cable is taken to break at this strain, which is
about what ropes of steel or stretched polyethylene bear."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RobotAtRest(Result):
    """A robot at rest.

    Attributes:
        robot: The robot.
        model: Name of the cable model.
        cables: The cables, without pulleys if these are ignored.
        X_WP: Pose of the platform.
        l0: Unstrained lengths from A to B, shape (m,) [m].
        tensions: At the platform, shape (m,) [N].
        lengths: Under load, shape (m,) [m].
        slack: Which cables are, as `CableState` has it, shape (m,).
        surplus_lengths: What l0 is longer than the straight path, shape (m,) [m].
        sags: Shape (m,) [m].
        stiffness: Shape (n, n) [N m, N per rad, m], of the motions that the platform has; None
            with inextensible cables.
        principal: Principal stiffnesses, turns times `arm`, least first, shape (n,) [N/m].
        arm: Mean distance of the anchor points from Po [m].
        stability: The verdict on them.
        frequencies: Natural frequencies, slowest first, shape (k,) [Hz]; with inextensible cables
            of the motions that these leave, None where they leave none.
        modes: Their shapes, columns (turn, translation), shape (6, k); None likewise.
        others: Other poses of rest of the same lengths, by energy.
        contacts: How far the platform may rest beside this pose [rad], since contacts hold it, and
            the moments that they hold about x, y, z of P [N m], shape (4,); None where nothing
            rubs, or with inextensible cables.
        drums: Tensions at the drums while all cables are wound up, and while all are paid out,
            shape (2, m) [N]; None without friction of sheaves.
    """

    robot: Robot
    model: str
    cables: CableSet
    X_WP: RigidTransform
    l0: Array
    tensions: Array
    lengths: Array
    slack: np.ndarray
    surplus_lengths: Array
    sags: Array
    stiffness: Array | None
    principal: Array
    arm: float
    stability: Stability
    frequencies: Array | None
    modes: Array | None
    others: list[Equilibrium]
    drums: Array | None = None
    contacts: Array | None = None

    @property
    def names(self) -> list[str]:
        """Names of the cables."""
        return [cable.name for cable in self.robot.cables]

    @property
    def geometry(self) -> str:
        """Geometry of the cables, as `Robot.geometry_words`."""
        return self.robot.geometry_words(self.cables.has_pulleys())

    def as_dict(self) -> dict[str, Any]:
        """For JSON; what is infinite or does not apply is null."""
        extras: dict[str, Any] = {}
        if self.drums is not None:
            extras["drum_tensions_winding_up_n"] = self.drums[0].tolist()
            extras["drum_tensions_paying_out_n"] = self.drums[1].tolist()
        if self.contacts is not None:
            extras["rests_within_rad"], *extras["held_moments_n_m"] = self.contacts.tolist()
        numbers: dict[str, Any] = finite({
            "robot": self.robot.name,
            "cable_model": self.model,
            "pulleys": self.cables.has_pulleys(),
            "geometry": self.geometry,
            "pose": pose_numbers(self.X_WP),
            "unstrained_lengths_m": self.l0.tolist(),
            "lengths_m": self.lengths.tolist(),
            "tensions_n": self.tensions.tolist(),
            "slack": self.slack.tolist(),
            "surplus_lengths_m": self.surplus_lengths.tolist(),
            "sags_m": self.sags.tolist(),
            "stability": str(self.stability),
            "principal_stiffnesses_n_per_m": self.principal.tolist(),
            "stiffness": None if self.stiffness is None else self.stiffness.tolist(),
            "frequencies_hz": None if self.frequencies is None else self.frequencies.tolist(),
            "modes": None if self.modes is None else self.modes.T.tolist(),
            "other_equilibria": [
                {"pose": pose_numbers(rest.X_WP), "energy_j": rest.energy,
                 "stability": str(rest.stability)}
                for rest in self.others
            ],
            **extras,
        })  # fmt: skip
        return numbers

    def tables(self) -> list[Table]:
        """A row for each cable."""
        headings = ("cable", "length [m]", "unstrained [m]", "tension [N]", "sag [mm]",
                    "surplus [mm]", "slack")  # fmt: skip
        rows = [
            (name, f"{self.lengths[k]:.5f}", f"{self.l0[k]:.5f}", f"{self.tensions[k]:.2f}",
             f"{1e3 * self.sags[k]:.2f}",
             f"{1e3 * self.surplus_lengths[k]:.3f}" if self.surplus_lengths[k] > 0.0 else "-",
             "slack" if self.slack[k] else "")
            for k, name in enumerate(self.names)
        ]  # fmt: skip
        angles = np.degrees(angles_from_rotation(self.X_WP.rotation()))
        pose = f"({numbers(self.X_WP.translation(), 5)}) m, ({numbers(angles)}) deg"
        title = f"{self.robot.name} at {pose}: {self.stability}; {self.model} cables, "
        return [Table(title + self.geometry, headings, rows)]

    def lines(self) -> list[str]:
        """Drums, stiffness, vibrations, contacts, and other poses of rest."""
        result = []
        friction = self.robot.cable_behaviour().sheave_friction
        if friction > 0.0 and not self.cables.has_pulleys():
            result.append(f"note: sheave_friction {friction:g} of {self.robot.name} does nothing "
                          "without pulleys")  # fmt: skip
        if self.drums is not None:
            for words, row in zip(("wound up", "paid out"), self.drums, strict=True):
                tensions = ", ".join(f"{tension:.2f}" for tension in row)
                result.append(f"tensions at the drums while cable is {words} [N]: {tensions}")
        stiffness = ", ".join(f"{k:.3g}" if np.isfinite(k) else "rigid" for k in self.principal)
        result.append(f"principal stiffnesses [N/m], turns times {self.arm:.3g} m: {stiffness}")
        if self.frequencies is not None:
            result.append(f"natural frequencies [Hz]: {frequency_words(self.frequencies)}")
        if self.contacts is not None:
            within, *moments = self.contacts.tolist()
            result.append(
                f"rest is not unique: contacts hold moments up to ({numbers(moments, 3)}) N m "
                "about x, y, z of P, so that the platform may rest turned by up to "
                f"{np.degrees(within):.3g} deg from here; frequencies are those of swings that "
                "slip, small swings are faster"
            )
        if self.others:
            result.append(f"other poses of rest of these lengths: {len(self.others)}, higher ones")
        return result

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The robot at rest; and the behaviour of its cables and contacts by its file, which is
        refused where the file says nothing of it."""
        from cdpr_drake.analyses.statics.rest_figures import behaviour_figure, rest_figure

        return {"rest": partial(rest_figure, self), "behaviour": partial(behaviour_figure, self)}


def frequency_words(frequencies: Array) -> str:
    """Natural frequencies in words; those of what falls away are no numbers."""
    return ", ".join(f"{f:.4g}" if np.isfinite(f) else "unstable" for f in frequencies)


def static_at_pose(robot: Robot, X_WP: RigidTransform, model: str, pulleys: bool) -> RobotAtRest:
    """Holds a robot at a pose by tensions of least 2-norm within its bounds.

    Raises:
        CdprError: The pose is outside the frame, or cannot be held; says why.
    """
    cables, behaviour = robot.cable_set(pulleys), _behaviour(robot, model)
    holding = hold_robot(robot, X_WP, cables, model)
    tensions, l0 = holding.tensions, holding.unstrained_lengths
    if not behaviour.changes_lengths():
        return _at_rest(robot, cables, model, X_WP, l0, tensions)
    lengths = cable_paths(X_WP, cables).lengths
    counted = counted_lengths(lengths, tensions, cables.stiffness, behaviour)
    linear, l0 = tangent_cables(cables, counted, tensions, behaviour)
    rest = _at_rest(robot, linear, model, X_WP, l0, tensions)
    return replace(rest, cables=cables, l0=counted)


def static_at_lengths(
    robot: Robot, l0: Array, model: str, pulleys: bool, seed: int = 0
) -> RobotAtRest:
    """Lets a robot hang with these unstrained lengths, at the lowest pose of rest.

    Searched from the home pose and from `STARTS` seeded random poses in the frame. Cables that
    stiffen or are warm are elastic ones that touch their law at the tensions, which is Newton's
    method.

    Args:
        robot: The robot.
        l0: Unstrained lengths from A to B, shape (m,) [m].
        model: Name of the cable model.
        pulleys: True if the cables run over the robot's pulleys.
        seed: Of the random poses.

    Raises:
        CdprError: No pose in the frame has these lengths without breaking a cable; by how much.
    """
    cables, behaviour = robot.cable_set(pulleys), _behaviour(robot, model)
    if not behaviour.changes_lengths():
        return _at_lengths(robot, cables, l0, model, seed)
    tensions = np.zeros(cables.count)
    for _ in range(MOST_TOUCHES):
        linear, linear_l0 = tangent_cables(cables, l0, tensions, behaviour)
        rest = _at_lengths(robot, linear, linear_l0, model, seed)
        change = float(np.max(np.abs(rest.tensions - tensions)))
        tensions = rest.tensions
        if change <= TOUCHING * float(np.max(tensions)):
            return replace(rest, cables=cables, l0=np.asarray(l0, float))
    raise EquilibriumError(
        f"lengths: after {MOST_TOUCHES} steps tensions still change by {change:.3g} N; accepted: "
        "cables that stiffen less"
    )


def _at_lengths(robot: Robot, cables: CableSet, l0: Array, model: str, seed: int) -> RobotAtRest:
    """As `static_at_lengths`, on these cables."""
    platform, joint = rigid_platform(robot), robot.joint()
    lower = np.array(robot.frame.lower, float)
    if robot.plane_height is not None:
        lower[2] = robot.plane_height
    random = random_starts(lower, robot.frame.upper, STARTS, seed, platform.motion)
    starts = [robot.home.transform()]
    starts += random if joint.is_as_world() else map(joint.nearest, random)
    check_model(model, cables)
    elastic = model if CABLE_MODELS[model].law != STRAIGHT else "elastic"
    # Elastic cables always come to rest somewhere; the tension they need there tells whether the
    # lengths make sense.
    rests = equilibria(cables, elastic, platform, l0, starts)
    low, high = robot.frame.bounds()
    places = np.array([rest.X_WP.translation() for rest in rests])
    within = np.all((low <= places) & (places <= high), axis=1)
    inside = list(compress(rests, within))
    if not inside:
        check_pose(robot, rests[0].X_WP)
    strength = np.minimum(cables.breaking_load, LARGEST_STRAIN * cables.stiffness)
    bearable = [rest for rest in inside if np.all(rest.tensions <= strength)]
    if not bearable:
        rest = min(inside, key=lambda rest: float(np.max(rest.tensions)))
        i = int(np.argmax(rest.tensions / strength))
        raise EquilibriumError(
            f"lengths: no pose in the frame has them; at best cable {i + 1} is stretched by "
            f"{1e3 * rest.tensions[i] * l0[i] / cables.stiffness[i]:.3g} mm and takes "
            f"{rest.tensions[i]:.4g} N; accepted: at most its breaking load, {strength[i]:.4g} N"
        )
    if not CABLE_MODELS[model].extensible:
        elastic_rests, bearable = bearable, []
        for rest in elastic_rests:
            with suppress(EquilibriumError):
                rigid = equilibrium_near(cables, INEXTENSIBLE, platform, l0, rest.X_WP)
                bearable.append(rigid)
        if not bearable:
            best = min(elastic_rests, key=lambda rest: float(np.max(rest.tensions)))
            stretch = best.tensions * l0 / cables.stiffness
            i = int(np.argmax(stretch))
            raise EquilibriumError(
                f"lengths: no pose has them with inextensible cables; at best cable {i + 1} would "
                f"have to be {1e3 * stretch[i]:.3g} mm longer"
            )
    lowest = min(bearable, key=lambda rest: rest.energy)
    others = [rest for rest in bearable if rest is not lowest]
    return _at_rest(robot, cables, model, lowest.X_WP, l0, lowest.tensions, others, lowest)


def _at_rest(
    robot: Robot, cables: CableSet, model: str, X_WP: RigidTransform, l0: Array, tensions: Array,
    others: Sequence[Equilibrium] = (), rest: Equilibrium | None = None,
) -> RobotAtRest:  # fmt: skip
    """Stiffness, vibrations and sag at a pose of rest; `rest` has its stability if it is known."""
    platform, arm = rigid_platform(robot), anchor_arm(cables)
    if CABLE_MODELS[model].extensible:
        state = cable_state(cables, model, X_WP, l0)
        full = platform_stiffness(cables, model, platform, X_WP, l0).total
        K = platform.motion.part(full, X_WP.rotation().matrix())
        principal = principal_stiffnesses(0.5 * (K + K.T), platform, arm)
        modes = natural_modes(full, platform, X_WP)
        lengths, slack, sags = state.lengths, state.slack, state.sags
        surplus = state.surplus_lengths
    else:
        K = None
        rigid = np.full(platform.motion.freedom, np.inf)
        principal = rigid if rest is None else rest.stiffnesses
        modes = inextensible_modes(cables, platform, X_WP, tensions)
        lengths = cable_paths(X_WP, cables).lengths
        slack, sags = tensions <= 0.0, np.zeros_like(l0)
        surplus = np.maximum(l0 - lengths, 0.0)
    vibrates = K is not None or len(modes.frequencies) > 0
    return RobotAtRest(
        robot=robot, model=model, cables=cables, X_WP=X_WP, l0=np.asarray(l0, float),
        tensions=tensions, lengths=lengths, slack=slack, surplus_lengths=surplus, sags=sags,
        stiffness=K, principal=principal, arm=arm,
        stability=classify_equilibrium(principal) if rest is None else rest.stability,
        frequencies=modes.frequencies if vibrates else None,
        modes=modes.shapes if vibrates else None, others=list(others),
        drums=_drums(robot, cables, X_WP, tensions),
        contacts=None if K is None else _contacts(robot, K, X_WP),
    )  # fmt: skip


def _behaviour(robot: Robot, model: str) -> CableBehaviour:
    """What the robot's cables do beside the elastic law; refuses models that do not go with it."""
    behaviour, law = robot.cable_behaviour(), CABLE_MODELS.get(model)
    if behaviour.changes_lengths() and law and not (law.extensible and law.law == STRAIGHT):
        raise CableModelError(
            f"cable model: found {model} for cables that stiffen or are warm, see cable.behaviour "
            f"of {robot.name}; accepted: elastic, kelvin_voigt"
        )
    return behaviour


def _drums(robot: Robot, cables: CableSet, X_WP: RigidTransform, tensions: Array) -> Array | None:
    """Tensions at the drums, wound up and paid out, shape (2, m) [N]; None without friction."""
    friction = robot.cable_behaviour().sheave_friction
    if friction == 0.0 or not cables.has_pulleys():
        return None
    if cables.has_platform_pulleys():
        raise CableModelError(
            f"cable.behaviour.sheave_friction of {robot.name}: found {friction:g} with pulleys at "
            "the platform; accepted: 0, or pulleys at the exit points only"
        )
    radii = np.where(cables.pulley_radius > 0.0, cables.pulley_radius, np.inf)
    wraps, ones = cable_paths(X_WP, cables).arcs / radii, np.ones(cables.count)
    return np.array([drum_tensions(tensions, wraps, friction, s * ones) for s in (1.0, -1.0)])


def _contacts(robot: Robot, K: Array, X_WP: RigidTransform) -> Array | None:
    """How far the platform may rest beside a pose [rad], and held moments [N m], shape (4,).

    Infinite where the pose is not stable, by the stiffness K of the motions that the robot has.
    """
    contacts = robot.contact_hysteresis()
    if contacts is None:
        return None
    R = X_WP.rotation().matrix()
    B = robot.motion_type().basis(R)
    if np.min(np.linalg.eigvalsh(0.5 * (K + K.T))) <= 0.0:
        return np.array([np.inf, *contacts.held_moments()])
    compliance = (B @ np.linalg.inv(K) @ B.T)[:3, :3]
    return np.array([contacts.turns_of_rest(compliance, R), *contacts.held_moments()])
