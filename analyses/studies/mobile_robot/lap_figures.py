"""Figures 5.19 to 5.21 of the servoing thesis: paths of the platform and sums of lengths by lap."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.mobile_robot.laps import PHASES, SHOWN
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import nth_look

PATHS = {
    "paths_plain": ("plain", "Figure 5.19: path of the platform from above, no correction"),
    "paths_corrected": ("corrected", "Figure 5.20: path of the platform from above, corrected"),
}
"""Figures by name: configuration, title."""

LENGTH_LAPS = (10, 20)
"""Laps of which sums are drawn, beside the last one that was begun."""

LOOKS = {"plain": ("no correction", 0), "corrected": ("with correction", 4)}
"""Words, and number of the first look."""


def paths_figure(name: str, runs: Runs) -> Figure:
    """Paths of the first run of a configuration in the laps `SHOWN` and its last whole one."""
    configuration, title = PATHS[name]
    run = runs(configuration=configuration).rows[0]
    figure, axes = new_figure(1, 1, (9.0, 7.6), f"{title}, first run")
    last = max(int(run["laps_done"] + 1e-9), 1)
    laps = dict(zip((*SHOWN, last), run["paths_m"], strict=True))
    for number, (lap, path) in enumerate(sorted(laps.items())):
        there = np.all(np.isfinite(path), axis=1)
        if not np.any(there):
            continue
        closed = path[[*range(PHASES), 0]] if np.all(there) else path[there]
        look = nth_look(number)
        axes.plot(
            closed[:, 0], closed[:, 1], **line_style(look), label=f"lap {lap}",
            marker=look.marker, markevery=(2 * number, 8), markerfacecolor="white", markersize=5.0,
        )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x in W [m]", ylabel="y in W [m]")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="center")
    return figure


def lengths_figure(runs: Runs) -> Figure:
    """Sums of lengths over single laps, of the first run without and with correction."""
    if not any(runs.has(configuration=name) for name in LOOKS):
        raise MissingRuns(", ".join(LOOKS))
    figure, axes = new_figure(
        1, 1, (11.0, 6.6), "Figure 5.21: sum of the cable lengths during single laps, first run"
    )
    where = (np.arange(PHASES) + 0.5) / PHASES
    for name, (words, first) in LOOKS.items():
        if not runs.has(configuration=name):
            continue
        sums = runs(configuration=name).rows[0]["sums_m"]
        begun = np.flatnonzero(np.any(np.isfinite(sums), axis=1)) + 1
        laps = sorted({*(lap for lap in LENGTH_LAPS if lap in begun), *begun[-1:].tolist()})
        for number, lap in enumerate(laps):
            draw_curve(
                axes, where, sums[lap - 1], nth_look(first + number), f"{words}, lap {lap}",
                phase=phase_of(first + number, 8),
            )  # fmt: skip
    axes.set(xlabel="part of the lap [-]", ylabel="sum of the cable lengths [m]", xlim=(0.0, 1.0))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")
    return figure
