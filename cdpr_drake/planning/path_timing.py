"""The fastest motion along a path that keeps the limits of tensions and winches.

What libraries do. Drake's `Toppra` takes limits of joint velocities, accelerations and torques, of
frames, and of generalized forces one by one: forces with a redundancy, as of more cables than
degrees of freedom, are not among them. The Python side of `toppra` takes any polygon of (u, x), but
leaves the projection along the redundancy to who asks. So the passes are here, over programs that
have the redundancy in them; with limits of the winches alone they agree with Drake's, which is a
test.

Damping of the platform is linear in ds/dt, and the programs are linear in (ds/dt)^2: it is taken as
a share of (ds/dt)^2 that is exact at the speeds of the plan before, until these stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.numerics.own_terms import ProgramReport
from cdpr_drake.planning.failures import held_badly, stuck
from cdpr_drake.planning.margin_kernel import ROUNDING, rest_margins
from cdpr_drake.planning.path_task import MotionSamples, PathTask, sample_motion
from cdpr_drake.planning.reachability_kernel import (
    DONE,
    UNSOLVED,
    backward,
    forward,
    largest_speeds,
)
from cdpr_drake.planning.resistance import resistance_bounds
from cdpr_drake.planning.resistance_kernel import resistance_margins
from cdpr_drake.planning.station_kernel import BASIS, RATE
from cdpr_drake.trajectories.pose_path import PosePath
from cdpr_drake.trajectories.timed_path import TimedPath

STATIONS = 500
"""Usual number of stations."""

FEWEST, MOST = 10, 100_000
"""Numbers of stations that are accepted."""

SETTLED, MOST_ROUNDS = 1e-6, 60
"""Relative change of (ds/dt)^2 at which the damping has settled, and rounds until then: each takes
the damping at the speeds of the one before, which halves the error at least where damping alone
limits the speed."""

EVEN_SHARE = 0.5
"""Of the stations, those that all pieces of a path share evenly: a rounded corner is short, and its
limits change much. The others are shared by length."""


@dataclass(frozen=True, eq=False)
class PathPlan:
    """A time-optimal motion along a path.

    Attributes:
        task: The robot and its limits.
        path: The path.
        trajectory: The motion.
        reachable: Smallest and largest (ds/dt)^2 from which the end can be reached at rest, or the
            next corner at which it rests, shape (n + 1, 2) [m^2/s^2].
        largest: Largest (ds/dt)^2 that the limits admit at a station by itself, shape (n + 1,)
            [m^2/s^2]; NaN where the platform could not rest, and the motion carries it through.
        program: Of a `PathTimingProgram` with own terms, how it was solved; `reachable` and
            `largest` are then those without these. None: by the passes.
    """

    task: PathTask
    path: PosePath
    trajectory: TimedPath
    reachable: Array
    largest: Array
    program: ProgramReport | None = None

    @property
    def duration(self) -> float:
        """Time that it takes [s]."""
        return self.trajectory.durations[0]

    def samples(self, rate: float = 1000.0) -> MotionSamples:
        """What it asks, so many times a second [Hz], from its start to its end."""
        motion = self.trajectory
        count = int(np.floor(self.duration * rate)) + 1
        return sample_motion(self.task, motion, motion.start_time + np.arange(count) / rate)


def plan_along_path(
    task: PathTask, path: PosePath, stations: int = STATIONS, start_time: float = 0.0
) -> PathPlan:
    """Plans the fastest motion from rest to rest along a path.

    Args:
        task: The robot and its limits.
        path: The path; where its direction jumps, the platform rests. Its speeds are kept, too.
        stations: About how many points of the path the limits are asked at; a path of more pieces
            has more.
        start_time: When it begins [s].

    Raises:
        PlanningError: There is no such motion, and says where and which cable; a cable cannot run;
            the number of stations is not accepted.
    """
    legs = [_settled_leg(task, *leg, path.length) for leg in stations_of_leg(path, stations)]
    places = np.concatenate([legs[0].places[:1], *(leg.places[1:] for leg in legs)])
    x = np.concatenate([legs[0].x[:1], *(leg.x[1:] for leg in legs)])
    reachable = np.concatenate([legs[0].reachable[:1], *(leg.reachable[1:] for leg in legs)])
    largest = np.concatenate([legs[0].largest[:1], *(leg.largest[1:] for leg in legs)])
    motion = TimedPath.make(path, places, x, start_time)
    return PathPlan(task, path, motion, reachable, largest)


def stations_of_leg(path: PosePath, stations: int) -> list[tuple[PosePath, Array]]:
    """The legs of a path from rest to rest, each with s of its stations [m].

    Args:
        path: The path.
        stations: As `plan_along_path`.

    Raises:
        PlanningError: The number is not accepted.
    """
    if not FEWEST <= stations <= MOST:
        raise PlanningError(f"stations: found {stations}; accepted: {FEWEST} to {MOST}")
    density = (
        stations * (1.0 - EVEN_SHARE) / path.length,
        stations * EVEN_SHARE / len(path.pieces),
    )
    return [(leg, _places(leg, *density)) for leg in path.legs()]


@dataclass(frozen=True, eq=False)
class _Leg:
    """From rest to rest; entries as of `PathPlan`, places are s."""

    places: Array
    x: Array
    reachable: Array
    largest: Array


def _settled_leg(task: PathTask, leg: PosePath, places: Array, whole: float) -> _Leg:
    """The leg whose damping is that of its own speeds, planned again until they stay."""
    found = _plan_leg(task, leg, places, whole, np.zeros(len(places)))
    if not task.dynamics.is_damped:
        return found
    for _ in range(MOST_ROUNDS):
        before, found = found.x, _plan_leg(task, leg, places, whole, found.x)
        if np.max(np.abs(found.x - before)) <= SETTLED * np.max(found.x):
            return found
    raise PlanningError(
        f"path: found no law of time under the platform's damping in {MOST_ROUNDS} rounds; "
        "accepted: another number of stations"
    )


def _plan_leg(task: PathTask, leg: PosePath, places: Array, whole: float, damped_at: Array) -> _Leg:
    """The fastest law of time of a leg, with damping that is exact at (ds/dt)^2 = `damped_at`."""
    points = leg.points(places)
    stations, reach = task.stations(points, damped_at)
    limits, lim = task.limits.packed(), task.limits
    fastest = lim.cable_speed / np.maximum(np.max(np.abs(stations[:, RATE]), axis=1), 1e-300)
    most = np.minimum(leg.largest_speeds(places), lim.speed)
    fastest = np.minimum(fastest, most / np.maximum(reach, 1e-300)) ** 2
    n, r = len(places) - 1, stations.shape[1] - BASIS
    etas, margins = np.zeros((n + 1, r)), np.empty(n + 1)
    rest_margins(stations, limits, etas, margins)
    bounds = resistance_bounds(task, points, stations)
    if bounds.shape[1]:
        still, resisting = np.zeros(n + 1), np.empty(n + 1)
        resistance_margins(bounds, still, still, resisting, np.empty(n + 1, np.int64))
        margins = np.minimum(margins, resisting)
    margins[np.abs(margins) <= ROUNDING] = 0.0
    for end in (0, n):
        if not margins[end] >= 0.0:
            raise PlanningError(held_badly(task, points[end], places[end], whole))
    ways = np.diff(places)
    speeds, ends = np.empty((n + 1, 2)), np.empty((n, 2, 2 + 2 * r))
    x, u = np.zeros(n + 1), np.empty(n)
    code, where = backward(stations, bounds, ways, fastest, etas, margins, limits, speeds, ends)
    if code == DONE and speeds[0, 0] > 0.0:
        code, where = 1, 0
    if code == DONE:
        code, where = forward(stations, bounds, ways, fastest, speeds, ends, limits, x, u)
    if code == UNSOLVED:
        raise PlanningError(
            f"path: at s = {places[where]:.4g} m of {whole:.4g} m a linear program was not solved; "
            "accepted: another number of stations"
        )
    if code != DONE:
        worst = int(np.argmin(margins))
        if margins[worst] < 0.0:
            raise PlanningError(held_badly(task, points[worst], places[worst], whole))
        raise PlanningError(
            stuck(
                task,
                points[where : where + 2],
                stations[where : where + 2],
                places[where : where + 2],
                whole,
                fastest[where],
                speeds[where + 1],
            )
        )
    largest = np.empty(n + 1)
    largest_speeds(stations, bounds, etas, margins, fastest, limits, largest)
    return _Leg(places, x, speeds, largest)


def _places(leg: PosePath, per_length: float, per_piece: float) -> Array:
    """Stations of a leg: its breaks, and more in between, the same way apart within a piece."""
    places = [leg.breaks[:1]]
    for a, b in zip(leg.breaks[:-1], leg.breaks[1:], strict=True):
        steps = int(np.ceil(per_length * (b - a) + per_piece))
        places.append(np.linspace(a, b, steps + 1)[1:])
    found = np.concatenate(places)
    return found if len(found) > 2 else np.linspace(found[0], found[-1], 3)
