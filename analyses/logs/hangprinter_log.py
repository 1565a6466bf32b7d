"""Series of a Hangprinter's calibration: motor angles, positions of some rows, forces.

Either the arrays `motor_pos_samp` [deg], `xyz_of_samp` [mm] and `force_samp` as they stand in its
calibration script and as its measuring scripts print them, or the same as CSV with the headers
motor_A_deg ..., x_mm, y_mm, z_mm, force_A ... Positions belong to the first rows. The unit of the
forces is not stated there, so that they are kept as raw_force_A unless the user says one.

Source: github.com/tobbelobb/auto-calibration-simulation-for-hangprinter (MIT), simulation.py.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.logs.frames import turned_columns
from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.recorded_log import MOTOR, POSITION, TENSION, RecordedLog, settled
from cdpr_drake.analyses.logs.text_tables import cell_table, log_text
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError

_ARRAYS = {"motor_pos_samp": "motors", "xyz_of_samp": "points", "force_samp": "forces"}

_LETTERS = "ABCDEFGHIJKL"

_MOTOR = re.compile(r"motor_([A-Za-z0-9]+)_deg")

_FORCE = re.compile(r"force_([A-Za-z0-9]+)")


def knows_hangprinter(head: str) -> str:
    """Why a text is one of these; empty where it is not."""
    if re.search(r"^\s*motor_pos_samp\s*=", head, re.MULTILINE):
        return "it has the array motor_pos_samp"
    cells = [cell.strip() for cell in head.partition("\n")[0].split(",")]
    motors = [cell for cell in cells if _MOTOR.fullmatch(cell)]
    return f"it has the columns {motors[0]} to {motors[-1]}" if len(motors) > 2 else ""


def read_hangprinter(path: Path, asked: LogRequest) -> RecordedLog:
    """Reads motor angles, positions and forces; a row is a pose at which the machine rested.

    Raises:
        LogFileError: It is no such file, or its arrays do not fit each other.
    """
    text = log_text(path)
    why = knows_hangprinter(text)
    if not why:
        raise LogFileError(f"{path}: found no motor_pos_samp and no motor_A_deg; accepted: one")
    if "array" in why:
        names, motors, points, forces = _from_script(path, text, asked)
    else:
        names, motors, points, forces = _from_columns(path, text, asked)
    columns: Columns = {
        f"{name}_{MOTOR}": np.radians(column) for name, column in zip(names, motors.T, strict=True)
    }
    units = {"motor angles": "deg by the format"}
    if points is not None:
        columns |= dict(zip(POSITION, 1e-3 * points.T, strict=True))
        units["positions"] = "mm by the format"
    remarks = []
    if forces is not None:
        factor = asked.factor("force")
        for name, column in zip(names, forces.T, strict=True):
            header = f"raw_force_{name}" if factor is None else f"{name}_{TENSION}"
            columns[header] = column * (1.0 if factor is None else factor)
        if factor is None:
            remarks.append(
                "the unit of the forces is not stated: kept as raw_force; --unit force=N"
            )
        else:
            units["forces"] = f"{asked.units['force']}, as told"
    log = RecordedLog(
        path, "hangprinter", why, turned_columns(columns, asked.R_WF), units, tuple(remarks)
    )
    return settled(log)


def _from_columns(
    path: Path, text: str, asked: LogRequest
) -> tuple[list[str], Array, Array | None, Array | None]:
    table = cell_table(path, text)
    header, numbers = table.rows[0], table.numbers(1)
    if not len(numbers):
        raise LogFileError(f"{path}: found a header without rows; accepted: one row at least")
    letters = [m[1] for cell in header if (m := _MOTOR.fullmatch(cell))]

    def some(wanted: list[str]) -> Array | None:
        if not all(name in header for name in wanted):
            return None
        return numbers[:, [header.index(name) for name in wanted]]

    motors = some([f"motor_{letter}_deg" for letter in letters])
    assert motors is not None
    points = some(["x_mm", "y_mm", "z_mm"])
    return asked.names(path, len(letters), letters), motors, points, some(
        [f"force_{letter}" for letter in letters]
    )  # fmt: skip


def _from_script(
    path: Path, text: str, asked: LogRequest
) -> tuple[list[str], Array, Array | None, Array | None]:
    plain = "\n".join(line.partition("#")[0] for line in text.split("\n"))
    found = {what: _array(path, plain, name) for name, what in _ARRAYS.items()}
    motors = found["motors"]
    if motors is None:
        raise LogFileError(f"{path}: motor_pos_samp: found no rows; accepted: one at least")
    count, width = motors.shape
    for what, columns in (("points", 3), ("forces", width)):
        rows = found[what]
        if rows is None:
            continue
        if rows.shape[1] != columns or len(rows) > count:
            name = next(key for key, value in _ARRAYS.items() if value == what)
            raise LogFileError(
                f"{path}: {name}: found {len(rows)} rows of {rows.shape[1]}; accepted: at most "
                f"{count} of {columns}"
            )
        found[what] = np.vstack([rows, np.full((count - len(rows), columns), np.nan)])
    names = asked.names(path, width, _LETTERS[:width])
    return names, motors, found["points"], found["forces"]


def _array(path: Path, text: str, name: str) -> Array | None:
    """Rows of one array; None where there is none, or it is empty."""
    places = [m.end() for m in re.finditer(rf"^\s*{name}\s*=\s*(?:np\.array\()?", text, re.M)]
    if not places:
        return None
    if len(places) > 1:
        raise LogFileError(f"{path}: {name}: found {len(places)} times; accepted: once")
    start = text.find("[", places[0])
    depth = 0
    for end in range(max(start, 0), len(text)):
        depth += {"[": 1, "]": -1}.get(text[end], 0)
        if depth == 0:
            break
    else:
        raise LogFileError(
            f"{path}: {name}: found brackets that do not close; accepted: [[...], ...]"
        )
    try:
        rows = ast.literal_eval(text[start : end + 1])
        table = np.array(rows, float)
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as problem:
        raise LogFileError(
            f"{path}: {name}: found no table of numbers; accepted: [[...], ...]"
        ) from problem
    if table.size == 0:
        return None
    if table.ndim != 2 or not np.isfinite(table).all():
        what = f"shape {table.shape}" if table.ndim != 2 else "numbers that are not finite"
        raise LogFileError(f"{path}: {name}: found {what}; accepted: rows of finite numbers")
    return table
