"""What a run's estimate of the wrench on its platform was worth: numbers and a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.arrays import Array
from cdpr_drake.palette import ESTIMATED, IDEAL
from cdpr_drake.systems.estimators.wrench_estimator import (
    WRENCH_ESTIMATED,
    WRENCH_SIGMA,
    WRENCH_SKIPPED,
)
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH

PARTS = (("force", "n", slice(3, 6)), ("moment", "nm", slice(0, 3)))
"""Force and moment of a spatial force, and their units."""


def true_wrench(log: Log) -> Array:
    """What the section `disturbances` put on the platform, shape (n, 6) [N m, N]; else zeros."""
    if APPLIED_WRENCH in log:
        return np.asarray(log[APPLIED_WRENCH])
    return np.zeros_like(log[WRENCH_ESTIMATED])


def wrench_summary(log: Log, kind: str, delay: float) -> dict[str, Any]:
    """Errors of an estimate against what pushed the platform, as late as the estimate is.

    Args:
        log: The log.
        kind: Name of the observer.
        delay: By how much it shows a slow wrench late [s].
    """
    time, found = log["time"], np.asarray(log[WRENCH_ESTIMATED])
    true = np.column_stack([np.interp(time - delay, time, row) for row in true_wrench(log).T])
    wrong = found - true
    no_pose, no_direction = (int(x) for x in log[WRENCH_SKIPPED][-1])
    summary: dict[str, Any] = {
        "kind": kind, "delay_s": delay,
        "samples_without_pose": no_pose, "samples_without_direction": no_direction,
    }  # fmt: skip
    for name, unit, part in PARTS:
        summary[f"{name}_rms_{unit}"] = float(np.sqrt(np.mean(np.sum(wrong[:, part] ** 2, axis=1))))
        mean = np.mean(wrong[:, part], axis=0)
        summary[f"{name}_bias_{unit}"] = [float(x) for x in mean]
        sigma = np.mean(log[WRENCH_SIGMA][:, part], axis=0)
        summary[f"{name}_sigma_{unit}"] = [float(x) for x in sigma]
    return summary


def wrench_figure(title: str, log: Log) -> Figure:
    """True and estimated force and moment over time, with three standard deviations of readings."""
    time, found, sigma = log["time"], log[WRENCH_ESTIMATED], log[WRENCH_SIGMA]
    true = true_wrench(log)
    figure, panels = new_figure(2, 3, (12.0, 6.4), title)
    for row, (name, _, part) in enumerate(PARTS):
        unit = "N" if name == "force" else "N m"
        for k, axis in enumerate("xyz"):
            panel, column = panels[row, k], part.start + k
            low, high = (found[:, column] + s * 3.0 * sigma[:, column] for s in (-1.0, 1.0))
            panel.fill_between(time, low, high, color="0.85", label="3 sigma of readings")
            panel.plot(time, true[:, column], **line_style(IDEAL), label="that pushes")
            panel.plot(time, found[:, column], **line_style(ESTIMATED), label="estimated")
            panel.set(ylabel=f"{name} along {axis} [{unit}]")
            if name == "moment":
                panel.set(xlabel="time [s]", ylabel=f"moment about {axis} [{unit}]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
