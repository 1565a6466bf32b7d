"""Raw logs of GRAB's cable robots: lines `type,time,...`, each of one device.

Type 3 is an actuator: number, state, motor counts, their rate, motor torque, cable length [m] and
its rate, tension, wanted tension [N], counts of the swivel encoder, their rate, swivel angle [rad].
Type 5 is the inclinometer: roll, pitch, yaw [deg]. Lengths and swivel angles count from where the
encoders were switched on. Devices are read out together: one time is one row.

Source: github.com/fzoffoli/UACDPR_SelfCalibration, sc_8_final.log beside sc_8_final_parsed.mat,
which has the same tensions, wanted tensions and roll, pitch [rad]; its swivel angles have the other
sign and a zero of their own, its lengths what homing adds.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.recorded_log import (
    ANGLES,
    COMMANDED,
    LENGTH,
    SWIVEL,
    TENSION,
    TIME,
    RecordedLog,
    settled,
)
from cdpr_drake.analyses.logs.text_tables import log_text, parsed
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.errors import LogFileError
from cdpr_drake.schema.fields import LARGEST

ACTUATOR, INCLINOMETER = "3", "5"

_CELLS = {ACTUATOR: 14, INCLINOMETER: 5}

_FIELDS = {LENGTH: 7, TENSION: 9, COMMANDED: 10, SWIVEL: 13}
"""Cells of an actuator's line."""

_LOOKED = 20
"""Lines by which a file is told."""

_MOST_ACTUATORS = 64


def knows_grab(head: str) -> str:
    """Why a text is one of these; empty where it is not."""
    lines = [line.split(",") for line in head.split("\n")[:_LOOKED] if line.strip()]
    of_type = [line for line in lines if len(line) == _CELLS.get(line[0], -1)]
    actuators = sum(1 for line in of_type if line[0] == ACTUATOR)
    numbers = all(parsed(cell.strip()) is not None for line in of_type for cell in line[1:])
    if len(lines) < 2 or not actuators or not numbers or len(of_type) < 0.6 * len(lines):
        return ""
    return "its lines are type,time,... with 14 cells of actuators (3), 5 of the inclinometer (5)"


def read_grab_log(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads lengths, swivel angles, tensions, wanted tensions, and roll, pitch, yaw.

    Raises:
        LogFileError: It is no such file, or a line of it is damaged; names the line.
    """
    text = log_text(path)
    why = knows_grab(text[:20_000])
    if not why:
        raise LogFileError(f"{path}: found {text[:30]!r} at the top; accepted: lines type,time,...")
    rows: dict[float, dict[str, dict[int, float]]] = {}
    other: dict[str, int] = {}
    lines = text.split("\n")
    at_line: dict[float, int] = {}
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split(",")]
        kind = cells[0]
        if kind not in _CELLS:
            if not kind.isdigit():
                raise LogFileError(
                    f"{path}:{number}: type: found {kind[:20]!r}; accepted: a number"
                )
            other[kind] = other.get(kind, 0) + 1
            continue
        values = _numbers(path, number, cells, kind)
        row = rows.setdefault(values[1], {})
        at_line.setdefault(values[1], number)
        key = int(values[2]) if kind == ACTUATOR else -1
        if kind == ACTUATOR and not (key == values[2] and 0 <= key < _MOST_ACTUATORS):
            raise LogFileError(
                f"{path}:{number}: actuator: found {cells[2]}; accepted: a whole number from 0"
            )
        if kind == ACTUATOR:
            if key in row.get(LENGTH, {}):
                raise LogFileError(
                    f"{path}:{number}: found actuator {key} twice at {values[1]:g} s; accepted: "
                    "once"
                )
            for what, cell in _FIELDS.items():
                row.setdefault(what, {})[key] = values[cell]
        else:
            row.setdefault(INCLINOMETER, {}).update(enumerate(values[2:5]))
    return _log(path, asked, why, rows, at_line, other)


def _numbers(path: Path, number: int, cells: list[str], kind: str) -> list[float]:
    if len(cells) != _CELLS[kind]:
        raise LogFileError(
            f"{path}:{number}: found {len(cells)} cells of type {kind}; accepted: {_CELLS[kind]}"
        )
    values = []
    for j, cell in enumerate(cells):
        value = parsed(cell)
        if value is None or np.isnan(value):
            raise LogFileError(
                f"{path}:{number}: cell {j + 1}: found {cell[:30]!r}; accepted: a number "
                f"up to {LARGEST:g}"
            )
        values.append(value)
    return values


def _log(
    path: Path, asked: LogRequest, why: str, rows: dict[float, dict[str, dict[int, float]]],
    at_line: dict[float, int], other: dict[str, int],
) -> RecordedLog:  # fmt: skip
    ids = sorted({key for row in rows.values() for key in row.get(LENGTH, {})})
    names = asked.names(path, len(ids))
    columns: Columns = {TIME: np.array(list(rows))}
    for what in _FIELDS:
        for name, key in zip(names, ids, strict=True):
            header = f"{COMMANDED}{name}_{TENSION}" if what == COMMANDED else f"{name}_{what}"
            columns[header] = np.array(
                [row.get(what, {}).get(key, np.nan) for row in rows.values()]
            )
    for k, header in enumerate(ANGLES):
        turns = np.array([row.get(INCLINOMETER, {}).get(k, np.nan) for row in rows.values()])
        if np.isfinite(turns).any():
            columns[header] = np.radians(turns)
    remarks = ["lengths and swivel angles count from where the encoders were switched on"]
    if other:
        told = ", ".join(f"{count} of type {kind}" for kind, count in sorted(other.items()))
        remarks.append(f"lines of other devices were left out: {told}")
    units = {
        "lengths, swivels, tensions": "m, rad, N by the format",
        "roll, pitch, yaw": "deg by the format",
        "cables": ", ".join(f"{n} is actuator {key}" for n, key in zip(names, ids, strict=True)),
    }
    log = RecordedLog(path, "grab", why, columns, units, tuple(remarks))
    return settled(log, np.array([at_line[time] for time in rows]))
