"""Logs in MATLAB's files: what GRAB's tools parse, or any variables with a mapping.

Variables of GRAB's: t [s], epsilon (roll, pitch, yaw) [rad], cable_length [m], swivel [rad],
tensions, target_tensions [N], each with a row a cable; also with _r behind (1 kHz), then with
epsilon_r in degrees, as the inclinometer sends them. A mapping gives variables their headers, with
{c} for the names of cables: `st.tensions: "{c}_tension_n"`.

Source: github.com/fzoffoli/UACDPR_SelfCalibration, CdprViconDataHandling/CdprDataHandling.m and
CdprViconDataHandling.m, which makes radians of epsilon_r.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.calibration.columns import UNITS, read_header, split_unit
from cdpr_drake.analyses.logs.frames import turned_columns
from cdpr_drake.analyses.logs.log_request import TOLD, LogRequest, even_times
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
from cdpr_drake.analyses.logs.text_tables import MOST_BYTES
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.schema.input_files import file_size

GRAB_VARIABLES = {
    "t": (TIME,),
    "epsilon": ANGLES,
    "epsilon_r": ("roll_deg", "pitch_deg", "yaw_deg"),
    "cable_length": (f"{{c}}_{LENGTH}",),
    "swivel": (f"{{c}}_{SWIVEL}",),
    "tensions": (f"{{c}}_{TENSION}",),
    "target_tensions": (f"{COMMANDED}{{c}}_{TENSION}",),
}
"""Headers of their variables."""

MAGIC = b"MATLAB 5.0 MAT-file"

_ROBOT = {"EndEffector", "Trasmission"}
"""Fields of their robots, as the files spell them."""


def knows_mat(raw: bytes) -> str:
    """Why a file is one of these; empty where it is not."""
    return f"it begins with {MAGIC.decode()}" if raw.startswith(MAGIC) else ""


def read_mat_variables(path: Path) -> dict[str, Any]:
    """Variables of a file by name, those of structures by structure.name.

    Raises:
        LogFileError: It cannot be read.
    """
    from scipy.io import loadmat

    try:
        if file_size(path) > MOST_BYTES:
            raise LogFileError(f"{path}: found more than {MOST_BYTES:,} bytes; accepted: fewer")
        content = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except LogFileError:
        raise
    except Exception as problem:  # scipy raises of all kinds on damaged files
        words = " ".join(str(problem).split())[:160] or type(problem).__name__
        raise LogFileError(f"{path}: cannot be read as a file of MATLAB: {words}") from problem
    return dict(_flat("", {k: v for k, v in content.items() if not k.startswith("__")}, 0))


def _flat(prefix: str, content: dict[str, Any], depth: int) -> Iterator[tuple[str, Any]]:
    for name, value in content.items():
        names = getattr(value, "_fieldnames", None)
        if names is not None and depth < 8:
            inner = {key: getattr(value, key) for key in names}
            yield from _flat(f"{prefix}{name}.", inner, depth + 1)
        else:
            yield f"{prefix}{name}", value


def read_mat(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads a log of GRAB's tools, or the variables that a mapping names.

    Raises:
        LogFileError: It cannot be read, has none of these variables, is a robot, or its variables
            do not have equally many rows.
    """
    found = read_mat_variables(path)
    if {name.split(".")[1] for name in found if "." in name} >= _ROBOT:
        raise LogFileError(
            f"{path}: found a robot of GRAB's tools; accepted: logs; see cdpr import"
        )
    wanted = _mapped(path, found, asked) if asked.mapping else _known(found)
    if not wanted:
        raise LogFileError(
            f"{path}: found the variables {', '.join(found)[:120] or 'none'}; accepted: "
            f"{', '.join(GRAB_VARIABLES)}, or a mapping that says what they are"
        )
    tables = {name: _table(path, name, found[name]) for name in wanted}
    count = max(len(table) for table in tables.values())
    columns: Columns = {}
    remarks = [f"variables left out: {', '.join(rest)}" for rest in [_rest(found, wanted)] if rest]
    for name, headers in wanted.items():
        table = tables[name]
        if len(table) != count:
            raise LogFileError(
                f"{path}: {name}: found {len(table)} rows; accepted: {count}, as the others have"
            )
        for header, column in zip(_spread(path, name, headers, table, asked), table.T, strict=True):
            if header in columns:
                raise LogFileError(f"{path}: {name}: found {header} twice; accepted: once")
            name_si, factor = _si(header)
            columns[name_si] = factor * column
    by_rate = TIME not in columns and asked.rate is not None
    if by_rate:
        columns = {TIME: even_times(path, count, asked.rate), **columns}
    columns = {header: columns[header] for header in sorted(columns, key=lambda h: h != TIME)}
    said = "m, rad, N, s by the format"
    if any(headers[0].endswith("_deg") for headers in wanted.values()):
        said += "; epsilon_r in deg"
    units = {"variables": said if not asked.mapping else "by the mapping"}
    if by_rate:
        units["time"] = f"{asked.rate:g} rows/s, {TOLD}"
    log = RecordedLog(
        path, "mat", knows_mat(MAGIC), turned_columns(columns, asked.R_WF), units, tuple(remarks)
    )
    return settled(log)


