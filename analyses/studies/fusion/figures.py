"""Figure of the study: errors of the estimate in time and of every configuration, consistency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.seeded_study import StudyData
from cdpr_drake.analyses.studies.fusion.configurations import Configuration
from cdpr_drake.analyses.studies.fusion.trials import COLUMNS, RATE
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.palette import BOUND, SHADED, nth_look

SHOWN = ("on_board", "external", "both")
COVERED = ("on_board covered", "both, on_board covered", "both, external covered")


def fusion_figure(found: StudyData, shown: Sequence[Configuration]) -> Figure:
    """The figure of finished configurations; without those of a covered camera no panel of them."""
    figure, axes = new_figure(2, 2, (15.0, 11.0), "Two cameras, lengths, an IMU and depths, fused")
    words = {c.name: c.words for c in shown}
    _draw_times(axes[0, 0], found, SHOWN, words, "distance", "pose estimate, mean over seeds")
    if any(name in found for name in COVERED):
        title = "a camera covered from 2 to 5 s"
        _draw_times(axes[0, 1], found, COVERED, words, "distance", title)
        axes[0, 1].axvspan(2.0, 5.0, color=SHADED.color, linewidth=0.0)
    else:
        axes[0, 1].remove()
    _draw_bars(axes[1, 0], found, shown)
    _draw_consistency(axes[1, 1], found, words)
    return figure


def _draw_times(
    axes: Any,
    found: StudyData,
    names: Sequence[str],
    words: Mapping[str, str],
    key: str,
    title: str,
) -> None:
    """Means over seeds in time."""
    for number, name in enumerate(names):
        if name in found:
            values = np.mean(found[name][key], axis=0)
            axes.plot(
                np.arange(len(values)) / RATE, 1e3 * values, **line_style(nth_look(number)),
                label=words[name],
            )  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="distance from the true pose [mm]", title=title)
    axes.set_ylim(bottom=0.0)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")


def _draw_bars(axes: Any, found: StudyData, shown: Sequence[Configuration]) -> None:
    """Mean errors of the estimate of every configuration, and the largest of each run."""
    for place, one in enumerate(shown):
        numbers = found[one.name]["numbers"]
        means, largest = (1e3 * numbers[:, COLUMNS.index(k)] for k in ("mean_m", "largest_m"))
        first = place == 0
        axes.barh(
            place, np.mean(means), 0.6, **bar_style(nth_look(0)), label="mean" if first else None
        )
        axes.plot(
            largest, np.full(len(largest), place), linestyle="", marker="x",
            color=nth_look(7).color, label="largest, each run" if first else None,
        )  # fmt: skip
    axes.set_yticks(range(len(shown)), [one.words for one in shown], fontsize=8)
    axes.invert_yaxis()
    axes.set(xlabel="distance of the estimate from the true pose [mm]", title="all configurations")
    axes.legend(loc="best")


def _draw_consistency(axes: Any, found: StudyData, words: Mapping[str, str]) -> None:
    """Normalized errors in time, mean over seeds."""
    for number, name in enumerate(SHOWN):
        if name in found:
            values = np.mean(found[name]["nees"], axis=0)
            axes.plot(
                np.arange(len(values)) / RATE, values, **line_style(nth_look(number)),
                label=words[name],
            )  # fmt: skip
    axes.axhline(6.0, label="as uncertain as wrong", **line_style(BOUND))
    axes.margins(y=0.1)
    axes.set(xlabel="time [s]", ylabel="normalized error squared [-]", title="consistency")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="best")
