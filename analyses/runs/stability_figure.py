"""The figure of stability along a run: cables that pull, rank, margin."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.pictures import draw_curve, line_style, new_figure, shade
from cdpr_drake.analyses.runs.run_stability import StabilityAlong
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, DISTANCE, LOST, PLATFORM

DEEPEST = -1.5
"""Least margin that is drawn to scale [-]: nearly singular rows make it as low as one likes."""


def stability_figure(title: str, along: StabilityAlong) -> Figure:
    """Number of cables that pull, rank of the Jacobian and margin of the criterion over time; red
    and hatched where the rank is less than the platform's degrees of freedom."""
    figure, axes = new_figure(3, 1, (10.0, 9.0), title)
    lost = along.rank < along.freedom
    needed = f"holds the platform: {along.freedom}"
    most = max(float(np.max(along.taut)), along.freedom) + 0.5
    for panel, values, label in (
        (axes[0], along.taut, "cables that pull [-]"),
        (axes[1], along.rank, "rank of the Jacobian [-]"),
    ):
        draw_steps(panel, along.time, values, lost)
        panel.axhline(along.freedom, label=needed, **line_style(BOUND))
        panel.set(ylabel=label, ylim=(-0.2, most), yticks=range(int(most) + 1))
    shown = np.maximum(along.margin, DEEPEST)
    draw_curve(axes[2], along.time, shown, DISTANCE, "margin")
    axes[2].axhline(0.0, label="stable above 0", **line_style(BOUND))
    axes[2].set(ylabel="least eigenvalue of sym(Pi) [-]")
    if np.nanmin(along.margin, initial=np.inf) < DEEPEST:
        axes[2].set_title(
            f"least {np.nanmin(along.margin):.2f}, cut off at {DEEPEST:g}", fontsize=9
        )
    for panel in axes:
        shade(panel, along.time, lost, f"rank below {along.freedom}", LOST)
        panel.set(xlim=(along.time[0], along.time[-1]))
        panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    axes[-1].set(xlabel="time [s]")
    return figure


def draw_steps(axes: Any, times: Array, values: Array, lost: np.ndarray) -> None:
    """A whole number over time, shape (n,), thick and red where the rank is lost."""
    axes.step(times, values, where="post", **line_style(PLATFORM) | {"marker": ""})
    red = np.where(lost, values, np.nan)
    axes.step(times, red, where="post", color=LOST.color, linewidth=3.0)
