"""Whether two devices that were logged during a motion have the same clock."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

LEAST_ROWS = 20
"""A shift is looked for in logs with as many rows."""

LEAST_MOTION = 0.01
"""And with as much motion, where nothing else is said: of cables [m]."""

LARGEST_SHARE, LARGEST_SHIFT = 0.25, 5.0
"""Shifts that are tried: up to this share of the log, and up to as many seconds."""

WORSE = 1.5
"""A tracker is out of sync where lengths fit by this factor better with a shift than without."""


def tracker_shift(
    time: Array, counted: Array, tracked: Array, least: float = LEAST_MOTION
) -> tuple[float, float]:
    """By how much a tracker is late, and how much better quantities fit with that known.

    Quantities that were counted, such as lengths by winches, are compared with what they are by
    the tracker, each up to an offset and a scale of its own, with the tracker's rows moved in time.

    Args:
        time: Shape (k,) [s], growing.
        counted: Without the tracker, shape (k, m); NaN where there are none.
        tracked: By the tracker, shape (k, m), in the same units; NaN where there are none.
        least: How much they have to move for the log to tell.

    Returns:
        The shift [s], positive where the tracker is late, and the factor by which the root mean
        square of what does not fit falls, at least 1. (0, 1) where the log cannot tell.
    """
    if len(time) < LEAST_ROWS or np.nanmax(np.ptp(counted, axis=0), initial=0.0) < least:
        return 0.0, 1.0
    step = float(np.median(np.diff(time)))
    most = min(LARGEST_SHARE * float(time[-1] - time[0]), LARGEST_SHIFT)
    if not most > step:
        return 0.0, 1.0
    count = min(int(most / step), 200)
    inside = (time >= time[0] + most) & (time <= time[-1] - most)
    shifts = np.linspace(-most, most, 2 * count + 1)
    misfit = np.array([_misfit(time, counted, tracked, s, inside) for s in shifts])
    if not np.all(np.isfinite(misfit)):
        return 0.0, 1.0
    best = int(np.argmin(misfit))
    shift = shifts[best]
    if 0 < best < 2 * count:
        low, mid, high = misfit[best - 1] ** 2, misfit[best] ** 2, misfit[best + 1] ** 2
        bend = low - 2.0 * mid + high
        if bend > 0.0:
            shift += 0.5 * (low - high) / bend * (shifts[1] - shifts[0])
    least = min(_misfit(time, counted, tracked, shift, inside), misfit[best])
    return float(shift), float(misfit[count] / max(least, 1e-12))


def _misfit(time: Array, counted: Array, tracked: Array, shift: float, inside: Array) -> float:
    """Root mean square of what does not fit if the tracker is late by a shift."""
    squares, rows = 0.0, 0
    for i in range(counted.shape[1]):
        seen = np.isfinite(tracked[:, i])
        use = inside.astype(bool) & np.isfinite(counted[:, i])
        if np.sum(seen) < 2 or np.sum(use) < 3:
            continue
        moved = np.interp(time[use] + shift, time[seen], tracked[seen, i])
        A = np.stack([moved, np.ones_like(moved)], axis=1)
        fit = np.linalg.lstsq(A, counted[use, i], rcond=None)[0]
        rest = counted[use, i] - A @ fit
        squares, rows = squares + float(rest @ rest), rows + len(rest)
    return float(np.sqrt(squares / rows)) if rows else np.nan
