"""OptiTrack Motive's CSV: rigid bodies and markers over time.

Above the rows stand a line of settings in pairs, and lines of types, names, identities and what
each column is. Quaternions have their real part last. Where the settings name no `Length Units`, as
in format version 1.1, the user has to.

Source: OptiTrack, Data Export: CSV, docs.optitrack.com/motive/data-export/data-export-csv.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.logs.frames import axes_in_words, turned_columns
from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.recorded_log import POSITION, QUATERNION, TIME, RecordedLog, settled
from cdpr_drake.analyses.logs.text_tables import cell_table, log_text
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError, accepted_names

FIRST = "Format Version"

_UNITS = {"meters": 1.0, "centimeters": 1e-2, "millimeters": 1e-3}

_MOST_HEAD = 12
"""Lines above the rows; there are seven or eight."""

_TURN = 1e-2
"""By how much the length of a quaternion may differ from 1."""


def knows_motive(head: str) -> str:
    """Why a text is one of these; empty where it is not."""
    return f"its first cell is {FIRST!r}" if head.startswith(f"{FIRST},") else ""


def read_motive(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads poses of the platform's rigid body, and markers that belong to no body.

    Raises:
        LogFileError: It is no such file, does not say its unit, has no body or several, or a cell
            is no number.
    """
    text = log_text(path)
    why = knows_motive(text)
    if not why:
        raise LogFileError(f"{path}: found {text[:30]!r} at the top; accepted: {FIRST!r}")
    lines = text.split("\n")
    place = next((k for k, line in enumerate(lines[:_MOST_HEAD]) if line.startswith("Frame,")), -1)
    if place < 0:
        raise LogFileError(
            f"{path}: found no line that begins with Frame; accepted: one above rows"
        )
    settings = _pairs(lines[0])
    width = len(lines[place].split(","))
    head = [_cells(line, width) for line in lines[1:place] if line.strip(", \t")]
    types = next(
        (row for row in head if any("Rigid Body" in c or c == "Marker" for c in row)), None
    )
    what = next((row for row in head if "Position" in row), None)
    if types is None or what is None:
        raise LogFileError(f"{path}: found no types or no Position above the rows; accepted: both")
    if settings.get("Rotation Type", "Quaternion") != "Quaternion":
        raise LogFileError(
            f"{path}: Rotation Type: found {settings['Rotation Type']}; accepted: Quaternion"
        )
    names = head[min(head.index(types) + 1, len(head) - 1)]
    axes = _cells(lines[place], width)
    table = cell_table(path, text, ",", skip=place + 1)
    if len(table.rows[0]) != width:
        raise LogFileError(
            f"{path}:{table.lines[0]}: found {len(table.rows[0])} cells; accepted: {width}"
        )
    factor, unit = _unit(path, settings, asked)
    groups = _groups(path, types, names, what, axes)
    body = _body(path, groups, table.rows, asked)
    wanted: dict[str, tuple[int, float]] = {TIME: (1, 1.0)}
    if body:
        for header, axis in zip(POSITION, "XYZ", strict=True):
            wanted[header] = (groups["Rigid Body", body]["Position", axis], factor)
        for header, axis in zip(QUATERNION, "WXYZ", strict=True):
            wanted[header] = (groups["Rigid Body", body]["Rotation", axis], 1.0)
    for (kind, name), of_axis in groups.items():
        if kind == "Marker" and _is_used(table.rows, of_axis["Position", "X"]):
            word = re.sub(r"\W+", "_", name).strip("_")
            for header, axis in zip(POSITION, "XYZ", strict=True):
                wanted[f"marker_{word}_{header}"] = (of_axis["Position", axis], factor)
    columns: Columns = {
        header: factor * np.array([table.number(k, j) for k in range(len(table.rows))])
        for header, (j, factor) in wanted.items()
    }
    units = {"positions": unit}
    if asked.R_WF is not None:
        units["axes"] = axes_in_words(asked.R_WF)
    _check_turns(path, columns, table.lines)
    log = RecordedLog(
        path, "motive", why, turned_columns(columns, asked.R_WF), units, _remarks(groups, body)
    )
    return settled(log, np.array(table.lines))


def _cells(line: str, width: int) -> list[str]:
    cells = [cell.strip().strip('"') for cell in line.split(",")]
    return cells[:width] + [""] * (width - len(cells))


def _pairs(line: str) -> dict[str, str]:
    cells = [cell.strip() for cell in line.split(",")]
    return dict(zip(cells[::2], cells[1::2], strict=False))


