"""How figures look, the same for all runs and studies."""

from __future__ import annotations

import warnings
from contextlib import AbstractContextManager
from io import BytesIO
from textwrap import fill
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine, LayoutEngine
from matplotlib.ticker import FuncFormatter, MaxNLocator

from cdpr_drake import palette
from cdpr_drake.palette import Look

CYCLE = (
    *palette.DASHES, (0.0, (7.0, 2.0, 1.0, 2.0, 1.0, 2.0)), (0.0, (10.0, 3.0)), (0.0, (3.0, 1.0)),
    (0.0, (1.0, 4.0)),
)  # fmt: skip
"""Dashes of curves that nobody chose a look for: none of two of the palette's colours is alike."""

STYLE: Any = {
    "font.size": 12,
    # Where nobody chooses a look, curves take those of the palette one after the other.
    "axes.prop_cycle": cycler(
        color=[palette.nth_look(k).color for k in range(len(palette.COLORS))],
        linestyle=CYCLE,
    ),
    "hatch.linewidth": 0.6,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "legend.fontsize": 10,
    "lines.linewidth": 1.4,
}

NO_LAYOUT: Any = {"figure.autolayout": False, "figure.constrained_layout.use": False}
"""Else matplotlib puts the user's preferred layout where a figure has none."""

DPI = 130
"""Resolution of saved figures [1/inch]."""

NOTEBOOK_DPI = 80
"""Resolution of figures in notebooks [1/inch]."""

LETTERS_PER_INCH = 9.0
"""So many letters of a title fit on an inch, about."""

FIXED_ASPECT_ROUNDS = 3
"""So often is a figure laid out that has axes of a given aspect, until labels and titles are in it
and beside each other."""

BAR_EDGE = "#202020"
"""Of bars, and so of their hatches."""

COVERED_LINE: dict[str, Any] = {
    "linestyle": "-", "linewidth": 5.0, "alpha": 0.4,
    "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4,
}  # fmt: skip
"""Of a curve that others may lie on: wide and pale, with hollow markers."""


def styled() -> AbstractContextManager[None]:
    """While axes are made and filled, they look as all do."""
    context: AbstractContextManager[None] = mpl.rc_context(STYLE)
    return context


def lay_out(figure: Figure) -> LayoutEngine | None:
    """Lays a figure out once and takes its engine from it, which is returned.

    So no file depends on which others were written before it. Nor is the figure drawn more than
    once for each: with an engine, even one that does nothing, matplotlib draws everything twice.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        # Axes whose aspect is given shrink once they have a place, and titles move with them.
        fixed = any(axes.name != "3d" and axes.get_aspect() != "auto" for axes in figure.axes)
        with mpl.rc_context({**STYLE, **NO_LAYOUT}), warnings.catch_warnings():
            # Matplotlib measures the time: on a busy machine it warns of any legend.
            warnings.filterwarnings("ignore", 'Creating legend with loc="best"', UserWarning)
            for _ in range(FIXED_ASPECT_ROUNDS if fixed else 1):
                engine.execute(figure)
            figure.set_layout_engine(None)
    return engine


class ShownFigure(Figure):
    """A figure that shows itself at the end of a notebook cell, without a plotting backend."""

    def _repr_png_(self) -> bytes:
        buffer, dpi = BytesIO(), self.dpi
        self.set_dpi(NOTEBOOK_DPI)  # coarse letters are wider: they are laid out as they are drawn
        engine = lay_out(self)
        with mpl.rc_context({**STYLE, **NO_LAYOUT}):
            self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
            self.set_layout_engine(engine)  # for what is drawn into it later
        self.set_dpi(dpi)
        return buffer.getvalue()


def bare_figure(size: tuple[float, float], title: str) -> Figure:
    """An empty figure of a size [inch]; no window, no global state.

    Lines of the title that are longer than the figure is wide are broken.
    """
    letters = int(LETTERS_PER_INCH * size[0])
    with mpl.rc_context(STYLE):
        figure = ShownFigure(figsize=size, layout="constrained")
        figure.suptitle("\n".join(fill(line, letters) for line in title.splitlines()))
        return figure


def new_figure(
    rows: int, columns: int, size: tuple[float, float], title: str
) -> tuple[Figure, Any]:
    """A figure of rows x columns axes and a size [inch]; one pair of axes comes as itself."""
    figure = bare_figure(size, title)
    with mpl.rc_context(STYLE):
        return figure, figure.subplots(rows, columns)


def spread(figure: Figure, room: float) -> None:
    """Keeps room round all panels of a figure, so that labels of neighbours are apart [inch]."""
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(w_pad=room)


def line_style(look: Look) -> dict[str, Any]:
    """Arguments of `plot` for a curve with this look, without its marker."""
    return {"color": look.color, "linestyle": look.dash}


def bar_style(look: Look) -> dict[str, Any]:
    """Arguments of `bar` and `barh` for bars with this look."""
    return {"color": look.color, "hatch": look.hatch, "edgecolor": BAR_EDGE, "linewidth": 0.6}


def few_ticks(axis: Axis, most: int = 6) -> None:
    """Ticks, at most so many steps, at plain numbers, without zeros that say nothing."""
    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
    plain_numbers(axis)


def plain_numbers(axis: Axis) -> None:
    """Numbers at ticks without zeros that say nothing: 0, 0.5 and 1."""
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}"))
    )
