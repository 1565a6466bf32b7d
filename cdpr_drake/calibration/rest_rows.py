"""Rows of a recorder's log at which the platform rests.

A recorder samples while the robot drives from pose to pose. Balance of forces holds at rest alone:
in motion, friction and inertia are in the tensions. The platform rests in a window of rows in which
no length or angle changes faster than a share of how fast the log moves otherwise, and in which
neither these nor the tensions scatter about their lines by more than noise. Noise is that of the
quietest windows. Windows that overlap are a group; where a length or an angle creeps, it is split.

A log with a row for each pose, as one takes it by hand, has no such windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy.stats import chi2

from cdpr_drake.arrays import Array

SPAN, FEWEST_ROWS, MOST_ROWS = 1.0, 5, 50
"""Duration of a window [s], and its rows at least and at most; where more would be in it, every
n-th row of the log is looked at."""

SLOW, FAST = 0.03, 95.0
"""Largest rate at rest, as a share of this percentile of the log's rates."""

CERTAIN, STEADY = 4.0, 3.0
"""Largest rate and scatter at rest, in those that noise makes."""

NEAR = 1.5
"""Distance of a row from the median of its group, in scatters that are rest."""

QUIETEST = 10.0
"""Percentile of the windows' scatter that tells the noise."""

FINE = 0.02
"""Largest noise of lengths and angles, as a share of their range; rows that differ by more are
poses of their own."""

STEADY_SHARE = 1e-3
"""Scatter of a tension at rest that is always accepted, as a share of the largest tension."""

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RestRows:
    """Groups of rows at rest, and what is left out.

    Attributes:
        groups: First row of each group and the row behind its last.
        moving: Rows in which a length or an angle changes, shape (k,).
        unsteady: Rows in which none does, but which scatter, as of a platform that swings, (k,).
        is_motion: True if rows follow each other so soon and so near that they are of a motion.
    """

    groups: tuple[slice, ...]
    moving: Flags
    unsteady: Flags
    is_motion: bool

    def means(self, table: Array) -> tuple[Array, Array]:
        """Means of a table, shape (k, c), over each group, and standard deviations, both (g, c).

        NaN where a group has no number.
        """
        mean, std = (np.full((len(self.groups), table.shape[1]), np.nan) for _ in range(2))
        for g, rows in enumerate(self.groups):
            seen = np.isfinite(table[rows]).any(axis=0)
            mean[g, seen] = np.nanmean(table[rows][:, seen], axis=0)
            std[g, seen] = np.nanstd(table[rows][:, seen], axis=0)
        return mean, std


def rows_at_rest(time: Array, counted: Sequence[Array], tensions: Array | None) -> RestRows:
    """Rows at which the platform rests, in groups.

    Args:
        time: Instants of the rows, growing, shape (k,) [s].
        counted: Tables of lengths, motor angles, swivel angles or tilts, each shape (k, c), NaN
            where nothing was measured; rates and noise are compared within a table.
        tensions: Shape (k, m) [N]; None: none were measured.
    """
    count, every = len(time), 1
    if count > 2:
        every = max(1, round(SPAN / (MOST_ROWS * float(np.median(np.diff(time))))))
    t = time[::every]
    tables = [_filled(t, table[::every]) for table in counted]
    forces = np.zeros((len(t), 0)) if tensions is None else _filled(t, tensions[::every])
    groups: list[slice] = []
    slow, is_motion = np.zeros(len(t), bool), False
    if len(t) > FEWEST_ROWS and any(table.shape[1] for table in tables):
        groups, slow, is_motion = _groups(t, [x for x in tables if x.shape[1]], forces)
    groups = [slice(g.start * every, min((g.stop - 1) * every + 1, count)) for g in groups]
    left = np.ones(count, bool)
    for group in groups:
        left[group] = False
    slow = np.repeat(slow, every)[:count]
    return RestRows(tuple(groups), left & ~slow, left & slow, is_motion)


