"""How figures look, the same for all studies."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from cdpr_drake.arrays import Array

_STYLE: Any = {
    "font.size": 12,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "legend.fontsize": 10,
    "lines.linewidth": 1.4,
}

DPI = 130
"""Resolution of saved figures [1/inch]."""

NOTEBOOK_DPI = 80
"""Resolution of figures in notebooks [1/inch]."""


COVERED_LINE: dict[str, Any] = {
    "linestyle": "-", "linewidth": 5.0, "alpha": 0.4,
    "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4,
}  # fmt: skip
"""Of a curve that others may lie on: wide and pale, with hollow markers."""


class ShownFigure(Figure):
    """A figure that shows itself at the end of a notebook cell, without a plotting backend."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        with mpl.rc_context(_STYLE):
            self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
        return buffer.getvalue()


def bare_figure(size: tuple[float, float], title: str) -> Figure:
    """An empty figure of a size [inch]; no window, no global state."""
    with mpl.rc_context(_STYLE):
        figure = ShownFigure(figsize=size, layout="constrained")
        figure.suptitle(title)
        return figure


def new_figure(
    rows: int, columns: int, size: tuple[float, float], title: str
) -> tuple[Figure, Any]:
    """A figure of rows x columns axes and a size [inch]; one pair of axes comes as itself."""
    figure = bare_figure(size, title)
    with mpl.rc_context(_STYLE):
        return figure, figure.subplots(rows, columns)


def save_figure(figure: Figure, path: Path) -> Path:
    """Writes a figure, as the ending of its file says, and returns its path."""
    with mpl.rc_context(_STYLE):
        figure.savefig(path, dpi=DPI)
    return path


def figure_writer(draw: Callable[[], Figure]) -> Callable[[Path], Path]:
    """What draws a figure and writes it, once it is given a path."""
    return lambda path: save_figure(draw(), path)


def few_ticks(axis: Axis, most: int = 6) -> None:
    """Ticks, at most so many steps, at plain numbers, without zeros that say nothing."""
    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
    plain_numbers(axis)


def plain_numbers(axis: Axis) -> None:
    """Numbers at ticks without zeros that say nothing: 0, 0.5 and 1."""
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}"))
    )


def shade_slack(axes: Axes, times: Array, slack: Array) -> None:
    """Shades the times, shape (n,) [s], at which any cable, shape (n, m), is slack."""
    some = np.any(slack > 0.0, axis=1)
    if np.any(some):
        low, high = axes.get_ylim()
        axes.fill_between(
            times, low, high, where=some.tolist(), color="C3", alpha=0.10, label="some cable slack"
        )
        axes.set_ylim(low, high)
