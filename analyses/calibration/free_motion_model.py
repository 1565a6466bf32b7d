"""A robot whose winches stand still, as a function of what is unknown of it.

The unknown vector has constants of the robot, how a sensor of turns is mounted and where it counts
from, its clock, and unstrained lengths of the cables. The state at the first instant of a stretch
is apart. The motion is that of the room `dynamics`, with cables of Kelvin and Voigt.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import CableBehaviour, behaving_cables, behaviour_of
from cdpr_drake.cables.models import ELASTIC, KELVIN_VOIGT
from cdpr_drake.cables.states import cable_derivatives
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.dynamics.free_run_kernel import free_run
from cdpr_drake.dynamics.robot_arrays import CREEPING, RUBBING, Drive, RobotArrays, pack_robot
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import cross_matrix, pose_row
from cdpr_drake.geometry.rotation_kernel import turn_pose
from cdpr_drake.identification.parameters import CENTER, DAMPING, MASS_GROUP, MOMENTS, STIFFNESS
from cdpr_drake.models.robot_dynamics import dynamic_model, platform_size
from cdpr_drake.models.robot_schema import HysteresisSettings, Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.stiffness import natural_modes

FREE_GROUPS = (MASS_GROUP, CENTER, MOMENTS, STIFFNESS, DAMPING)
"""Groups that a motion on standing winches can tell."""

HYSTERESIS, STIFFENING, CREEP = "hysteresis", "stiffening", "creep"
LOAD_CELLS, LOAD_ZEROS = "load_cells", "load_cell_zeros"

ASKED_GROUPS = (HYSTERESIS, STIFFENING, CREEP, LOAD_CELLS, LOAD_ZEROS)
"""Groups that are unknown where they are asked for alone: friction in what a platform hangs on,
what cables do beside the elastic law, and what load cells tell of a known load and of none."""

PRIOR_UNITS = {MASS_GROUP: "kg", CENTER: "m", MOMENTS: "kg m^2", STIFFNESS: "N"}
"""Groups of which something may be known beforehand, with the unit of its standard deviation."""

SENSORS = ("sensor", LOAD_CELLS, LOAD_ZEROS)
"""Groups that the motion does not depend on."""

TURNING = 0.5
"""Angular velocity from which on contacts count as bent as far as they go at first [rad/s]."""

STATE, START, BENT = 13, 12, 3
"""Numbers of a platform's state, of what moves the state at the first instant, and of how far
contacts are bent then."""

ANGLE_OF_STEP = 0.7
"""Largest step times the fastest mode of the cables [rad]: the method is stable up to 1.7, and what
is slow, and is compared, is exact to 1e-6."""

DECAY_OF_STEP = 1.5
"""The same of a mode's decay in a step; stable up to 2.5."""

STIFFER = 2.0
"""The fastest mode may become so many times as fast in the search."""


@dataclass(frozen=True)
class Unknown:
    """One number of the unknown vector.

    Attributes:
        name: As results name it.
        unit: Its unit.
        group: Its group.
        before: As it is believed.
        size: How far it may usually be from that; weighs as a prior of this standard deviation.
        least: Bounds.
        most: See there.
        first: Where the search begins; None: as it is believed.
        known: Whether the size is what is known beforehand, and counts in standard errors.
    """

    name: str
    unit: str
    group: str
    before: float
    size: float
    least: float = -np.inf
    most: float = np.inf
    first: float | None = None
    known: bool = False


