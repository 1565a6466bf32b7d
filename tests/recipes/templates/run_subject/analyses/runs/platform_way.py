"""How far the platform went in a run."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import draw_curve, new_figure
from cdpr_drake.analyses.runs.run import Run, Subject
from cdpr_drake.arrays import Array
from cdpr_drake.palette import DISTANCE


def way(run: Run) -> Array:
    """Length of the path of Po up to each row of the log, shape (n,) [m]."""
    steps = np.linalg.norm(np.diff(run.log["X_WP"][:, 4:], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def numbers(run: Run) -> dict[str, Any]:
    """Length of the whole path."""
    return {"length_m": float(way(run)[-1])}


def figure(run: Run) -> Figure:
    """Length of the path over time."""
    drawn, axes = new_figure(1, 1, (8.0, 4.0), run.title("Way of the platform"))
    draw_curve(axes, run.log["time"], way(run), DISTANCE)
    axes.set(xlabel="time [s]", ylabel="way of P [m]")
    return drawn


WAY = Subject("platform_way", numbers, {"platform_way": figure})
