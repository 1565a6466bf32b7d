"""Figures of case studies in the layout of the published ones, so that both lie side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import lcm
from typing import Any

from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.cable_figures import cable_panels
from cdpr_drake.analyses.studies.framework.case_panels import (
    Draw,
    Scene,
    Shown,
    draw_camera_deviation,
    draw_camera_paths,
    draw_image_deviation,
    draw_image_paths,
    legend_below,
    sorted_legend,
)
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled

PANEL = (6.6, 5.0)
"""Size of a panel [inch]."""

Find = Callable[[Sequence[str]], Shown]
"""Those of some configurations that were run, as a panel shows them."""


@dataclass(frozen=True)
class Panel:
    """A panel of a published figure.

    Attributes:
        draw: What fills it.
        of: Names of the configurations that it shows.
        words: Above it, after its letter; empty: the words of its one configuration.
        letter: Its letter in the published figure; empty where that has none.
        space: Whether its axes are in space.
        times: Moments that are marked, on an axis of time [s].
    """

    draw: Draw
    of: tuple[str, ...]
    words: str = ""
    letter: str = ""
    space: bool = False
    times: tuple[float, ...] = ()


@dataclass(frozen=True)
class PanelLayout:
    """A published figure as rows of panels.

    Attributes:
        title: What it shows, with its number.
        rows: Of panels; rows may differ in their number.
        height: Of a row, over that of `PANEL`.
    """

    title: str
    rows: tuple[tuple[Panel, ...], ...]
    height: float = 1.0

    def figure(self, find: Find, runs: Runs) -> Figure:
        """Draws it from runs; panels of which nothing was run are left out.

        Raises:
            MissingRuns: Nothing of it was run, or runs have not what a panel shows.
        """
        rows = [[(panel, find(panel.of)) for panel in row] for row in self.rows]
        rows = [[(panel, shown) for panel, shown in row if shown] for row in rows]
        rows = [row for row in rows if row]
        if not rows:
            raise MissingRuns(self.title)
        width = max(len(row) for row in rows)
        size = (max(PANEL[0] * width, 8.0), self.height * PANEL[1] * len(rows) + 1.6)
        figure, columns = bare_figure(size, self.title), lcm(*(len(row) for row in rows))
        with styled():
            grid = figure.add_gridspec(len(rows), columns)
            panels = []
            for number, row in enumerate(rows):
                step = columns // len(row)
                for place, (panel, shown) in enumerate(row):
                    where = grid[number, place * step : (place + 1) * step]
                    panels.append(_fill(figure, where, panel, Scene(shown, runs)))
        legend_below(figure, *sorted_legend(panels))
        return figure


@dataclass(frozen=True)
class CableLayout:
    """A published figure with a panel for each cable.

    Attributes:
        title: What it shows, with its number.
        quantity: Name in `cable_figures.QUANTITIES`.
        of: Names of the configurations that it shows.
    """

    title: str
    quantity: str
    of: tuple[str, ...]

    def figure(self, find: Find, runs: Runs) -> Figure:
        """Draws it from runs.

        Raises:
            MissingRuns: Nothing of it was run, or runs have not that quantity.
        """
        shown = find(self.of)
        figure = cable_panels(self.title, list(shown), self.quantity) if shown else None
        if figure is None:
            raise MissingRuns(self.title)
        return figure


Layout = PanelLayout | CableLayout


def paths_layout(title: str, of: tuple[str, ...]) -> PanelLayout:
    """Paths in the image and in space, each beside its distance from the straight line: (a) to (d)
    as figures 3.39, 4.3 to 4.5, 4.7 and 5.24 of the servoing thesis."""
    return PanelLayout(
        title,
        (
            (
                Panel(draw_image_paths, of, "path of the object's centre in the image", "a"),
                Panel(draw_image_deviation, of, "distance from its straight line", "b"),
            ),
            (
                Panel(draw_camera_paths, of, "path of the camera", "c", space=True),
                Panel(draw_camera_deviation, of, "distance from its straight line", "d"),
            ),
        ),
    )


def each(draw: Draw, of: Sequence[str], columns: int = 3) -> tuple[tuple[Panel, ...], ...]:
    """Rows of panels, one a configuration, lettered (a), (b), ..."""
    panels = [Panel(draw, (name,), letter=chr(ord("a") + k)) for k, name in enumerate(of)]
    return tuple(tuple(panels[k : k + columns]) for k in range(0, len(panels), columns))


def _fill(figure: Figure, where: Any, panel: Panel, scene: Scene) -> Any:
    axes: Any = figure.add_subplot(where, projection="3d" if panel.space else None)
    panel.draw(axes, scene)
    for time in panel.times:
        axes.axvline(time, color="#303030", linestyle=":", linewidth=1.2)
    words = panel.words or scene.shown[0][0].label
    axes.set_title(f"({panel.letter}) {words}" if panel.letter else words, fontsize=11)
    return axes
