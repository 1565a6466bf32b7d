"""Figure of the study: errors of the estimate in time and of every configuration, consistency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.fusion.configurations import SERVO
from cdpr_drake.analyses.studies.fusion.trials import RATE
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.palette import BOUND, SHADED, nth_look

SHOWN = ("on_board", "external", "both")
COVERED = ("on_board covered", "both, on_board covered", "both, external covered")


def fusion_figure(runs: Runs) -> Figure:
    """The figure of what is there; without runs with a covered camera no panel of them."""
    figure, axes = new_figure(2, 2, (15.0, 11.0), "Two cameras, lengths, an IMU and depths, fused")
    _draw_times(axes[0, 0], runs, SHOWN, "pose estimate, mean over seeds")
    if any(runs.has(configuration=name) for name in COVERED):
        _draw_times(axes[0, 1], runs, COVERED, "a camera covered from 2 to 5 s")
        axes[0, 1].axvspan(2.0, 5.0, color=SHADED.color, linewidth=0.0)
    else:
        axes[0, 1].remove()
    _draw_bars(axes[1, 0], runs)
    _draw_consistency(axes[1, 1], runs)
    return figure


def _draw_means(
    axes: Any, runs: Runs, names: Sequence[str], column: str, scale: float = 1.0
) -> None:
    """Means of curves over seeds in time."""
    for number, name in enumerate(names):
        if runs.has(configuration=name):
            some = runs(configuration=name)
            values = np.mean(some[column], axis=0)
            axes.plot(
                np.arange(len(values)) / RATE, scale * values, **line_style(nth_look(number)),
                label=some.rows[0]["sources"],
            )  # fmt: skip


def _draw_times(axes: Any, runs: Runs, names: Sequence[str], title: str) -> None:
    """Errors of the estimate, mean over seeds."""
    _draw_means(axes, runs, names, "estimate_m", 1e3)
    axes.set(xlabel="time [s]", ylabel="distance from the true pose [mm]", title=title)
    axes.set_ylim(bottom=0.0)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")


def _draw_bars(axes: Any, runs: Runs) -> None:
    """Mean errors of the estimate of every configuration, and the largest of each run."""
    shown = dict(runs(trial=SERVO).by("sources"))
    for place, some in enumerate(shown.values()):
        means, largest = 1e3 * some["mean_m"], 1e3 * some["largest_m"]
        first = place == 0
        axes.barh(
            place, np.mean(means), 0.6, **bar_style(nth_look(0)), label="mean" if first else None
        )
        axes.plot(
            largest, np.full(len(largest), place), linestyle="", marker="x",
            color=nth_look(7).color, label="largest, each run" if first else None,
        )  # fmt: skip
    axes.set_yticks(range(len(shown)), list(shown), fontsize=8)
    axes.invert_yaxis()
    axes.set(xlabel="distance of the estimate from the true pose [mm]", title="all configurations")
    axes.legend(loc="best")


def _draw_consistency(axes: Any, runs: Runs) -> None:
    """Normalized errors in time, mean over seeds."""
    _draw_means(axes, runs, SHOWN, "nees_by_row")
    axes.axhline(6.0, label="as uncertain as wrong", **line_style(BOUND))
    axes.margins(y=0.1)
    axes.set(xlabel="time [s]", ylabel="normalized error squared [-]", title="consistency")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="best")
