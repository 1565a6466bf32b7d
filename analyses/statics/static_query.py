"""A robot at rest: at a pose, or where its cables' unstrained lengths let it hang."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    counted_lengths,
    drum_tensions,
    tangent_cables,
)
from cdpr_drake.cables.dispatch_kernel import STRAIGHT
from cdpr_drake.cables.models import (
    CABLE_MODELS,
    INEXTENSIBLE,
    CableState,
    cable_state,
    check_model,
)
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
from cdpr_drake.summaries import Summarized, numbers

STARTS = 40
"""Poses from which equilibria are searched, beside the home pose."""

MOST_TOUCHES, TOUCHING = 20, 1e-10
"""Steps of Newton's method for cables that stiffen, which end where tensions change by less, of the
largest; four or five are usual."""

LARGEST_STRAIN = 0.03
"""Where a robot file gives no breaking load, a cable is taken to break at this strain, which is
about what ropes of steel or stretched polyethylene bear."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class StaticReport(Summarized):
    """A robot at rest.

    Attributes:
        robot: Its name.
        model: Name of the cable model.
        cables: The cables, without pulleys if that was asked for.
        geometry: Geometry of the cables, as `Robot.geometry_words`.
        names: Names of the cables.
        X_WP: Pose of the platform.
        l0: Unstrained lengths from A to B, shape (m,) [m].
        tensions: At the platform, shape (m,) [N].
        lengths: Under load, shape (m,) [m].
        slack: Which cables are, as `CableState` has it, shape (m,).
        surplus_lengths: What l0 is longer than the straight path, shape (m,) [m].
        sags: Shape (m,) [m].
        bounds: The robot's smallest and largest tension [N].
        stiffness: Shape (n, n) [N m, N per rad, m], of the motions that the platform has; None
            with inextensible cables.
        principal: Principal stiffnesses, turns times `arm`, least first, shape (n,) [N/m].
        arm: Mean distance of the anchor points from Po [m].
        stability: The verdict on them.
        frequencies: Natural frequencies, slowest first, shape (k,) [Hz]; with inextensible cables
            of the motions that these leave, None where they leave none.
        modes: Their shapes, columns (turn, translation), shape (6, k); None likewise.
        others: Other poses of rest that were found, by energy.
        contacts: How far the platform may rest beside this pose [rad], since contacts hold it, and
            the moments that they hold about x, y, z of P [N m], shape (4,); None where nothing
            rubs, or with inextensible cables.
        drums: Tensions at the drums while all cables are wound up, and while all are paid out,
            shape (2, m) [N]; None without friction of sheaves.
    """

    robot: str
    model: str
    cables: CableSet
    geometry: str
    names: list[str]
    X_WP: RigidTransform
    l0: Array
    tensions: Array
    lengths: Array
    slack: np.ndarray
    surplus_lengths: Array
    sags: Array
    bounds: tuple[float, float]
    stiffness: Array | None
    principal: Array
    arm: float
    stability: Stability
    frequencies: Array | None
    modes: Array | None
    others: list[Equilibrium]
    drums: Array | None = None
    contacts: Array | None = None

    def as_dict(self) -> dict[str, Any]:
        """The report for JSON; what is infinite or does not apply is null."""
        drums: dict[str, Any] = {}
        if self.drums is not None:
            drums = {
                "drum_tensions_winding_up_n": self.drums[0].tolist(),
                "drum_tensions_paying_out_n": self.drums[1].tolist(),
            }
        if self.contacts is not None:
            drums["rests_within_rad"] = _finite(self.contacts)[0]
            drums["held_moments_n_m"] = self.contacts[1:].tolist()
        return {
            "robot": self.robot,
            "cable_model": self.model,
            "pulleys": self.cables.has_pulleys(),
            "geometry": self.geometry,
            "pose": _pose(self.X_WP),
            "unstrained_lengths_m": self.l0.tolist(),
            "lengths_m": self.lengths.tolist(),
            "tensions_n": self.tensions.tolist(),
            "slack": self.slack.tolist(),
            "surplus_lengths_m": self.surplus_lengths.tolist(),
            "sags_m": self.sags.tolist(),
            "stability": str(self.stability),
            "principal_stiffnesses_n_per_m": _finite(self.principal),
            "stiffness": None if self.stiffness is None else self.stiffness.tolist(),
            "frequencies_hz": None if self.frequencies is None else _finite(self.frequencies),
            "modes": None if self.modes is None else self.modes.T.tolist(),
            "other_equilibria": [
                {"pose": _pose(one.X_WP), "energy_j": one.energy, "stability": str(one.stability)}
                for one in self.others
            ],
        } | drums

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        angles = np.degrees(angles_from_rotation(self.X_WP.rotation()))
        slack = [name for name, loose in zip(self.names, self.slack, strict=True) if loose]
        slowest = "-"
        if self.frequencies is not None:
            slowest = f"{self.frequencies[0]:.4g} Hz"
        return f"{self.robot} at rest, {self.model} cables: {self.stability}", [
            ("geometry", self.geometry),
            ("pose", f"({numbers(self.X_WP.translation())}) m, ({numbers(angles)}) deg"),
            ("tensions", f"{np.min(self.tensions):.4g} to {np.max(self.tensions):.4g} N"),
            ("slack", ", ".join(slack) or "none"),
            ("unstrained", f"({numbers(self.l0)}) m"),
            ("least stiffness", f"{self.principal[0]:.4g} N/m"),
            ("slowest mode", slowest),
            ("other rests", str(len(self.others))),
        ]


