"""Figure of the study: laps until failure, sums of lengths, slack cables, paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    NUMBERS,
    PUBLISHED_LAPS,
    PUBLISHED_PLAIN,
    VARIED_ESTIMATORS,
    Configuration,
)
from cdpr_drake.analyses.studies.mobile_robot.lap_figures import LENGTHS, PATHS, lap_drawings
from cdpr_drake.analyses.studies.mobile_robot.laps import COLUMNS, FREE, PHASES, SHOWN
from cdpr_drake.analyses.studies.mobile_robot.tension_figures import (
    SHOWN as TENSIONS,
)
from cdpr_drake.analyses.studies.mobile_robot.tension_figures import (
    tension_drawings,
)
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    line_style,
    new_figure,
    plain_numbers,
)
from cdpr_drake.palette import SHADED, nth_look

BOTH = ("plain", "corrected")
WORDS = {"plain": "no correction", "corrected": "with correction"}

FIGURES = ("mobile_robot", "choices", *TENSIONS, *PATHS, LENGTHS)
"""Names of all figures that the study can write."""


def mobile_robot_drawings(
    found: StudyData, shown: Sequence[Configuration]
) -> dict[str, Callable[[], Figure]]:
    """What draws `mobile_robot`, `choices` and those of `tension_drawings` and `lap_drawings`, by
    name, of finished configurations."""
    drawn: dict[str, Callable[[], Figure]] = {}
    if found:
        drawn["mobile_robot"] = partial(_laps_figure, found)
    main = {"plain", "corrected", *(f"estimator {kind}" for kind in PUBLISHED_LAPS)}
    if any(c.name not in main for c in shown):
        drawn["choices"] = partial(_choices_figure, found, shown)
    return drawn | tension_drawings(found) | lap_drawings(found)


def _laps_figure(found: StudyData) -> Figure:
    figure, axes = new_figure(2, 2, (13.0, 10.0), "A tag on a mobile robot that goes round")
    _draw_laps(axes[0, 0], found)
    _draw_lengths(axes[0, 1], found)
    _draw_slack(axes[1, 0], found)
    _draw_paths(axes[1, 1], found)
    return figure


def _choices_figure(found: StudyData, shown: Sequence[Configuration]) -> Figure:
    figure, axes = new_figure(2, 1, (10.0, 13.0), "What is not printed, three values")
    by_lengths = [f"estimator {kind}" for kind in VARIED_ESTIMATORS]
    for one, names, title in (
        (axes[0], BOTH, "known tag each lap, control integration"),
        (axes[1], by_lengths, "no known tag, estimators by cable lengths"),
    ):
        chosen = [c for c in shown if c.name.endswith(tuple(names))]
        _draw_choices(one, found, chosen, names)
        one.set_title(title, loc="right")
    return figure


def _draw_laps(axes: Any, found: StudyData) -> None:
    """Bars of laps until the end: medians, each run, what is published."""
    names = [f"estimator {k}" for k in PUBLISHED_LAPS] + ["plain"]
    labels = [f"estimator {NUMBERS[k]}" for k in PUBLISHED_LAPS] + ["1, known tag"]
    published = [*PUBLISHED_LAPS.values(), PUBLISHED_PLAIN]
    for place, (name, laps) in enumerate(zip(names, published, strict=True)):
        first = place == 0
        if name in found:
            ends = found[name]["end"][:, 1]
            axes.bar(place, np.median(ends), 0.6, **bar_style(nth_look(0)),
                     label="median" if first else None)  # fmt: skip
            axes.plot(np.full(len(ends), place), ends, linestyle="", marker="x",
                      color=nth_look(7).color, label="a run" if first else None)  # fmt: skip
        axes.plot([place - 0.4, place + 0.4], [laps, laps], **line_style(nth_look(1)),
                  linewidth=2.5, label="published" if first else None)  # fmt: skip
    axes.set_xticks(range(len(names)), labels, rotation=20)
    axes.set(ylabel="laps until tracking ends", title="no correction")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left")


def _draw_lengths(axes: Any, found: StudyData) -> None:
    """Largest rise of the sum of lengths over that of the first whole lap, lap by lap."""
    for number, name in enumerate(BOTH):
        if name not in found:
            continue
        sums = found[name]["sums"]
        start = np.take(sums, [min(1, sums.shape[1] - 1)], axis=1)
        rise = sums - start
        worst = np.full((len(rise), rise.shape[1]), np.nan)
        there = np.any(np.isfinite(rise), axis=2)
        worst[there] = np.nanmax(rise[there], axis=1)
        laps = np.arange(1, worst.shape[1] + 1)
        for k, row in enumerate(worst):
            axes.plot(laps, row, **line_style(nth_look(number)), linewidth=0.9,
                      label=WORDS[name] if k == 0 else None)  # fmt: skip
    axes.set_xscale("log")
    plain_numbers(axes.xaxis)
    axes.set(xlabel="lap", ylabel="rise of the sum of lengths since lap 2 [m]",
             title="cable that was paid out, worst moment of each lap")  # fmt: skip
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")


def _draw_slack(axes: Any, found: StudyData) -> None:
    """The most cables slack at once in each lap, over all runs."""
    for number, name in enumerate(BOTH):
        if name in found:
            table = found[name]["laps"][:, :, COLUMNS.index("most_slack")]
            there = np.any(np.isfinite(table), axis=0)
            laps = np.arange(1, table.shape[1] + 1)[there]
            axes.step(laps, np.nanmax(table[:, there], axis=0), where="mid",
                      **line_style(nth_look(number)), label=WORDS[name])  # fmt: skip
    axes.axhspan(FREE + 0.5, 8.2, color=SHADED.color, linewidth=0.0,
                 label="fewer than six cables hold the platform")  # fmt: skip
    axes.set_xscale("log")
    plain_numbers(axes.xaxis)
    axes.set(xlabel="lap", ylabel="most cables slack at once, of all runs", ylim=(-0.2, 8.2),
             title="slack cables")  # fmt: skip
    axes.legend(loc="best")


def _draw_paths(axes: Any, found: StudyData) -> None:
    """Paths of the platform from above, of the first run."""
    number = 0
    for name in BOTH:
        if name not in found:
            continue
        paths, done = found[name]["paths"][0], found[name]["end"][0, 1]
        for path, lap in zip(paths, (*SHOWN, max(int(done + 1e-9), 1)), strict=True):
            there = np.all(np.isfinite(path), axis=1)
            if not np.any(there) or (lap in SHOWN and path is paths[-1]):
                continue
            closed = path[[*range(PHASES), 0]] if np.all(there) else path[there]
            axes.plot(closed[:, 0], closed[:, 1], **line_style(nth_look(number)),
                      label=f"{WORDS[name]}, lap {lap}")  # fmt: skip
            number += 1
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title="path of the platform, first run")
    if number:
        axes.legend(loc="best", fontsize=8)


def _draw_choices(
    axes: Any, found: StudyData, shown: Sequence[Configuration], names: Sequence[str]
) -> None:
    """Laps until the end of what was varied, every run; looks by how configurations' names end."""
    shown = [c for c in shown if c.name in found]
    for place, one in enumerate(shown):
        ends = found[one.name]["end"][:, 1]
        look = nth_look(next(k for k, name in enumerate(names) if one.name.endswith(name)))
        axes.barh(place, np.median(ends), 0.6, **bar_style(look))
        axes.plot(ends, np.full(len(ends), place), linestyle="", marker="x",
                  color=nth_look(7).color)  # fmt: skip
    axes.set_yticks(range(len(shown)), [one.words for one in shown])
    axes.set_xscale("log")
    plain_numbers(axes.xaxis)
    axes.set_xlim(1.0, max(axes.get_xlim()[1], 40.0))
    axes.invert_yaxis()
    axes.set(xlabel="laps until tracking ends, or the run does (crosses: each run)")
