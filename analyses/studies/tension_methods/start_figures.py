"""Largest tensions over where a run starts: tables, and a figure with the printed ones."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.tension_methods.experiments import THESIS_ROBOT
from cdpr_drake.analyses.studies.tension_methods.start_experiments import (
    GAINS,
    ONE_STEP,
    PRINTED,
    START_ERROR,
    START_EXPERIMENTS,
)
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND, DASHED, Look, nth_look

TITLE = (
    "Largest tension over the start error, {0}\n"
    "lines with symbols: found; thin, with the symbol at their end: Gazebo thesis; crossed: lost"
)

DRAWN = 2e4
"""Larger tensions, of platforms that are lost, are drawn as this [N]."""

PRINTED_AT = 1.04
"""Where the printed values' symbols stand, as a share of the panel's width."""


def start_tables(runs: Runs) -> list[Table]:
    """Of each experiment a table: a row for each start and method, a column for each gain."""
    tables = []
    there = dict(runs.by("experiment"))
    for name, meaning in START_EXPERIMENTS.items():
        if name not in there:
            continue
        table = new_table(
            f"{name}: {meaning}",
            ("start", "balance", "between", "method"),
            ("rate [Hz]", *(f"Kp {gain:g} [N]" for gain in GAINS), "printed [N]", "turn [deg]"),
        )
        for keys, some in there[name].by(
            "start", "balance", "between", "method", "control_rate_hz"
        ):
            start, balance, between, method, rate = keys
            by_gain = {run["kp_per_s2"]: run for run in some}
            table.add_row(
                start, balance, between, method, f"{rate:g}",
                *(
                    f"{by_gain[gain]['tension_max_n']:.4g}" + " lost" * by_gain[gain]["lost"]
                    if gain in by_gain else "-"
                    for gain in GAINS
                ),
                ", ".join(f"{one:g}" for one in PRINTED[method]),
                f"{np.degrees(some.largest('turn_max_rad')):.3g}",
            )  # fmt: skip
        tables.append(table)
    return tables


def start_figure(all_runs: Runs) -> Figure:
    """Largest tension over the start error; a row for rows and rate, a column for a method."""
    runs = all_runs(experiment=START_ERROR)
    groups = dict(runs.by("balance", "control_rate_hz"))
    figure, grid = new_figure(
        len(groups),
        len(PRINTED),
        (14.0, 1.8 + 2.9 * len(groups)),
        TITLE.format("by method and gain"),
    )
    panels = np.reshape(np.array(grid, object), (len(groups), len(PRINTED)))
    for line, ((balance, rate), some) in zip(panels, groups.items(), strict=True):
        rows = "six rows" if balance == "wrench" else "three rows"
        for axes, (method, printed) in zip(line, PRINTED.items(), strict=True):
            _panel(axes, some(method=method), printed)
            axes.set_title(f"{method.replace('_', ' ')}, {rows}, {rate:g} Hz", fontsize=10)
        line[0].set_ylabel("largest tension [N]")
    low = min(axes.get_ylim()[0] for axes in panels.flat)
    high = max(axes.get_ylim()[1] for axes in panels.flat)
    for axes in panels.flat:
        axes.set_ylim(low, high)
    for axes in panels[-1]:
        axes.set_xlabel("start error [m]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _panel(axes: Axes, runs: Runs, printed: tuple[float, ...]) -> None:
    for number, (gain, value) in enumerate(zip(GAINS, printed, strict=True)):
        some = [run for run in runs if run["kp_per_s2"] == gain]
        if not some:
            continue
        some.sort(key=lambda run: run["start_error_m"])
        look = nth_look(number)
        errors = [run["start_error_m"] for run in some]
        sizes = [min(run["tension_max_n"], DRAWN) for run in some]
        found = line_style(look) | {"marker": look.marker, "markersize": 5.0}
        axes.plot(errors, sizes, label=f"Kp = Kd = {gain:g}", **found)
        lost = [(e, t) for e, t, run in zip(errors, sizes, some, strict=True) if run["lost"]]
        if lost:
            axes.plot(*zip(*lost, strict=True), "x", color="black", markersize=10.0)
        mark = Look(look.color, DASHED, look.marker)
        axes.axhline(value, **line_style(mark) | {"linewidth": 1.0, "marker": ""})
        axes.plot(
            PRINTED_AT, value, transform=axes.get_yaxis_transform(), clip_on=False, linestyle="",
            marker=look.marker, color=look.color, markerfacecolor="white",
        )  # fmt: skip
    bound = load_robot(THESIS_ROBOT).tension_limits()[1]
    axes.axhline(bound, label=f"upper bound {bound:g} N", **line_style(BOUND))
    axes.set_yscale("log")


def one_step_figure(all_runs: Runs) -> Figure:
    """Largest tensions where forces act for a tenth of the time, a panel for each method."""
    runs = all_runs(experiment=ONE_STEP)
    figure, grid = new_figure(
        1, len(PRINTED), (14.0, 4.8), "Largest tension where forces act for 1 ms of 10 ms"
    )
    for axes, (method, printed) in zip(
        np.ravel(np.array(grid, object)), PRINTED.items(), strict=True
    ):
        for number, ((start, between), some) in enumerate(
            runs(method=method).by("start", "between")
        ):
            pairs = sorted((run["kp_per_s2"], min(run["tension_max_n"], DRAWN)) for run in some)
            label, look = f"start: {start}; between: {between}", nth_look(number)
            found = line_style(look) | {"marker": look.marker, "markersize": 5.0}
            axes.plot(*zip(*pairs, strict=True), label=label, **found)
        axes.plot(GAINS, printed, "k*", markersize=12.0, label="Gazebo thesis")
        axes.set(yscale="log", xlabel="Kp = Kd")
        axes.set_title(method.replace("_", " "), fontsize=10)
    first = figure.axes[0]
    first.set_ylabel("largest tension [N]")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