def static_at_pose(robot: Robot, X_WP: RigidTransform, model: str, pulleys: bool) -> StaticReport:
    """The robot held at a pose by tensions of least 2-norm within its bounds.

    Raises:
        CdprError: The pose is outside the frame, or cannot be held; says why.
    """
    cables, behaviour = robot.cable_set(pulleys), _behaviour(robot, model, pulleys)
    held = hold_robot(robot, X_WP, cables, model)
    l0 = held.unstrained_lengths
    if behaviour.changes_lengths():
        lengths = cable_paths(X_WP, cables).lengths
        counted = counted_lengths(lengths, held.tensions, cables.stiffness, behaviour)
        linear, l0 = tangent_cables(cables, counted, held.tensions, behaviour)
        touching = cable_state(linear, model, X_WP, l0)
        report = _report(robot, linear, model, X_WP, l0, held.tensions, state=touching, others=[])
        return replace(report, cables=cables, l0=counted)
    state = cable_state(cables, model, X_WP, l0) if CABLE_MODELS[model].extensible else None
    return _report(robot, cables, model, X_WP, l0, held.tensions, state=state, others=[])


def static_at_lengths(
    robot: Robot, l0: Array, model: str, pulleys: bool, seed: int = 0
) -> StaticReport:
    """The robot where it hangs with these unstrained lengths: the lowest pose of rest.

    Searched from the home pose and from `STARTS` seeded random poses in the frame.

    Args:
        robot: The robot.
        l0: Unstrained lengths from A to B, shape (m,) [m].
        model: Name of the cable model.
        pulleys: Whether the cables run over the robot's pulleys.
        seed: Of the random poses.

    Raises:
        CdprError: No pose in the frame has these lengths without breaking a cable; by how much.
    """
    cables, behaviour = robot.cable_set(pulleys), _behaviour(robot, model, pulleys)
    if behaviour.changes_lengths():
        return _touching(robot, l0, model, pulleys, seed)
    return _at_lengths(robot, cables, l0, model, seed)


def _touching(robot: Robot, counted: Array, model: str, pulleys: bool, seed: int) -> StaticReport:
    """As `static_at_lengths` of cables that stiffen or are warm: by elastic ones that touch their
    law at the tensions, which is Newton's method."""
    cables, behaviour = robot.cable_set(pulleys), robot.cable_behaviour()
    tensions = np.zeros(cables.count)
    for _ in range(MOST_TOUCHES):
        linear, l0 = tangent_cables(cables, counted, tensions, behaviour)
        report = _at_lengths(robot, linear, l0, model, seed)
        moved = float(np.max(np.abs(report.tensions - tensions)))
        tensions = report.tensions
        if moved <= TOUCHING * float(np.max(tensions)):
            return replace(report, cables=cables, l0=np.asarray(counted, float))
    raise EquilibriumError(
        f"lengths: after {MOST_TOUCHES} steps tensions still change by {moved:.3g} N; accepted: "
        "cables that stiffen less"
    )