def _groups(time: Array, tables: list[Array], forces: Array) -> tuple[list[slice], Flags, bool]:
    """Groups of rows at rest, rows in which no length or angle changes, and whether rows are of a
    motion."""
    step = float(np.median(np.diff(time)))
    size = int(np.clip(round(SPAN / step), FEWEST_ROWS, len(time) - 1))
    t = sliding_window_view(time, size)
    t = t - t.mean(axis=1, keepdims=True)
    slow = t[:, -1] - t[:, 0] <= 2.0 * size * step  # windows without a gap
    steady, limits, is_motion = slow.copy(), [], step <= SPAN
    for table in tables:
        rates, scatter = (np.max(x, axis=1) for x in _lines(t, table))
        fine = FINE * float(np.max(np.ptp(table, axis=0)))
        is_motion &= bool(np.median(scatter) <= fine)
        noise = min(_noise(scatter, size), fine)
        most = np.maximum(
            CERTAIN * noise / np.sqrt(np.sum(t**2, axis=1)),
            SLOW * float(np.percentile(rates, FAST)),
        )
        loose = np.maximum(STEADY * noise, most * (t[:, -1] - t[:, 0]) / np.sqrt(12.0))
        slow &= rates <= most
        steady &= scatter <= loose
        limits.append(NEAR * float(np.median(loose)))
    quiet = slow & steady
    if quiet.any() and forces.shape[1]:
        scatter = _lines(t, forces)[1]
        noises = np.array([_noise(column, size) for column in scatter[quiet].T])
        quiet &= np.all(
            scatter <= np.maximum(STEADY * noises, STEADY_SHARE * np.max(np.abs(forces))), axis=1
        )
    edge = size // 3  # motion begins and ends there
    linked, unmoved = np.zeros(len(time), bool), np.zeros(len(time), bool)
    for begin in np.flatnonzero(quiet):
        linked[begin + edge + 1 : begin + size - edge] = True  # to the row before, in one window
    for begin in np.flatnonzero(slow):
        unmoved[begin : begin + size] = True
    ends = np.flatnonzero(np.diff(np.concatenate([[False], linked, [False]]).astype(int)))
    first, stop = ends.reshape(-1, 2).T - [[1], [0]]
    alone = np.ones(len(first), bool)  # a short group beside another is the way there
    alone[1:] &= first[1:] > stop[:-1]
    alone[:-1] &= first[1:] > stop[:-1]
    groups = [
        part
        for group, lone in zip(map(slice, first.tolist(), stop.tolist()), alone, strict=True)
        if lone or group.stop - group.start >= size
        for part in _split(group, tables, limits, size)
    ]
    return groups, unmoved, is_motion


def _split(group: slice, tables: list[Array], limits: list[float], least: int) -> list[slice]:
    """A group in which every row is near the median, of half of some rows at least, as of a stop no
    longer than a window; else its parts of so many rows at least in which every row is."""
    count = group.stop - group.start
    if count < max(FEWEST_ROWS, least // 2):
        return []
    near = np.ones(count, bool)
    for table, limit in zip(tables, limits, strict=True):
        rows = table[group]
        near &= np.all(np.abs(rows - np.median(rows, axis=0)) <= limit, axis=1)
    if near.all():
        return [group]
    runs = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    if not len(runs):
        return []
    begin, end = max(runs.reshape(-1, 2).tolist(), key=lambda run: run[1] - run[0])
    cuts = [group.start, group.start + begin, group.start + end, group.stop]
    return [
        part
        for a, b in pairwise(cuts) if b - a >= least
        for part in _split(slice(a, b), tables, limits, least)
    ]  # fmt: skip


def _lines(t: Array, table: Array) -> tuple[Array, Array]:
    """Rates and scatter about the line of each window, each shape (windows, c); t is centred."""
    size = t.shape[1]
    x = sliding_window_view(table, size, axis=0)
    x = x - x.mean(axis=2, keepdims=True)
    slopes = np.einsum("wi,wci->wc", t, x) / np.sum(t**2, axis=1)[:, None]
    x = x - slopes[:, :, None] * t[:, None]
    return np.abs(slopes), np.sqrt(np.sum(x**2, axis=2) / (size - 2))


def _noise(scatter: Array, size: int) -> float:
    """Noise by the scatter of windows about their lines."""
    expected = np.sqrt(chi2.ppf(QUIETEST / 100.0, size - 2) / (size - 2))
    return float(np.percentile(scatter, QUIETEST) / expected)


def _filled(time: Array, table: Array) -> Array:
    """Columns that have numbers, empty cells on the line between their neighbours."""
    seen = np.isfinite(table)
    return np.array([
        np.interp(time, time[own], column[own])
        for column, own in zip(table.T, seen.T, strict=True) if own.any()
    ]).T.reshape(len(time), -1)  # fmt: skip