def _unit(path: Path, settings: dict[str, str], asked: LogRequest) -> tuple[float, str]:
    """Factor of lengths, and who said so."""
    given, told = settings.get("Length Units", ""), asked.factor("length")
    known = _UNITS.get(given.lower())
    if known is None and told is None:
        raise LogFileError(
            f"{path}: Length Units: found {given or 'none'}; {accepted_names(given, _UNITS)}, or "
            "--unit length=m, mm or cm"
        )
    if known is not None and told is not None and known != told:
        raise LogFileError(
            f"{path}: Length Units: found {given}, and {asked.units['length']} told by --unit; "
            "accepted: one of them"
        )
    if known is not None:
        return known, f"{given.lower()} by the file's Length Units"
    return float(told or 1.0), f"{asked.units['length']}, as told"


_POSITION = tuple(("Position", axis) for axis in "XYZ")
_COLUMNS = {
    "Rigid Body": (*_POSITION, *(("Rotation", axis) for axis in "XYZW")),
    "Marker": _POSITION,
    "Rigid Body Marker": _POSITION,
}
"""Columns that a body or marker has, by its type."""


def _groups(
    path: Path, types: list[str], names: list[str], what: list[str], axes: list[str]
) -> dict[tuple[str, str], dict[tuple[str, str], int]]:
    """Columns by type and name of their body, and there by Rotation or Position and axis.

    Raises:
        LogFileError: A body or a marker has some of its columns only.
    """
    found: dict[tuple[str, str], dict[tuple[str, str], int]] = {}
    for j, (kind, name, part, axis) in enumerate(zip(types, names, what, axes, strict=True)):
        if j > 1 and (part, axis) in _COLUMNS.get(kind, ()):
            found.setdefault((kind, name), {}).setdefault((part, axis), j)
    for (kind, name), parts in found.items():
        missing = [f"{part} {axis}" for part, axis in _COLUMNS[kind] if (part, axis) not in parts]
        if missing:
            whole = ", ".join(f"{part} {axis}" for part, axis in _COLUMNS[kind])
            raise LogFileError(
                f"{path}: {kind} {name!r}: found no column {', '.join(missing)}; accepted: {whole}"
            )
    return found


def _is_used(rows: list[list[str]], column: int) -> bool:
    return any(row[column] for row in rows)


def _body(
    path: Path, groups: dict[tuple[str, str], dict[tuple[str, str], int]],
    rows: list[list[str]], asked: LogRequest,
) -> str:  # fmt: skip
    """Name of the rigid body that is the platform; empty where there are markers alone."""
    bodies = {
        name: sum(1 for row in rows if row[parts["Position", "X"]])
        for (kind, name), parts in groups.items()
        if kind == "Rigid Body"
    }
    told = ", ".join(f"{name!r} ({count} rows)" for name, count in bodies.items())
    if asked.body is not None:
        if asked.body not in bodies:
            raise LogFileError(f"{path}: body: found {asked.body!r}; accepted: {told or 'none'}")
        return asked.body
    seen = [name for name, count in bodies.items() if count]
    if len(seen) > 1:
        raise LogFileError(f"{path}: body: found {told}; accepted: one of them by --body")
    if not seen and not any(kind == "Marker" for kind, _ in groups):
        raise LogFileError(f"{path}: found no rigid body and no marker; accepted: one at least")
    return seen[0] if seen else ""


def _check_turns(path: Path, columns: Columns, lines: list[int]) -> None:
    if QUATERNION[0] not in columns:
        return
    size: Array = np.linalg.norm([columns[name] for name in QUATERNION], axis=0)
    off = np.abs(size - 1.0) > _TURN
    if off.any():
        k = int(np.argmax(off))
        raise LogFileError(
            f"{path}:{lines[k]}: quaternion: found length {size[k]:.4g}; accepted: 1"
        )


def _remarks(
    groups: dict[tuple[str, str], dict[tuple[str, str], int]], body: str
) -> tuple[str, ...]:
    said = [f"the platform is the rigid body {body!r}"] if body else ["no rigid body: markers only"]
    parts = sum(1 for kind, _ in groups if kind == "Rigid Body Marker")
    others = [n for kind, n in groups if kind == "Rigid Body" and n != body]
    if parts:
        said.append(f"{parts} markers that make up rigid bodies were left out")
    if others:
        said.append(f"other rigid bodies were left out: {', '.join(others)}")
    return tuple(said)
