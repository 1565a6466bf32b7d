"""Figures of a motion in proven sets: sets, obstacles and path in three views, and its limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from scipy.spatial import ConvexHull

from cdpr_drake.analyses.planning.plan_figures import (
    plan_path_figure,
    tension_figure,
    winch_figure,
)
from cdpr_drake.analyses.planning.proven_plan_results import ProvenRun
from cdpr_drake.analyses.planning.timed_plan_results import TimedRun
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.curves import draw_curve
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, DESIRED, OUTLINE, PLATFORM, SHADED, TARGET, nth_look
from cdpr_drake.planning.box_timing import inertial_terms, mass_of

VIEWS = ((0, 1), (0, 2), (1, 2))
"""Coordinates across and up of the three views."""

CIRCLE = 24
"""Corners of a round outline."""

POINTS = 400


def proven_pictures(run: ProvenRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figures of a motion in proven sets, by the names of their files."""
    drawn: dict[str, Callable[[], Figure]] = {
        "sets": lambda: sets_figure(run),
        "tensions": lambda: tension_figure(run),
        "winches": lambda: winch_figure(run),
        "path": lambda: plan_path_figure(run),
    }
    if run.found.box is not None:
        drawn["accelerations"] = lambda: acceleration_figure(run)
    return dict(figure_writers(drawn, formats))


def sets_figure(run: ProvenRun) -> Figure:
    """All sets, those that the path goes through, obstacles and the path, in three views.

    A view looks through everything: an obstacle is not touched where the path only seems to cross
    it. Sets are of Po, so obstacles lie deeper than the sets' borders by the platform and cables.
    """
    sets, path = run.sets, run.found.path
    used = sorted(set(path.curve.sets))
    lower, upper = run.robot.reach()
    flat = np.flatnonzero(upper - lower <= 0.0)
    views = [view for view in VIEWS if not set(view) & set(flat.tolist())]
    points = path.path.points(np.linspace(0.0, path.path.length, POINTS))[:, 4:7]
    figure = bare_figure((5.0 * max(len(views), 2), 5.6), f"Proven sets and the path\n{run.about}")
    with styled():
        places: Any = figure.subplots(1, len(views), squeeze=False)[0]
        for axes, (a, b) in zip(places, views, strict=True):
            boxes = [_rectangle(sets.lower[k], sets.upper[k], a, b) for k in range(len(sets))]
            axes.add_collection(
                PatchCollection(boxes, facecolor=SHADED.color, edgecolor="none", zorder=1)
            )
            for number in used:
                box = _rectangle(sets.lower[number], sets.upper[number], a, b)
                box.set(fill=False, edgecolor=OUTLINE.color, linewidth=0.9, zorder=3)
                axes.add_patch(box)
            for obstacle in sets.about["obstacles"]:
                outline = _outline(np.array(obstacle["points_m"]), obstacle["radius_m"], a, b)
                axes.add_patch(
                    Polygon(
                        outline, facecolor="white", edgecolor=BOUND.color, hatch="////",
                        linewidth=1.2, alpha=0.9, zorder=2,
                    )
                )  # fmt: skip
            axes.plot(points[:, a], points[:, b], zorder=5, **_thick(PLATFORM))
            corners = _corners(run)
            axes.plot(
                corners[:, a], corners[:, b], zorder=4, linewidth=0.0, marker=".",
                color=BOUND.color, markersize=6.0,
            )  # fmt: skip
            for place, look in ((points[0], DESIRED), (points[-1], TARGET)):
                axes.plot(
                    place[a], place[b], zorder=6, linestyle="none", marker=look.marker,
                    markersize=11.0, markerfacecolor="white", color=look.color,
                )  # fmt: skip
            axes.set(
                xlim=(lower[a], upper[a]), ylim=(lower[b], upper[b]),
                xlabel=f"{'xyz'[a]} in W [m]", ylabel=f"{'xyz'[b]} in W [m]", aspect="equal",
            )  # fmt: skip
        figure.legend(handles=_legend(run, len(used)), loc="outside lower center", ncols=4)
    return figure


