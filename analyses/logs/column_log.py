"""Text with columns: with headers as `cdpr calibrate` reads them, or with a mapping file.

A mapping gives each column a header with its unit, for files without headers, or with others.
Columns that no header of a calibration says keep their name.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.calibration.columns import (
    ANGLES,
    CORNERS,
    LENGTHS,
    POSITION,
    QUATERNION,
    RPY,
    SWIVELS,
    TAIT,
    TENSIONS,
    TIME,
    TORQUES,
    TURN,
    Column,
    first_number,
    preference,
    read_header,
    split_unit,
)
from cdpr_drake.analyses.logs import recorded_log as kept
from cdpr_drake.analyses.logs.frames import axes_in_words, turned_columns
from cdpr_drake.analyses.logs.log_request import SI_OF, TOLD, ColumnMapping, LogRequest, even_times
from cdpr_drake.analyses.logs.recorded_log import RecordedLog, settled
from cdpr_drake.analyses.logs.text_tables import CellTable, cell_table, log_text, parsed
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError

MOST_CABLES = 32
"""Cables of a log whose names nobody told: C1, C2, ..."""

_ENDINGS = {
    LENGTHS: kept.LENGTH, ANGLES: kept.MOTOR, SWIVELS: kept.SWIVEL, TENSIONS: kept.TENSION,
    TORQUES: "torque_nm",
}  # fmt: skip
_PARTS = {
    POSITION: kept.POSITION, QUATERNION: kept.QUATERNION, RPY: kept.ANGLES,
    TAIT: ("phi_rad", "theta_rad", "psi_rad"), TURN: ("rx_rad", "ry_rad", "rz_rad"),
}  # fmt: skip
_DIMENSION = {
    LENGTHS: "length", POSITION: "length", ANGLES: "angle", SWIVELS: "angle", RPY: "angle",
    TAIT: "angle", TURN: "angle", TENSIONS: "force", TORQUES: "torque", TIME: "time",
}  # fmt: skip

_HEADER = re.compile(r"[A-Za-z_]")


def knows_columns(head: str) -> str:
    """Why a text is one of these: its first row has words, its second numbers; else empty."""
    lines = [line for line in head.split("\n") if line.strip() and not line.startswith("#")][:2]
    if len(lines) < 2 or not _HEADER.search(lines[0]):
        return ""
    separator = next((one for one in (";", "\t", ",") if one in lines[0]), None)
    cells = [cell.strip().strip('"') for cell in lines[0].split(separator)]
    mark = "," if separator not in (",", None) else "."
    below = [cell.strip() for cell in lines[1].split(separator)]
    numbers = [parsed(cell, mark if "," in cell else ".") is not None for cell in below]
    names = ["C" + str(k + 1) for k in range(MOST_CABLES)]
    known = [cell for cell in cells if read_header(_plain(cell)[1], names, 1) is not None]
    if not known or len(below) != len(cells) or sum(numbers) < 0.5 * len(numbers):
        return ""
    return f"its first row has the headers {', '.join(known[:3])}"


def read_columns(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads text with columns.

    Raises:
        LogFileError: It has no headers and no mapping says what its columns are, no column is
            known, two say the same, or a cell is no number; names line and column.
    """
    return columns_of_text(path, log_text(path), asked)


def columns_of_text(path: Path, text: str, asked: LogRequest) -> RecordedLog:
    """As `read_columns`, of the text of a file."""
    mapping = asked.mapping
    skip = 0 if mapping is None else mapping.skip_rows
    table = cell_table(path, text, "" if mapping is None else mapping.separator or "", skip)
    headed = any(parsed(cell, table.decimal) is None for cell in table.rows[0])
    if not headed and (mapping is None or isinstance(mapping.headers, dict)):
        raise LogFileError(
            f"{path}: found {len(table.rows[0])} columns of numbers without a header; accepted: "
            "a header, or a mapping with a list of columns"
        )
    if headed and len(table.rows) < 2:
        raise LogFileError(f"{path}: found a header without rows; accepted: one row at least")
    headers = _headers(path, table, mapping, headed)
    columns, units, remarks = _converted(path, headers, table, int(headed), asked)
    if kept.TIME not in columns:
        rate = asked.rate if asked.rate is not None else mapping and mapping.rate
        if rate:
            times = even_times(path, len(table.rows) - headed, rate)
            columns = {kept.TIME: times, **columns}
            units["time"] = f"{rate:g} rows/s, {TOLD}"
    if asked.R_WF is not None:
        units["axes"] = axes_in_words(asked.R_WF)
    why = knows_columns(text[:20_000]) or f"columns as {mapping.path if mapping else path} says"
    if mapping is not None:
        why = f"columns as {mapping.path} says"
    log = RecordedLog(path, "csv", why, turned_columns(columns, asked.R_WF), units, remarks)
    return settled(log, np.array(table.lines[int(headed) :]))