def _at_lengths(robot: Robot, cables: CableSet, l0: Array, model: str, seed: int) -> StaticReport:
    """As `static_at_lengths`, on these cables."""
    platform = rigid_platform(robot)
    home, joint = robot.home.transform(), robot.joint()
    lower = np.array(robot.frame.lower, float)
    if robot.plane_height is not None:
        lower[2] = robot.plane_height
    random = random_starts(lower, robot.frame.upper, STARTS, seed, platform.motion)
    starts = [home, *(random if joint.is_as_world() else map(joint.nearest, random))]
    check_model(model, cables)
    elastic = model if CABLE_MODELS[model].law != STRAIGHT else "elastic"
    # Elastic cables always come to rest somewhere; the tension they need there tells whether the
    # lengths make sense.
    found = equilibria(cables, elastic, platform, l0, starts)
    inside = [one for one in found if _inside(robot, one.X_WP)]
    if not inside:
        check_pose(robot, found[0].X_WP)
    bearable = [one for one in inside if _least_missing(cables, one, l0) <= 0.0]
    if not bearable:
        raise EquilibriumError(_too_short(cables, min(inside, key=_largest_tension), l0))
    if not CABLE_MODELS[model].extensible:
        bearable = _made_inextensible(cables, platform, l0, bearable)
    chosen = min(bearable, key=lambda one: one.energy)
    others = [one for one in bearable if one is not chosen]
    state = None
    if CABLE_MODELS[model].extensible:
        state = cable_state(cables, model, chosen.X_WP, l0)
    return _report(
        robot,
        cables,
        model,
        chosen.X_WP,
        l0,
        chosen.tensions,
        state=state,
        others=others,
        rest=chosen,
    )


def _behaviour(robot: Robot, model: str, pulleys: bool) -> CableBehaviour:
    """What the robot's cables do beside the elastic law.

    Raises:
        CableModelError: The model, or the robot's pulleys, do not go with it.
    """
    behaviour = robot.cable_behaviour()
    known = CABLE_MODELS.get(model)
    elastic = known is not None and known.extensible and known.law == STRAIGHT
    if behaviour.changes_lengths() and known is not None and not elastic:
        raise CableModelError(
            f"cable model: found {model} for cables that stiffen or are warm, see cable.behaviour "
            f"of {robot.name}; accepted: elastic, kelvin_voigt"
        )
    return behaviour


def _drums(robot: Robot, cables: CableSet, X_WP: RigidTransform, tensions: Array) -> Array | None:
    """Tensions at the drums, wound up and paid out, shape (2, m) [N]; None without friction.

    Raises:
        CableModelError: Cables run over pulleys at the platform, too.
    """
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


def _inside(robot: Robot, X_WP: RigidTransform) -> bool:
    p, (lower, upper) = X_WP.translation(), robot.frame.bounds()
    return bool(np.all(p >= lower) and np.all(p <= upper))


def _strength(cables: CableSet) -> Array:
    return np.minimum(cables.breaking_load, LARGEST_STRAIN * cables.stiffness)


def _largest_tension(one: Equilibrium) -> float:
    return float(np.max(one.tensions))


def _least_missing(cables: CableSet, one: Equilibrium, l0: Array) -> float:
    """By how much the worst cable is too short for its load [m]; not above 0: it bears."""
    over = one.tensions - _strength(cables)
    return float(np.max(over * l0 / cables.stiffness))


def _too_short(cables: CableSet, one: Equilibrium, l0: Array) -> str:
    stretch = one.tensions * l0 / cables.stiffness
    i = int(np.argmax(one.tensions / _strength(cables)))
    return (
        f"lengths: no pose in the frame has them; at best cable {i + 1} is stretched by "
        f"{1e3 * stretch[i]:.3g} mm and takes {one.tensions[i]:.4g} N; accepted: at most its "
        f"breaking load, {_strength(cables)[i]:.4g} N"
    )


