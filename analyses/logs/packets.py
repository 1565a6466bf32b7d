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

FEWEST, PACKETS = 30, 5
"""Readings and packets, fewer do not show a clock."""

USUAL, PAUSED = 95.0, 4.0
"""Percentile of the steps, which packets of up to twenty reach, and steps longer by this factor
are pauses of the recorder: they do not count for the mean step."""

LATEST = 1.5
"""A reading that is off the clock by more than so many packets: the clock did not run evenly, or
readings were lost, and nothing is changed."""

SENSOR = "roll, pitch, yaw"
"""What is read together, in the words of remarks."""


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


@dataclass(frozen=True)
class UnevenClock:
    """Readings that came in packets, but without an even clock: nobody knows when each was taken.

    Attributes:
        packet: How many come together, the median.
        readings: How many there are.
        holes: From when to when packets were missing, or the recorder's clock jumped [s].
        missing: How many readings the holes had room for.
        off: How many readings are off the best even clock by more than `allowed`.
        allowed: As far as an even clock may be off, `LATEST` packets [s].
        farthest: By how much the farthest is off [s].
        farthest_at: When it came [s].
        absent: Rows without a reading.
        absent_at: The first of them [s]; None where there is none.
    """

    packet: float
    readings: int
    holes: tuple[tuple[float, float], ...]
    missing: int
    off: int
    allowed: float
    farthest: float
    farthest_at: float
    absent: int
    absent_at: float | None

    def words(self) -> str:
        """Where the clock is not even, and how many readings that concerns, in one line."""
        said = []
        if self.absent:
            said.append(f"{self.absent} rows have no reading, the first at {self.absent_at:.6g} s")
        if self.holes:
            start, end = max(self.holes, key=lambda hole: hole[1] - hole[0])
            count = len(self.holes)
            which = "a hole" if count == 1 else f"{count} holes, the longest"
            said.append(
                f"{which} from {start:.6g} to {end:.6g} s, about {self.missing} readings missing "
                f"among {self.readings}"
            )
        elif self.off:  # beside holes it is their doing
            said.append(
                f"{self.off} of {self.readings} readings are off an even clock by more than "
                f"{1e3 * self.allowed:.3g} ms, the farthest by {1e3 * self.farthest:.3g} ms at "
                f"{self.farthest_at:.6g} s"
            )
        return (
            f"{SENSOR} came in packets of {self.packet:.3g} readings, and stay in the rows in "
            f"which they came, since it is not known when they were taken: {'; '.join(said)}"
        )


def packet_clock(time: Array, table: Array) -> PacketClock | UnevenClock | None:
    """The clock of readings that came in packets; None where they did not, or are few.

    Args:
        time: Of the rows, shape (k,) [s].
        table: What the sensor told, shape (k, n), NaN where it told nothing; a row like the one
            before has nothing new.
    """
    told = np.flatnonzero(np.isfinite(table).all(axis=1))
    rows = told[np.flatnonzero(np.any(np.diff(table[told], axis=0) != 0.0, axis=1)) + 1]
    if len(rows) < FEWEST:
        return None
    came = time[rows]
    steps = np.diff(came)
    usual = steps[steps <= PAUSED * np.percentile(steps, USUAL)]
    inside = steps < TOGETHER * float(np.mean(usual))
    last = np.flatnonzero(~inside)  # without the packet that the file's end may have cut
    if np.mean(inside) < PACKED or len(last) < PACKETS:
        return None
    number = np.arange(len(rows))
    period, first = np.polyfit(last, came[last], 1)
    packet = float((last[-1] - last[0]) / (len(last) - 1))
    taken = first + period * number
    off, allowed = np.abs(came - taken), LATEST * packet * period
    absent = np.setdiff1d(np.arange(len(time)), told)
    if np.max(off) <= allowed and not len(absent):
        return PacketClock(rows, taken, packet, float(period))
    farthest = int(np.argmax(off))
    each, holes, missing = _holes(came, last)
    return UnevenClock(
        packet=each, readings=len(rows), holes=holes, missing=missing,
        off=int(np.sum(off > allowed)), allowed=float(allowed), farthest=float(off[farthest]),
        farthest_at=float(came[farthest]), absent=len(absent),
        absent_at=float(time[absent[0]]) if len(absent) else None,
    )  # fmt: skip


def _holes(
    came: Array, last: np.typing.NDArray[np.intp]
) -> tuple[float, tuple[tuple[float, float], ...], int]:
    """The usual packet, between which packets more time passed than their readings take [s], and
    how many readings that was time for.

    By medians, since holes themselves change the mean.

    Args:
        came: When readings came, shape (n,) [s].
        last: Numbers of the last ones of packets.
    """
    ends, counts = came[last], np.diff(last)
    took = np.diff(ends)
    each, usual = float(np.median(took / counts)), float(np.median(counts))
    more = took / each - counts
    (found,) = np.nonzero(more > LATEST * usual)
    holes = tuple((float(ends[k]), float(ends[k + 1])) for k in found)
    return usual, holes, round(float(np.sum(more[found])))


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
    if isinstance(clock, UnevenClock):
        return replace(log, remarks=(*log.remarks, clock.words()))
    readings = np.unwrap(table[clock.rows], axis=0)
    even = CubicSpline(clock.time, readings)(time)
    even = np.arctan2(np.sin(even), np.cos(even))
    outside = (time < clock.time[0]) | (time > clock.time[-1])
    even[outside] = np.nan
    columns = dict(log.columns)
    for header, column in zip(ANGLES, even.T, strict=True):
        columns[header] = column
    words = (
        f"{SENSOR} came in packets of {clock.packet:.3g} readings: they are read as taken "
        f"every {1e3 * clock.period:.4g} ms, up to {1e3 * _latest(time, clock):.3g} ms before "
        "they came"
    )
    return replace(log, columns=columns, remarks=(*log.remarks, words))


def _latest(time: Array, clock: PacketClock) -> float:
    return float(np.max(time[clock.rows] - clock.time))
