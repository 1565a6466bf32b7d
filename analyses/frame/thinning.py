"""Long logs, thinned for pictures without losing an extreme, and read in pieces.

Arrays may be mapped from a file. Nothing here needs matplotlib, so scenes in a browser use it, too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array

BINS = 1500
"""Pieces of a long curve, each drawn by its extremes: finer than print."""

PIECE = 50_000
"""Rows that are read at once."""


def extreme_rows(values: Array, bins: int = BINS) -> np.ndarray:
    """Rows of a curve that show all of it: the lowest and the highest of each of `bins` pieces.

    Args:
        values: Shape (n,). A piece with NaN, which is a gap, keeps one NaN too.
        bins: Number of pieces; a curve of up to four rows for each piece stays whole.

    Returns:
        Rows in ascending order with the first and the last; at most 3 bins + 2.
    """
    count = len(values)
    if count <= 4 * bins:
        return np.arange(count)
    width = -(-count // bins)
    rows = {0, count - 1}
    for start in range(0, count, width):
        piece = np.asarray(values[start : start + width])
        missing = np.isnan(piece)
        if np.any(missing):
            rows.add(start + int(np.argmax(missing)))
        if not np.all(missing):
            rows.add(start + int(np.nanargmin(piece)))
            rows.add(start + int(np.nanargmax(piece)))
    return np.array(sorted(rows))


def envelope(values: Array, pieces: int = 250) -> tuple[np.ndarray, Array, Array, Array] | None:
    """Extremes and means of pieces of a curve that chatters: it turns back twice in most of them.

    Args:
        values: Shape (n,).
        pieces: Number of pieces; 250 of a figure's width are as wide as a thick line.

    Returns:
        The middle row of each piece, and its lowest, mean and highest value, shape (pieces,); None
        for a smoother curve, one with less than four rows for each piece, or with gaps.
    """
    count = len(values)
    if count < 4 * pieces or not np.all(np.isfinite(values)):
        return None
    edges = np.linspace(0, count, pieces + 1).astype(int)
    turns = np.append([False, False], np.diff(np.sign(np.diff(values))) != 0)
    if np.median(np.add.reduceat(turns, edges[:-1])) < 2:
        return None
    low, high = (extreme.reduceat(values, edges[:-1]) for extreme in (np.minimum, np.maximum))
    means = np.add.reduceat(values, edges[:-1]) / np.diff(edges)
    return (edges[:-1] + edges[1:]) // 2, low, means, high


def path_rows(points: Array, bins: int = BINS) -> np.ndarray:
    """Rows of a path, shape (n, d), that show all of it: the extremes of each coordinate."""
    return np.unique(np.concatenate([extreme_rows(column, bins) for column in points.T]))


def by_pieces(function: Callable[..., Any], *arrays: Array) -> Any:
    """`function` of arrays with equally many rows, applied to `PIECE` rows at a time.

    The function returns one array with as many rows, or a tuple of such; so does this.
    """
    parts = [
        function(*(np.asarray(array[start : start + PIECE]) for array in arrays))
        for start in range(0, max(len(arrays[0]), 1), PIECE)
    ]
    if isinstance(parts[0], tuple):
        return tuple(np.concatenate(same) for same in zip(*parts, strict=True))
    return np.concatenate(parts)


def spans(times: Array, holds: np.ndarray, bins: int = BINS) -> Array:
    """Begins and ends of the times in which something holds, shape (k, 2).

    Args:
        times: Of the rows, shape (n,), growing.
        holds: True or above 0 where it holds from a row to the next, shape (n,); the last row does
            not count.
        bins: Gaps shorter than the whole duration by this factor are closed.
    """
    if len(times) < 2:
        return np.empty((0, 2))
    on = np.zeros(len(times) + 1, np.int8)
    on[1:-1] = np.asarray(holds[:-1]) > 0.0
    change = np.diff(on)
    begins = np.asarray(times)[np.flatnonzero(change == 1)]
    ends = np.asarray(times)[np.flatnonzero(change == -1)]
    apart = begins[1:] - ends[:-1] >= (times[-1] - times[0]) / bins
    if len(begins):
        begins, ends = begins[np.append(True, apart)], ends[np.append(apart, True)]
    return np.column_stack([begins, ends])
