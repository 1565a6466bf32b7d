"""Figures of a free motion: limits used over time, distances and view, and those of every plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.planning.free_plan_results import FreeRun
from cdpr_drake.analyses.planning.plan_figures import (
    plan_path_figure,
    reached_rows,
    tension_figure,
    winch_figure,
)
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.curves import draw_bars, draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look

USES = ("tensions and torques", "cable speeds", "cable accelerations", "speed of Po")
"""Columns of `MotionSamples.uses`."""


def free_pictures(run: FreeRun, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figures of a free motion, by the names of their files."""
    drawn: dict[str, Callable[[], Figure]] = {
        "limits": lambda: limits_figure(run),
        "tensions": lambda: tension_figure(run),
        "winches": lambda: winch_figure(run),
        "path": lambda: plan_path_figure(run),
    }
    if run.distances or run.view:
        drawn["distances"] = lambda: distance_figure(run)
    return dict(figure_writers(drawn, formats))


def limits_figure(run: FreeRun) -> Figure:
    """Which share of its limits a motion uses over time, and which limits it reaches when."""
    samples, lim = run.samples, run.task.limits
    rows = reached_rows(run.robot, samples)
    height = 0.8 + 0.24 * max(len(rows), 1)
    title = f"Shares of limits, and the limits that are reached\n{run.about}"
    figure = bare_figure((11.0, 5.0 + height), title)
    there = [True, True, bool(np.isfinite(lim.cable_acceleration)), bool(np.isfinite(lim.speed))]
    shown = [k for k in range(len(USES)) if there[k]]
    with styled():
        axes, bars = figure.subplots(2, 1, sharex=True, height_ratios=(4.0, height))
        for number, k in enumerate(shown):
            draw_curve(
                axes, samples.times, samples.uses[:, k], nth_look(number), USES[k],
                phase=phase_of(number, len(shown)),
            )  # fmt: skip
        axes.axhline(1.0, label="limit of the plan", **line_style(BOUND))
        _mark_knots(axes, run.solution.times)
        axes.set(ylabel="share of the limit [-]", ylim=(0.0, None))
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        draw_bars(bars, samples.times, rows)
        bars.set(xlabel="time [s]", ylabel="limit reached")
        axes.margins(x=0.01)
    return figure


def distance_figure(run: FreeRun) -> Figure:
    """Distances and view over time, with what was asked."""
    kinds: list[tuple[dict[str, Array], str, float]] = []
    if run.distances:
        asked = run.asked.clearance or 0.0
        kinds.append((run.distances, "distance [m]", asked))
    if run.view:
        kinds.append((run.view, "within the view [-], 0 at its edge", 0.0))
    figure = bare_figure((10.0, 1.2 + 3.4 * len(kinds)), f"What the motion stays off\n{run.about}")
    with styled():
        places: Any = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
        for place, (curves, label, least) in zip(places, kinds, strict=True):
            for k, (name, values) in enumerate(curves.items()):
                draw_curve(
                    place, run.looks, values, nth_look(k), name, phase=phase_of(k, len(curves))
                )
            place.axhline(least, label="asked for", **line_style(BOUND))
            _mark_knots(place, run.solution.times)
            place.set(ylabel=label)
            place.margins(x=0.01)
            place.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        places[-1].set(xlabel="time [s]")
    return figure


def _mark_knots(axes: Any, times: Array) -> None:
    """Ticks of the knots, at which the program asks, on the lower edge."""
    axes.plot(
        times, np.zeros(len(times)), "|", transform=axes.get_xaxis_transform(), markersize=10.0,
        color=BOUND.color, clip_on=False, label="knots",
    )  # fmt: skip
