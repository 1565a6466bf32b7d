"""A robot on standing winches as a function of its unknown constants, and of those of its sensors.

The state at the first instant of a stretch is not among them. The motion is that of the room
`dynamics`, with cables of Kelvin and Voigt.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

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
from cdpr_drake.identification.parameters import (
    AXES,
    CENTER,
    DAMPING,
    MASS_GROUP,
    MOMENTS,
    SIX,
    STIFFNESS,
    DynamicModel,
)
from cdpr_drake.identification.regressor import symmetric
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.statics.stiffness import natural_modes

FREE_GROUPS = (MASS_GROUP, CENTER, MOMENTS, STIFFNESS, DAMPING)
"""Groups that a motion on standing winches can tell."""

HYSTERESIS, STIFFENING, CREEP = "hysteresis", "stiffening", "creep"
LOAD_CELLS, LOAD_ZEROS, SENSOR = "load_cells", "load_cell_zeros", "sensor"

NAMED_GROUPS = (HYSTERESIS, STIFFENING, CREEP, LOAD_CELLS, LOAD_ZEROS)
"""Groups that are unknown only where they are named: friction in what a platform hangs on, what
cables do in addition to the elastic law, scale and zeros of load cells."""

PRIOR_UNITS = {MASS_GROUP: "kg", CENTER: "m", MOMENTS: "kg m^2", STIFFNESS: "N"}
"""Groups that can be known beforehand, with the unit of the standard deviation."""

TURNING = 0.5
"""Angular velocity from which on contacts count as bent as far as they go at first [rad/s]."""

STATE, START, BENT = 13, 12, 3
"""Numbers of a platform's state, of what moves the state at the first instant, and of how far
contacts are bent then."""

ANGLE_OF_STEP = 0.7
"""Largest step times the fastest mode of the cables [rad]: the method is stable up to 1.7, and
slow modes, which are compared, are exact to 1e-6."""

DECAY_OF_STEP = 1.5
"""The same of a mode's decay in a step; stable up to 2.5."""

