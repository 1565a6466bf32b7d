"""What the estimate of the wrench on a platform was worth in a run: numbers and a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake import palette
from cdpr_drake.analyses.frame.figures import line_style, new_figure
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.arrays import Array
from cdpr_drake.palette import IDEAL
from cdpr_drake.sections.wrench_estimation.section import ESTIMATED, SIGMA, SKIPPED
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH

WRENCH_PARTS = (("force", "n", slice(3, 6)), ("moment", "nm", slice(0, 3)))
"""Force and moment of a spatial force, and their units in keys."""


def true_wrench(log: Mapping[str, Array]) -> Array:
    """Wrench that sections push the platform with, shape (n, 6) [N m, N]; zeros where none does."""
    if APPLIED_WRENCH in log:
        return np.asarray(log[APPLIED_WRENCH])
    return np.zeros_like(log[ESTIMATED])


def wrench_numbers(run: Run) -> dict[str, Any]:
    """Errors of the estimate against the true wrench, which is delayed as the estimate is."""
    section, log, time = run.scenario.wrench_estimation, run.log, run.log["time"]
    delay = section.response().delay
    true = np.column_stack([np.interp(time - delay, time, row) for row in true_wrench(log).T])
    errors = np.asarray(log[ESTIMATED]) - true
    no_pose, no_direction = (int(x) for x in log[SKIPPED][-1])
    numbers: dict[str, Any] = {
        "kind": section.kind, "delay_s": delay,
        "samples_without_pose": no_pose, "samples_without_direction": no_direction,
    }  # fmt: skip
    for name, unit, part in WRENCH_PARTS:
        rms = np.sqrt(np.mean(np.sum(errors[:, part] ** 2, axis=1)))
        numbers[f"{name}_rms_{unit}"] = float(rms)
        numbers[f"{name}_bias_{unit}"] = np.mean(errors[:, part], axis=0).tolist()
        numbers[f"{name}_sigma_{unit}"] = np.mean(log[SIGMA][:, part], axis=0).tolist()
    return numbers


def wrench_figure(run: Run) -> Figure:
    """True and estimated force and moment over time, with three standard deviations of readings."""
    time, estimate, sigma = (run.log[name] for name in ("time", ESTIMATED, SIGMA))
    true = true_wrench(run.log)
    title = run.title("What pushes the platform beside its cables, true and estimated")
    figure, panels = new_figure(2, 3, (12.0, 6.4), title)
    for row, (name, _, part) in enumerate(WRENCH_PARTS):
        for k, axis in enumerate("xyz"):
            panel, column = panels[row, k], part.start + k
            low, high = (estimate[:, column] + s * 3.0 * sigma[:, column] for s in (-1.0, 1.0))
            panel.fill_between(time, low, high, color="0.85", label="3 sigma of readings")
            panel.plot(time, true[:, column], **line_style(IDEAL), label="that pushes")
            panel.plot(
                time, estimate[:, column], **line_style(palette.ESTIMATED), label="estimated"
            )
            panel.set(ylabel=f"force along {axis} [N]")
            if name == "moment":
                panel.set(xlabel="time [s]", ylabel=f"moment about {axis} [N m]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


SUBJECTS = (Subject("wrench_estimation", wrench_numbers, {"wrench": wrench_figure}),)
"""What a run reports of the section."""
