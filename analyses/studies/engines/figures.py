"""Figure of the study: orders of convergence, and how far pairs of runs part."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.engines.pairs import METHODS
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.palette import DASHED, SOLID, nth_look


def engine_figure(runs: Runs) -> Figure:
    """Orders of convergence and distances of the runs that are there."""
    figure, axes = new_figure(2, 2, (13.0, 9.5), "Compiled engine beside the plant")
    for name, dash in (("taut", SOLID), ("catching", DASHED)):
        if runs.has(order=name):
            row = runs.one(order=name)
            for k, method in enumerate(METHODS):
                look = nth_look(k)
                axes[0, 0].loglog(
                    1e3 * np.array(row["steps_s"]), row["distances_m"][method], linestyle=dash,
                    color=look.color, marker=look.marker, label=f"{method}, {name}",
                )  # fmt: skip
    axes[0, 0].set(xlabel="step [ms]", ylabel="distance to the plant at 0.02 ms [m]",
                   title="soft cables")  # fmt: skip
    if runs.has(kind="scenario"):
        some = runs(kind="scenario")
        names = some.list("scenario")
        axes[0, 1].barh(
            names, 1e6 * some["distance_m"], label="on the path", **bar_style(nth_look(0))
        )
        axes[0, 1].barh(
            names, 1e6 * some["final_distance_m"], height=0.4, label="at the end",
            **bar_style(nth_look(1)),
        )  # fmt: skip
        axes[0, 1].set_xscale("log")
        axes[0, 1].tick_params(axis="y", labelsize=8)
    axes[0, 1].set(xlabel="distance of the engines [um]", title="scenarios that ship")
    if runs.has(kind="impacts"):
        some = runs(kind="impacts")
        whats = (("distance_m", "on the path"), ("final_distance_m", "at the end"))
        for k, (what, label) in enumerate(whats):
            sizes = np.sort(1e6 * some[what])
            axes[1, 0].semilogy(sizes, label=label, **line_style(nth_look(k)))
    axes[1, 0].set(xlabel="runs, sorted", ylabel="distance of the engines [um]",
                   title="servo, cables paid out at random")  # fmt: skip
    if runs.has(kind="energy"):
        some = runs(kind="energy")
        for k, (column, label) in enumerate((("least_gain", "least"), ("largest_gain", "largest"))):
            look = nth_look(k)
            axes[1, 1].semilogx(
                1e3 * some["step_s"], some[column], marker=look.marker, label=label,
                **line_style(look),
            )  # fmt: skip
    axes[1, 1].set(xlabel="step [ms]", ylabel="change of energy over that of the fall",
                   title="real stiffness, undamped, runge_kutta3")  # fmt: skip
    for one in axes.ravel():
        if one.get_legend_handles_labels()[0]:
            one.legend(loc="best", fontsize=8)
    return figure
