"""Figures of closed loops from a control stability workspace: errors and paths of every loop."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.analyses.visualization.figure_style import line_style, new_figure
from cdpr_drake.palette import OTHER_OUTCOME, OUTCOMES, Look
from cdpr_drake.systems.monitoring.run_monitor import Outcome

LEAST_DRAWN_SHARE = 1e-4
"""Smaller errors are not drawn."""


def error_figure(rows: Frame, scheme: str) -> Figure:
    """|e| of every loop of a scheme over time."""
    modes = modes_of(rows, scheme)
    figure, panels = new_figure(
        1, len(modes), (_width(modes), 5.0),
        f"Feature error |e| of every closed loop, relative to its start, {scheme}",
    )  # fmt: skip
    for axes, (mode, some) in zip(np.ravel(panels), modes.items(), strict=True):
        for outcome, arrays in zip(some["outcome"], some["arrays"], strict=True):
            curve = arrays["curve"]
            share = np.maximum(curve / max(curve[0], 1e-12), LEAST_DRAWN_SHARE)
            axes.plot(np.linspace(0.0, 1.0, len(curve)), share, **_thin(look_of(outcome)))
        limits = (LEAST_DRAWN_SHARE, 3.0)
        axes.set(yscale="log", xlabel="time / duration of the run [-]", ylim=limits, title=mode)
    np.ravel(panels)[0].set_ylabel("|e| / |e| at the start [-]")
    _legend(figure, modes)
    return figure


def path_figure(rows: Frame, scheme: str) -> Figure:
    """Paths of the platform of every loop of a scheme."""
    modes = modes_of(rows, scheme)
    figure, panels = new_figure(
        2, len(modes), (_width(modes), 8.4),
        f"Paths of the platform, Po, in the world frame W, from above and from the side, {scheme}",
    )  # fmt: skip
    grid = np.reshape(panels, (2, len(modes)))
    for column, (mode, some) in enumerate(modes.items()):
        for outcome, arrays in zip(some["outcome"], some["arrays"], strict=True):
            look, way = look_of(outcome), arrays["way"]
            for axes, up in zip(grid[:, column], (5, 6), strict=True):
                axes.plot(way[:, 4], way[:, up], **_thin(look))
                axes.plot(*way[0, [4, up]], look.marker, color=look.color, markersize=3)
        for axes, name in zip(grid[:, column], "yz", strict=True):
            axes.set(aspect="equal", xlabel="x in W [m]", ylabel=f"{name} in W [m]")
        grid[0, column].set_title(mode)
    _legend(figure, modes)
    return figure


def modes_of(rows: Frame, scheme: str) -> dict[str, Frame]:
    """Loops of a scheme by mode."""
    some = rows[rows["scheme"] == scheme]
    if not len(some):
        raise NothingToDraw
    return dict([*some.groupby("mode", sort=False)])


def look_of(outcome: str) -> Look:
    """Look of curves by how their run ended."""
    return OUTCOMES.get(outcome, OTHER_OUTCOME)


def _thin(look: Look) -> dict[str, Any]:
    return line_style(look) | {"linewidth": 0.6, "alpha": 0.6}


def _width(modes: dict[str, Frame]) -> float:
    return max(7.0, 3.5 * len(modes))  # room for the title


def _legend(figure: Figure, modes: dict[str, Frame]) -> None:
    words = {outcome for some in modes.values() for outcome in some["outcome"]}
    handles = [
        Line2D([], [], marker=look_of(word).marker, label=word.replace("_", " "),
               **line_style(look_of(word)))
        for word in sorted(words, key=lambda word: Outcome[word.upper()])
    ]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