@dataclass(frozen=True, eq=False)
class FreeMotionModel:
    """A robot on standing winches.

    Attributes:
        robot: As it is believed.
        start: A pose near which it hangs.
        unknowns: The unknown vector.
        step: Largest step of the method [s].
        fixed: Numbers that are not unknown, by name.
    """

    robot: Robot
    start: RigidTransform
    unknowns: tuple[Unknown, ...]
    step: float
    fixed: dict[str, float]
    _last: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    @staticmethod
    def of(
        robot: Robot, start: RigidTransform, groups: Sequence[str], turns: bool, tracker: bool
    ) -> FreeMotionModel:
        """With these groups unknown.

        Args:
            robot: As it is believed.
            start: A pose near which it hangs.
            groups: Names of `FREE_GROUPS` and `ASKED_GROUPS`.
            turns: Whether a sensor tells turns alone, from an unknown heading, mounted unknown.
            tracker: Whether a tracker's frame is unknown.

        Raises:
            IdentificationError: The robot does not move freely in space, or a group is not known.
        """
        for word in groups:
            if word not in (*FREE_GROUPS, *ASKED_GROUPS):
                raise IdentificationError(
                    f"unknown: found {word!r}; accepted of a free motion: "
                    f"{', '.join((*FREE_GROUPS, *ASKED_GROUPS))}"
                )
        all_of = _all_unknowns(robot, start, turns, tracker)
        asked = [one for one in all_of if one.group in (*groups, "", "sensor")]
        fixed = {one.name: one.before for one in all_of if one not in asked}
        fastest = STIFFER * _fastest_mode(robot, start)
        step = ANGLE_OF_STEP / fastest
        longest = DECAY_OF_STEP / (fastest**2 * step)
        asked = [
            replace(one, most=max(longest, 2.0 * one.before))
            if one.name == "all.retardation_time" else one
            for one in asked
        ]  # fmt: skip
        return FreeMotionModel(robot, start, tuple(asked), step, fixed)

    @cached_property
    def cables(self) -> CableSet:
        """As they are believed; searches ask for them at each step. Read, not written."""
        return self.robot.cable_set()

    @property
    def names(self) -> list[str]:
        """Of the vector."""
        return [one.name for one in self.unknowns]

    @property
    def memory(self) -> int:
        """Numbers of a first state beside those of the platform: how far contacts are bent."""
        return BENT if any(one.group == HYSTERESIS for one in self.unknowns) else 0

    def knowing(self, sigmas: Mapping[str, float]) -> FreeMotionModel:
        """The model with groups that are known beforehand, by standard deviations.

        Raises:
            IdentificationError: A group is not unknown, or is none of `PRIOR_UNITS`.
        """
        asked = {one.group for one in self.unknowns}
        for group, sigma in sigmas.items():
            accepted = [name for name in PRIOR_UNITS if name in asked]
            if group not in accepted:
                raise IdentificationError(
                    f"priors: found {group!r}; accepted: of what is unknown, "
                    f"{', '.join(accepted) or 'none'}"
                )
            if not 0.0 < sigma < np.inf:
                raise IdentificationError(
                    f"priors: {group}: found {sigma:g}; accepted: > 0 [{PRIOR_UNITS[group]}]"
                )
        unknowns = tuple(
            replace(one, size=sigmas[one.group], known=True) if one.group in sigmas else one
            for one in self.unknowns
        )
        return replace(self, unknowns=unknowns)

    def before(self) -> Array:
        """The vector as it is believed."""
        return np.array([one.before for one in self.unknowns])

    def first(self) -> Array:
        """Where the search begins, in sizes from what is believed, shape (f,)."""
        starts = [one.before if one.first is None else one.first for one in self.unknowns]
        sizes = np.array([one.size for one in self.unknowns])
        return np.asarray((np.array(starts) - self.before()) / sizes)

    def by_name(self, vector: Array) -> dict[str, float]:
        """All numbers at a vector."""
        return self.fixed | dict(zip(self.names, vector.tolist(), strict=True))

    def lengths(self, vector: Array) -> Array:
        """Unstrained lengths, shape (m,) [m]."""
        found = self.by_name(vector)
        return np.array([found[f"{c.name}.unstrained_length"] for c in self.robot.cables])

    def platform(self, vector: Array) -> RigidPlatform:
        """The platform at a vector."""
        n = self.by_name(vector)
        mass, c = n["mass"], np.array([n[f"center_of_mass.{a}"] for a in "xyz"])
        xx, yy, zz, xy, xz, yz = (n[f"inertia.{a}"] for a in ("xx", "yy", "zz", "xy", "xz", "yz"))
        I_central = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        S = cross_matrix(c)
        believed = rigid_platform(self.robot)
        return replace(believed, mass=mass, p_PCo=c, I_PPo=I_central + mass * S @ S.T)

    def arrays(self, vector: Array) -> RobotArrays:
        """The robot at a vector, as the kernels take it."""
        n, cables = self.by_name(vector), self.cables
        believed = float(np.mean(cables.stiffness))
        share = n["all.stiffness"] / believed
        cables = replace(
            cables, stiffness=cables.stiffness * share,
            retardation=np.full(cables.count, n["all.retardation_time"]),
        )  # fmt: skip
        cables = behaving_cables(cables, self.behaviour(vector))
        return pack_robot(
            self.platform(vector), cables, KELVIN_VOIGT, Drive(), home=self.lengths(vector),
            damping=(n["drag.force"], n["drag.moment"]), contacts=self.contacts(vector),
        )  # fmt: skip

    def contacts(self, vector: Array) -> ContactHysteresis:
        """Friction against turns of the platform at a vector."""
        n = self.by_name(vector)
        return ContactHysteresis(
            tilt=n["hysteresis.tilt"], turn=n["hysteresis.turn"], slip=n["hysteresis.slip"]
        )

    def behaviour(self, vector: Array) -> CableBehaviour:
        """What the cables do beside the elastic law at a vector."""
        n = self.by_name(vector)
        return replace(
            behaviour_of(self.cables), stiffening=n["all.stiffening"],
            creep_stiffness=n["all.creep_stiffness"], creep_time=n["all.creep_time"],
        )  # fmt: skip

    def run(self, vector: Array, moved: Array, count: int, step: float) -> tuple[Array, Array]:
        """States and tensions at even instants, shapes (count, 13) and (count, m); NaN behind an
        instant at which the motion cannot go on. Both are read, not written: who asks again for
        the same motion, as slopes over what sensors have do, gets the same arrays.

        Args:
            vector: The unknown vector.
            moved: From `start` at rest to the first state: rotation vector and translation in W,
                then V_WP, shape (12,); behind it how far contacts are bent, in P, as shares of
                the slip, shape (12 + 3,), or nothing: as far as they go by their velocity.
            count: Instants.
            step: Between them [s].
        """
        moves = [x for u, x in zip(self.unknowns, vector, strict=True) if u.group not in SENSORS]
        key = np.array([*moves, *moved, count, step]).tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self._moved(vector, moved, count, step)
        return self._last[key]

    def _moved(self, vector: Array, moved: Array, count: int, step: float) -> tuple[Array, Array]:
        m = len(self.robot.cables)
        state = np.zeros(STATE + m)
        state[:7] = pose_row(self.start)
        turn_pose(state, *moved[:3])
        state[4:7] += moved[3:6]
        state[7:STATE], state[STATE:] = moved[6:START], self.lengths(vector)
        arrays = self.arrays(vector)
        if arrays.kinds[RUBBING] > 0:
            share = moved[START:] if len(moved) > START else usually_bent(state, moved[6:9])
            state = np.concatenate([state, self.contacts(vector).slip * share])
        if arrays.kinds[CREEPING] > 0:  # strains about which the platform swings
            l0 = self.lengths(vector) * self.behaviour(vector).longer()
            at_rest = cable_paths(self.start, self.cables).lengths / l0 - 1.0
            state = np.concatenate([state, np.maximum(at_rest, 0.0)])
        states, tensions = np.full((count, len(state)), np.nan), np.full((count, m), np.nan)
        asked = (np.zeros(m), step, self.step, states, tensions, np.zeros(4))
        bad = free_run(arrays, state, *asked)
        if bad != INTEGRATION_OK:
            states[-1] = np.nan
        return states[:, :STATE], tensions

    def frequencies(self, vector: Array) -> Array:
        """Of the modes about the pose of rest, slowest first [Hz].

        Raises:
            EquilibriumError: The platform does not rest anywhere near.
        """
        platform, n = self.platform(vector), self.by_name(vector)
        cables = self.cables
        share = n["all.stiffness"] / float(np.mean(cables.stiffness))
        cables = replace(cables, stiffness=cables.stiffness * share)
        l0 = self.lengths(vector)
        X_WP = equilibrium_near(cables, ELASTIC, platform, l0, self.start).X_WP
        K = platform.weight_stiffness(X_WP)
        K = K - cable_derivatives(cables, ELASTIC, X_WP, l0).wrench_by_pose
        return np.sort(natural_modes(K, platform, X_WP).frequencies)