def _made_inextensible(
    cables: CableSet, platform: Any, l0: Array, elastic: list[Equilibrium]
) -> list[Equilibrium]:
    rigid = []
    for one in elastic:
        try:
            rigid.append(equilibrium_near(cables, INEXTENSIBLE, platform, l0, one.X_WP))
        except EquilibriumError:
            continue
    if not rigid:
        best = min(elastic, key=_largest_tension)
        stretch = best.tensions * l0 / cables.stiffness
        i = int(np.argmax(stretch))
        raise EquilibriumError(
            f"lengths: no pose has them with inextensible cables; at best cable {i + 1} would have "
            f"to be {1e3 * stretch[i]:.3g} mm longer"
        )
    return rigid


def _report(
    robot: Robot,
    cables: CableSet,
    model: str,
    X_WP: RigidTransform,
    l0: Array,
    tensions: Array,
    *,
    state: CableState | None,
    others: list[Equilibrium],
    rest: Equilibrium | None = None,
) -> StaticReport:
    platform, arm = rigid_platform(robot), anchor_arm(cables)
    lengths = cable_paths(X_WP, cables).lengths
    if state is None:  # inextensible
        rigid = np.full(platform.motion.freedom, np.inf)
        principal = rigid if rest is None else rest.stiffnesses
        K = frequencies = shapes = None
        left = inextensible_modes(cables, platform, X_WP, tensions)
        if len(left.frequencies):
            frequencies, shapes = left.frequencies, left.shapes
        surplus_lengths, sags = np.maximum(l0 - lengths, 0.0), np.zeros_like(l0)
        slack = tensions <= 0.0
    else:
        full = platform_stiffness(cables, model, platform, X_WP, l0).total
        K = platform.motion.part(full, X_WP.rotation().matrix())
        principal = principal_stiffnesses(0.5 * (K + K.T), platform, arm)
        modes = natural_modes(full, platform, X_WP)
        frequencies, shapes = modes.frequencies, modes.shapes
        lengths, slack = state.lengths, state.slack
        surplus_lengths, sags = state.surplus_lengths, state.sags
    return StaticReport(
        robot=robot.name,
        model=model,
        cables=cables,
        geometry=robot.geometry_words(cables.has_pulleys()),
        names=[cable.name for cable in robot.cables],
        X_WP=X_WP,
        l0=np.asarray(l0, float),
        tensions=tensions,
        lengths=lengths,
        slack=slack,
        surplus_lengths=surplus_lengths,
        sags=sags,
        bounds=robot.tension_limits(),
        stiffness=K,
        principal=principal,
        arm=arm,
        stability=classify_equilibrium(principal) if rest is None else rest.stability,
        frequencies=frequencies,
        modes=shapes,
        others=others,
        drums=_drums(robot, cables, X_WP, tensions),
        contacts=None if K is None else _contacts(robot, K, X_WP),
    )


def _contacts(robot: Robot, K: Array, X_WP: RigidTransform) -> Array | None:
    """How far the platform may rest beside a pose [rad], and held moments [N m], shape (4,).

    Infinite where the pose is not stable.

    Args:
        robot: The robot.
        K: Stiffness of the motions that it has, shape (n, n).
        X_WP: The pose.
    """
    contacts = robot.contact_hysteresis()
    if contacts is None:
        return None
    R, motion = X_WP.rotation().matrix(), robot.motion_type()
    B = motion.basis(R)
    if np.min(np.linalg.eigvalsh(0.5 * (K + K.T))) <= 0.0:
        return np.array([np.inf, *contacts.held_moments()])
    compliance = (B @ np.linalg.inv(K) @ B.T)[:3, :3]
    return np.array([contacts.turns_of_rest(compliance, R), *contacts.held_moments()])


def _pose(X_WP: RigidTransform) -> dict[str, list[float]]:
    angles = np.degrees(angles_from_rotation(X_WP.rotation()))
    return {"position_m": X_WP.translation().tolist(), "angles_deg": angles.tolist()}


def _finite(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
