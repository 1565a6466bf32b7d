"""Controller logs of GTGraffiti, a planar robot on an upright wall.

A line is `mode: x y - x_d y_d | e s l v | e s l v | ...`: the estimated position and the wanted one
[m], and of each cable error, state, minus its length [m], and its rate [m/s]. There are no times.
x is to the right and y upwards, which are x and z of W. 0 0 is no wanted position.

Source: github.com/gchenfc/cable-robot, Firmware/gerry06_mcu_only, analysis/gerry00_estimation.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.logs.log_request import TOLD, LogRequest, even_times
from cdpr_drake.analyses.logs.recorded_log import (
    COMMANDED,
    ESTIMATED,
    LENGTH,
    TIME,
    RecordedLog,
    settled,
)
from cdpr_drake.analyses.logs.text_tables import log_text, parsed
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.errors import LogFileError

_START = re.compile(r"(-?\d+): (\S+) (\S+) - (\S+) (\S+)$")

_MESSAGE = re.compile(r"[A-Z][A-Z _!]*")
"""A line of words that the controller says between two rows."""

_LOOKED = 20


def knows_gtgraffiti(head: str) -> str:
    """Why a text is one of these; empty where it is not."""
    lines = [line for line in head.split("\n")[:_LOOKED] if line.strip()]
    known = [line for line in lines if _cells(line) is not None]
    if len(lines) > 1 and len(known) >= 0.8 * len(lines):
        return "its lines are mode: x y - x y | error state length speed | ..."
    return ""


def read_gtgraffiti(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads lengths, estimated and wanted positions; the rate of rows must be told.

    Raises:
        LogFileError: It is no such file, a line of it is damaged, or the rate was not told.
    """
    text = log_text(path)
    why = knows_gtgraffiti(text[:20_000])
    if not why:
        raise LogFileError(
            f"{path}: found {text[:30]!r} at the top; accepted: mode: x y - x y | ..."
        )
    lines = [(k, line) for k, line in enumerate(text.split("\n"), 1) if line.strip()]
    rows: list[list[float]] = []
    remarks = []
    for number, line in lines:
        row = _cells(line)
        if row is None and _MESSAGE.fullmatch(line.strip()):
            remarks.append(f"line {number} says {line.strip()} and was left out")
            continue
        if row is None and number == lines[-1][0]:
            remarks.append(f"the last line, {number}, is cut off and was left out")
            continue
        if row is None or (rows and len(row) != len(rows[0])):
            raise LogFileError(
                f"{path}:{number}: found {line[:40]!r}; accepted: mode: x y - x y | e s l v | ..."
            )
        rows.append(row)
    table = np.array(rows)
    cables = (table.shape[1] - 5) // 4
    names = asked.names(path, cables)
    columns: Columns = {TIME: even_times(path, len(table), asked.rate)}
    for k, name in enumerate(names):
        columns[f"{name}_{LENGTH}"] = -table[:, 5 + 4 * k + 2]
    wanted = table[:, 3:5]
    wanted[np.all(wanted == 0.0, axis=1)] = np.nan
    for k, axis in enumerate("xz"):
        columns[f"{ESTIMATED}{axis}_m"] = table[:, 1 + k]
        columns[f"{COMMANDED}{axis}_m"] = wanted[:, k]
    columns["mode"] = table[:, 0]
    remarks.append("x and y of the log are x and z of W; a wanted position 0, 0 is none")
    units = {"lengths, positions": "m by the format", "time": f"{asked.rate:g} rows/s, {TOLD}"}
    return settled(RecordedLog(path, "gtgraffiti", why, columns, units, tuple(remarks)))


def _cells(line: str) -> list[float] | None:
    """Mode, two positions and four numbers of each cable; None where a line is another."""
    parts = [part.strip() for part in line.split("|")]
    start = _START.match(parts[0])
    if start is None or len(parts) < 4:
        return None
    cells = list(start.groups())
    for part in parts[1:-1]:
        four = part.split()
        if len(four) != 4:
            return None
        cells += four
    values = [parsed(cell) for cell in cells]
    if any(value is None for value in values):
        return None
    return [float(value) for value in values if value is not None]
