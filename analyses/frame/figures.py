"""Figures: one look for all, curves, bars and planes, and files with the same bytes every day.

The look is `light.mplstyle` and `cdpr_drake.palette`: a cable, method or configuration keeps its
colour, dashes, marker and hatch by its number, a role by its name. No figure has a window or
changes the settings of matplotlib.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine, LayoutEngine
from matplotlib.ticker import FuncFormatter, MaxNLocator

from cdpr_drake import palette
from cdpr_drake.analyses.frame.thinning import extreme_rows, spans
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.arrays import Array
from cdpr_drake.palette import SHADED, Look, nth_look

CYCLE = (
    *palette.DASHES, (0.0, (7.0, 2.0, 1.0, 2.0, 1.0, 2.0)), (0.0, (10.0, 3.0)), (0.0, (3.0, 1.0)),
    (0.0, (1.0, 4.0)),
)  # fmt: skip
"""Dashes of curves without a look: none of two colours of the palette is alike."""

SHEET = Path(__file__).with_name("light.mplstyle")

STYLE: Any = dict(mpl.rc_params_from_file(SHEET, use_default_template=False)) | {
    "axes.prop_cycle": cycler(color=palette.COLORS, linestyle=CYCLE)
}
"""Settings of matplotlib while a figure is drawn or written."""

NOTEBOOK_DPI = 80
"""Resolution of figures in notebooks [1/inch]."""

LETTERS_PER_INCH = 9.0
"""Letters of a title that fit on an inch, about."""

FIXED_ASPECT_ROUNDS = 3
"""Layouts of a figure with axes of a fixed aspect, until labels and titles are apart."""

COVERED_LINE: dict[str, Any] = {
    "linestyle": "-", "linewidth": 5.0, "alpha": 0.4,
    "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4,
}  # fmt: skip
"""A curve on which others may lie: wide and pale, with hollow markers."""

UNDATED: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
"""Metadata that keep the day out of a file, by its ending."""

MARKS = 7
"""Symbols on a curve."""

HATCHED_ALPHA = 0.4
"""Opacity of shades with a hatch, which curves of their colour are drawn over."""

PALETTE = tuple(map(nth_look, range(len(palette.COLORS))))
"""Looks of the first things of a list."""

LEGEND_BESIDE: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)}
"""Place of a legend to the right of its axes."""


def styled() -> AbstractContextManager[None]:
    """The look of all figures, while axes are made and filled."""
    context: AbstractContextManager[None] = mpl.rc_context(STYLE)
    return context


class ShownFigure(Figure):
    """A figure that shows itself at the end of a notebook cell, without a plotting backend."""

    def _repr_png_(self) -> bytes:
        buffer, dpi = BytesIO(), self.dpi
        self.set_dpi(NOTEBOOK_DPI)  # coarse letters are wider: they are laid out as they are drawn
        engine = lay_out(self)
        with styled():
            self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
            self.set_layout_engine(engine)  # for what is drawn into it later
        self.set_dpi(dpi)
        return buffer.getvalue()


def bare_figure(size: tuple[float, float], title: str) -> Figure:
    """An empty figure of a size [inch], with a title whose long lines are broken."""
    letters = int(LETTERS_PER_INCH * size[0])
    with styled():
        figure = ShownFigure(figsize=size, layout="constrained")
        figure.suptitle("\n".join(fill(line, letters) for line in title.splitlines()))
        return figure


def new_figure(
    rows: int, columns: int, size: tuple[float, float], title: str
) -> tuple[Figure, Any]:
    """A figure of rows x columns axes and a size [inch]; one pair of axes comes as itself."""
    figure = bare_figure(size, title)
    with styled():
        return figure, figure.subplots(rows, columns)


def panels(
    count: int, columns: int, size: tuple[float, float], title: str, share_x: bool = False
) -> tuple[Figure, list[Any]]:
    """A figure of as many axes as there are panels, row by row; the rest of the last row is free.

    Args:
        count: Number of panels; a figure of none has an empty one.
        columns: Panels side by side at most.
        size: Of the figure [inch].
        title: Title.
        share_x: True if all panels have the same horizontal axis.
    """
    columns = max(min(columns, count), 1)
    figure = bare_figure(size, title)
    with styled():
        grid = figure.subplots(-(-max(count, 1) // columns), columns, squeeze=False, sharex=share_x)
    axes = list(grid.ravel())
    for free in axes[max(count, 1) :]:
        free.remove()
    return figure, axes[: max(count, 1)]


def shared_legend(figure: Figure, panels: Iterable[Any], ncols: int) -> None:
    """A legend below all panels, which names each label once."""
    handles = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=ncols)


def spread(figure: Figure, room: float) -> None:
    """Keeps room around all panels of a figure, so that labels of neighbours are apart [inch]."""
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(w_pad=room)


def line_style(look: Look) -> dict[str, Any]:
    """Arguments of `plot` for a curve with this look, without its marker."""
    return {"color": look.color, "linestyle": look.dash}


def bar_style(look: Look) -> dict[str, Any]:
    """Arguments of `bar` and `barh` for bars with this look."""
    return {"color": look.color, "hatch": look.hatch, "edgecolor": "#202020", "linewidth": 0.6}


def few_ticks(axis: Axis, most: int = 6) -> None:
    """Ticks, at most so many steps, at plain numbers."""
    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
    plain_numbers(axis)


def plain_numbers(axis: Axis) -> None:
    """Numbers at ticks without trailing zeros: 0, 0.5 and 1."""
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}"))
    )


def draw_curve(
    axes: Any, times: Array, values: Array, look: Look, label: str | None = None, *,
    scale: float = 1.0, phase: float = 0.5, **more: Any,
) -> None:  # fmt: skip
    """Draws a curve over time, thinned, with a few symbols of its look.

    Args:
        axes: Axes to draw into.
        times: Shape (n,), growing.
        values: Shape (n,); NaN is a gap.
        look: Its look.
        label: For the legend.
        scale: Factor on the values.
        phase: Place of the symbols between two steps, 0 to 1; curves that may lie on each other
            have different ones.
        more: Passed on to `plot`.
    """
    rows = extreme_rows(values)
    t, y = np.asarray(times)[rows], scale * np.asarray(values[rows], float)
    style = line_style(look) | more
    if look.marker and len(t):
        steps = t[0] + (np.arange(MARKS) + phase) / MARKS * (t[-1] - t[0])
        style |= {
            "marker": look.marker, "markersize": style.get("markersize", 5.5),
            "markevery": np.unique(np.clip(np.searchsorted(t, steps), 0, len(t) - 1)).tolist(),
            "markerfacecolor": "white",
        }  # fmt: skip
    axes.plot(t, y, label=label, **style)


def phase_of(number: int, count: int) -> float:
    """Place of the symbols of the curve with this number of `count`, for `draw_curve`."""
    return (number + 0.5) / max(count, 1)


def curves(
    axes: Any, times: Array, values: Array, by: Sequence[str], *,
    numbers: Sequence[int] | None = None, scale: float = 1.0,
) -> None:  # fmt: skip
    """Draws a curve for each column, in the look of its number.

    Args:
        axes: Axes to draw into.
        times: Shape (n,), growing.
        values: Shape (n, k); NaN is a gap.
        by: Names of the columns, for the legend.
        numbers: Of the columns among all that there are; None: 0 to k - 1.
        scale: Factor on the values.
    """
    numbers = range(len(by)) if numbers is None else numbers
    for place, (name, number) in enumerate(zip(by, numbers, strict=True)):
        phase = phase_of(place, len(by))
        draw_curve(axes, times, values[:, place], nth_look(number), name, scale=scale, phase=phase)


def shade(
    axes: Any, times: Array, holds: np.ndarray, label: str | None, look: Look = SHADED
) -> None:
    """Shades the times in which something holds; times and holds as in `spans`."""
    for number, (begin, end) in enumerate(spans(times, holds)):
        axes.axvspan(
            begin, end, facecolor=look.color, hatch=look.hatch or None, zorder=0,
            edgecolor="white" if look.hatch else "none", linewidth=0.0,
            alpha=HATCHED_ALPHA if look.hatch else None,
            label=label if number == 0 else None,
        )  # fmt: skip


def mark_instants(axes: Any, instants: Sequence[tuple[float, str]]) -> None:
    """Marks the instants [s] that are in view by lines across with words on them."""
    low, high = axes.get_xlim()
    for time, words in instants:
        if low <= time <= high:
            axes.axvline(time, color="#303030", linestyle=":", linewidth=1.2, zorder=1)
            axes.annotate(
                words, (time, 1.0), (2, -3), xycoords=("data", "axes fraction"),
                textcoords="offset points", rotation=90, va="top", fontsize=8, color="#303030",
                zorder=5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85},
            )  # fmt: skip


def draw_bars(axes: Any, times: Array, rows: Sequence[tuple[str, Look, Array]]) -> None:
    """Draws a row of bars for each name: the times in which something holds for it.

    Args:
        axes: Axes to draw into.
        times: Shape (n,) [s].
        rows: From top to bottom: name, look, whether it holds, shape (n,).
    """
    for place, (_, look, holds) in enumerate(rows):
        bars = [(float(begin), float(end - begin)) for begin, end in spans(times, holds)]
        # The edge shows what lasts shorter than a dot of the print is wide.
        axes.broken_barh(
            bars, (place - 0.36, 0.72), facecolor=look.color, edgecolor=look.color, linewidth=0.5
        )
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=9)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")


def bars(
    axes: Any, names: Sequence[str], heights: Mapping[str, Sequence[float] | Array],
    looks: Sequence[Look] = PALETTE, **words: Any,
) -> None:  # fmt: skip
    """Draws a group of bars at each name, one bar of a group for each key.

    Args:
        axes: Axes to draw into.
        names: Of the k groups.
        heights: By key, which is for the legend, shape (k,) each; NaN draws nothing.
        looks: Looks of the keys, at least as many.
        words: How the names are written, passed on to `set_xticks`.
    """
    places, width = np.arange(len(names)), 0.8 / max(len(heights), 1)
    for number, (key, values) in enumerate(heights.items()):
        shift = (number - (len(heights) - 1) / 2.0) * width
        axes.bar(places + shift, values, width, label=key, **bar_style(looks[number]))
    axes.set_xticks(places, names, **words)


def plane(axes: Any, values: Array, label: str, **more: Any) -> None:
    """Draws values by colour, dark small, bright large; values that are not finite stay empty.

    Args:
        axes: Axes to draw into.
        values: Shape (rows, columns).
        label: Words and unit of the scale of colours.
        more: Passed on to `imshow`.
    """
    image = axes.imshow(values, cmap="cividis", interpolation="nearest", **more)
    axes.figure.colorbar(image, ax=axes, label=label)
    axes.grid(visible=False)


def lay_out(figure: Figure) -> LayoutEngine | None:
    """Lays a figure out once and takes its engine from it, which is returned.

    So no file depends on the files before it, and the figure is drawn once for each: with an
    engine, even one that does nothing, matplotlib draws everything twice.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        # Axes whose aspect is given shrink once they have a place, and titles move with them.
        fixed = any(axes.name != "3d" and axes.get_aspect() != "auto" for axes in figure.axes)
        with styled(), warnings.catch_warnings():
            # Matplotlib measures the time: on a busy machine it warns of any legend.
            warnings.filterwarnings("ignore", 'Creating legend with loc="best"', UserWarning)
            warnings.filterwarnings("ignore", "constrained_layout not applied", UserWarning)
            for _ in range(FIXED_ASPECT_ROUNDS if fixed else 1):
                engine.execute(figure)
            figure.set_layout_engine(None)
    return engine


