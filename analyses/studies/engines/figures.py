"""Figure of the study: orders of convergence, and how far pairs of runs part."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from cdpr_drake.analyses.studies.engines.pairs import METHODS
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.visualization.figure_style import (
    bar_style,
    bare_figure,
    line_style,
    plain_numbers,
    styled,
)
from cdpr_drake.arrays import Array
from cdpr_drake.palette import DASHED, SOLID, nth_look


def engine_figure(runs: Runs) -> Figure:
    """Orders of convergence and distances of the runs that are there."""
    figure = bare_figure((14.0, 13.0), "Compiled engine beside the plant")
    with styled():
        axes = figure.subplot_mosaic([["soft", "names"], ["impacts", "names"], ["energy", "names"]])
    _draw_orders(axes["soft"], runs)
    _draw_scenarios(axes["names"], runs)
    _draw_impacts(axes["impacts"], runs)
    _draw_energy(axes["energy"], runs)
    for one in axes.values():
        if one.get_legend_handles_labels()[0] and one is not axes["names"]:
            one.legend(loc="best", fontsize=8)
    return figure


def _draw_orders(axes: Any, runs: Runs) -> None:
    """Distance to the plant by step, method and case."""
    for name, dash in (("taut", SOLID), ("catching", DASHED)):
        if runs.has(order=name):
            row = runs.one(order=name)
            steps = 1e3 * np.array(row["steps_s"])
            for k, method in enumerate(METHODS):
                look = nth_look(k)
                axes.loglog(
                    steps, row["distances_m"][method], linestyle=dash,
                    color=look.color, marker=look.marker, label=f"{method}, {name}",
                )  # fmt: skip
            _name_steps(axes, steps)
    axes.set(xlabel="step [ms]", ylabel="distance to the plant at 0.02 ms [m]",
             title="soft cables")  # fmt: skip


def _draw_scenarios(axes: Any, runs: Runs) -> None:
    """How far the engines part in each scenario that ships."""
    if runs.has(kind="scenario"):
        some = runs(kind="scenario")
        names = some.list("scenario")
        axes.barh(names, 1e6 * some["distance_m"], label="on the path", **bar_style(nth_look(0)))
        axes.barh(
            names, 1e6 * some["final_distance_m"], height=0.4, label="at the end",
            **bar_style(nth_look(1)),
        )  # fmt: skip
        axes.set_xscale("log")
        axes.set_ylim(-0.8, len(names) - 0.2)
        axes.tick_params(axis="y", labelsize=8)
        axes.legend(  # bars fill the axes
            loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=6.0, fontsize=8, ncols=2
        )
    axes.set(xlabel="distance of the engines [µm]", title="scenarios that ship")


def _draw_impacts(axes: Any, runs: Runs) -> None:
    """Distances of many runs in which cables catch the platform, sorted."""
    if runs.has(kind="impacts"):
        some = runs(kind="impacts")
        whats = (("distance_m", "on the path"), ("final_distance_m", "at the end"))
        for k, (what, label) in enumerate(whats):
            sizes = np.sort(1e6 * some[what])
            axes.semilogy(sizes, label=label, **line_style(nth_look(k)))
    axes.set(xlabel="runs, sorted", ylabel="distance of the engines [µm]",
             title="servo, cables paid out at random")  # fmt: skip


def _draw_energy(axes: Any, runs: Runs) -> None:
    """What the integration adds to the energy, by step."""
    if runs.has(kind="energy"):
        some = runs(kind="energy")
        steps = 1e3 * some["step_s"]
        for k, (column, label) in enumerate((("least_gain", "least"), ("largest_gain", "largest"))):
            look = nth_look(k)
            axes.semilogx(steps, some[column], marker=look.marker, label=label, **line_style(look))
        _name_steps(axes, steps)
    axes.set(xlabel="step [ms]", ylabel="change of energy over that of the fall [-]",
             title="real stiffness, undamped, runge_kutta3")  # fmt: skip


def _name_steps(axes: Any, steps: Array) -> None:
    """Numbers at the steps that were taken, and nowhere else."""
    axes.set_xticks(steps)
    axes.xaxis.set_minor_locator(NullLocator())
    plain_numbers(axes.xaxis)