def _headers(
    path: Path, table: CellTable, mapping: ColumnMapping | None, headed: bool
) -> list[str]:
    """What is read in each column; empty: it is left out."""
    if mapping is None:
        return table.rows[0]
    width = len(table.rows[0])
    if isinstance(mapping.headers, tuple):
        if len(mapping.headers) != width:
            raise LogFileError(
                f"{mapping.path}: columns: found {len(mapping.headers)}; accepted: {width}, one "
                f"for each column of {path}"
            )
        return list(mapping.headers)
    missing = [name for name in mapping.headers if name not in table.rows[0]]
    if missing:
        raise LogFileError(
            f"{mapping.path}: columns: found {missing[0]!r}; accepted: names in {path}: "
            f"{', '.join(table.rows[0])[:120]}"
        )
    return [mapping.headers.get(name, "") for name in table.rows[0]]


def _plain(header: str) -> tuple[str, str]:
    """What stands before a header that is no measurement, and the header without it."""
    for prefix in (kept.COMMANDED, kept.ESTIMATED):
        if header.lower().startswith(prefix):
            return prefix, header[len(prefix) :]
    return "", header


def _converted(
    path: Path, headers: list[str], table: CellTable, first: int, asked: LogRequest
) -> tuple[Columns, dict[str, str], tuple[str, ...]]:
    names = list(asked.cables or ["C" + str(k + 1) for k in range(MOST_CABLES)])
    start = first_number([_plain(header)[1] for header in headers], len(asked.cables or ()) or -1)
    columns: Columns = {}
    units: dict[str, str] = {}
    unread: list[str] = []
    worse: list[str] = []
    taken: dict[str, str] = {}
    known = 0
    for j, header in enumerate(headers):
        if not header:
            continue
        prefix, words = _plain(header)
        column = read_header(words, names, start)
        values = np.full(len(table.rows) - first, np.nan)
        if column is None:
            numbers = [parsed(row[j], table.decimal) for row in table.rows[first:]]
            if any(value is None for value in numbers):
                unread.append(header)
                continue
            name, factor, told = header, 1.0, ""
        else:
            known += 1
            name = prefix + _name(column, names)
            factor, told = _factor(path, header, words, column, asked)
            numbers = [table.number(k, j) for k in range(first, len(table.rows))]
        if name in columns:
            here, there = preference(header), preference(taken[name])
            if here == there:
                raise LogFileError(f"{path}: column {header!r}: found {name} twice; accepted: once")
            worse.append(header if here < there else taken[name])
            if here < there:
                continue
            units.pop(taken[name], None)
        values[:], taken[name] = numbers, header
        columns[name] = factor * values
        if told:
            units[header] = told
    if not known:
        raise LogFileError(
            f"{path}: columns: found {', '.join(h for h in headers if h)[:120]}; accepted: time_s, "
            "C1_length_m, x_m, qw, C1_tension_n and the like, or a mapping that says so"
        )
    remarks = [f"columns with words were left out: {', '.join(unread)}"] if unread else []
    if worse:
        told = "what is measured, or what winches count, stands for them"
        remarks.append(f"left out, since {told}: {', '.join(worse)}")
    return columns, _joined(units), tuple(remarks)


def _name(column: Column, names: list[str]) -> str:
    key = column.key
    if column.what == TIME:
        return kept.TIME
    if column.what == CORNERS:
        assert isinstance(key, tuple)
        return f"tag{key[0]}_{'uv'[key[2]]}{key[1] + 1}_px"
    assert isinstance(key, int)
    if column.what in _PARTS:
        return _PARTS[column.what][key]
    return f"{names[key]}_{_ENDINGS[column.what]}"


def _factor(
    path: Path, header: str, words: str, column: Column, asked: LogRequest
) -> tuple[float, str]:
    """By which a column becomes SI, and who said so."""
    dimension = _DIMENSION.get(column.what, "")
    if not dimension:
        return 1.0, ""
    unit = split_unit(words)[1]
    if unit:
        return column.factor, f"{unit} by its header"
    told = asked.factor(dimension)
    if told is not None:
        return told, f"{asked.units[dimension]}, as told"
    return 1.0, f"{SI_OF[dimension]}, since neither header nor --unit says another"


def _joined(units: dict[str, str]) -> dict[str, str]:
    """Units, with columns of one unit and origin in one line."""
    by_words: dict[str, list[str]] = {}
    for header, words in units.items():
        by_words.setdefault(words, []).append(header)
    return {
        f"{headers[0]} to {headers[-1]}" if len(headers) > 2 else ", ".join(headers): words
        for words, headers in by_words.items()
    }


def as_table(log: RecordedLog, headers: tuple[str, ...]) -> Array | None:
    """Columns of a log, shape (k, n); None where one is missing."""
    return log.table(headers) if all(header in log.columns for header in headers) else None