def save_figure(figure: Figure, path: Path) -> Path:
    """Writes a figure, as the ending of its file says, PNG without one, and returns its path.

    The file appears whole or not at all; an older one stays until then.

    Raises:
        OSError: It cannot be written, for instance on a full disk.
    """
    path = path if path.suffix else path.with_name(f"{path.name}.{DEFAULT_FORMATS[0]}")
    with whole_file(path) as part:
        _put(figure, part)
    return path


def _put(figure: Figure, path: Path) -> None:
    with styled():
        figure.savefig(path, metadata=UNDATED.get(path.suffix[1:].lower()))


def figure_writers(
    drawn: Mapping[str, Callable[[], Figure]], formats: Sequence[str] = DEFAULT_FORMATS
) -> dict[str, Callable[[Path], Path]]:
    """Functions that write figures, by the names of their files.

    A figure is drawn when its first file is written and dropped after its last.

    Args:
        drawn: Functions that draw the figures, by name without ending.
        formats: Endings of the files of each figure.
    """
    writers: dict[str, Callable[[Path], Path]] = {}
    for name, draw in drawn.items():
        once = _DrawnOnce(draw, len(formats))
        for ending in formats:
            writers[f"{name}.{ending}"] = once.write
    return writers


class _DrawnOnce:
    """A figure for several files."""

    def __init__(self, draw: Callable[[], Figure], files: int) -> None:
        self._draw, self._left = draw, files
        self._figure: Figure | None = None

    def write(self, path: Path) -> Path:
        """Writes the figure in place: `write_pictures` makes the file whole."""
        if self._figure is None:
            self._figure = self._draw()
            lay_out(self._figure)
        figure = self._figure
        self._left -= 1
        if self._left <= 0:
            self._figure = None
        _put(figure, path)
        return path


def write_figures(
    folder: Path,
    drawn: Mapping[str, Callable[[], Figure]],
    formats: Sequence[str] = DEFAULT_FORMATS,
) -> dict[str, str]:
    """Draws figures and writes them into a folder that exists; one that fails costs no other.

    Returns:
        Of each file that could not be written, the name and why, in one line.
    """
    return write_pictures(folder, dict(figure_writers(drawn, formats)))
