"""Figures of the study of the mobile robot: laps, lengths, slack, paths and tensions by lap."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    line_style,
    new_figure,
    plain_numbers,
)
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, SHADED, nth_look

PHASES = 40
"""Moments of a lap of which lengths, places and tensions are measured."""

SHOWN, TENSION_LAPS = (1, 10, 20), (1, 2, 10, 20, 30)
"""Laps of which the path, and tensions, are measured, beside the last whole one."""

FREE = 2
"""Cables of eight that may be slack while six hold the platform."""

THRESHOLD = 1.0
"""Tension below which the scenario corrects [N], 5.3.1."""

AS_CHOSEN = "as chosen"
VIEWED = (
    "estimator control_integration", "estimator cable_lengths",
    "estimator cable_lengths_elastic_pulleys",
)  # fmt: skip
"""Ways to follow the tag in other views."""

WORDS = {"plain": "no correction", "corrected": "with correction"}
MOMENTS = (np.arange(PHASES) + 0.5) / PHASES


def last_lap(done: float) -> int:
    """Number of the last whole lap, from 1, of a run that ended after so many."""
    return max(int(done + 1e-9), 1)


def of_views(rows: Frame) -> Frame:
    """Runs in the view of the scenario and in others, with nothing else changed."""
    views = rows["choice"].str.startswith("view") | (rows["choice"] == AS_CHOSEN)
    return rows[rows["way"].isin(VIEWED) & views]


def by_words(rows: Frame) -> dict[str, Frame]:
    """Runs with a known tag, as chosen, by words; NothingToDraw if there are none."""
    runs = {words: rows[rows["configuration"] == name] for name, words in WORDS.items()}
    if not any(map(len, runs.values())):
        raise NothingToDraw
    return {words: group for words, group in runs.items() if len(group)}


def first_run(rows: Frame, name: str) -> tuple[Mapping[str, Array], int]:
    """Curves of a configuration's first run, and its last whole lap."""
    runs = rows[rows["configuration"] == name]
    if not len(runs):
        raise NothingToDraw
    return runs["arrays"].iloc[0], last_lap(runs["laps_done"].iloc[0])


def laps_figure(rows: Frame) -> Figure:
    """Laps until failure, sums of lengths, slack cables, paths."""
    figure, panels = new_figure(2, 2, (13.0, 10.0), "A tag on a mobile robot that goes round")
    ends, lengths, slack, paths = panels.flat
    draw_laps(ends, rows)
    for number, (words, runs) in enumerate(by_words(rows).items()):
        style = line_style(nth_look(number))
        for k, curves in enumerate(runs["arrays"]):
            sums = curves["sums_m"]
            rise = np.fmax.reduce(sums - sums[min(1, len(sums) - 1)], axis=1)
            lengths.plot(np.arange(1, len(rise) + 1), rise, **style, linewidth=0.9,
                         label=words if k == 0 else None)  # fmt: skip
        most = np.fmax.reduce([curves["most_slack"] for curves in runs["arrays"]], axis=0)
        slack.step(np.arange(1, len(most) + 1), most, where="mid", **style, label=words)
    slack.axhspan(FREE + 0.5, 8.2, color=SHADED.color, linewidth=0.0,
                  label="fewer than six cables hold the platform")  # fmt: skip
    lengths.set(ylabel="rise of the sum of lengths since lap 2 [m]",
                title="cable that was paid out, worst moment of each lap")  # fmt: skip
    slack.set(ylabel="most cables slack at once, of all runs", title="slack cables")
    for axes in (lengths, slack):
        axes.set(xlabel="lap", xscale="log")
        plain_numbers(axes.xaxis)
        axes.legend(loc="best")
    slack.set_ylim(-0.2, 8.2)
    for number, (name, words) in enumerate(WORDS.items()):
        if (rows["configuration"] == name).any():
            draw_paths(paths, rows, name, f"{words}, ", 4 * number)
    paths.set(title="path of the platform, first run")
    if paths.get_legend_handles_labels()[0]:  # below: lost platforms go through the middle
        paths.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=6.0, fontsize=8, ncols=3
        )
    return figure


