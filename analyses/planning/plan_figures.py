"""What figures of plans share: curves over time in panels, and bars of limits that are reached."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    bare_figure,
    curves,
    draw_bars,
    line_style,
    panels,
    styled,
)
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, PLATFORM, Look, nth_look
from cdpr_drake.planning.path_task import MotionSamples

CROWDED = 24  # rows of limits that a figure shows; of more, those that are reached longest


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over time.

    Attributes:
        label: Quantity and unit.
        curves: Values by name, shape (n,) each.
        bounds: Values of lines across.
        bound: What the legend calls these.
        knots: Instants to mark on the lower edge [s].
    """

    label: str
    curves: Mapping[str, Array]
    bounds: Sequence[float] = ()
    bound: str = "limit"
    knots: Array | None = None

    def draw(self, axes: Any, times: Array, legend: bool = True) -> None:
        """Draws the curves on axes; times of shape (n,) [s]."""
        curves(axes, times, np.column_stack([*self.curves.values()]), [*self.curves])
        for k, value in enumerate(self.bounds):
            style = line_style(BOUND) | {"linewidth": 1.2, "zorder": 1}
            axes.axhline(value, label=None if k else self.bound, **style)
        if self.knots is not None:
            axes.plot(
                self.knots, np.zeros(len(self.knots)), "|", label="knots", markersize=10.0,
                transform=axes.get_xaxis_transform(), color=BOUND.color, clip_on=False,
            )  # fmt: skip
        axes.set_ylabel(self.label)
        axes.margins(x=0.01)
        if legend:
            axes.legend(**LEGEND_BESIDE)


def panel_figure(
    title: str, size: tuple[float, float], times: Array, rows: Sequence[Panel],
    one_legend: bool = False,
) -> Figure:  # fmt: skip
    """Panels one below the other, of a size [inch]; with one legend it is that of the first."""
    figure, places = panels(len(rows), 1, size, title, share_x=True)
    with styled():
        for number, (axes, panel) in enumerate(zip(places, rows, strict=True)):
            panel.draw(axes, times, legend=not (one_legend and number))
        places[-1].set_xlabel("time [s]")
    return figure


def reached_figure(
    title: str, robot: Robot, samples: MotionSamples, along: Array, xlabel: str, height: float,
    draw: Callable[[Any], None],
) -> Figure:  # fmt: skip
    """Axes above bars of the limits that are reached along times or places, shape (n,).

    Args:
        title: Title.
        robot: The robot.
        samples: What its motion needs.
        along: Times or places of the samples.
        xlabel: Label of these.
        height: Of the axes [inch].
        draw: Draws on the axes.
    """
    rows = reached_rows(robot, samples)
    band = 0.8 + 0.24 * max(len(rows), 1)
    figure = bare_figure((11.0, height + 1.0 + band), title)
    with styled():
        axes, bars = figure.subplots(2, 1, sharex=True, height_ratios=(height, band))
        draw(axes)
        draw_bars(bars, along, rows)
        bars.set(xlabel=xlabel, ylabel="limit reached")
        axes.margins(x=0.01)
    return figure


def reached_rows(robot: Robot, samples: MotionSamples) -> list[tuple[str, Look, Array]]:
    """Limits that are reached: name, look, and whether it is at each sample, shape (n,)."""
    rows: list[tuple[str, Look, Array]] = []
    for name, holds in samples.active().items():
        by_cable = holds.shape[1] == len(robot.cables)
        for k in np.flatnonzero(np.any(holds, axis=0)).tolist():
            cable, look = (f"{robot.cables[k].name} ", nth_look(k)) if by_cable else ("", PLATFORM)
            rows.append((f"{cable}{name}", look, holds[:, k]))
    longest = sorted(range(len(rows)), key=lambda i: -float(np.sum(rows[i][2])))[:CROWDED]
    return [rows[i] for i in sorted(longest)]


def thick(look: Look) -> dict[str, Any]:
    """Style of a path."""
    return line_style(look) | {"linewidth": 2.4, "marker": ""}