def _known(found: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    wanted = {}
    for name in found:
        last = name.rpartition(".")[2]
        headers = GRAB_VARIABLES.get(last) or GRAB_VARIABLES.get(last.removesuffix("_r"))
        if headers is not None:
            wanted[name] = headers
    return wanted if len(wanted) > 1 else {}


def _mapped(path: Path, found: dict[str, Any], asked: LogRequest) -> dict[str, tuple[str, ...]]:
    mapping = asked.mapping
    assert mapping is not None
    if not isinstance(mapping.headers, dict):
        raise LogFileError(f"{mapping.path}: columns: found a list; accepted: variable: header")
    missing = [name for name in mapping.headers if name not in found]
    if missing:
        raise LogFileError(
            f"{mapping.path}: columns: found {missing[0]!r}; accepted: variables of {path}: "
            f"{', '.join(found)[:120]}"
        )
    return {
        name: tuple(word.strip() for word in words.split(","))
        for name, words in mapping.headers.items()
        if words
    }


def _rest(found: dict[str, Any], wanted: dict[str, tuple[str, ...]]) -> list[str]:
    return [name for name in found if name not in wanted]


def _table(path: Path, name: str, value: Any) -> Array:
    """A variable with a row an instant, shape (k, n): MATLAB's have a row a cable here."""
    try:
        table = np.atleast_1d(np.asarray(value, float))
    except (TypeError, ValueError) as problem:
        raise LogFileError(f"{path}: {name}: found what are no numbers") from problem
    if table.ndim == 1:
        return table[:, None]
    if table.ndim != 2:
        raise LogFileError(f"{path}: {name}: found shape {table.shape}; accepted: rows and columns")
    return table.T if table.shape[0] < table.shape[1] else table


def _spread(
    path: Path, name: str, headers: tuple[str, ...], table: Array, asked: LogRequest
) -> list[str]:
    width = table.shape[1]
    if len(headers) == 1 and "{c}" in headers[0]:
        return [headers[0].replace("{c}", cable) for cable in asked.names(path, width)]
    if len(headers) != width:
        raise LogFileError(
            f"{path}: {name}: found {width} columns; accepted: {len(headers)}: {', '.join(headers)}"
        )
    return list(headers)


def _si(header: str) -> tuple[str, float]:
    """A header with its SI unit, and the factor on its numbers."""
    words, unit = split_unit(header)
    if not unit or (read_header(header, [], 1) is not None and unit in ("s", "m", "rad", "n")):
        return header, 1.0
    dimension, factor = UNITS[unit]
    si = {"length": "m", "angle": "rad", "force": "n", "time": "s", "torque": "nm"}.get(dimension)
    if si is None or unit == si:
        return header, 1.0
    return f"{header[: len(words)]}_{si}", factor
