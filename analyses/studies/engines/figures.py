"""Figure of the study: orders of convergence, and how far pairs of runs part."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.pictures import new_figure, save_figure
from cdpr_drake.analyses.studies.engines.statements import column, scenario_names_in
from cdpr_drake.analyses.studies.engines.tasks import (
    CATCHING_ORDERS,
    ENERGY_STEPS,
    METHODS,
    TAUT_ORDERS,
)
from cdpr_drake.arrays import Array

MARKERS = ("o", "s", "^")


def write_engine_figures(folder: Path, found: Mapping[str, Mapping[str, Array]]) -> None:
    """Writes `engines.png` of the finished tasks into a folder that exists."""
    figure, axes = new_figure(2, 2, (13.0, 9.5), "Compiled engine beside the plant")
    kinds = (("order taut", TAUT_ORDERS, "-"), ("order catching", CATCHING_ORDERS, "--"))
    for name, task, style in kinds:
        if name in found:
            for k, method in enumerate(METHODS):
                axes[0, 0].loglog(
                    1e3 * np.array(task.steps()), found[name]["distance"][0, :, k], style,
                    color=f"C{k}", marker=MARKERS[k], label=f"{method}, {name.split()[1]}",
                )  # fmt: skip
    axes[0, 0].set(xlabel="step [ms]", ylabel="distance to the plant at 0.02 ms [m]",
                   title="soft cables")  # fmt: skip
    names = scenario_names_in(found)
    if names:
        pairs = np.array([found[f"scenario {name}"]["pairs"][0] for name in names])
        ends = column(pairs, "final_distance_m")
        axes[0, 1].barh(names, 1e6 * column(pairs, "distance_m"), color="C0", label="on the path")
        axes[0, 1].barh(names, 1e6 * ends, color="C1", height=0.4, label="at the end")
        axes[0, 1].set_xscale("log")
        axes[0, 1].tick_params(axis="y", labelsize=8)
    axes[0, 1].set(xlabel="distance of the engines [um]", title="scenarios that ship")
    if "impacts" in found:
        pairs = found["impacts"]["pairs"]
        for what, label in (("distance_m", "on the path"), ("final_distance_m", "at the end")):
            axes[1, 0].semilogy(np.sort(1e6 * column(pairs, what)), label=label)
    axes[1, 0].set(xlabel="runs, sorted", ylabel="distance of the engines [um]",
                   title="servo, cables paid out at random")  # fmt: skip
    if "energy" in found:
        rows = found["energy"]["energy"]
        axes[1, 1].semilogx(1e3 * np.array(ENERGY_STEPS), rows[:, 1], "o-", label="least")
        axes[1, 1].semilogx(1e3 * np.array(ENERGY_STEPS), rows[:, 0], "s-", label="largest")
    axes[1, 1].set(xlabel="step [ms]", ylabel="change of energy over that of the fall",
                   title="real stiffness, undamped, runge_kutta3")  # fmt: skip
    for one in axes.ravel():
        if one.get_legend_handles_labels()[0]:
            one.legend(loc="best", fontsize=8)
    save_figure(figure, folder / "engines.png")
