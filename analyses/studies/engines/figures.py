"""Figure of the study: orders of convergence, and how far pairs of runs part."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.engines.pairs import (
    CATCHING_ORDERS,
    ENERGY_STEPS,
    METHODS,
    TAUT_ORDERS,
)
from cdpr_drake.analyses.studies.engines.statements import column, scenario_names_in
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import DASHED, SOLID, nth_look


def engine_figure(found: Mapping[str, Mapping[str, Array]]) -> Figure:
    """Orders of convergence and distances of the finished tasks."""
    figure, axes = new_figure(2, 2, (13.0, 9.5), "Compiled engine beside the plant")
    kinds = (("order taut", TAUT_ORDERS, SOLID), ("order catching", CATCHING_ORDERS, DASHED))
    for name, task, dash in kinds:
        if name in found:
            for k, method in enumerate(METHODS):
                look = nth_look(k)
                axes[0, 0].loglog(
                    1e3 * np.array(task.steps()), found[name]["distance"][0, :, k], linestyle=dash,
                    color=look.color, marker=look.marker, label=f"{method}, {name.split()[1]}",
                )  # fmt: skip
    axes[0, 0].set(xlabel="step [ms]", ylabel="distance to the plant at 0.02 ms [m]",
                   title="soft cables")  # fmt: skip
    names = scenario_names_in(found)
    if names:
        pairs = np.array([found[f"scenario {name}"]["pairs"][0] for name in names])
        ends = column(pairs, "final_distance_m")
        axes[0, 1].barh(
            names, 1e6 * column(pairs, "distance_m"), label="on the path", **bar_style(nth_look(0))
        )
        axes[0, 1].barh(names, 1e6 * ends, height=0.4, label="at the end", **bar_style(nth_look(1)))
        axes[0, 1].set_xscale("log")
        axes[0, 1].tick_params(axis="y", labelsize=8)
    axes[0, 1].set(xlabel="distance of the engines [um]", title="scenarios that ship")
    if "impacts" in found:
        pairs = found["impacts"]["pairs"]
        whats = (("distance_m", "on the path"), ("final_distance_m", "at the end"))
        for k, (what, label) in enumerate(whats):
            sizes = np.sort(1e6 * column(pairs, what))
            axes[1, 0].semilogy(sizes, label=label, **line_style(nth_look(k)))
    axes[1, 0].set(xlabel="runs, sorted", ylabel="distance of the engines [um]",
                   title="servo, cables paid out at random")  # fmt: skip
    if "energy" in found:
        rows = found["energy"]["energy"]
        for k, (row, label) in enumerate(((1, "least"), (0, "largest"))):
            look = nth_look(k)
            axes[1, 1].semilogx(
                1e3 * np.array(ENERGY_STEPS), rows[:, row], marker=look.marker, label=label,
                **line_style(look),
            )  # fmt: skip
    axes[1, 1].set(xlabel="step [ms]", ylabel="change of energy over that of the fall",
                   title="real stiffness, undamped, runge_kutta3")  # fmt: skip
    for one in axes.ravel():
        if one.get_legend_handles_labels()[0]:
            one.legend(loc="best", fontsize=8)
    return figure
