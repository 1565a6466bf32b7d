"""Figure of the study: laps until failure, sums of lengths, slack cables, paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    CORRECTED,
    NUMBERS,
    PLAIN_RUN,
    PUBLISHED,
    PUBLISHED_LAPS,
    PUBLISHED_PLAIN,
    VARIED_ESTIMATORS,
    VIEWED_ESTIMATORS,
    VIEWS,
)
from cdpr_drake.analyses.studies.mobile_robot.laps import FREE, PHASES, SHOWN
from cdpr_drake.analyses.studies.mobile_robot.view_statements import view_prefixes
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    line_style,
    new_figure,
    plain_numbers,
)
from cdpr_drake.palette import SHADED, nth_look

WORDS = {PLAIN_RUN: "no correction", CORRECTED: "with correction"}


def laps_figure(runs: Runs) -> Figure:
    """Laps until failure, sums of lengths, slack cables, paths."""
    figure, axes = new_figure(2, 2, (13.0, 10.0), "A tag on a mobile robot that goes round")
    _draw_laps(axes[0, 0], runs)
    _draw_lengths(axes[0, 1], runs)
    _draw_slack(axes[1, 0], runs)
    _draw_paths(axes[1, 1], runs)
    return figure


def choices_figure(runs: Runs) -> Figure:
    """Laps until failure under other choices of what is not printed.

    Raises:
        MissingRuns: None was run.
    """
    there = {
        name: some
        for name, some in runs.by("configuration")
        if name.partition(", ")[0] not in VIEWS
    }
    if not set(there) - set(PUBLISHED):
        raise MissingRuns("other choices")
    title = "What the thesis does not print, at three values each"
    figure, axes = new_figure(2, 1, (10.0, 13.0), title)
    by_lengths = [f"estimator {kind}" for kind in VARIED_ESTIMATORS]
    for one, names, title in (
        (axes[0], list(WORDS), "known tag each lap, control integration"),
        (axes[1], by_lengths, "no known tag, estimators by cable lengths"),
    ):
        shown = {name: some for name, some in there.items() if name.endswith(tuple(names))}
        _draw_choices(one, shown, names)
        one.set_title(title, loc="right")
    return figure


def views_figure(runs: Runs) -> Figure:
    """Laps until the end over how far the tag may drift in the image, by estimator.

    Raises:
        MissingRuns: No other view was run.
    """
    views = view_prefixes()
    names = [f"{prefix}estimator {VIEWED_ESTIMATORS[0]}" for prefix, _ in views.values()]
    if not all(runs.has(configuration=name) for name in names):
        raise MissingRuns("other views")
    figure, axes = new_figure(1, 1, (9.0, 6.0), "How long the tag is followed, by its view")
    for number, kind in enumerate(VIEWED_ESTIMATORS):
        look = nth_look(number)
        points = [
            (1e3 * margin, runs(configuration=f"{prefix}estimator {kind}")["laps_done"])
            for prefix, margin in views.values()
        ]
        axes.plot([x for x, _ in points], [np.median(ends) for _, ends in points],
                  marker=look.marker, label=f"estimator {NUMBERS[kind]}, median",
                  **line_style(look))  # fmt: skip
        for x, ends in points:
            axes.plot(np.full(len(ends), x), ends, linestyle="", marker=look.marker,
                      color=look.color, markerfacecolor="none", markersize=4)  # fmt: skip
        axes.axhline(PUBLISHED_LAPS[kind], linewidth=0.8, linestyle=":", color=look.color)
        axes.annotate(
            f"published, estimator {NUMBERS[kind]}",
            (1.01, PUBLISHED_LAPS[kind]),
            xycoords=("axes fraction", "data"),
            ha="left",
            va="center",
            fontsize=8,
        )
    axes.set(xlabel="margin of the tag along the image's short side [mm]",
             ylabel="laps until tracking ends, or the run does (hollow: each run)",
             ylim=(0.0, None))  # fmt: skip
    axes.legend(loc="best")
    return figure


def _draw_laps(axes: Any, runs: Runs) -> None:
    """Bars of laps until the end: medians, each run, what is published."""
    names = [f"estimator {k}" for k in PUBLISHED_LAPS] + [PLAIN_RUN]
    labels = [f"estimator {NUMBERS[k]}" for k in PUBLISHED_LAPS] + ["1, known tag"]
    published = [*PUBLISHED_LAPS.values(), PUBLISHED_PLAIN]
    for place, (name, laps) in enumerate(zip(names, published, strict=True)):
        first = place == 0
        if runs.has(configuration=name):
            ends = runs(configuration=name)["laps_done"]
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


def _draw_lengths(axes: Any, runs: Runs) -> None:
    """Largest rise of the sum of lengths over that of the first whole lap, lap by lap."""
    for number, name in enumerate(WORDS):
        if not runs.has(configuration=name):
            continue
        sums = runs(configuration=name)["sums_m"]
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


def _draw_slack(axes: Any, runs: Runs) -> None:
    """The most cables slack at once in each lap, over all runs."""
    for number, name in enumerate(WORDS):
        if runs.has(configuration=name):
            table = runs(configuration=name)["most_slack"]
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


def _draw_paths(axes: Any, runs: Runs) -> None:
    """Paths of the platform from above, of the first run."""
    number = 0
    for name in WORDS:
        if not runs.has(configuration=name):
            continue
        run = runs(configuration=name).rows[0]
        paths, done = run["paths_m"], run["laps_done"]
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
    if number:  # below the axes: lost platforms go through the middle
        axes.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=6.0, fontsize=8, ncols=3
        )


def _draw_choices(axes: Any, shown: Mapping[str, Runs], names: Sequence[str]) -> None:
    """Laps until the end of what was varied, every run; looks by how configurations' names end."""
    for place, (name, some) in enumerate(shown.items()):
        ends = some["laps_done"]
        look = nth_look(next(k for k, end in enumerate(names) if name.endswith(end)))
        axes.barh(place, np.median(ends), 0.6, **bar_style(look))
        axes.plot(ends, np.full(len(ends), place), linestyle="", marker="x",
                  color=nth_look(7).color)  # fmt: skip
    axes.set_yticks(range(len(shown)), [some.rows[0]["words"] for some in shown.values()])
    axes.set_xscale("log")
    plain_numbers(axes.xaxis)
    axes.set_xlim(1.0, max(axes.get_xlim()[1], 40.0))
    axes.invert_yaxis()
    axes.set(xlabel="laps until tracking ends, or the run does (crosses: each run)")
