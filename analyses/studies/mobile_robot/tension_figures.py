"""Tensions during single laps, as figures 2.18, 5.22 and 5.23 of the servoing thesis."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.mobile_robot.laps import PHASES, TENSION_LAPS, THRESHOLD
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look

TENSIONS: dict[str, tuple[str, str, tuple[int, ...]]] = {
    "tensions_estimator": ("estimator cable_lengths", "figure 2.18, Est. 4, no known tag", (1, 2)),
    "tensions_plain": ("plain", "figure 5.22, no correction", (1, 10, 20)),
    "tensions_corrected": ("corrected", "figure 5.23, with correction", (1, 10, 30)),
}
"""Figures by name: configuration, words, laps that the thesis shows beside the last one."""


def panels_of(run: Run, laps: tuple[int, ...]) -> dict[int, Array]:
    """Tensions of laps that a run got to, and of its last whole one, (PHASES, m) [N]."""
    tensions = run["tensions_n"]
    panels = {lap: tensions[TENSION_LAPS.index(lap)] for lap in laps}
    panels[max(int(run["laps_done"] + 1e-9), 1)] = tensions[-1]
    return {lap: rows for lap, rows in sorted(panels.items()) if np.any(np.isfinite(rows))}


def tensions_figure(name: str, runs: Runs) -> Figure:
    """One of `TENSIONS`, of the first run of its configuration."""
    configuration, words, laps = TENSIONS[name]
    panels = panels_of(runs(configuration=configuration).rows[0], laps)
    rows = -(-len(panels) // 2)
    figure, grid = new_figure(
        rows, 2, (14.0, 1.8 + 3.6 * rows), f"Cable tensions behind a mobile robot, {words}"
    )
    flat = list(np.ravel(grid))
    where = (np.arange(PHASES) + 0.5) / PHASES
    for axes, (lap, tensions) in zip(flat, panels.items(), strict=False):
        count = tensions.shape[1]
        for k in range(count):
            draw_curve(
                axes, where, tensions[:, k], nth_look(k), f"cable {k + 1}",
                phase=phase_of(k, count), linewidth=1.2, markersize=4.0,
            )  # fmt: skip
        axes.axhline(THRESHOLD, **line_style(BOUND), label="threshold of the correction")
        axes.set_title(f"lap {lap}")
        axes.set(xlabel="part of the lap [-]", ylabel="tension [N]", xlim=(0.0, 1.0))
    for axes in flat[len(panels) :]:
        axes.remove()
    figure.legend(*flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return figure
