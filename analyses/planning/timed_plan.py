"""A motion of a robot among what moves, proven at every instant."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from pydrake.geometry import Capsule, Convex, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.planning.motions_in_sets import (
    JUDGED,
    MotionInSets,
    acceleration_figure,
    thick,
)
from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled
from cdpr_drake.analyses.workspaces.proven_sets import ProvenSets
from cdpr_drake.analyses.workspaces.timed_sets import find_timed_sets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, DESIRED, OUTLINE, PLATFORM, SHADED, TARGET
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.planning.timed_motion import MotionInTime, motion_in_time, straight_time
from cdpr_drake.workspaces.cable_interference import Surroundings
from cdpr_drake.workspaces.moving_clearances import moving_clearances
from cdpr_drake.workspaces.moving_shapes import MovingObstacle
from cdpr_drake.workspaces.timed_sets import TimedSets

if TYPE_CHECKING:
    from cdpr_drake.analyses.visualization.shown_things import ShownThing

RESTING, SHORTEST_WAIT = 2e-3, 0.2
"""Below this speed [m/s] for so long [s] a platform is said to wait."""

PLACES, INSTANTS = 90, 160
"""Places of the way and instants at which obstacles that move are looked for."""

MOVING_CHECKS = ("cables off what moves", "platform off what moves")
"""Names of the checks in addition to the kinds."""

REPLAY, REPLAY_RATE = "replay.html", 30.0
"""Page of the replay, and its frames a second [Hz]."""

AFTER = 1.0
"""How long what moves is shown after the platform has arrived [s]."""

RESTS, MOVES = (0.55, 0.55, 0.55, 1.0), (0.72, 0.55, 0.38, 1.0)
"""Colours of obstacles."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TimedPlan(MotionInSets):
    """A motion of a robot in sets of poses and time.

    Attributes:
        in_sets: The motion with its path in the sets.
        things: What moves.
        around: The robot's cables and platform.
    """

    in_sets: MotionInTime
    things: Sequence[MovingObstacle]
    around: Surroundings

    @property
    def sets(self) -> TimedSets:
        """The sets."""
        return self.in_sets.sets

    @property
    def title(self) -> str:
        """What it is, in words for titles."""
        return (
            f"{self.robot.name}, {self.geometry}, proven motion among what moves, "
            f"least {self.in_sets.cost}: "
            f"{self.way:.4g} m, {self.solution.duration:.4g} s"
        )

    @cached_property
    def track(self) -> tuple[Array, Array]:
        """Times, shape (n,) [s], and positions of Po in W, shape (n, 3) [m], of the motion."""
        times = np.linspace(0.0, self.motion.end_time, 2000)
        return times, self.motion.path.points(times)[:, 4:7]  # type: ignore[union-attr]

    @cached_property
    def way(self) -> float:
        """Length of the way of Po [m]."""
        return float(np.sum(np.linalg.norm(np.diff(self.track[1], axis=0), axis=1)))

    def waits(self) -> list[tuple[float, float]]:
        """When the platform waits on its way: from, to [s]."""
        times, points = self.track
        slow = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times) < RESTING
        edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]]).astype(int)))
        spans = [(float(times[a]), float(times[b])) for a, b in edges.reshape(-1, 2)]
        return [(a, b) for a, b in spans if b - a >= SHORTEST_WAIT]

    def proof(self) -> tuple[list[str], list[str]]:
        """What is proven at every instant, and what is not, in words."""
        about, lim = self.sets.about, self.task.limits
        least, most = about["tension_limits_n"]
        yes = [
            f"tensions from {least:g} to {most:g} N give the motion, its acceleration and any "
            "other in the box",
            "cables touch neither each other, platform, frame nor obstacles that rest or move",
            "the platform touches neither frame nor obstacles that rest or move",
            self._afterwards(),
        ]
        if np.isfinite(lim.cable_speed):
            yes.insert(1, f"cables are not faster than {lim.cable_speed:.4g} m/s")
        no = self.kept_at_samples()
        if not self._settles():
            no.append(f"what obstacles do at the goal after {self.sets.horizon:.4g} s")
        return yes, no

    def _settles(self) -> bool:
        return all(thing.settled() <= self.sets.horizon for thing in self.things)

    def _afterwards(self) -> str:
        until = "for ever" if self._settles() else f"until {self.sets.horizon:.4g} s"
        return f"the platform can stay at the goal {until}"

    def time_bound(self) -> float:
        """No motion within these limits arrives earlier [s].

        From rest to rest over the distance along each axis with the acceleration of the box, over
        the straight line with the largest speed, and not before the goal is clear.
        """
        lim = self.task.limits
        ends = self.track[1][[0, -1]]
        ways = np.abs(ends[1] - ends[0])
        box = np.array(self.sets.about["accelerations_m_s2"], float)
        bound = float(np.max(2.0 * np.sqrt(ways / box)))
        speed = min(lim.speed, lim.cable_speed)
        if np.isfinite(speed):
            bound = max(bound, float(np.linalg.norm(ways)) / speed)
        return bound

    def details(self) -> dict[str, Any]:
        """Way, bounds, proof, waits, and exact checks of samples."""
        in_sets, plan = self.in_sets, self.solution
        yes, no = self.proof()
        least_time = in_sets.cost == "time"
        straight = float(np.linalg.norm(np.diff(self.track[1][[0, -1]], axis=0)))
        return {
            "duration_s": plan.duration,
            "path_length_m": self.way,
            "proven": {"path": True, "motion": True, "of": yes, "not_of": no},
            "least": in_sets.cost,
            "cost": plan.duration if least_time else self.way,
            "lower_bound": self.time_bound() if least_time else straight,
            "straight_m": straight,
            "curve_at_most_m": in_sets.length,
            "largest_accelerations_m_s2": in_sets.accelerations.tolist(),
            "largest_speed_m_s": in_sets.speed,
            "waits": [{"from_s": a, "to_s": b} for a, b in self.waits()],
            "goal_clear_from_s": in_sets.goal_from,
            "moving": [thing.name for thing in self.things],
            "stretches": [
                {"from_s": a, "to_s": b, "set": int(n)} for a, b, n in in_sets.stretches()
            ],
            "sets": {"count": len(self.sets), "overlaps": len(self.sets.graph), **self.sets.about},
            "judged_samples": self.judged[0],
            "judged_infeasible": dict(self.judged[1]),
            "sets_time_s": self.sets_time,
            "planning_time_s": self.planning_time,
        }  # fmt: skip

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The way in space and time first."""
        return {
            "space_time": partial(space_time_figure, self),
            "sets": partial(sets_over_time_figure, self),
            **super().figures(),
            "accelerations": partial(acceleration_figure, self),
        }

    def pages(self) -> dict[str, Callable[[Path], object]]:
        """A replay, in which obstacles move, too."""
        return {REPLAY: lambda path: write_timed_replay(path, self)}


def plan_among_moving(
    robot: Robot, sets: ProvenSets, things: Sequence[MovingObstacle], ends: tuple[Array, Array],
    task: PathTask, least: str, *, arguments: dict[str, Any], begin: float,
    say: Callable[[str], None],
) -> TimedPlan:  # fmt: skip
    """A motion among what moves, in sets that are proven otherwise.

    Args:
        robot: The robot.
        sets: Sets that are proven but for what moves.
        things: What moves.
        ends: Start at time 0 and goal, shape (6,) each [m, rad].
        task: The robot with its limits.
        least: length or time.
        arguments: What was asked, for JSON.
        begin: When the search for sets began, by `time.perf_counter` [s].
        say: Called with a line on what is done now.

    Raises:
        WorkspaceError: As `find_timed_sets`.
        PlanningError: As `motion_in_time`.
    """
    if sets.about["accelerations_m_s2"] is None or sets.conditions is None:
        raise PlanningError(
            "sets: found sets of a file, or without accelerations, with obstacles that move; "
            "accepted: sets that were found with accelerations"
        )
    box = np.array(sets.about["accelerations_m_s2"], float)
    clearance = float(sets.about["clearance_m"])
    whole = straight_time(task, ends[0], ends[1], box)
    timed = find_timed_sets(robot, sets, things, ends, whole, clearance=clearance, say=say)
    between = time.perf_counter()
    in_sets = motion_in_time(timed, *ends, task, box, cost=least, say=say)
    took = time.perf_counter() - between
    around = sets.conditions.around
    assert around is not None
    return TimedPlan(
        robot=robot, limits=task.limits, arguments=arguments, planning_time=took,
        solution=in_sets.plan, in_sets=in_sets, things=tuple(things), around=around,
        sets_time=between - begin, judged=judged_in_time(sets, in_sets, things, around, JUDGED),
    )  # fmt: skip


def judged_in_time(
    sets: ProvenSets, in_sets: MotionInTime, things: Sequence[MovingObstacle],
    around: Surroundings, count: int,
) -> tuple[int, dict[str, int]]:  # fmt: skip
    """Samples of a motion, evenly in time, and of each check at how many it fails exactly."""
    motion = in_sets.plan.trajectory
    times = np.linspace(motion.start_time, motion.end_time, count)
    poses = [motion.pose(float(t)) for t in times]
    p = np.array([X.translation() for X in poses])
    R = np.array([X.rotation().matrix() for X in poses])
    failed = {name: int(np.count_nonzero(~holds)) for name, holds in sets.judge(p, R).items()}
    gaps = moving_clearances(around, things, times, p[:, np.newaxis], R[:, np.newaxis])[:, 0]
    hit = ~(gaps > float(sets.about["clearance_m"]))
    return count, failed | {
        name: int(np.count_nonzero(hit[:, k])) for k, name in enumerate(MOVING_CHECKS)
    }


def write_timed_replay(path: Path, plan: TimedPlan) -> None:
    """Writes the motion with all obstacles as a page that opens without a server."""
    from cdpr_drake.analyses.visualization.replay import write_replay
    from cdpr_drake.analyses.visualization.shown_things import Surroundings as ShownSurroundings

    end = plan.motion.end_time
    times = np.arange(0.0, min(end + AFTER, plan.sets.horizon), 1.0 / REPLAY_RATE)
    samples = plan.samples
    tensions = np.column_stack([np.interp(times, samples.times, row) for row in samples.tensions.T])
    log: dict[str, Array] = {
        "time": times,
        "X_WP": np.array([pose_row(plan.motion.pose(float(t))) for t in times]),
        "tensions": tensions,
    }
    things = []
    for number, obstacle in enumerate(plan.sets.about["obstacles"]):
        shape = ConvexShape(np.array(obstacle["points_m"]), obstacle["radius_m"])
        things.append(_shown(f"obstacle_{number}", shape, RESTS, None))
    for number, moving in enumerate(plan.things):
        for k, (shape, poses) in enumerate(moving.shown(times)):
            name = f"moving_{number}_{k}"
            log[name] = np.array([pose_row(X) for X in poses])
            things.append(_shown(name, shape, MOVES, name))
    around = ShownSurroundings(things=tuple(things))
    write_replay(path, plan.robot, log, around=around, title=plan.title)


def _shown(
    name: str, shape: ConvexShape, color: tuple[float, float, float, float], quantity: str | None
) -> ShownThing:
    from cdpr_drake.analyses.visualization.shown_things import ShownThing

    solid, X = drake_shape(shape)
    return ShownThing(name, solid, color, X, quantity)


def drake_shape(shape: ConvexShape) -> tuple[Shape, RigidTransform]:
    """A convex shape as Drake has it, and its pose; one that is round and no ball or capsule is
    shown, and taken, without its radius."""
    points = shape.points
    if len(points) == 1:
        return Sphere(shape.radius), RigidTransform(points[0])
    if len(points) == 2:
        way = points[1] - points[0]
        R = RotationMatrix.MakeFromOneVector(way, 2)
        X = RigidTransform(R, 0.5 * (points[0] + points[1]))
        return Capsule(max(shape.radius, 1e-4), float(np.linalg.norm(way))), X
    return Convex(points.T, shape.name or "hull"), RigidTransform()


def space_time_figure(plan: TimedPlan) -> Figure:
    """Where on its way the platform is over time, and where it would be hit.

    Grey is exact: there the platform at that place of the way, or its cables, would be nearer to
    what moves than they may.
    """
    times, points = plan.track
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    until = min(plan.sets.horizon, 1.25 * plan.motion.end_time)
    instants, places = np.linspace(0.0, until, INSTANTS), np.linspace(0.0, along[-1], PLACES)
    p = np.column_stack([np.interp(places, along, points[:, k]) for k in range(3)])
    R = plan.motion.pose(0.0).rotation().matrix()
    gaps = moving_clearances(plan.around, plan.things, instants, p, np.repeat(R[None], PLACES, 0))
    hit = (np.min(gaps, axis=2) <= plan.sets.about["clearance_m"]).T
    figure = bare_figure((9.0, 5.0), f"The way in space and time\n{plan.title}")
    with styled():
        axes = figure.subplots()
        axes.pcolormesh(
            instants, places, np.where(hit, 1.0, np.nan), cmap="Greys", vmin=0.0, vmax=2.2,
            shading="nearest", rasterized=True,
        )  # fmt: skip
        axes.contour(
            instants, places, hit.astype(float), levels=[0.5], colors=BOUND.color, linewidths=1.0
        )
        shown = np.append(times, until), np.append(along, along[-1])
        axes.plot(*shown, zorder=5, **thick(PLATFORM))
        for a, b in plan.waits():
            at = float(np.interp(0.5 * (a + b), times, along))
            axes.annotate(
                f"waits {b - a:.3g} s", (0.5 * (a + b), at), xytext=(0, 9), ha="center",
                textcoords="offset points", zorder=6,
            )  # fmt: skip
        for time, place, look in ((0.0, 0.0, DESIRED), (times[-1], along[-1], TARGET)):
            axes.plot(time, place, zorder=6, linestyle="none", marker=look.marker, markersize=11.0,
                      markerfacecolor="white", color=look.color)  # fmt: skip
        edge = 0.05 * along[-1]
        axes.set(xlabel="time [s]", ylabel="way of Po [m]", xlim=(-0.01 * until, until),
                 ylim=(-edge, along[-1] + edge))  # fmt: skip
        shade = Patch(facecolor="#9a9a9a", edgecolor=BOUND.color, label="something is there")
        ends = [
            Line2D([], [], linewidth=0, marker=look.marker, color=look.color, label=label,
                   markerfacecolor="white", markersize=10)
            for look, label in ((DESIRED, "start"), (TARGET, "goal"))
        ]  # fmt: skip
        line = Line2D([], [], label="platform, Po", **thick(PLATFORM))
        figure.legend(handles=[shade, line, *ends], loc="outside lower center", ncols=4)
    return figure


def sets_over_time_figure(plan: TimedPlan) -> Figure:
    """Each coordinate of Po over time, in the sets that hold it."""
    times, points = plan.track
    sets = plan.sets
    figure = bare_figure((9.0, 2.4 * len(sets.axes) + 1.4), f"Sets of poses and time\n{plan.title}")
    with styled():
        places: Any = figure.subplots(len(sets.axes), 1, sharex=True, squeeze=False)[:, 0]
        for k, (axes, number) in enumerate(zip(places, sets.axes, strict=True)):
            boxes = [
                _span(sets.times[n], sets.lower[n, k], sets.upper[n, k]) for n in range(len(sets))
            ]
            axes.add_collection(
                PatchCollection(boxes, facecolor=SHADED.color, edgecolor="none", zorder=1)
            )
            for first, last, n in plan.in_sets.stretches():
                box = _span((first, last), sets.lower[n, k], sets.upper[n, k])
                box.set(fill=False, edgecolor=OUTLINE.color, linewidth=1.0, zorder=3)
                axes.add_patch(box)
            axes.plot(times, points[:, number], zorder=5, **thick(PLATFORM))
            axes.set(ylabel=f"{'xyz'[number]} in W [m]", xlim=(0.0, sets.horizon))
            axes.margins(y=0.05)
            axes.autoscale_view(scalex=False)
        places[-1].set(xlabel="time [s]")
        figure.legend(
            handles=[
                Patch(facecolor=SHADED.color, label=f"{len(sets)} proven sets, of Po"),
                Patch(fill=False, edgecolor=OUTLINE.color, label="the one that holds it"),
                Line2D([], [], label="platform, Po", **thick(PLATFORM)),
            ],
            loc="outside lower center", ncols=3,
        )  # fmt: skip
    return figure


def _span(times: Array | tuple[float, float], low: float, high: float) -> Rectangle:
    return Rectangle((times[0], low), times[1] - times[0], high - low)
