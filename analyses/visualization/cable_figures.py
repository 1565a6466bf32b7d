"""Figures with one curve a cable: tensions with their bounds and who is slack when, lengths, ..."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.visualization.curves import (
    by_pieces,
    draw_bars,
    draw_curve,
    phase_of,
    shade,
)
from cdpr_drake.analyses.visualization.figure_style import bare_figure, line_style, styled
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look

NEAR = 1.5
"""A bound is drawn where it is at most this times as large as the largest tension; one farther off
would press the curves flat, and is put into words."""


class HasCables(Protocol):
    """A robot or a mechanism: its cables have names."""

    @property
    def cables(self) -> Sequence[Any]:
        """The cables, in the order of all vectors of m."""


def cable_figure(
    title: str,
    robot: HasCables,
    log: Mapping[str, Array],
    quantity: str,
    label: str,
    *,
    scale: float = 1.0,
    bounds: tuple[float, float] | None = None,
) -> Figure:
    """One curve a cable; of tensions also their bounds, and below which cable is slack and when.

    Args:
        title: Title.
        robot: The robot or mechanism.
        log: "time", shape (n,) [s], "slack" and the quantity, shape (n, m).
        quantity: Its name in the log.
        label: Words and unit of its axis.
        scale: Factor from the log's unit to that of the axis.
        bounds: Smallest and largest tension [N], for tensions; None: no bounds and no bars.
            Without, the times in which some cable is slack are shaded.
    """
    times, slack = log["time"], log["slack"]
    some_slack = by_pieces(lambda rows: np.any(rows > 0.0, axis=1), slack[:-1])
    bars = bounds is not None and bool(np.any(some_slack))
    figure = bare_figure((10.0, 5.0 + (0.5 + 0.22 * len(robot.cables)) * bars), title)
    with styled():
        if bars:
            heights = (4.2, 0.5 + 0.2 * len(robot.cables))
            axes, band = figure.subplots(2, 1, sharex=True, height_ratios=heights)
        else:
            axes = band = figure.subplots(1, 1)
        draw_cables(axes, robot, times, log[quantity], scale)
        if bounds is not None:
            _draw_bounds(axes, bounds, words="" if bars else "no cable is slack")
        elif len(some_slack):
            shade(axes, times, np.append(some_slack, False), "some cable slack")
        axes.set(ylabel=label)
        band.set(xlabel="time [s]")
        axes.margins(x=0.01)
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        if bars:
            rows = [(c.name, nth_look(k), slack[:, k]) for k, c in enumerate(robot.cables)]
            draw_bars(band, times, rows)
            band.set_ylabel("slack cable [-]")
    return figure


def draw_cables(
    axes: Any, robot: HasCables, times: Array, values: Array, scale: float = 1.0
) -> None:
    """Draws a curve for each cable in its own look; values of shape (n, m)."""
    count = len(robot.cables)
    for k, cable in enumerate(robot.cables):
        draw_curve(
            axes,
            times,
            values[:, k],
            nth_look(k),
            cable.name,
            scale=scale,
            phase=phase_of(k, count),
        )


def _draw_bounds(axes: Any, bounds: tuple[float, float], words: str) -> None:
    """The smallest and the largest tension as lines, or in words where far above the curves."""
    low, high = bounds
    _, top = axes.get_ylim()
    style = line_style(BOUND) | {"linewidth": 1.2, "zorder": 1}
    axes.axhline(low, label=f"lower bound {low:g} N", **style)
    if high <= NEAR * top:
        axes.axhline(high, label=f"upper bound {high:g} N", **style)
    else:
        axes.plot([], [], " ", label=f"upper bound {high:g} N\n(above the axis)")
    if words:
        axes.plot([], [], " ", label=words)
