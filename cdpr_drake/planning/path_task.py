"""Whom a path is planned for, and what a motion asks of its cables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import impossible_cable
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_row
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.margin_kernel import PATH_SPEED_USE, TENSION_USE, uses_of
from cdpr_drake.planning.resistance import check_resistance, resistance_bounds
from cdpr_drake.planning.resistance_kernel import resistance_margins
from cdpr_drake.planning.station_kernel import BASIS, NO_CABLE, SINGULAR, stations_of
from cdpr_drake.trajectories.timed_path import TimedPath

ACTIVE = 2e-3
"""A limit is reached where less than this share of its range is left: between stations a plan keeps
off its limits by the square of the stations' distance."""


@dataclass(frozen=True, eq=False)
class PathTask:
    """A robot on a path.

    Attributes:
        cables: Its cables, as they are believed to be.
        dynamics: Its platform; `motions` says what of it moves.
        limits: What the motion may ask.
        names: Of the cables, for messages; empty: by number.
        resist: Wrenches on the platform about Po in W, (moment, force), shape (k, 6): at every
            point of a path tensions must also exist under each; none: shape (0, 6) [N m, N].
    """

    cables: CableSet
    dynamics: PlatformDynamics
    limits: MotionLimits
    names: Sequence[str] = ()
    resist: Array = field(default_factory=lambda: np.empty((0, 6)), repr=False)

    def __post_init__(self) -> None:
        """Checks that the cables can control the platform.

        Raises:
            PlanningError: There are fewer cables than degrees of freedom, cables run over pulleys
                of the platform, whose lengths bend in another way along a path, or the wrenches to
                resist are not accepted.
        """
        if self.cables.has_platform_pulleys():
            raise PlanningError(
                "a path: found pulleys at the platform; accepted: cables that are fixed there"
            )
        m, n = self.cables.count, len(self.dynamics.motions)
        if m < n:
            raise PlanningError(
                f"a path of {n} degrees of freedom: found {m} cables; accepted: at least {n}, "
                "since fewer cannot follow a given path"
            )
        check_resistance(self)

    def name(self, cable: int) -> str:
        """Of a cable, counted from 0."""
        return self.names[cable] if self.names else f"cable {cable + 1}"

    def stations(self, points: Array, x: Array | None = None) -> tuple[Array, Array]:
        """What points of a path, shape (n, 19), ask: as `station_kernel.stations_of` writes it.

        Args:
            points: The points.
            x: (ds/dt)^2 at which the platform's damping is exact, shape (n,) [m^2/s^2]; where it is
                0, and by default, without damping.

        Raises:
            PlanningError: A cable cannot run, or the wrench matrix is singular; names the pose.
        """
        m = self.cables.count
        rank = len(self.dynamics.motions)
        slowness = np.zeros(len(points)) if x is None else slowness_at(x)
        out, reach = np.empty((len(points), BASIS + m - rank, m)), np.empty(len(points))
        problem, where = stations_of(
            np.ascontiguousarray(points),
            self.cables.packed(),
            self.dynamics.packed(),
            np.array(self.dynamics.motions, np.int64),
            slowness,
            out,
            reach,
        )
        if problem == NO_CABLE:
            X = pose_from_row(points[where, :7])
            why = impossible_cable(X, self.cables)
            raise PlanningError(f"path: at the pose {pose_words(points[where])}: {why}")
        if problem == SINGULAR:
            raise PlanningError(
                f"path: at the pose {pose_words(points[where])} the wrench matrix is singular; "
                f"accepted: poses where it has rank {rank}"
            )
        return out, reach


