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
    frame = pd.DataFrame(columns)
    return Log(path=Path("made"), dialect="", why="", frame=frame, ledger=pd.DataFrame())


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
    held = np.searchsorted(came, time + 1e-9, side="right") - 1
    told = turns(taken)[np.maximum(held, 0)]
    told = np.arctan2(np.sin(told), np.cos(told))
    columns = {SECONDS: time, **dict(zip(ANGLES, told.T, strict=True))}
    return made(columns)


def off(log, late=0.0):
    """Largest error of angles [rad], late by a constant time."""
    time = log.frame[SECONDS]
    wrong = log.table(ANGLES) - turns(time - late)
    wrong = np.arctan2(np.sin(wrong), np.cos(wrong))
    return np.nanmax(np.abs(wrong[(time > 20.1) & (time < 23.9)]))


def test_packets_are_spread_over_the_time_in_which_they_were_taken():
    log = packed()
    spread = without_packets(log)
    # Held readings are wrong even with the best constant delay; these are not.
    assert min(off(log, late) for late in np.arange(0.0, 0.03, 0.002)) > 0.05
    assert off(spread) < OFF
    assert off(spread) < 0.1 * off(log)
    assert "packets of 3 readings" in spread.remarks[-1]
    assert "every 10 ms" in spread.remarks[-1]


def test_readings_that_came_one_by_one_stay():
    log = packed(packet=1)
    assert without_packets(log) is log
    still = made({**log.frame, ANGLES[0]: 0.0 * log.time})
    assert without_packets(still) is still
    bare = made({SECONDS: log.time, "C1_length_m": 0.0 * log.time})
    assert without_packets(bare) is bare


def rows_of(log, kept):
    return made({h: v[kept] for h, v in log.frame.items()})


def numbers(words):
    """Those of a remark, in their order."""
    return [float(found) for found in re.findall(r"\d+\.?\d*", words)]


def test_packets_around_a_hole_stay_and_a_remark_says_where_it_is():
    log = packed()
    holed = rows_of(log, (log.time < 21.0) | (log.time > 21.5))  # nothing was recorded
    same = without_packets(holed)
    assert same.frame is holed.frame
    (words,) = same.remarks
    assert words.startswith("roll, pitch, yaw came in packets of 3 readings, and stay")
    assert "a hole from" in words
    packet, start, end, missing, readings = numbers(words)
    assert packet == PACKET
    assert missing == pytest.approx(0.5 / PERIOD, abs=PACKET)
    assert readings == pytest.approx(3.5 / PERIOD, abs=PACKET)
    assert 21.0 - PACKET * PERIOD <= start <= 21.0
    assert 21.5 <= end <= 21.5 + PACKET * PERIOD


def test_a_long_pause_neither_makes_packets_nor_hides_them():
    single, log = packed(packet=1), packed()
    for each in (single, log):
        each.frame[SECONDS] = each.time + 100.0 * (each.time > 22.0)
    assert without_packets(single) is single
    (words,) = without_packets(log).remarks
    assert "a hole from 22 to 122" in words


def test_of_several_holes_the_longest_is_told_with_their_number():
    log = packed()
    one, other = (log.time < 21.0) | (log.time > 21.2), (log.time < 22.0) | (log.time > 22.6)
    (words,) = without_packets(rows_of(log, one & other)).remarks
    _, count, start, end, missing, _ = numbers(words)
    assert (count, round(start, 1), round(end, 1)) == (2, 22.0, 22.6)
    assert missing == pytest.approx(0.8 / PERIOD, abs=2 * PACKET)


def test_a_clock_that_becomes_slower_is_told_with_how_many_readings_are_off():
    log = packed()
    time = log.time + 0.05 * (log.time - 20.0) ** 2  # 0.8 s late in the end, never a hole
    slow = made({**log.frame, SECONDS: time})
    same = without_packets(slow)
    assert same.frame is slow.frame
    (words,) = same.remarks
    assert "hole" not in words
    _, off, count, allowed, farthest, at = numbers(words)
    assert 0 < off < count == pytest.approx(4.0 / PERIOD, abs=PACKET)
    assert farthest > allowed > 1e3 * PACKET * PERIOD  # [ms]
    assert time[0] <= at <= time[-1]


def test_rows_without_angles_are_told_where_readings_came_in_packets():
    log = packed()
    columns = {**log.frame, ANGLES[1]: log.frame[ANGLES[1]].copy()}
    columns[ANGLES[1]][1500:1520] = np.nan
    (words,) = without_packets(made(columns)).remarks
    assert "20 rows have no reading, the first at 21.5 s" in words
    assert "off an even clock" not in words


def test_an_import_keeps_every_reading_where_rows_are_left_out(tmp_path):
    log = packed()
    epsilon = np.degrees(log.table(ANGLES)).T
    st = {"t_r": log.time, "epsilon_r": epsilon, "tensions_r": np.ones((4, len(log.time)))}
    savemat(tmp_path / "fast.mat", {"st": st})
    found = import_log(tmp_path / "fast.mat", every=5)
    assert len(found.frame) == pytest.approx(len(log.time) / 5, abs=1)
    assert off(found) < OFF
    assert any("packets" in words for words in found.remarks)
