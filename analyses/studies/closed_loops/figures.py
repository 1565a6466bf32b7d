"""Figures of closed loops from a control stability workspace."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import OTHER_OUTCOME, OUTCOMES, Look
from cdpr_drake.systems.monitoring.run_monitor import Outcome

LEAST_DRAWN_SHARE = 1e-4
"""Smaller errors are not drawn."""


def error_figure(runs: Runs) -> Figure:
    """|e| of every loop over time."""
    modes = dict(runs.by("mode"))
    figure, panels = new_figure(
        1,
        len(modes),
        (_width(len(modes)), 5.0),
        "Feature error |e| of every closed loop, relative to its start",
    )
    for axes, (mode, some) in zip(np.ravel(panels), modes.items(), strict=True):
        for curve, outcome in zip(some["curve"], some.list("outcome"), strict=True):
            share = np.maximum(curve / max(curve[0], 1e-12), LEAST_DRAWN_SHARE)
            progress = np.linspace(0.0, 1.0, len(curve))
            style = line_style(_look(outcome)) | {"linewidth": 0.6, "alpha": 0.6}
            axes.plot(progress, share, **style)
        axes.set(
            yscale="log", xlabel="time / duration of the run [-]", ylim=(LEAST_DRAWN_SHARE, 3.0)
        )
        axes.set_title(mode)
    np.ravel(panels)[0].set_ylabel("|e| / |e| at the start [-]")
    _legend(figure, runs)
    return figure


def way_figure(runs: Runs) -> Figure:
    """Paths of the platform of every loop."""
    modes = dict(runs.by("mode"))
    figure, panels = new_figure(
        2,
        len(modes),
        (_width(len(modes)), 8.4),
        "Paths of the platform, Po, in the world frame W, from above and from the side",
    )
    grid = np.reshape(panels, (2, len(modes)))
    for column, (mode, some) in enumerate(modes.items()):
        for way, outcome in zip(some["way"], some.list("outcome"), strict=True):
            for axes, up in zip(grid[:, column], (5, 6), strict=True):
                look = _look(outcome)
                style = line_style(look) | {"linewidth": 0.6, "alpha": 0.6}
                axes.plot(way[:, 4], way[:, up], **style)
                axes.plot(*way[0, [4, up]], look.marker, color=look.color, markersize=3)
        for axes, name in zip(grid[:, column], "yz", strict=True):
            axes.set_aspect("equal")
            axes.set(xlabel="x in W [m]", ylabel=f"{name} in W [m]")
        grid[0, column].set_title(mode)
    _legend(figure, runs)
    return figure


def _width(modes: int) -> float:
    return max(7.0, 3.5 * modes)  # room for the title


def _look(outcome: str) -> Look:
    return OUTCOMES.get(outcome, OTHER_OUTCOME)


def _legend(figure: Figure, runs: Runs) -> None:
    there = sorted(runs.counts("outcome"), key=lambda word: Outcome[word.upper()])
    handles = [
        Line2D(
            [], [], marker=_look(word).marker, label=word.replace("_", " "),
            **line_style(_look(word)),
        )
        for word in there
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