def acceleration_figure(run: ProvenRun | TimedRun) -> Figure:
    """Accelerations over time with the box for which tensions are proven; of a turn moments, too.

    Without turns they are those of Po, with turns those of the centre of mass.
    """
    motion, about = run.motion, run.sets.about
    box = run.found.box if isinstance(run, ProvenRun) else None  # what moves has no turns
    times = np.linspace(motion.start_time, motion.end_time, 2 * POINTS)
    rows = np.array([motion.motion(t) for t in times])
    limits = np.array(about["accelerations_m_s2"])
    if box is None or box.moments is None:
        panels = [(rows[:, 16:19], limits, "acceleration in W [m/s²]")]
        of = "Acceleration of Po in the proven box"
    else:
        _, terms = inertial_terms(rows, *mass_of(run.task))
        panels = [
            (terms[:, :3], limits, "acceleration in W [m/s²]"),
            (terms[:, 3:], np.array(about["moments_n_m"]), "moment in P [N m]"),
        ]
        of = "Acceleration of the centre of mass, and moment about it, in the proven boxes"
    figure = bare_figure((10.0, 5.0 + 3.5 * (len(panels) - 1)), f"{of}\n{run.about}")
    with styled():
        grid = figure.subplots(len(panels), 1, squeeze=False, sharex=True)
        for axes, (values, halves, label) in zip(grid[:, 0], panels, strict=True):
            _draw_in_box(axes, times, values, halves)
            axes.set_ylabel(label)
        grid[-1, 0].set_xlabel("time [s]")
    return figure


def _draw_in_box(axes: Any, times: Array, values: Array, halves: Array) -> None:
    for k in range(3):
        look = nth_look(k)
        draw_curve(axes, times, values[:, k], look, f"along {'xyz'[k]}", phase=(k + 0.5) / 3)
    for number, bound in enumerate(np.unique(halves)):
        for side in (-bound, bound):
            name = "proven box" if side > 0.0 and number == 0 else None
            axes.axhline(side, label=name, **line_style(BOUND))
    axes.margins(x=0.01)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))


def _corners(run: ProvenRun) -> Array:
    """Corners of the shortest polyline, positions in W, shape (n, 3) [m]."""
    sets, points = run.sets, run.found.path.sequence.points
    found = np.repeat(sets.lower[:1, :3], len(points), axis=0)
    moved = sets.axes[sets.axes < 3]
    found[:, moved] = points[:, : len(moved)]
    return found


def _thick(look: Any) -> dict[str, Any]:
    return line_style(look) | {"linewidth": 2.4, "marker": ""}


def _rectangle(lower: Array, upper: Array, a: int, b: int) -> Rectangle:
    return Rectangle((lower[a], lower[b]), upper[a] - lower[a], upper[b] - lower[b])


def _outline(points: Array, radius: float, a: int, b: int) -> Array:
    """Outline of a convex shape as a view shows it, shape (k, 2) [m]."""
    flat = points[:, [a, b]]
    if radius > 0.0:
        turns = np.linspace(0.0, 2.0 * np.pi, CIRCLE, endpoint=False)
        ring = radius * np.column_stack([np.cos(turns), np.sin(turns)])
        flat = (flat[:, np.newaxis] + ring).reshape(-1, 2)
    return np.asarray(flat[ConvexHull(flat).vertices], float)


def _legend(run: ProvenRun, used: int) -> list[Any]:
    shown = [
        Patch(facecolor=SHADED.color, label=f"{len(run.sets)} proven sets, of Po"),
        Patch(fill=False, edgecolor=OUTLINE.color, label=f"the {used} of the path"),
        Line2D([], [], label="path of Po", **_thick(PLATFORM)),
        Line2D([], [], linewidth=0, marker=".", color=BOUND.color, label="shortest polyline"),
        Line2D([], [], linewidth=0, marker=DESIRED.marker, color=DESIRED.color, label="start",
               markerfacecolor="white", markersize=10),
        Line2D([], [], linewidth=0, marker=TARGET.marker, color=TARGET.color, label="goal",
               markerfacecolor="white", markersize=10),
    ]  # fmt: skip
    if run.sets.about["obstacles"]:
        shown.insert(
            2, Patch(facecolor="white", edgecolor=BOUND.color, hatch="////", label="obstacles")
        )
    return shown
