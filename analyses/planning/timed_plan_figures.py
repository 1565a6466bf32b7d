"""Figures of a motion among what moves: space and time, its sets over time, and a replay."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from cdpr_drake.analyses.planning.plan_figures import (
    plan_path_figure,
    tension_figure,
    winch_figure,
)
from cdpr_drake.analyses.planning.proven_plan_figures import acceleration_figure
from cdpr_drake.analyses.planning.timed_plan_results import TimedRun
from cdpr_drake.analyses.planning.timed_replay import write_timed_replay
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, DESIRED, OUTLINE, PLATFORM, SHADED, TARGET
from cdpr_drake.workspaces.moving_clearances import moving_clearances

PLACES, INSTANTS = 90, 160
"""Places of the way and instants at which it is looked whether something is there."""

REPLAY = "replay.html"


def timed_pictures(run: TimedRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figures of a motion among what moves, by the names of their files."""
    drawn: dict[str, Callable[[], Figure]] = {
        "space_time": lambda: space_time_figure(run),
        "sets": lambda: sets_over_time_figure(run),
        "tensions": lambda: tension_figure(run),
        "winches": lambda: winch_figure(run),
        "path": lambda: plan_path_figure(run),
        "accelerations": lambda: acceleration_figure(run),
    }
    pictures: dict[str, Callable[[Path], object]] = dict(figure_writers(drawn, formats))
    pictures[REPLAY] = lambda path: write_timed_replay(path, run)
    return pictures


def space_time_figure(run: TimedRun) -> Figure:
    """Where on its way the platform is over time, and where it would be hit.

    Grey is exact: there the platform at that place of the way, or its cables, would be nearer to
    what moves than they may.
    """
    times, points = run.track
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    until = min(run.sets.horizon, 1.25 * run.motion.end_time)
    instants, places = np.linspace(0.0, until, INSTANTS), np.linspace(0.0, along[-1], PLACES)
    p = np.column_stack([np.interp(places, along, points[:, k]) for k in range(3)])
    R = run.motion.pose(0.0).rotation().matrix()
    gaps = moving_clearances(run.around, run.things, instants, p, np.repeat(R[None], PLACES, 0))
    hit = (np.min(gaps, axis=2) <= run.sets.about["clearance_m"]).T
    figure = bare_figure((9.0, 5.0), f"The way in space and time\n{run.about}")
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
        axes.plot(*shown, zorder=5, **_thick(PLATFORM))
        for a, b in run.waits():
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
        line = Line2D([], [], label="platform, Po", **_thick(PLATFORM))
        figure.legend(handles=[shade, line, *ends], loc="outside lower center", ncols=4)
    return figure


def sets_over_time_figure(run: TimedRun) -> Figure:
    """Each coordinate of Po over time, in the sets that hold it."""
    times, points = run.track
    sets = run.sets
    figure = bare_figure((9.0, 2.4 * len(sets.axes) + 1.4), f"Sets of poses and time\n{run.about}")
    with styled():
        places: Any = figure.subplots(len(sets.axes), 1, sharex=True, squeeze=False)[:, 0]
        for k, (axes, number) in enumerate(zip(places, sets.axes, strict=True)):
            boxes = [
                _rectangle(sets.times[n], sets.lower[n, k], sets.upper[n, k])
                for n in range(len(sets))
            ]
            axes.add_collection(
                PatchCollection(boxes, facecolor=SHADED.color, edgecolor="none", zorder=1)
            )
            for first, last, n in run.found.stretches():
                box = _rectangle((first, last), sets.lower[n, k], sets.upper[n, k])
                box.set(fill=False, edgecolor=OUTLINE.color, linewidth=1.0, zorder=3)
                axes.add_patch(box)
            axes.plot(times, points[:, number], zorder=5, **_thick(PLATFORM))
            axes.set(ylabel=f"{'xyz'[number]} in W [m]", xlim=(0.0, sets.horizon))
            axes.margins(y=0.05)
            axes.autoscale_view(scalex=False)
        places[-1].set(xlabel="time [s]")
        figure.legend(
            handles=[
                Patch(facecolor=SHADED.color, label=f"{len(sets)} proven sets, of Po"),
                Patch(fill=False, edgecolor=OUTLINE.color, label="the one that holds it"),
                Line2D([], [], label="platform, Po", **_thick(PLATFORM)),
            ],
            loc="outside lower center", ncols=3,
        )  # fmt: skip
    return figure


def _thick(look: Any) -> dict[str, Any]:
    return line_style(look) | {"linewidth": 2.4, "marker": ""}


def _rectangle(times: Array | tuple[float, float], low: float, high: float) -> Rectangle:
    return Rectangle((times[0], low), times[1] - times[0], high - low)
