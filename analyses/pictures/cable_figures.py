"""Figures that every run of a cable robot has: one curve a cable, and paths in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdpr_drake.analyses.pictures.figure_style import bare_figure, new_figure, shade_slack
from cdpr_drake.analyses.reporting import Log
from cdpr_drake.arrays import Array
from cdpr_drake.cables import KELVIN_VOIGT, cable_curves
from cdpr_drake.geometry import CableSet
from cdpr_drake.models import Robot
from cdpr_drake.spatial import pose_from_row


@dataclass(frozen=True)
class Path3D:
    """A path in W to draw: points of shape (n, 3) [m], its label, colour and line style."""

    points: Array
    label: str
    color: str
    style: str


def cable_figure(
    title: str, robot: Robot, log: Log, quantity: str, label: str, scale: float = 1.0
) -> Figure:
    """One curve a cable, with the times shaded in which some cable is slack.

    Args:
        title: Title.
        robot: The robot.
        log: "time", shape (n,) [s], "slack" and the quantity, shape (n, m).
        quantity: Its name in the log.
        label: Words and unit of its axis.
        scale: Factor from the log's unit to that of the axis.
    """
    figure, axes = new_figure(1, 1, (10.0, 5.0), title)
    times, values = log["time"], log[quantity]
    for k, cable in enumerate(robot.cables):
        axes.plot(times, scale * values[:, k], color=f"C{k % 10}", label=cable.name)
    shade_slack(axes, times, log["slack"])
    axes.set(xlabel="time [s]", ylabel=label)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def path_figure(
    title: str, robot: Robot, cables: CableSet, log: Log, paths: list[Path3D]
) -> Figure:
    """Paths in 3D: with the whole robot, its cables as they are at the end, and close up."""
    figure = bare_figure((13.0, 6.5), title)
    whole = figure.add_subplot(1, 2, 1, projection="3d")
    close = figure.add_subplot(1, 2, 2, projection="3d")
    for axes in (whole, close):
        for path in paths:
            axes.plot(*path.points.T, path.style, color=path.color, linewidth=1.8, label=path.label)
    _draw_cables(whole, cables, log)
    _set_box(whole, robot.frame.lower, robot.frame.upper)
    points = np.vstack([path.points for path in paths])
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.55 * max(float(np.max(high - low)), 1e-3)
    _set_box(close, (low + high) / 2.0 - half, (low + high) / 2.0 + half)
    figure.legend(*close.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _draw_cables(axes: Any, cables: CableSet, log: Log) -> None:
    """Cables at the end of the run, drawn straight behind their pulleys, red where slack."""
    X_WP = pose_from_row(log["X_WP"][-1])
    straight = cable_curves(cables, KELVIN_VOIGT, X_WP, np.zeros(cables.count))
    for curve, slack in zip(straight, log["slack"][-1], strict=True):
        axes.plot(*curve, color="C3" if slack else "0.35", linewidth=0.9)


def _set_box(axes: Any, lower: Array, upper: Array) -> None:
    axes.set(
        xlim=(lower[0], upper[0]),
        ylim=(lower[1], upper[1]),
        zlim=(lower[2], upper[2]),
        xlabel="x [m]",
        ylabel="y [m]",
        zlabel="z [m]",
    )
    axes.set_box_aspect(upper - lower, zoom=0.92)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
