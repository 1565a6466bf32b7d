"""Figures with one curve a cable: tensions with their bounds, slack cables, lengths, speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    bare_figure,
    draw_bars,
    draw_curve,
    line_style,
    phase_of,
    shade,
    styled,
)
from cdpr_drake.analyses.frame.thinning import by_pieces, envelope
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look

NEAR = 1.5
"""Bounds up to so many times the largest tension are drawn; a farther one would press the curves
flat, and is put into words."""


BAND_ALPHA = 0.35
"""Of the band in which values chatter."""


class HasCables(Protocol):
    """A robot or a mechanism: its cables have names."""

    @property
    def cables(self) -> Sequence[Any]:
        """The cables, in the order of all vectors of m."""


def cable_figure(
    title: str, robot: HasCables, log: Mapping[str, Array], quantity: str, label: str, *,
    scale: float = 1.0, bounds: tuple[float, float] | None = None,
) -> Figure:  # fmt: skip
    """One curve a cable; below tensions, bars show when each cable is slack.

    Args:
        title: Title.
        robot: The robot or mechanism.
        log: "time", shape (n,) [s], "slack" and the quantity, shape (n, m).
        quantity: Its name in the log.
        label: Words and unit of its axis.
        scale: Factor from the log's unit to the unit of the axis.
        bounds: Smallest and largest tension [N], for tensions; None: no bounds and no bars, and the
            times in which a cable is slack are shaded.
    """
    times, slack = log["time"], log["slack"]
    any_slack = by_pieces(lambda rows: np.any(rows > 0.0, axis=1), slack[:-1])
    with_bars = bounds is not None and bool(np.any(any_slack))
    heights = [4.2, 0.5 + 0.2 * len(robot.cables)] if with_bars else [1.0]
    extra = 0.5 + 0.22 * len(robot.cables) if with_bars else 0.0
    figure = bare_figure((10.0, 5.0 + extra), title)
    with styled():
        panels = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights, squeeze=False)
        axes, last = panels[0, 0], panels[-1, 0]
        draw_cables(axes, robot, times, log[quantity], scale)
        if bounds is not None:
            _draw_bounds(axes, bounds, words="" if with_bars else "no cable is slack")
        elif len(any_slack):
            shade(axes, times, np.append(any_slack, False), "some cable slack")
        axes.set(ylabel=label)
        last.set(xlabel="time [s]")
        axes.margins(x=0.01)
        axes.legend(**LEGEND_BESIDE)
        if with_bars:
            rows = [(c.name, nth_look(k), slack[:, k]) for k, c in enumerate(robot.cables)]
            draw_bars(last, times, rows)
            last.set_ylabel("slack cable")
    return figure


def draw_cables(
    axes: Any, robot: HasCables, times: Array, values: Array, scale: float = 1.0
) -> None:
    """Draws a curve for each cable in its own look; values of shape (n, m).

    A cable whose values chatter has a curve of their means, in a pale band between their extremes.
    """
    count, bands = len(robot.cables), 0
    for k, cable in enumerate(robot.cables):
        look, phase, chatter = nth_look(k), phase_of(k, count), envelope(values[:, k])
        if chatter is None:
            draw_curve(axes, times, values[:, k], look, cable.name, scale=scale, phase=phase)
            continue
        bands += 1
        rows, low, means, high = chatter
        band = {"color": look.color, "alpha": BAND_ALPHA, "linewidth": 0.0}
        axes.fill_between(times[rows], scale * low, scale * high, **band)
        draw_curve(axes, times[rows], means, look, cable.name, scale=scale, phase=phase)
    if bands:
        axes.fill_between([], [], color="0.8", label="band: extremes,\ncurve in it: means")


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