def draw_laps(axes: Any, rows: Frame) -> None:
    """Bars of laps until the end without correction: medians, each run, what is printed."""
    plain = rows[(rows["choice"] == AS_CHOSEN) & (rows["way"] != "corrected")]
    labels = []
    for place, (way, runs) in enumerate(plain.groupby("way", sort=False)):
        ends, laps = runs["laps_done"], runs["printed_laps"].iloc[0]
        shown = [
            axes.bar(place, ends.median(), 0.6, **bar_style(nth_look(0))),
            *axes.plot(np.full(len(ends), place), ends, "x", color=nth_look(7).color),
            *axes.plot([place - 0.4, place + 0.4], [laps, laps], **line_style(nth_look(1)),
                       linewidth=2.5),
        ]  # fmt: skip
        number = runs["estimator"].iloc[0]
        labels.append(f"{number}, known tag" if way == "plain" else f"estimator {number}")
    axes.set_xticks(range(len(labels)), labels, rotation=20)
    axes.set(ylabel="laps until tracking ends", title="no correction")
    if labels:
        axes.legend(shown, ["median", "a run", "published"], loc="upper left")


def draw_paths(axes: Any, rows: Frame, name: str, words: str = "", look: int = 0) -> None:
    """Paths of the platform from above in laps of the first run of a configuration."""
    curves, last = first_run(rows, name)
    laps = dict(zip((*SHOWN, last), curves["paths_m"], strict=True))
    for number, (lap, path) in enumerate(sorted(laps.items())):
        finite = np.all(np.isfinite(path), axis=1)
        if np.any(finite):
            closed = path[[*range(PHASES), 0]] if np.all(finite) else path[finite]
            mark = nth_look(look + number)
            axes.plot(
                *closed[:, :2].T, **line_style(mark), label=f"{words}lap {lap}", marker=mark.marker,
                markevery=(2 * number, 8), markerfacecolor="white", markersize=5.0,
            )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x in W [m]", ylabel="y in W [m]")


def paths_figure(rows: Frame, name: str, number: str) -> Figure:
    """Figures 5.19 and 5.20."""
    title = f"Figure {number}: path of the platform from above, {WORDS[name]}, first run"
    figure, axes = new_figure(1, 1, (9.0, 7.6), title)
    draw_paths(axes, rows, name)
    axes.legend(loc="center")
    return figure


def lengths_figure(rows: Frame) -> Figure:
    """Figure 5.21: sums of lengths over single laps."""
    title = "Figure 5.21: sum of the cable lengths during single laps, first run"
    figure, axes = new_figure(1, 1, (11.0, 6.6), title)
    for first, (words, runs) in zip((0, 4), by_words(rows).items(), strict=False):
        sums = runs["arrays"].iloc[0]["sums_m"]
        begun = np.flatnonzero(np.any(np.isfinite(sums), axis=1)) + 1
        laps = sorted({*(lap for lap in (10, 20) if lap in begun), int(begun[-1])})
        for number, lap in enumerate(laps, start=first):
            draw_curve(axes, MOMENTS, sums[lap - 1], nth_look(number), f"{words}, lap {lap}",
                       phase=phase_of(number, 8))  # fmt: skip
    axes.set(xlabel="part of the lap [-]", ylabel="sum of the cable lengths [m]", xlim=(0.0, 1.0))
    axes.legend(loc="best")
    return figure