STIFFER = 2.0
"""The fastest mode may become so many times as fast in the search."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingingRobot:
    """A robot as it is believed, whose platform moves freely in space.

    Attributes:
        dynamics: Names of the cables, mass, centre of mass and inertia.
        contacts: Friction against turns; slip counts where the stiffnesses are zero, too.
        home: Pose X_WP.
        size: Length scale of the platform [m].
    """

    name: str
    dynamics: DynamicModel
    platform: RigidPlatform
    cables: CableSet
    contacts: ContactHysteresis
    home: RigidTransform
    size: float


@dataclass(frozen=True)
class Unknown:
    """One number of the unknown vector.

    Attributes:
        group: Group; empty: always unknown.
        before: The belief.
        size: Usual distance from the belief; weighs as a prior of this standard deviation.
        least, most: Bounds.
        first: Where the search begins; None: at the belief.
        prior: True if the size is known beforehand, and counts in standard errors.
    """

    name: str
    unit: str
    group: str
    before: float
    size: float
    least: float = -np.inf
    most: float = np.inf
    first: float | None = None
    prior: bool = False


@dataclass(frozen=True, eq=False)
class SwingModel:
    """A robot on standing winches.

    Attributes:
        robot: The belief.
        start: A pose near which it hangs.
        step: Largest step of the method [s].
        fixed: Numbers that are not unknown, by name.
    """

    robot: SwingingRobot
    start: RigidTransform
    unknowns: tuple[Unknown, ...]
    step: float
    fixed: dict[str, float]
    _last: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    @staticmethod
    def of(
        robot: SwingingRobot, start: RigidTransform, groups: Sequence[str], turns: bool,
        tracker: bool,
    ) -> SwingModel:  # fmt: skip
        """With unknown groups.

        Args:
            robot, start: The attributes.
            groups: Names of `FREE_GROUPS` and `NAMED_GROUPS`.
            turns: True if a sensor tells turns alone, by an unknown heading and mount.
            tracker: True if a tracker's frame is unknown.

        Raises:
            IdentificationError: A group is not known by name.
        """
        for word in groups:
            if word not in (*FREE_GROUPS, *NAMED_GROUPS):
                raise IdentificationError(
                    f"unknown: found {word!r}; accepted of a free motion: "
                    f"{', '.join((*FREE_GROUPS, *NAMED_GROUPS))}"
                )
        every = _every_unknown(robot, start, turns, tracker)
        free = [u for u in every if u.group in (*groups, "", SENSOR)]
        fixed = {u.name: u.before for u in every if u not in free}
        fastest = STIFFER * _fastest_mode(robot, start)
        step = ANGLE_OF_STEP / fastest
        longest = DECAY_OF_STEP / (fastest**2 * step)
        free = [
            replace(u, most=max(longest, 2.0 * u.before)) if u.name == "all.retardation_time" else u
            for u in free
        ]
        return SwingModel(robot, start, tuple(free), step, fixed)

    @cached_property
    def names(self) -> list[str]:
        """Of the unknown vector."""
        return [u.name for u in self.unknowns]

    @property
    def memory(self) -> int:
        """Numbers of a first state after those of the platform: how far contacts are bent."""
        return BENT if any(u.group == HYSTERESIS for u in self.unknowns) else 0

    def knowing(self, sigmas: Mapping[str, float]) -> SwingModel:
        """The model with groups that are known beforehand, by standard deviations.

        Raises:
            IdentificationError: A group is not unknown, or is none of `PRIOR_UNITS`.
        """
        groups = {u.group for u in self.unknowns}
        for group, sigma in sigmas.items():
            accepted = [name for name in PRIOR_UNITS if name in groups]
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
            replace(u, size=sigmas[u.group], prior=True) if u.group in sigmas else u
            for u in self.unknowns
        )
        return replace(self, unknowns=unknowns)

    def before(self) -> Array:
        """The believed vector, shape (f,)."""
        return np.array([u.before for u in self.unknowns])

    def sizes(self) -> Array:
        """Sizes of the unknowns, shape (f,)."""
        return np.array([u.size for u in self.unknowns])

    def first(self) -> Array:
        """Where the search begins, in sizes from the belief, shape (f,)."""
        starts = [u.before if u.first is None else u.first for u in self.unknowns]
        return np.asarray((np.array(starts) - self.before()) / self.sizes())

    def by_name(self, vector: Array) -> dict[str, float]:
        """All numbers at a vector, those that are not unknown included."""
        return self.fixed | dict(zip(self.names, vector.tolist(), strict=True))

    def of_cables(self, vector: Array, what: str) -> Array:
        """A number of each cable, shape (m,)."""
        n = self.by_name(vector)
        return np.array([n[f"{name}.{what}"] for name in self.robot.dynamics.names])

    def lengths(self, vector: Array) -> Array:
        """Unstrained lengths, shape (m,) [m]."""
        return self.of_cables(vector, "unstrained_length")

    def stiffer(self, vector: Array) -> float:
        """Stiffness over the believed one."""
        believed = float(np.mean(self.robot.cables.stiffness))
        return self.by_name(vector)["all.stiffness"] / believed

    def platform(self, vector: Array) -> RigidPlatform:
        """The platform at a vector."""
        n = self.by_name(vector)
        mass, c = n["mass"], np.array([n[f"center_of_mass.{a}"] for a in AXES])
        I_central = symmetric(np.array([n[f"inertia.{ab}"] for ab in SIX]))
        S = cross_matrix(c)
        return replace(self.robot.platform, mass=mass, p_PCo=c, I_PPo=I_central + mass * S @ S.T)

    def contacts(self, vector: Array) -> ContactHysteresis:
        """Friction against turns of the platform at a vector."""
        n = self.by_name(vector)
        return ContactHysteresis(**{k: n[f"hysteresis.{k}"] for k in ("tilt", "turn", "slip")})

    def behaviour(self, vector: Array) -> CableBehaviour:
        """What the cables do in addition to the elastic law at a vector."""
        n = self.by_name(vector)
        changes = {k: n[f"all.{k}"] for k in ("stiffening", "creep_stiffness", "creep_time")}
        return replace(behaviour_of(self.robot.cables), **changes)

    def arrays(self, vector: Array) -> RobotArrays:
        """The robot at a vector, as kernels take it."""
        n, cables = self.by_name(vector), self.robot.cables
        cables = replace(
            cables, stiffness=cables.stiffness * self.stiffer(vector),
            retardation=np.full(cables.count, n["all.retardation_time"]),
        )  # fmt: skip
        return pack_robot(
            self.platform(vector), behaving_cables(cables, self.behaviour(vector)), KELVIN_VOIGT,
            Drive(), home=self.lengths(vector), damping=(n["drag.force"], n["drag.moment"]),
            contacts=self.contacts(vector),
        )  # fmt: skip

    def run(self, vector: Array, moved: Array, count: int, step: float) -> tuple[Array, Array]:
        """The motion at even instants. The arrays are read, not written: the last motion is kept,
        since slopes by numbers of sensors take it again.

        Args:
            vector: The unknown vector.
            moved: From `start` at rest to the first state: rotation vector and translation in W,
                then V_WP, shape (12,); after it how far contacts are bent, in P, as shares of
                the slip, shape (12 + 3,), or nothing: see `usually_bent`.
            count: Instants.
            step: Between them [s].

        Returns:
            States and tensions, shapes (count, 13) and (count, m); NaN after an instant at which
            the motion cannot go on.
        """
        sensors = (SENSOR, LOAD_CELLS, LOAD_ZEROS)
        moves = [x for u, x in zip(self.unknowns, vector, strict=True) if u.group not in sensors]
        key = np.array([*moves, *moved, count, step]).tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self._motion(vector, moved, count, step)
        return self._last[key]

    def _motion(self, vector: Array, moved: Array, count: int, step: float) -> tuple[Array, Array]:
        m, l0 = self.robot.cables.count, self.lengths(vector)
        state = np.zeros(STATE + m)
        state[:7] = pose_row(self.start)
        turn_pose(state, *moved[:3])
        state[4:7] += moved[3:6]
        state[7:STATE], state[STATE:] = moved[6:START], l0
        arrays = self.arrays(vector)
        if arrays.kinds[RUBBING] > 0:
            share = moved[START:] if len(moved) > START else usually_bent(state, moved[6:9])
            state = np.concatenate([state, self.contacts(vector).slip * share])
        if arrays.kinds[CREEPING] > 0:  # strains about which the platform swings
            l0 = l0 * self.behaviour(vector).longer()
            at_rest = cable_paths(self.start, self.robot.cables).lengths / l0 - 1.0
            state = np.concatenate([state, np.maximum(at_rest, 0.0)])
        states, tensions = np.full((count, len(state)), np.nan), np.full((count, m), np.nan)
        code = free_run(arrays, state, np.zeros(m), step, self.step, states, tensions, np.zeros(4))
        if code != INTEGRATION_OK:
            states[-1] = np.nan
        return states[:, :STATE], tensions

    def frequencies(self, vector: Array) -> Array:
        """Of the modes about the pose of rest, slowest first, shape (6,) [Hz].

        Raises:
            EquilibriumError: The platform does not rest anywhere near.
        """
        platform, cables, l0 = self.platform(vector), self.robot.cables, self.lengths(vector)
        cables = replace(cables, stiffness=cables.stiffness * self.stiffer(vector))
        X_WP = equilibrium_near(cables, ELASTIC, platform, l0, self.start).X_WP
        K = platform.weight_stiffness(X_WP)
        K = K - cable_derivatives(cables, ELASTIC, X_WP, l0).wrench_by_pose
        return np.sort(natural_modes(K, platform, X_WP).frequencies)

    def sensed(self, vector: Array, states: Array, step: float) -> tuple[Rotation, Array]:
        """Readings of the sensor at even states: turns, positions in its frame, (n, 3) [m]."""
        n = self.by_name(vector)
        turns, p = earlier(states, step, n["sensor.late"])
        if "sensor.heading" in n:
            heading, mount = _heading_and_mount(n)
            return heading * turns * mount, p
        if "tracker.x" in n:
            frame, origin = _tracker_frame(n)
            return frame * turns, frame.apply(p) + origin
        return turns, p

    def unsensed(
        self, vector: Array, turns: Rotation, positions: Array | None
    ) -> tuple[Rotation, Array | None]:
        """The inverse of `sensed`: turns and positions of P in W."""
        n = self.by_name(vector)
        if "sensor.heading" in n:
            heading, mount = _heading_and_mount(n)
            return heading.inv() * turns * mount.inv(), positions
        if "tracker.x" in n:
            frame, origin = _tracker_frame(n)
            if positions is not None:
                positions = frame.inv().apply(positions - origin)
            return frame.inv() * turns, positions
        return turns, positions

    def sensed_tensions(self, vector: Array, tensions: Array) -> Array:
        """Readings of the load cells, shape (n, m) [N]."""
        zeros = self.of_cables(vector, "load_cell_zero")
        return np.asarray(zeros + self.by_name(vector)["load_cells.scale"] * tensions)

    def unsensed_tensions(self, vector: Array, readings: Array) -> Array:
        """The inverse of `sensed_tensions`."""
        zeros = self.of_cables(vector, "load_cell_zero")
        return np.asarray((readings - zeros) / self.by_name(vector)["load_cells.scale"])


def earlier(states: Array, step: float, late: float) -> tuple[Rotation, Array]:
    """Turns and positions, shape (n, 3) [m], a time before even states, by Hermite's cubics.

    The model is asked earlier, not the log later: between rows of a log noise is less than at rows,
    and a clock that was sought so would be drawn to the middle between them.

    Args:
        states: Shape (n, 13).
        step: Between them [s].
        late: The time [s].
    """
    n = len(states)
    at = np.arange(n) - late / step
    k = np.clip(np.floor(at).astype(int), 0, n - 2)
    u = (at - k)[:, None]
    q, w = states[:, :4], states[:, 7:10]
    rates = np.empty((n, 7))
    rates[:, 0] = -0.5 * np.sum(w * q[:, 1:], axis=1)
    rates[:, 1:4] = 0.5 * (w * q[:, :1] + np.cross(w, q[:, 1:]))
    rates[:, 4:] = states[:, 10:13]
    x, v = states[:, :7], step * rates
    rows = (
        (1.0 + 2.0 * u) * (1.0 - u) ** 2 * x[k] + u * (1.0 - u) ** 2 * v[k]
        + u**2 * (3.0 - 2.0 * u) * x[k + 1] + u**2 * (u - 1.0) * v[k + 1]
    )  # fmt: skip
    return Rotation.from_quat(rows[:, [1, 2, 3, 0]]), rows[:, 4:]


def usually_bent(state: Array, turning: Array) -> Array:
    """How far contacts are bent by an angular velocity in W, in P, as shares of the slip."""
    w_P = Rotation.from_quat(state[[1, 2, 3, 0]]).inv().apply(turning)
    return np.asarray(w_P / np.hypot(np.linalg.norm(w_P), TURNING))


def _heading_and_mount(n: Mapping[str, float]) -> tuple[Rotation, Rotation]:
    heading = Rotation.from_rotvec([0.0, 0.0, n["sensor.heading"]])
    return heading, Rotation.from_rotvec([n[f"sensor.mount_{a}"] for a in AXES])


def _tracker_frame(n: Mapping[str, float]) -> tuple[Rotation, Array]:
    frame = Rotation.from_rotvec([n[f"tracker.turn_{a}"] for a in AXES])
    return frame, np.array([n[f"tracker.{a}"] for a in AXES])


def _every_unknown(
    robot: SwingingRobot, start: RigidTransform, turns: bool, tracker: bool
) -> list[Unknown]:
    """Every number that may be unknown."""
    model, platform, cables, rubbing = robot.dynamics, robot.platform, robot.cables, robot.contacts
    size = robot.size
    mean = float(np.mean(model.inertia[:3]))
    share = model.mass * platform.gravity / cables.count
    l0 = cable_paths(start, cables).lengths / (1.0 + share / model.stiffness)
    EA, T = float(np.mean(model.stiffness)), float(np.mean(model.retardation))
    damped = model.mass / size
    rubs = model.mass * platform.gravity * size if platform.gravity > 0.0 else 1.0
    does = behaviour_of(cables)
    stiff, g, creep = does.creep_stiffness, does.stiffening, does.creep_time
    rows: list[tuple[Any, ...]] = [
        *((f"{name}.unstrained_length", "m", "", value, 0.1 * value)
          for name, value in zip(model.names, l0.tolist(), strict=True)),
        ("mass", "kg", MASS_GROUP, model.mass, model.mass, 1e-3 * model.mass),
        *((f"center_of_mass.{a}", "m", CENTER, value, size)
          for a, value in zip(AXES, model.center_of_mass.tolist(), strict=True)),
        *((f"inertia.{ab}", "kg m^2", MOMENTS, value, mean, 0.02 * mean if k < 3 else -np.inf)
          for k, (ab, value) in enumerate(zip(SIX, model.inertia.tolist(), strict=True))),
        ("all.stiffness", "N", STIFFNESS, EA, EA, 0.02 * EA, STIFFER**2 * EA),
        ("all.retardation_time", "s", DAMPING, T, 0.01, 0.0),
        ("drag.force", "N s/m", DAMPING, 0.0, damped, 0.0),
        ("drag.moment", "N m s/rad", DAMPING, 0.0, damped * size**2, 0.0),
        *((f"hysteresis.{name}", "N m/rad", HYSTERESIS, K, rubs, 0.0, np.inf, K or 0.3 * rubs)
          for name, K in (("tilt", rubbing.tilt), ("turn", rubbing.turn))),
        ("hysteresis.slip", "rad", HYSTERESIS, rubbing.slip, 0.1, min(0.005, rubbing.slip),
         max(1.0, rubbing.slip)),
        ("all.stiffening", "1/N", STIFFENING, g, 1.0 / share, 0.0, max(2.0 / share, 2.0 * g),
         max(0.1 / share, g)),
        ("all.creep_stiffness", "", CREEP, stiff, 0.5, 0.0, 2.0, max(0.1, stiff)),
        ("all.creep_time", "s", CREEP, creep, 0.5, 0.01, 100.0),
        ("load_cells.scale", "", LOAD_CELLS, 1.0, 0.1, 0.5, 2.0),
        *((f"{name}.load_cell_zero", "N", LOAD_ZEROS, 0.0, 0.1 * share) for name in model.names),
    ]  # fmt: skip
    if turns:
        rows.append(("sensor.heading", "rad", SENSOR, 0.0, 0.5))
        rows += [(f"sensor.mount_{a}", "rad", SENSOR, 0.0, 0.2) for a in AXES]
    if tracker:
        rows += [(f"tracker.turn_{a}", "rad", SENSOR, 0.0, 0.5) for a in AXES]
        rows += [(f"tracker.{a}", "m", SENSOR, 0.0, 1.0) for a in AXES]
    rows.append(("sensor.late", "s", SENSOR, 0.0, 0.1))
    return [Unknown(*row) for row in rows]


def _fastest_mode(robot: SwingingRobot, X_WP: RigidTransform) -> float:
    """Of the platform on its cables, where their axial stiffness alone counts [rad/s]."""
    paths = cable_paths(X_WP, robot.cables)
    K = paths.J.T @ np.diag(robot.cables.stiffness / paths.lengths) @ paths.J
    return float(2.0 * np.pi * np.max(natural_modes(K, robot.platform, X_WP).frequencies))