def usually_bent(state: Array, turning: Array) -> Array:
    """How far contacts are bent by an angular velocity in W, in P, as shares of the slip."""
    w_P = Rotation.from_quat(state[[1, 2, 3, 0]]).inv().apply(turning)
    return np.asarray(w_P / np.hypot(np.linalg.norm(w_P), TURNING))


def _all_unknowns(robot: Robot, start: RigidTransform, turns: bool, tracker: bool) -> list[Unknown]:
    """Every number that may be unknown."""
    model, size = dynamic_model(robot), platform_size(robot)
    cables, platform = robot.cable_set(), rigid_platform(robot)
    mean = float(np.mean(model.inertia[:3]))
    lengths = cable_paths(start, cables).lengths
    share = model.mass * platform.gravity / len(robot.cables)
    l0 = lengths / (1.0 + share / model.stiffness)
    EA = float(np.mean(model.stiffness))
    damped = model.mass / size
    found = [
        Unknown(f"{c.name}.unstrained_length", "m", "", float(value), 0.1 * float(value))
        for c, value in zip(robot.cables, l0, strict=True)
    ]
    found.append(Unknown("mass", "kg", MASS_GROUP, model.mass, model.mass, 1e-3 * model.mass))
    for axis, value in zip("xyz", model.center_of_mass.tolist(), strict=True):
        found.append(Unknown(f"center_of_mass.{axis}", "m", CENTER, value, size))
    for k, words in enumerate(("xx", "yy", "zz", "xy", "xz", "yz")):
        least = 0.02 * mean if k < 3 else -np.inf
        found.append(
            Unknown(f"inertia.{words}", "kg m^2", MOMENTS, float(model.inertia[k]), mean, least)
        )
    T = float(np.mean(model.retardation))
    rubs = model.mass * platform.gravity * size if platform.gravity > 0.0 else 1.0
    does = behaviour_of(cables)
    rubbing = robot.platform.hysteresis or HysteresisSettings()
    found += [
        Unknown("all.stiffness", "N", STIFFNESS, EA, EA, 0.02 * EA, STIFFER**2 * EA),
        Unknown("all.retardation_time", "s", DAMPING, T, 0.01, 0.0),
        Unknown("drag.force", "N s/m", DAMPING, 0.0, damped, 0.0),
        Unknown("drag.moment", "N m s/rad", DAMPING, 0.0, damped * size**2, 0.0),
    ]
    found += [
        Unknown(
            "hysteresis.tilt", "N m/rad", HYSTERESIS, rubbing.tilt, rubs, 0.0,
            first=rubbing.tilt or 0.3 * rubs,
        ),
        Unknown(
            "hysteresis.turn", "N m/rad", HYSTERESIS, rubbing.turn, rubs, 0.0,
            first=rubbing.turn or 0.3 * rubs,
        ),
        Unknown(
            "hysteresis.slip", "rad", HYSTERESIS, rubbing.slip, 0.1, min(0.005, rubbing.slip),
            max(1.0, rubbing.slip),
        ),
        Unknown(
            "all.stiffening", "1/N", STIFFENING, does.stiffening, 1.0 / share, 0.0,
            max(2.0 / share, 2.0 * does.stiffening), first=max(0.1 / share, does.stiffening),
        ),
        Unknown(
            "all.creep_stiffness", "", CREEP, does.creep_stiffness, 0.5, 0.0, 2.0,
            first=max(0.1, does.creep_stiffness),
        ),
        Unknown("all.creep_time", "s", CREEP, does.creep_time, 0.5, 0.01, 100.0),
        Unknown("load_cells.scale", "", LOAD_CELLS, 1.0, 0.1, 0.5, 2.0),
    ]  # fmt: skip
    found += [
        Unknown(f"{c.name}.load_cell_zero", "N", LOAD_ZEROS, 0.0, 0.1 * share) for c in robot.cables
    ]
    if turns:
        found.append(Unknown("sensor.heading", "rad", "sensor", 0.0, 0.5))
        found += [Unknown(f"sensor.mount_{a}", "rad", "sensor", 0.0, 0.2) for a in "xyz"]
    if tracker:
        found += [Unknown(f"tracker.turn_{a}", "rad", "sensor", 0.0, 0.5) for a in "xyz"]
        found += [Unknown(f"tracker.{a}", "m", "sensor", 0.0, 1.0) for a in "xyz"]
    found.append(Unknown("sensor.late", "s", "sensor", 0.0, 0.1))
    return found


def _fastest_mode(robot: Robot, X_WP: RigidTransform) -> float:
    """Of the platform on its cables, where their axial stiffness alone counts [rad/s]."""
    cables, platform = robot.cable_set(), rigid_platform(robot)
    paths = cable_paths(X_WP, cables)
    K = paths.J.T @ np.diag(cables.stiffness / paths.lengths) @ paths.J
    return float(2.0 * np.pi * np.max(natural_modes(K, platform, X_WP).frequencies))