def slowness_at(x: Array) -> Array:
    """dt/ds of (ds/dt)^2 = x [m^2/s^2], shape (n,) [s/m]; 0 at rest."""
    x = np.asarray(x, float)
    return np.divide(1.0, np.sqrt(np.maximum(x, 0.0)), out=np.zeros(len(x)), where=x > 0.0)


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """What a motion asks at some times.

    Attributes:
        times: Shape (n,) [s].
        parameters: s, shape (n,) [m].
        speeds: ds/dt, shape (n,) [m/s].
        uses: Shares of the limits, shape (n, 4): of tensions and torques, of cable speeds, cable
            accelerations and the speed of Po; 1: reached, above: missed. The redundancy is used as
            well as it can be: what the tensions leave of their limits is as much as possible.
        tensions: That use it so, shape (n, m) [N].
        cable_speeds: dl/dt, shape (n, m) [m/s].
        cable_accelerations: d2l/dt2, shape (n, m) [m/s^2].
        torques: Of the motors, friction aside, shape (n, m) [N m]; NaN where neither their inertia
            nor their limit is known.
        limits: The limits.
        resisted: Share of the limits of tensions and torques that the motion and the worst of the
            wrenches to resist use together, shape (n,), also in `uses`; None: there are none.
    """

    times: Array
    parameters: Array
    speeds: Array
    uses: Array
    tensions: Array
    cable_speeds: Array
    cable_accelerations: Array
    torques: Array
    limits: MotionLimits
    resisted: Array | None = None

    def active(self) -> dict[str, np.ndarray]:
        """Which limits are reached, by name: for each cable, shape (n, m), or for Po, (n, 1)."""
        lim, t = self.limits, self.tensions
        half = 0.5 * (lim.upper - lim.lower)
        gaps = {
            "tension, lower": (t - lim.lower) / half,
            "tension, upper": (lim.upper - t) / half,
            "torque": 1.0 - np.abs(self.torques) / lim.torque,
            "cable speed": 1.0 - np.abs(self.cable_speeds) / lim.cable_speed,
            "cable acceleration": 1.0 - np.abs(self.cable_accelerations) / lim.cable_acceleration,
        }
        found: dict[str, np.ndarray] = {name: gap <= ACTIVE for name, gap in gaps.items()}
        found["speed of Po"] = self.uses[:, 3:] >= 1.0 - ACTIVE
        if self.resisted is not None:
            found["wrench to resist"] = self.resisted[:, np.newaxis] >= 1.0 - ACTIVE
        return found


def sample_motion(task: PathTask, motion: TimedPath, times: Array) -> MotionSamples:
    """What a motion asks at times within it [s].

    At the instant of a station it is what the stretch asks that begins there.

    Raises:
        PlanningError: A cable cannot run, or the wrench matrix is singular; names the pose.
    """
    assert motion.path is not None
    rows = motion.stretches()
    times = np.clip(times, motion.start_time, motion.end_time)
    number = np.clip(np.searchsorted(rows[:, 0], times, side="right") - 1, 0, len(rows) - 1)
    since = np.minimum(times - rows[number, 0], rows[number, 1])
    u = rows[number, 3]
    speeds = np.maximum(rows[number, 2] + u * since, 0.0)
    s = motion.stations[number] + (rows[number, 2] + 0.5 * u * since) * since
    found = samples_at(task, motion.path.points(s), times, s, u, speeds)
    if motion.path.speeds is not None:
        way = np.linalg.norm(motion.path.points(s)[:, 10:13], axis=1)
        uses = way * speeds / motion.path.largest_speeds(s)
        found.uses[:, PATH_SPEED_USE] = np.maximum(found.uses[:, PATH_SPEED_USE], uses)
    return found


def samples_at(
    task: PathTask, points: Array, times: Array, s: Array, u: Array, speeds: Array
) -> MotionSamples:
    """What points of a path, shape (n, 19), ask with d2s/dt2 = u and ds/dt = speeds, shape (n,).

    Raises:
        PlanningError: As `sample_motion`.
    """
    stations, reach = task.stations(points, speeds**2)
    n, m = len(points), task.cables.count
    uses, tensions, rates = np.empty((n, 4)), np.empty((n, m)), np.empty((n, 2, m))
    uses_of(stations, reach, u, speeds**2, task.limits.packed(), uses, tensions, rates)
    lim, resisting = task.limits, None
    if len(task.resist):
        margins = np.empty(n)
        bounds = resistance_bounds(task, points, stations)
        resistance_margins(bounds, u, speeds**2, margins, np.empty(n, np.int64))
        resisting = 1.0 - margins
        uses[:, TENSION_USE] = np.maximum(uses[:, TENSION_USE], resisting)
    torques = np.full((n, m), np.nan)
    if lim.inertia > 0.0 or np.isfinite(lim.torque):
        torques = lim.inertia / lim.ratio * rates[:, 1] - lim.ratio * tensions
    return MotionSamples(
        times=times, parameters=s, speeds=speeds, uses=uses, tensions=tensions,
        cable_speeds=rates[:, 0], cable_accelerations=rates[:, 1], torques=torques, limits=lim,
        resisted=resisting,
    )  # fmt: skip


def pose_words(point: Array) -> str:
    """A pose row as users write poses: x, y, z [m] and angles [deg]."""
    X = pose_from_row(point[:7])
    numbers = [*X.translation(), *np.degrees(angles_from_rotation(X.rotation()))]
    words = [f"{round(value, 4) + 0.0:.4g}" for value in numbers]
    return f"({', '.join(words[:3])}) m, ({', '.join(words[3:])}) deg"
