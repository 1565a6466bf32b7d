"""Readings of a slow sensor that came in packets, put back to the times at which they were taken.

A sensor that measures evenly is often read over a bus in packets: three readings in three rows,
one after the other, then nothing for a while. As the file has them, the first of a packet is late
by nearly a packet, and a platform that turns by 6 rad/s is off by degrees. When readings are even,
their number says when each was taken; the last of a packet is late least, and the clock runs
through those.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from cdpr_drake.analyses.logs.recorded_log import ANGLES, RecordedLog
from cdpr_drake.arrays import Array

TOGETHER = 0.25
"""Readings nearer to each other than this share of their mean step came in one packet."""

PACKED = 0.25
"""So large a share of the steps is within packets; else readings came one by one."""

FEWEST = 30
"""Readings, fewer do not show a clock."""

LATEST = 1.5
"""A reading that is off the clock by more than so many packets: the clock did not run evenly, or
readings were lost, and nothing is changed."""


@dataclass(frozen=True, eq=False)
class PacketClock:
    """When readings of a sensor were taken.

    Attributes:
        rows: Rows in which a reading is new, shape (n,).
        time: When they were taken, shape (n,) [s].
        packet: How many come together, the mean.
        period: Between readings [s].
    """

    rows: np.typing.NDArray[np.intp]
    time: Array
    packet: float
    period: float


def packet_clock(time: Array, table: Array) -> PacketClock | None:
    """The even clock of readings that came in packets; None where they did not.

    Args:
        time: Of the rows, shape (k,) [s].
        table: What the sensor told, shape (k, n); a row like the one before has nothing new.
    """
    rows = np.flatnonzero(np.any(table[1:] != table[:-1], axis=1)) + 1
    if len(rows) < FEWEST or not np.isfinite(table).all():
        return None
    came = time[rows]
    steps = np.diff(came)
    mean = float(np.mean(steps))
    inside = steps < TOGETHER * mean
    if np.mean(inside) < PACKED:
        return None
    last = np.flatnonzero(~inside)  # without the packet that the file's end may have cut
    number = np.arange(len(rows))
    period, first = np.polyfit(last, came[last], 1)
    packet = float((last[-1] - last[0]) / (len(last) - 1))
    taken = first + period * number
    if np.max(np.abs(came - taken)) > LATEST * packet * period:
        return None
    return PacketClock(rows, taken, packet, float(period))


def without_packets(log: RecordedLog) -> RecordedLog:
    """A log whose roll, pitch and yaw stand at the times at which they were taken.

    Between readings they are read by cubics, so that every row has them; rows before the first
    reading and behind the last have none. A log without packets stays what it is.

    Args:
        log: The log.
    """
    if log.time is None or any(header not in log.columns for header in ANGLES):
        return log
    table, time = log.table(ANGLES), log.time
    clock = packet_clock(time, table)
    if clock is None:
        return log
    readings = np.unwrap(table[clock.rows], axis=0)
    even = CubicSpline(clock.time, readings)(time)
    even = np.arctan2(np.sin(even), np.cos(even))
    outside = (time < clock.time[0]) | (time > clock.time[-1])
    even[outside] = np.nan
    columns = dict(log.columns)
    for header, column in zip(ANGLES, even.T, strict=True):
        columns[header] = column
    words = (
        f"roll, pitch, yaw came in packets of {clock.packet:.3g} readings: they are read as taken "
        f"every {1e3 * clock.period:.4g} ms, up to {1e3 * _latest(time, clock):.3g} ms before "
        "they came"
    )
    return replace(log, columns=columns, remarks=(*log.remarks, words))


def _latest(time: Array, clock: PacketClock) -> float:
    return float(np.max(time[clock.rows] - clock.time))
