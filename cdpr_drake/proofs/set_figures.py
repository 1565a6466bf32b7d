"""Figures of motions in proven sets, and the replay of one among what moves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from pydrake.geometry import Capsule, Convex, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial import ConvexHull

from cdpr_drake.analyses.frame.figures import new_figure, panels, styled
from cdpr_drake.analyses.planning.plan_figures import Panel, panel_figure, thick
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.convex_shapes import ConvexShape
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.palette import BOUND, DESIRED, OUTLINE, PLATFORM, SHADED, TARGET
from cdpr_drake.proofs.box_timing import inertial_terms, mass_of
from cdpr_drake.proofs.moving_clearances import moving_clearances

if TYPE_CHECKING:
    from cdpr_drake.proofs.motions_in_sets import MotionInSets, ProvenPlan, TimedPlan

POINTS = 400  # points of curves
VIEWS = ((0, 1), (0, 2), (1, 2))  # coordinates across and up of the three views
CIRCLE = 24  # corners of a round outline

PLACES, INSTANTS = 90, 160
"""Places of the way and instants at which obstacles that move are looked for."""

REPLAY_RATE = 30.0  # frames of the replay a second [Hz]
AFTER = 1.0  # how long what moves is shown after the platform has arrived [s]
RESTS, MOVES = (0.55, 0.55, 0.55, 1.0), (0.72, 0.55, 0.38, 1.0)  # colours of obstacles

ENDS = (("start", DESIRED), ("goal", TARGET))


def acceleration_figure(plan: MotionInSets, turns: bool) -> Figure:
    """Accelerations over time with the box for which tensions are proven; of a turn moments, too.

    Without turns they are those of Po, with turns those of the centre of mass.
    """
    motion, about = plan.motion, plan.sets.about
    times = np.linspace(motion.start_time, motion.end_time, 2 * POINTS)
    rows = np.array([motion.motion(t) for t in times])
    limits, label = np.array(about["accelerations_m_s2"]), "acceleration in W [m/s²]"
    if not turns:
        boxes = [_in_box(label, rows[:, 16:19], limits)]
        title = plan.titled("Acceleration of Po in the proven box")
    else:
        _, terms = inertial_terms(rows, *mass_of(plan.task))
        moments = np.array(about["moments_n_m"])
        boxes = [
            _in_box(label, terms[:, :3], limits),
            _in_box("moment in P [N m]", terms[:, 3:], moments),
        ]
        title = plan.titled(
            "Acceleration of the centre of mass, and moment about it, in the proven boxes"
        )
    return panel_figure(title, (10.0, 5.0 + 3.5 * (len(boxes) - 1)), times, boxes)


def _in_box(label: str, values: Array, halves: Array) -> Panel:
    curves = {f"along {axis}": column for axis, column in zip("xyz", values.T, strict=True)}
    bounds = [side * half for half in np.unique(halves) for side in (-1.0, 1.0)]
    return Panel(label, curves, bounds, "proven box")


def sets_figure(plan: ProvenPlan) -> Figure:
    """All sets, those that the path goes through, obstacles and the path, in three views.

    A view looks through everything: an obstacle is not touched where the path only seems to cross
    it. Sets are of Po, so obstacles lie deeper than the sets' borders by the platform and cables.
    """
    sets, path = plan.sets, plan.in_sets.path
    used = sorted(set(path.curve.sets))
    lower, upper = plan.robot.reach()
    flat = set(np.flatnonzero(upper - lower <= 0.0).tolist())
    views = [view for view in VIEWS if not set(view) & flat]
    points = path.path.points(np.linspace(0.0, path.path.length, POINTS))[:, 4:7]
    corners = np.repeat(sets.lower[:1, :3], len(path.sequence.points), axis=0)
    moved = sets.axes[sets.axes < 3]
    corners[:, moved] = path.sequence.points[:, : len(moved)]
    obstacles = [(np.array(o["points_m"]), o["radius_m"]) for o in sets.about["obstacles"]]
    size, title = (5.0 * max(len(views), 2), 5.6), plan.titled("Proven sets and the path")
    figure, places = panels(len(views), len(views), size, title)
    with styled():
        for axes, view in zip(places, views, strict=True):
            across, up = view
            _draw_boxes(
                axes, sets.lower[:, view], sets.upper[:, view],
                [(sets.lower[n, view], sets.upper[n, view]) for n in used],
            )  # fmt: skip
            for corner_points, radius in obstacles:
                outline = Polygon(
                    _outline(corner_points[:, view], radius), facecolor="white",
                    edgecolor=BOUND.color, hatch="////", linewidth=1.2, alpha=0.9, zorder=2,
                )  # fmt: skip
                axes.add_patch(outline)
            axes.plot(*points[:, view].T, zorder=5, **thick(PLATFORM))
            axes.plot(
                *corners[:, view].T, zorder=4, linewidth=0.0, marker=".", color=BOUND.color,
                markersize=6.0,
            )  # fmt: skip
            _draw_ends(axes, points[0, view], points[-1, view])
            axes.set(
                xlim=(lower[across], upper[across]), ylim=(lower[up], upper[up]),
                xlabel=f"{'xyz'[across]} in W [m]", ylabel=f"{'xyz'[up]} in W [m]", aspect="equal",
            )  # fmt: skip
        obstacle = Patch(facecolor="white", edgecolor=BOUND.color, hatch="////", label="obstacles")
        handles = [
            _box_handle(len(sets)),
            Patch(fill=False, edgecolor=OUTLINE.color, label=f"the {len(used)} of the path"),
            *([obstacle] if obstacles else []),
            Line2D([], [], label="path of Po", **thick(PLATFORM)),
            Line2D([], [], linewidth=0, marker=".", color=BOUND.color, label="shortest polyline"),
            *_end_handles(),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def sets_over_time_figure(plan: TimedPlan) -> Figure:
    """Each coordinate of Po over time, in the sets that hold it."""
    times, points = plan.track
    sets = plan.sets
    title = plan.titled("Sets of poses and time")
    size = (9.0, 2.4 * len(sets.axes) + 1.4)
    figure, places = panels(len(sets.axes), 1, size, title, share_x=True)
    with styled():
        for k, (axes, number) in enumerate(zip(places, sets.axes, strict=True)):
            low, high = sets.lower[:, k], sets.upper[:, k]
            first, last = np.array(sets.times).T
            used = [((a, low[n]), (b, high[n])) for a, b, n in plan.in_sets.stretches()]
            _draw_boxes(axes, np.column_stack([first, low]), np.column_stack([last, high]), used)
            axes.plot(times, points[:, number], zorder=5, **thick(PLATFORM))
            axes.set(ylabel=f"{'xyz'[number]} in W [m]", xlim=(0.0, sets.horizon))
            axes.margins(y=0.05)
            axes.autoscale_view(scalex=False)
        places[-1].set(xlabel="time [s]")
        handles = [
            _box_handle(len(sets)),
            Patch(fill=False, edgecolor=OUTLINE.color, label="the one that holds it"),
            Line2D([], [], label="platform, Po", **thick(PLATFORM)),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


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
    figure, axes = new_figure(1, 1, (9.0, 5.0), plan.titled("The way in space and time"))
    with styled():
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
            middle = 0.5 * (a + b)
            axes.annotate(
                f"waits {b - a:.3g} s", (middle, float(np.interp(middle, times, along))),
                xytext=(0, 9), ha="center", textcoords="offset points", zorder=6,
            )  # fmt: skip
        _draw_ends(axes, (0.0, 0.0), (times[-1], along[-1]))
        edge = 0.05 * along[-1]
        axes.set(xlabel="time [s]", ylabel="way of Po [m]", xlim=(-0.01 * until, until),
                 ylim=(-edge, along[-1] + edge))  # fmt: skip
        shade = Patch(facecolor="#9a9a9a", edgecolor=BOUND.color, label="something is there")
        line = Line2D([], [], label="platform, Po", **thick(PLATFORM))
        handles = [shade, line, *_end_handles()]
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_boxes(axes: Any, lower: Array, upper: Array, used: Iterable[tuple[Any, Any]]) -> None:
    """All boxes, corners of shape (n, 2), and the outlines of those that are used."""
    boxes = [Rectangle(a, *(b - a)) for a, b in zip(lower, upper, strict=True)]
    axes.add_collection(PatchCollection(boxes, facecolor=SHADED.color, edgecolor="none", zorder=1))
    for a, b in used:
        axes.add_patch(
            Rectangle(
                (a[0], a[1]), b[0] - a[0], b[1] - a[1], fill=False, edgecolor=OUTLINE.color,
                linewidth=1.0, zorder=3,
            )
        )  # fmt: skip


def _box_handle(count: int) -> Patch:
    return Patch(facecolor=SHADED.color, label=f"{count} proven sets, of Po")


def _draw_ends(axes: Any, start: Sequence[float] | Array, goal: Sequence[float] | Array) -> None:
    for place, (_, look) in zip((start, goal), ENDS, strict=True):
        axes.plot(*place, zorder=6, linestyle="none", marker=look.marker, markersize=11.0,
                  markerfacecolor="white", color=look.color)  # fmt: skip


def _end_handles() -> list[Line2D]:
    return [
        Line2D([], [], linewidth=0, marker=look.marker, color=look.color, label=label,
               markerfacecolor="white", markersize=10)
        for label, look in ENDS
    ]  # fmt: skip


def _outline(points: Array, radius: float) -> Array:
    """Outline of a round hull of points of a view, shape (n, 2), as corners, shape (k, 2) [m]."""
    if radius > 0.0:
        turns = np.linspace(0.0, 2.0 * np.pi, CIRCLE, endpoint=False)
        ring = radius * np.column_stack([np.cos(turns), np.sin(turns)])
        points = (points[:, np.newaxis] + ring).reshape(-1, 2)
    return np.asarray(points[ConvexHull(points).vertices], float)


def write_timed_replay(plan: TimedPlan, path: Path) -> None:
    """Writes the motion with all obstacles as a page that opens without a server."""
    from cdpr_drake.analyses.visualization.replay import write_replay
    from cdpr_drake.analyses.visualization.shown_things import ShownThing, Surroundings

    end, samples = plan.motion.end_time, plan.samples
    times = np.arange(0.0, min(end + AFTER, plan.sets.horizon), 1.0 / REPLAY_RATE)
    tensions = np.column_stack([np.interp(times, samples.times, row) for row in samples.tensions.T])
    log: dict[str, Array] = {
        "time": times,
        "X_WP": np.array([pose_row(plan.motion.pose(float(t))) for t in times]),
        "tensions": tensions,
    }
    things = []
    for number, obstacle in enumerate(plan.sets.about["obstacles"]):
        shape = ConvexShape(np.array(obstacle["points_m"]), obstacle["radius_m"])
        solid, X = drake_shape(shape)
        things.append(ShownThing(f"obstacle_{number}", solid, RESTS, X))
    for number, moving in enumerate(plan.things):
        for k, (shape, poses) in enumerate(moving.shown(times)):
            name = f"moving_{number}_{k}"
            log[name] = np.array([pose_row(X) for X in poses])
            solid, X = drake_shape(shape)
            things.append(ShownThing(name, solid, MOVES, X, name))
    write_replay(path, plan.robot, log, around=Surroundings(things=tuple(things)), title=plan.title)


def drake_shape(shape: ConvexShape) -> tuple[Shape, RigidTransform]:
    """A convex shape as Drake has it, and its pose; one that is round and no ball or capsule is
    shown without its radius."""
    points = shape.points
    if len(points) == 1:
        return Sphere(shape.radius), RigidTransform(points[0])
    if len(points) == 2:
        way = points[1] - points[0]
        R = RotationMatrix.MakeFromOneVector(way, 2)
        X = RigidTransform(R, 0.5 * (points[0] + points[1]))
        return Capsule(max(shape.radius, 1e-4), float(np.linalg.norm(way))), X
    return Convex(points.T, shape.name or "hull"), RigidTransform()
