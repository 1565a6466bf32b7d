"""Figures with a panel for each cable, as figures 5.11 to 5.13 and 5.25 of the servoing thesis."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.case_panels import Shown
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import BOUND

COLUMNS = 2
"""Panels side by side, as in the thesis."""

QUANTITIES = {
    "cable_lengths": ("unstrained_lengths", "cable length, unstrained [m]", 1.0),
    "cable_tensions": ("measured_tensions", "measured tension [N]", 1.0),
}
"""Of figures by name: name in the traces, label of the axis, factor."""

VELOCITIES = {"velocities": ("cable_velocities", "cable velocity [mm/s]", 1e3)}
"""The same, of what every study draws by configuration, too."""


def cable_panels(title: str, shown: Shown, name: str) -> Figure | None:
    """A panel a cable, a curve a configuration; None where not all runs have the quantity.

    Args:
        title: Of the study.
        shown: Configurations, the first run of each, how it looks in all figures.
        name: Of `QUANTITIES`, or "velocities".
    """
    quantity, label, factor = (QUANTITIES | VELOCITIES)[name]
    if any(quantity not in run.columns() for _, run, _ in shown):
        return None
    cables = load_robot(shown[0][1]["summary"]["robot"]).cables
    rows = -(-len(cables) // COLUMNS)
    words = f"{label[0].upper()}{label[1:].partition(' [')[0]}"
    figure = bare_figure((14.0, 2.6 * rows + 2.2), f"{words}, cable by cable\n{title}")
    grid: Any = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True)
    for k, cable in enumerate(cables):
        axes = grid.flat[k]
        for number, (configuration, run, look) in enumerate(shown):
            draw_curve(
                axes, run["time"], run[quantity][:, k], look, configuration.label,
                scale=factor, phase=phase_of(number, len(shown)), linewidth=1.0, markersize=4.0,
            )  # fmt: skip
        known = [
            run["tension_thresholds"]
            for _, run, _ in shown
            if "tension_thresholds" in run.columns()
        ]
        if name == "cable_tensions" and known:
            axes.axhline(known[0][-1, k], **line_style(BOUND), label="threshold")
        axes.set_title(cable.name, fontsize=10)
        axes.grid(alpha=0.3)
    for axes in grid.flat[len(cables) :]:
        axes.remove()
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    for axes in grid[:, 0]:
        axes.set_ylabel(label.replace(", unstrained", "").replace("measured ", ""))
    figure.legend(*grid.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
