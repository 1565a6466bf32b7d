"""Curves of runs as long as they like: thinned without losing an extreme, marked for grey print.

Quantities are read in pieces, so that they may be arrays mapped from a file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.palette import SHADED, Look

BINS = 1500
"""Pieces into which a long curve is cut, each drawn by its extremes: finer than it is printed."""

HATCHED_ALPHA = 0.4
"""Opacity of shades with a hatch, which curves of their colour are drawn over."""

MARKS = 7
"""Symbols on a curve."""

PIECE = 50_000
"""Rows that are read at once."""


def extreme_rows(values: Array, bins: int = BINS) -> np.ndarray:
    """Rows of a curve that show all of it: of each of `bins` pieces the lowest and the highest.

    Args:
        values: Shape (n,). Where a piece has NaN, which are gaps, one of them is kept too.
        bins: Number of pieces; a curve of up to four rows for each is kept whole.

    Returns:
        Rows in ascending order, the first and the last among them; at most 3 bins + 2.
    """
    count = len(values)
    if count <= 4 * bins:
        return np.arange(count)
    width = -(-count // bins)
    kept = {0, count - 1}
    for start in range(0, count, width):
        piece = np.asarray(values[start : start + width])
        missing = np.isnan(piece)
        if np.any(missing):
            kept.add(start + int(np.argmax(missing)))
        if not np.all(missing):
            kept.add(start + int(np.nanargmin(piece)))
            kept.add(start + int(np.nanargmax(piece)))
    return np.array(sorted(kept))


def path_rows(points: Array, bins: int = BINS) -> np.ndarray:
    """Rows of a path, shape (n, d), that show all of it: the extremes of each coordinate."""
    return np.unique(np.concatenate([extreme_rows(column, bins) for column in points.T]))


def by_pieces(function: Callable[..., Any], *arrays: Array) -> Any:
    """`function` of arrays with equally many rows, applied to `PIECE` rows at a time.

    The function returns one array with as many rows, or a tuple of such; so does this.
    """
    count = len(arrays[0])
    parts = [
        function(*(np.asarray(a[start : start + PIECE]) for a in arrays))
        for start in range(0, max(count, 1), PIECE)
    ]
    if isinstance(parts[0], tuple):
        return tuple(np.concatenate(same) for same in zip(*parts, strict=True))
    return np.concatenate(parts)


def draw_curve(
    axes: Any,
    times: Array,
    values: Array,
    look: Look,
    label: str | None = None,
    *,
    scale: float = 1.0,
    phase: float = 0.5,
    **more: Any,
) -> None:
    """Draws a curve over time with a few of its look's symbols on it.

    Args:
        axes: Where.
        times: Shape (n,), growing.
        values: Shape (n,); NaN is a gap.
        look: Its look.
        label: For the legend.
        scale: Factor on the values.
        phase: Where the symbols stand, 0 to 1 between one and the next; curves that may lie on
            each other take different ones.
        more: Passed on to `plot`.
    """
    # Heavy by matplotlib, which scenes that thin their paths by this file need not.
    from cdpr_drake.analyses.visualization.figure_style import line_style

    rows = extreme_rows(values)
    t, y = np.asarray(times)[rows], scale * np.asarray(values[rows], float)
    style = line_style(look) | more
    if look.marker and len(t):
        style |= {
            "marker": look.marker,
            "markersize": style.get("markersize", 5.5),
            "markevery": _marked(t, phase),
            "markerfacecolor": "white",
        }
    axes.plot(t, y, label=label, **style)


def _marked(t: Array, phase: float) -> list[int]:
    wanted = t[0] + (np.arange(MARKS) + phase) / MARKS * (t[-1] - t[0])
    return np.unique(np.clip(np.searchsorted(t, wanted), 0, len(t) - 1)).tolist()


def phase_of(number: int, count: int) -> float:
    """Where the symbols of the curve with this number of `count` stand, for `draw_curve`."""
    return (number + 0.5) / max(count, 1)


def spans(times: Array, holds: np.ndarray, bins: int = BINS) -> Array:
    """From when to when something holds, shape (k, 2).

    Args:
        times: Of the rows, shape (n,), growing.
        holds: Whether it holds from a row to the next, shape (n,); the last row counts for
            nothing, as nothing comes after it.
        bins: Gaps shorter than the whole duration by this factor are closed.
    """
    if len(times) < 2:
        return np.empty((0, 2))
    on = np.zeros(len(times) + 1, np.int8)
    on[1:-1] = np.asarray(holds[:-1]) > 0.0
    change = np.diff(on)
    begins, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    found = np.column_stack([np.asarray(times)[begins], np.asarray(times)[ends]])
    if len(found) < 2:
        return found
    apart = found[1:, 0] - found[:-1, 1] >= (times[-1] - times[0]) / bins
    return np.column_stack(
        [found[np.append(True, apart), 0], found[np.append(apart, True), 1]]
    )  # fmt: skip


def shade(
    axes: Any, times: Array, holds: np.ndarray, label: str | None, look: Look = SHADED
) -> None:
    """Shades the times at which something holds; times and holds as in `spans`."""
    for number, (begin, end) in enumerate(spans(times, holds)):
        axes.axvspan(
            begin, end, facecolor=look.color, hatch=look.hatch or None, zorder=0,
            edgecolor="white" if look.hatch else "none", linewidth=0.0,
            alpha=HATCHED_ALPHA if look.hatch else None,
            label=label if number == 0 else None,
        )  # fmt: skip


def mark_instants(axes: Any, instants: Sequence[tuple[float, str]]) -> None:
    """Marks instants [s] by lines across, with their words on them, where they are shown."""
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
    """A band of bars: who, and when something holds for it.

    Args:
        axes: Where.
        times: Shape (n,) [s].
        rows: From top to bottom: name, look, whether it holds, shape (n,).
    """
    for place, (_, look, holds) in enumerate(rows):
        found = spans(times, holds)
        bars = [(float(begin), float(end - begin)) for begin, end in found]
        # The edge shows what lasts shorter than a dot of the print is wide.
        axes.broken_barh(
            bars, (place - 0.36, 0.72), facecolor=look.color, edgecolor=look.color, linewidth=0.5
        )
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=9)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
