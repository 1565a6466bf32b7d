"""Readings that came in packets are put back to when they were taken."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from cdpr_drake.analyses.logs.clocks import without_packets
from cdpr_drake.analyses.logs.columns import PARTS, RPY, SECONDS
from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.logs.log import Log

ANGLES = list(PARTS[RPY])

SPEED, SWING = 13.0, np.radians(25.0)
"""Of a platform that swings twice a second [rad/s], and how far [rad]."""

STEP, PERIOD, PACKET = 1e-3, 0.01, 3
"""Rows, readings [s], and how many come together."""

OFF = SWING * (SPEED * PERIOD) ** 4 / 384 + SWING * SPEED * STEP
"""Cubics between readings, and the row at which a reading comes first, a millisecond late."""


def made(columns):
    """A log of columns."""
    return Log(path=Path("made"), frame=pd.DataFrame(columns), ledger=pd.DataFrame())


def turns(time):
    """Roll, pitch, yaw, shape (k, 3) [rad]; yaw goes through 180 degrees."""
    return np.column_stack([
        SWING * np.sin(SPEED * time), 0.5 * SWING * np.cos(SPEED * time),
        np.pi + 0.4 * np.sin(0.7 * SPEED * time),
    ])  # fmt: skip


def packed(packet=PACKET, span=4.0):
    """A log whose rows hold the reading that came last; three come in three rows."""
    time = 20.0 + np.arange(round(span / STEP)) * STEP
    taken = 20.0 + np.arange(round(span / PERIOD)) * PERIOD
    number = np.arange(len(taken))
    last = np.minimum(number - number % packet + packet - 1, len(taken) - 1)
    came = taken[last] + (number % packet - packet + 1) * STEP  # in rows, one after the other
    rows = np.maximum(np.searchsorted(came, time + 1e-9, side="right") - 1, 0)
    angles = turns(taken)[rows]
    angles = np.arctan2(np.sin(angles), np.cos(angles))
    return made({SECONDS: time, **dict(zip(ANGLES, angles.T, strict=True))})


def off(log, late=0.0):
    """Largest error of angles [rad], late by a constant time."""
    time = log.frame[SECONDS]
    wrong = log.table(ANGLES) - turns(time - late)
    wrong = np.arctan2(np.sin(wrong), np.cos(wrong))
    return np.nanmax(np.abs(wrong[(time > 20.1) & (time < 23.9)]))


def test_packets_are_spread_over_the_time_in_which_they_were_taken():
    log = packed()
    spread = without_packets(log)
    # Readings in their rows are wrong even with the best constant delay; these are not.
    assert min(off(log, late) for late in np.arange(0.0, 0.03, 0.002)) > 0.05
    assert off(spread) < min(OFF, 0.1 * off(log))
    assert "packets of 3 readings: they are read as taken every 10 ms" in spread.remarks[-1]


def altered(log, **columns):
    return made({**log.frame, **columns})


def paused(log):
    return altered(log, **{SECONDS: log.time + 100.0 * (log.time > 22.0)})


def with_holes(log, *holes):
    """Rows of these times were not recorded."""
    inside = [(log.time >= start) & (log.time <= end) for start, end in holes]
    return made(log.frame[~np.any(inside, axis=0)].reset_index(drop=True))


SINGLE = packed(packet=1)


@pytest.mark.parametrize("log", [
    SINGLE, altered(SINGLE, **{ANGLES[0]: 0.0 * SINGLE.time}), paused(SINGLE),
    made({SECONDS: SINGLE.time, "C1_length_m": 0.0 * SINGLE.time}),
])  # fmt: skip
def test_readings_that_came_one_by_one_stay(log):
    assert without_packets(log) is log


def near(*values, by=PACKET * PERIOD + STEP):
    return [pytest.approx(value, abs=by) for value in values]


MISSING = np.where((np.arange(4000) < 1500) | (np.arange(4000) >= 1520), 0.0, np.nan)

UNEVEN = [
    (lambda log: with_holes(log, (21.0, 21.5)), "a hole from",
     [*near(21.0, 21.5), *near(50, 350, by=PACKET)]),
    (paused, "a hole from", [*near(22.0, 122.0), *near(10_000, 400, by=PACKET)]),
    (lambda log: with_holes(log, (21.0, 21.2), (22.0, 22.6)), "2 holes, the longest from",
     [2, *near(22.0, 22.6), *near(80, 320, by=2 * PACKET)]),
    # 0.8 s late in the end, never a hole: off, of, allowed [ms], farthest [ms], at.
    (lambda log: altered(log, **{SECONDS: log.time + 0.05 * (log.time - 20.0) ** 2}),
     "readings are off an even clock",
     [*near(148, 399, by=PACKET), *near(54, 151, by=1), *near(24.77)]),
    (lambda log: altered(log, **{ANGLES[1]: log.frame[ANGLES[1]] + MISSING}),
     "rows have no reading, the first at", [20, 21.5]),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words", "values"), UNEVEN)
def test_packets_without_an_even_clock_stay_and_a_remark_says_why(change, words, values):
    log = change(packed())
    same = without_packets(log)
    assert same.frame is log.frame
    (remark,) = same.remarks
    start, _, why = remark.partition(": ")
    assert start.startswith("roll, pitch, yaw came in packets of 3 readings, and stay in the rows")
    assert words in why
    assert ("hole" in why) == ("hole" in words)
    assert [float(number) for number in re.findall(r"\d+\.?\d*", why)] == values


def test_an_import_keeps_every_reading_where_rows_are_left_out(tmp_path):
    log = packed()
    epsilon = np.degrees(log.table(ANGLES)).T
    st = {"t_r": log.time, "epsilon_r": epsilon, "tensions_r": np.ones((4, len(log.time)))}
    savemat(tmp_path / "fast.mat", {"st": st})
    thin = import_log(tmp_path / "fast.mat", every=5)
    assert len(thin.frame) == pytest.approx(len(log.time) / 5, abs=1)
    assert off(thin) < OFF