def tensions_figure(rows: Frame, name: str, words: str, laps: tuple[int, ...]) -> Figure:
    """Figures 2.18, 5.22 and 5.23: tensions in laps of the first run, and in its last whole one."""
    curves, last = first_run(rows, name)
    tensions = curves["tensions_n"]
    panels = {lap: tensions[TENSION_LAPS.index(lap)] for lap in laps} | {last: tensions[-1]}
    panels = {lap: panel for lap, panel in sorted(panels.items()) if np.any(np.isfinite(panel))}
    lines = -(-len(panels) // 2)
    title = f"Cable tensions behind a mobile robot, {words}"
    figure, grid = new_figure(lines, 2, (14.0, 1.8 + 3.6 * lines), title)
    flat = list(np.ravel(grid))
    for axes, (lap, panel) in zip(flat, panels.items(), strict=False):
        count = panel.shape[1]
        for k in range(count):
            draw_curve(axes, MOMENTS, panel[:, k], nth_look(k), f"cable {k + 1}",
                       phase=phase_of(k, count), linewidth=1.2, markersize=4.0)  # fmt: skip
        axes.axhline(THRESHOLD, **line_style(BOUND), label="threshold of the correction")
        axes.set_title(f"lap {lap}")
        axes.set(xlabel="part of the lap [-]", ylabel="tension [N]", xlim=(0.0, 1.0))
    for axes in flat[len(panels) :]:
        axes.remove()
    figure.legend(*flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return figure


def choices_figure(rows: Frame) -> Figure:
    """Laps until the end under other choices of what is not printed, every run."""
    rows = rows[~rows["choice"].str.startswith("view")]
    if (rows["choice"] == AS_CHOSEN).all():
        raise NothingToDraw
    title = "What the thesis does not print, at three values each"
    figure, panels = new_figure(2, 1, (10.0, 13.0), title)
    for axes, ways, words in (
        (panels[0], tuple(WORDS), "known tag each lap, control integration"),
        (panels[1], VIEWED[1:], "no known tag, estimators by cable lengths"),
    ):
        groups = rows[rows["way"].isin(ways)].groupby("words", sort=False)
        for place, (_, runs) in enumerate(groups):
            ends, look = runs["laps_done"], nth_look(ways.index(runs["way"].iloc[0]))
            axes.barh(place, ends.median(), 0.6, **bar_style(look))
            axes.plot(ends, np.full(len(ends), place), linestyle="", marker="x",
                      color=nth_look(7).color)  # fmt: skip
        axes.set_yticks(range(len(groups)), [label for label, _ in groups])
        axes.set_xscale("log")
        plain_numbers(axes.xaxis)
        axes.set_xlim(1.0, max(axes.get_xlim()[1], 40.0))
        axes.invert_yaxis()
        axes.set(xlabel="laps until tracking ends, or the run does (crosses: each run)")
        axes.set_title(words, loc="right")
    return figure


def views_figure(rows: Frame) -> Figure:
    """Laps until the end over how far the tag may drift in the image, by estimator."""
    rows = of_views(rows)
    if (rows["choice"] == AS_CHOSEN).all():
        raise NothingToDraw
    figure, axes = new_figure(1, 1, (9.0, 6.0), "How long the tag is followed, by its view")
    for way, runs in rows.groupby("way", sort=False):
        look, number = nth_look(VIEWED.index(way)), runs["estimator"].iloc[0]
        margin, laps = 1e3 * runs["margin_m"], runs["printed_laps"].iloc[0]
        middle = runs["laps_done"].groupby(margin).median()
        axes.plot(middle.index, middle, marker=look.marker, label=f"estimator {number}, median",
                  **line_style(look))  # fmt: skip
        axes.plot(margin, runs["laps_done"], linestyle="", marker=look.marker, color=look.color,
                  markerfacecolor="none", markersize=4)  # fmt: skip
        axes.axhline(laps, linewidth=0.8, linestyle=":", color=look.color)
        axes.annotate(f"published, estimator {number}", (1.01, laps),
                      xycoords=("axes fraction", "data"), ha="left", va="center",
                      fontsize=8)  # fmt: skip
    axes.set(xlabel="margin of the tag along the image's short side [mm]",
             ylabel="laps until tracking ends, or the run does (hollow: each run)",
             ylim=(0.0, None))  # fmt: skip
    axes.legend(loc="best")
    return figure


FIGURES: dict[str, Callable[[Frame], Figure]] = {
    "mobile_robot": laps_figure,
    "choices": choices_figure,
    "views": views_figure,
    "tensions_estimator": partial(
        tensions_figure, name="estimator cable_lengths",
        words="figure 2.18, Est. 4, no known tag", laps=(1, 2),
    ),
    "tensions_plain": partial(
        tensions_figure, name="plain", words="figure 5.22, no correction", laps=(1, 10, 20)
    ),
    "tensions_corrected": partial(
        tensions_figure, name="corrected", words="figure 5.23, with correction", laps=(1, 10, 30)
    ),
    "paths_plain": partial(paths_figure, name="plain", number="5.19"),
    "paths_corrected": partial(paths_figure, name="corrected", number="5.20"),
    "lengths_by_lap": lengths_figure,
}  # fmt: skip
"""By the name of the file."""
