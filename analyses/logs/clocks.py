"""Clocks of logs: readings that came in packets, and a second recorder of the same motion.

A sensor that measures evenly is often read over a bus in packets: three readings in three rows, one
after the other, then nothing for a while. As the file has them, the first of a packet is late by
nearly a packet, and a platform that turns by 6 rad/s is off by degrees. When readings are even,
their number says when each was taken; the last of a packet is late least, and the clock runs
through those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from cdpr_drake.analyses.logs.columns import (
    ESTIMATED,
    LENGTH,
    MOTOR,
    PARTS,
    POSITION,
    QUATERNION,
    RPY,
    SECONDS,
)
from cdpr_drake.analyses.logs.log import Log, refusal
from cdpr_drake.arrays import Array
from cdpr_drake.numerics.clock_alignment import align_clocks, interpolate_rows

TOGETHER, PACKED = 0.25, 0.25
"""Steps below this share of the mean are within a packet; so large a share of all steps is, or
readings came one by one."""

FEWEST, PACKETS = 30, 5
"""Readings and packets, fewer do not show a clock."""

USUAL, PAUSED = 95.0, 4.0
"""Percentile of the steps, which packets of up to twenty reach; steps longer by this factor are
pauses of the recorder and do not count for the mean step."""

LATEST = 1.5
"""Packets by which a reading may be off the clock; else the clock was not even, or readings were
lost, and nothing is changed."""


def without_packets(log: Log) -> Log:
    """A log whose roll, pitch and yaw stand at the times at which they were taken.

    Between readings they are read by cubics, so that every row has them; rows before the first
    reading and behind the last have none. A log without packets, or with an uneven clock, keeps
    them; a remark says where the clock is not even.
    """
    names = list(PARTS[RPY])
    if log.time is None or not set(names) <= set(log.frame):
        return log
    time, table = log.time, log.table(names)
    present = np.flatnonzero(np.isfinite(table).all(axis=1))
    new = np.any(np.diff(table[present], axis=0) != 0.0, axis=1)
    rows = present[np.flatnonzero(new) + 1]
    if len(rows) < FEWEST:
        return log
    came = time[rows]
    steps = np.diff(came)
    usual = steps[steps <= PAUSED * np.percentile(steps, USUAL)]
    inside = steps < TOGETHER * float(np.mean(usual))
    last = np.flatnonzero(~inside)  # without the packet that the file's end may have cut
    if np.mean(inside) < PACKED or len(last) < PACKETS:
        return log
    period, first = np.polyfit(last, came[last], 1)
    packet = float((last[-1] - last[0]) / (len(last) - 1))
    taken = first + period * np.arange(len(rows))
    off, allowed = np.abs(came - taken), float(LATEST * packet * period)
    absent = time[np.setdiff1d(np.arange(len(time)), present)]
    if np.max(off) > allowed or len(absent):
        return log.with_remarks(_uneven(came, last, off, allowed, absent))
    even = CubicSpline(taken, np.unwrap(table[rows], axis=0))(time)
    even = np.arctan2(np.sin(even), np.cos(even))
    even[(time < taken[0]) | (time > taken[-1])] = np.nan
    frame = log.frame.assign(**dict(zip(names, even.T, strict=True)))
    return replace(log, frame=frame).with_remarks(
        f"roll, pitch, yaw came in packets of {packet:.3g} readings: they are read as taken every "
        f"{1e3 * float(period):.4g} ms, up to {1e3 * float(np.max(came - taken)):.3g} ms before "
        "they came"
    )


def _uneven(came: Array, last: np.ndarray, off: Array, allowed: float, absent: Array) -> str:
    """Where the clock of packets is not even; holes are seen by medians: they change the mean."""
    ends, counts = came[last], np.diff(last)
    took = np.diff(ends)
    each, packet = float(np.median(took / counts)), float(np.median(counts))
    more = took / each - counts
    holes = np.flatnonzero(more > LATEST * packet)
    parts = []
    if len(absent):
        parts.append(f"{len(absent)} rows have no reading, the first at {absent[0]:.6g} s")
    if len(holes):
        k = holes[int(np.argmax(took[holes]))]
        which = "a hole" if len(holes) == 1 else f"{len(holes)} holes, the longest"
        parts.append(
            f"{which} from {ends[k]:.6g} to {ends[k + 1]:.6g} s, about "
            f"{round(float(np.sum(more[holes])))} readings missing among {len(came)}"
        )
    elif np.any(off > allowed):  # beside holes it is their doing
        k = int(np.argmax(off))
        parts.append(
            f"{int(np.sum(off > allowed))} of {len(came)} readings are off an even clock by more "
            f"than {1e3 * allowed:.3g} ms, the farthest by {1e3 * off[k]:.3g} ms at {came[k]:.6g} s"
        )
    return (
        f"roll, pitch, yaw came in packets of {packet:.3g} readings, and stay in the rows in "
        f"which they came, since it is not known when they were taken: {'; '.join(parts)}"
    )


def join_logs(first: Log, second: Log) -> Log:
    """Reads the second log's clock as the first one's, and puts both into one log.

    The clocks are compared by what moved in both: positions, cable lengths, motor angles, or
    positions that a controller estimated, whichever a log has first.

    Raises:
        LogFileError: One has no times or nothing that moved, or both have a column.
        ClockError: They are not of one motion, or it repeats itself.
    """
    if first.time is None or second.time is None:
        path = first.path if first.time is None else second.path
        raise refusal(f"{path}: time", "no column of times", "one, to align two clocks")
    both = [name for name in second.frame if name in first.frame and name != SECONDS]
    if both:
        words = f"{', '.join(both[:4])}, which {first.path} has, too"
        raise refusal(second.path, words, "each column in one of the two logs")
    by = _moving(first, True), _moving(second, False)
    clock = align_clocks(first.time, first.table(by[0]), second.time, second.table(by[1]))
    names = [name for name in second.frame if name != SECONDS]
    table = interpolate_poses(
        second.time, second.table(names), names, clock.on_other_clock(first.time)
    )
    frame = first.frame.assign(**dict(zip(names, table.T, strict=True)))
    shift, drift = clock.sigmas
    words = (
        f"the second clock is read {clock.shift:+.5f} s later, sigma {1e3 * shift:.3f} ms, at "
        f"{clock.reference:.4g} s of its own; drift {1e6 * clock.drift:+.1f} ppm, sigma "
        f"{1e6 * drift:.1f} ppm"
    )
    missing = int(np.count_nonzero(np.isnan(table).all(axis=1)))
    lonely = f"{missing} rows of the first log have nothing of the second beside them"
    name = second.path.name
    joined = replace(
        first, dialect=f"{first.dialect} and {second.dialect}",
        why=f"{first.why}; {name}: {second.why}", frame=frame,
        ledger=pd.concat([first.ledger, second.ledger.assign(
            header=[f"{name}: {header}" for header in second.ledger["header"]]
        )], ignore_index=True),
        units={**first.units, **{f"{name}, {what}": unit for what, unit in second.units.items()}},
        clocks={
            "shift_s": clock.shift, "shift_sigma_s": shift, "drift": clock.drift,
            "drift_sigma": drift, "reference_s": clock.reference, "by": [list(each) for each in by],
            "residual_rms": dict(zip(by[0], clock.residual.tolist(), strict=True)),
            "rows": clock.rows, "words": words,
        },
    )  # fmt: skip
    remarks = [*(f"{name}: {remark}" for remark in second.remarks), words]
    return joined.with_remarks(*remarks, *([lonely] if missing else []))


def interpolate_poses(time: Array, table: Array, names: Sequence[str], at: Array) -> Array:
    """Columns at other instants, as `interpolate_rows`, where quaternions stay rotations."""
    columns = np.array([names.index(name) for name in PARTS[QUATERNION] if name in names])
    whole = len(columns) == len(PARTS[QUATERNION])
    if whole:  # they go on without a change of sign
        rows = np.flatnonzero(np.isfinite(table[:, columns]).all(axis=1))
        q = table[np.ix_(rows, columns)]
        turned = np.sum(q[1:] * q[:-1], axis=1) < 0.0
        sign = np.cumprod(np.where(np.concatenate([[False], turned]), -1.0, 1.0))
        table = table.copy()
        table[np.ix_(rows, columns)] = q * sign[: len(q), None]
    table = interpolate_rows(time, table, at)
    if whole:
        q = table[:, columns]
        size = np.linalg.norm(q, axis=1, keepdims=True)
        table[:, columns] = q / np.where(q[:, :1] < 0.0, -size, size)
    return table


def _moving(log: Log, cables_first: bool) -> list[str]:
    """Columns by which a log's clock is compared."""
    points = [name for name in PARTS[POSITION] if name in log.frame]
    estimated = [f"{ESTIMATED}{name}" for name in PARTS[POSITION] if ESTIMATED + name in log.frame]
    winches = [log.of_cables(LENGTH), log.of_cables(MOTOR)]
    kinds = [*winches, points, estimated] if cables_first else [points, *winches, estimated]
    columns = next((kind for kind in kinds if kind), [])
    if not columns:
        raise refusal(
            log.path, "no positions, lengths or motor angles", "one of them, to align two clocks"
        )
    return columns
