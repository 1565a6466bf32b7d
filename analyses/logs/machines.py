"""Logs of machines whose files are no tables: Hangprinter, Maslow, GRAB, GTGraffiti, MATLAB."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from cdpr_drake.analyses.logs.assembly import (
    LEFT_OUT,
    Values,
    assemble,
    is_number,
    numbers,
    read_cells,
)
from cdpr_drake.analyses.logs.columns import (
    COMMANDED,
    ESTIMATED,
    LENGTH,
    PARTS,
    RPY,
    SECONDS,
    SWIVEL,
    TENSION,
)
from cdpr_drake.analyses.logs.log import AS_TOLD, Facts, Log, refusal, unreadable
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError

_LOOKED = 20
"""Lines by which a file is recognised."""


def _top(head: str) -> list[str]:
    return [line for line in head.split("\n", _LOOKED)[:_LOOKED] if line.strip()]


# Hangprinter: github.com/tobbelobb/auto-calibration-simulation-for-hangprinter, simulation.py.

_ARRAYS = ("motor_pos_samp", "xyz_of_samp", "force_samp")
_MOTOR = re.compile(r"motor_([A-Za-z0-9]+)_deg")
_NO_FORCE_UNIT = (
    "the unit of the forces is not stated: kept as raw_force; cdpr import-log --unit force=N"
)


def knows_hangprinter(head: str) -> str:
    """Recognises the arrays of a Hangprinter's scripts, or a table of motor_A_deg."""
    if re.search(r"^\s*motor_pos_samp\s*=", head, re.MULTILINE):
        return "it has the array motor_pos_samp"
    cells = [cell.strip() for cell in head.partition("\n")[0].split(",")]
    motors = [cell for cell in cells if _MOTOR.fullmatch(cell)]
    return f"it has the columns {motors[0]} to {motors[-1]}" if len(motors) > 2 else ""


def read_hangprinter(path: Path, text: str, facts: Facts) -> Log:
    """Reads motor angles [deg], positions [mm] of some rows, and forces; a row is a pose at rest.

    Forces have no unit there; they are kept as raw_force unless the user names one.
    """
    lines, decimal = None, "."
    if "array" in knows_hangprinter(text):
        tables = {name: _series(path, text, name) for name in _ARRAYS}
        motors = tables["motor_pos_samp"]
        if not motors:
            raise refusal(f"{path}: motor_pos_samp", "no rows", "one at least")
        letters = list("ABCDEFGHIJKL"[: len(motors[0])])
        shown = {"motor_pos_samp": [f"motor_{letter}_deg" for letter in letters],
                 "xyz_of_samp": ["x_mm", "y_mm", "z_mm"],
                 "force_samp": [f"force_{letter}" for letter in letters]}  # fmt: skip
        for name, rows in tables.items():
            wide = [row for row in rows if len(row) != len(shown[name])]
            if wide or len(rows) > len(motors):
                words = f"{len(rows)} rows of {len((wide or rows)[0])}"
                accepted = f"at most {len(motors)} of {len(shown[name])}"
                raise refusal(f"{path}: {name}", words, accepted)
        frames = [pd.DataFrame(rows, columns=shown[n]) for n, rows in tables.items() if rows]
        frame = pd.concat(frames, axis=1).fillna("")
    else:
        cells = read_cells(path, text)
        lines, decimal = cells.lines[1:], cells.decimal
        frame = pd.DataFrame(cells.rows[1:], columns=cells.rows[0])
        if frame.empty:
            raise refusal(path, "a header without rows", "one row at least")
        letters = [motor[1] for cell in frame if (motor := _MOTOR.fullmatch(cell))]
    own, columns = list(frame), frame.to_numpy().T.tolist()
    names = facts.names(path, len(letters), letters)
    stated, headers = "force" in facts.units, {name: name for name in own}
    for letter, name in zip(letters, names, strict=True):
        headers[f"motor_{letter}_deg"] = f"{name}_motor_deg"
        headers[f"force_{letter}"] = f"{name}_tension" if stated else f"raw_force_{letter}"
    forces = any(f"force_{letter}" in own for letter in letters)
    units = {"motor angles": "deg by the format"}
    units |= {"positions": "mm by the format"} if "x_mm" in own else {}
    units |= {"forces": f"{facts.units['force']}, {AS_TOLD}"} if forces and stated else {}
    return assemble(
        path, [(headers[own[j]], column) for j, column in enumerate(columns)], facts, shown=own,
        lines=lines, units=units, cables=names, decimal=decimal,
        remarks=[_NO_FORCE_UNIT] if forces and not stated else [],
    )  # fmt: skip


def _series(path: Path, text: str, name: str) -> list[list[str]]:
    """Rows of an array of a script; signs may be doubled, --7945.95, as its scripts accept it."""
    plain = re.sub(r"#[^\n]*", "", text)
    begins = list(re.finditer(rf"^[ \t]*{name}\s*=\s*(np\.array\s*\()?\s*(?=\[)", plain, re.M))
    if len(begins) > 1:
        places = ", ".join(str(plain.count("\n", 0, begin.end()) + 1) for begin in begins)
        raise refusal(f"{path}: {name}", f"{len(begins)} times, in lines {places}", "once")
    if not begins:
        return []
    begin = begins[0].end()
    other = r"[^\[\]]*+"
    table = re.compile(rf"\[({other}\[{other}\])*+{other}\]").match(plain, begin)
    if table is None or not (table[1] or table[0].strip("[], \n") == ""):
        place = f"{path}:{plain.count(chr(10), 0, begin) + 1}: {name}"
        raise refusal(place, "no table with closed brackets", "[[...], ...]")
    rows = []
    for row in re.compile(r"\[([^\[\]]+)\]").finditer(plain, begin + 1, table.end() - 1):
        cells = [cell.strip() for cell in row[1].strip().rstrip(",").split(",")]
        for k, cell in enumerate(cells):
            signs, word = re.fullmatch(r"([+\-\s]*)(.*)", cell, re.S).groups()  # type: ignore[union-attr]
            if not word or not is_number(word):
                line = plain.count("\n", 0, row.start(1)) + 1
                accepted = "numbers, or nan where nothing was measured"
                raise refusal(f"{path}:{line}: {name}", repr(cell[:40]), accepted)
            cells[k] = "" if word.lower() == "nan" else "-" * (signs.count("-") % 2) + word
        rows.append(cells)
    return rows


# Maslow 4: github.com/MaslowCNC/Maslow_4, FluidNC/src/Maslow/Calibration.cpp.

_BELTS = re.compile(r"\{([^{}]*\b(?:tl|tr|bl|br)\b[^{}]*)\}")


def knows_maslow(head: str) -> str:
    """Recognises CLBM lines, or the belts alone as they are pasted in forums."""
    if re.search(r"CLBM:\s*\[", head):
        return "it has CLBM lines"
    return "it has belts {bl: ..., tl: ...}" if _BELTS.search(head) else ""


def read_maslow(path: Path, text: str, facts: Facts) -> Log:
    """Reads belt lengths [mm] at the poses of a calibration, in the plane of the work.

    The firmware repeats its list with more poses each time, or sends poses one by one.
    """
    lines = list(enumerate(text.split("\n"), 1))
    if "CLBM" in knows_maslow(text):
        lines = [(number, line) for number, line in lines if "CLBM:" in line]
    series: list[tuple[int, dict[str, str]]] = []
    remarks = []
    for number, line in lines:
        poses = [(number, _belts(path, number, found[1])) for found in _BELTS.finditer(line)]
        if [belts for _, belts in poses[: len(series)]] == [belts for _, belts in series]:
            series = poses
        elif len(poses) > 1 and len(series) > 1 and "CLBM:" in line:
            remarks.append(f"line {number} begins another series; {len(series)} poses before it "
                           "were left out")  # fmt: skip
            series = poses
        else:
            series += poses
    if not series:
        raise refusal(path, "no belts", "CLBM:[{bl:..., br:..., ...}, ...]")
    names = list(series[0][1])
    for number, belts in series:
        if set(belts) != set(names):
            raise refusal(f"{path}:{number}", f"the belts {', '.join(belts)}", ", ".join(names))
    new = facts.names(path, len(names), names)
    columns = [
        (f"{cable}_length_mm", [belts[name] for _, belts in series])
        for name, cable in zip(names, new, strict=True)
    ]
    return assemble(
        path, columns, facts, shown=names, cables=new, lines=[number for number, _ in series],
        units={"belts": "mm by the format"}, remarks=remarks,
    )  # fmt: skip


def _belts(path: Path, number: int, words: str) -> dict[str, str]:
    """Lengths by belt of one pose."""
    belts = {}
    for pair in words.split(","):
        name, mark, value = (part.strip().strip("\"'") for part in pair.partition(":"))
        if not mark or not value or not is_number(value) or name in belts:
            accepted = "belts with their lengths, each once, as bl:2376.69"
            raise refusal(f"{path}:{number}", repr(pair.strip()[:40]), accepted)
        belts[name] = value
    return belts


# GRAB: github.com/fzoffoli/UACDPR_SelfCalibration, sc_8_final.log beside sc_8_final_parsed.mat,
# which has the same tensions and roll, pitch [rad]; its swivel angles have the other sign and a
# zero of their own, its lengths what homing adds. The two older layouts: OCDPR_SelfCalibration.

_LAYOUTS = {
    14: {LENGTH: 7, TENSION: 9, COMMANDED: 10, SWIVEL: 13},
    12: {LENGTH: 7, TENSION: 8, SWIVEL: 11}, 11: {LENGTH: 7, SWIVEL: 10},
}  # fmt: skip
"""Cells of an actuator's line by its number of cells: older recorders wrote fewer."""

_UNUSED = ("state", "motor counts", "motor rate", "motor torque", "length rate", "swivel counts",
           "swivel rate")  # fmt: skip
"""What else an actuator's line has; older recorders wrote no rates of lengths."""

_ACTUATOR, _INCLINOMETER, _TILT_CELLS, _MOST_ACTUATORS = "3", "5", 5, 64

_JITTER = 2.5e-3
"""Older recorders read actuators one after the other: so much later is the same row [s]."""


def knows_grab(head: str) -> str:
    """Recognises lines type,time,... of actuators and of the inclinometer."""
    lines = [line.split(",") for line in _top(head)]
    width = next((len(c) for c in lines if c[0] == _ACTUATOR and len(c) in _LAYOUTS), 0)
    width_of = {_ACTUATOR: width, _INCLINOMETER: _TILT_CELLS}
    known = [cells for cells in lines if len(cells) == width_of.get(cells[0])]
    values = all(is_number(cell) and cell.strip() for cells in known for cell in cells)
    if len(lines) < 2 or not width or not values or len(known) < 0.6 * len(lines):
        return ""
    words = f"{width} cells of actuators (3), {_TILT_CELLS} of the inclinometer (5)"
    return f"its lines are type,time,... with {words}"


def read_grab(path: Path, text: str, facts: Facts) -> Log:
    """Reads lengths [m], swivel angles [rad], tensions, wanted tensions [N], and roll, pitch, yaw
    [deg]; one time is one row. Lengths and swivels count from where encoders were switched on.
    """
    rows: dict[float, dict[tuple[str, int], float]] = {}  # by time
    at_line: list[int] = []
    other = Counter[str]()
    width = late = 0
    for number, line in enumerate(text.split("\n"), 1):
        cells = [cell.strip() for cell in line.split(",")]
        if not line.strip():
            continue
        if cells[0] not in (_ACTUATOR, _INCLINOMETER):
            if not cells[0].isdigit():
                raise refusal(f"{path}:{number}: type", f"{cells[0][:20]!r}", "a number")
            other[cells[0]] += 1
            continue
        actuator = cells[0] == _ACTUATOR
        width = width or (len(cells) if actuator and len(cells) in _LAYOUTS else 0)
        cell_count = (width or 14) if actuator else _TILT_CELLS
        if len(cells) != cell_count:
            raise refusal(f"{path}:{number}", f"{len(cells)} cells of type {cells[0]}", cell_count)
        for j, cell in enumerate(cells):
            if not is_number(cell, finite=True):
                raise refusal(f"{path}:{number}: cell {j + 1}", f"{cell[:30]!r}", "a finite number")
        values = [float(cell) for cell in cells]
        key = int(values[2])
        if actuator and not (key == values[2] and 0 <= key < _MOST_ACTUATORS):
            raise refusal(f"{path}:{number}: actuator", cells[2], "a whole number from 0")
        time = values[1]
        if time not in rows and rows and actuator and width < 14:
            before = next(reversed(rows))
            if 0.0 < time - before < _JITTER and (LENGTH, key) not in rows[before]:
                time = before
                late += 1
        if time not in rows:
            rows[time] = {}
            at_line.append(number)
        if actuator and (LENGTH, key) in rows[time]:
            raise refusal(f"{path}:{number}", f"actuator {key} twice at {values[1]:g} s", "once")
        if actuator:
            rows[time] |= {(what, key): values[j] for what, j in _LAYOUTS[width].items()}
        else:
            rows[time] |= {(_INCLINOMETER, k): values[2 + k] for k in range(3)}
    keys = sorted({key for row in rows.values() for what, key in row if what == LENGTH})
    names = facts.names(path, len(keys))
    headers = {
        (what, key): f"{COMMANDED}{name}_{TENSION}" if what == COMMANDED else f"{name}_{what}"
        for what in _LAYOUTS[width or 14] for name, key in zip(names, keys, strict=True)
    }  # fmt: skip
    if any((_INCLINOMETER, 0) in row for row in rows.values()):
        headers |= {(_INCLINOMETER, k): f"{a}_deg" for k, a in enumerate(("roll", "pitch", "yaw"))}
    columns = [(SECONDS, np.array(list(rows)))]
    columns += [(header, np.array([row.get(key, np.nan) for row in rows.values()]))
                for key, header in headers.items()]  # fmt: skip
    remarks = ["lengths and swivel angles count from where the encoders were switched on"]
    if other:
        counts = ", ".join(f"{count} of type {kind}" for kind, count in sorted(other.items()))
        remarks.append(f"lines of other devices were left out: {counts}")
    if late:
        remarks.append(f"{late} lines that came up to {1e3 * _JITTER:g} ms after the first one of "
                       "their row stand in that row")  # fmt: skip
    unused = [name for name in _UNUSED if width in (0, 14) or name != "length rate"]
    units = {
        "lengths, swivels, tensions": "m, rad, N by the format",
        "roll, pitch, yaw": "deg by the format",
        "cables": ", ".join(f"{n} is actuator {key}" for n, key in zip(names, keys, strict=True)),
    }
    return assemble(
        path, columns, facts, lines=at_line, units=units, cables=names, remarks=remarks,
        left_out=dict.fromkeys(unused + [f"type {kind}" for kind in sorted(other)], LEFT_OUT),
    )  # fmt: skip


# GTGraffiti: github.com/gchenfc/cable-robot, Firmware/gerry06_mcu_only.


def knows_graffiti(head: str) -> str:
    """Recognises lines `mode: x y - x_d y_d | error state -length rate | ...`."""
    lines = _top(head)
    known = sum(_graffiti_cells(line) is not None for line in lines)
    words = "its lines are mode: x y - x y | error state length speed | ..."
    return words if len(lines) > 1 and known >= 0.8 * len(lines) else ""


def read_graffiti(path: Path, text: str, facts: Facts) -> Log:
    """Reads lengths, estimated and wanted positions [m] of a robot on an upright wall.

    x is to the right and y upwards, which are x and z of W; 0 0 is no wanted position.
    """
    lines = [(k, line) for k, line in enumerate(text.split("\n"), 1) if line.strip()]
    rows: list[list[float]] = []
    remarks = []
    for number, line in lines:
        cells = _graffiti_cells(line)
        if cells is not None and len(cells) == len((rows or [cells])[0]):
            rows.append(cells)
        elif cells is None and re.fullmatch(r"[A-Z][A-Z _!]*", line.strip()):
            remarks.append(f"line {number} says {line.strip()} and was left out")
        elif cells is None and number == lines[-1][0]:
            remarks.append(f"the last line, {number}, is cut off and was left out")
        else:
            raise refusal(f"{path}:{number}", f"{line[:40]!r}", "mode: x y - x y | e s l v | ...")
    if facts.rate is None:
        raise refusal(f"{path}: time", "no column of times", "one, or use rate [1/s]")
    table = np.array(rows)
    names = facts.names(path, (table.shape[1] - 5) // 4)
    wanted = table[:, 3:5]
    wanted[np.all(wanted == 0.0, axis=1)] = np.nan
    columns = [(f"{name}_{LENGTH}", -table[:, 7 + 4 * k]) for k, name in enumerate(names)]
    for k, axis in enumerate("xz"):
        columns.append((f"{ESTIMATED}{axis}_m", table[:, 1 + k]))
        columns.append((f"{COMMANDED}{axis}_m", wanted[:, k]))
    columns.append(("mode", table[:, 0]))
    remarks.append("x and y of the log are x and z of W; a wanted position 0, 0 is none")
    return assemble(
        path, columns, replace(facts, R_WF=None), units={"lengths, positions": "m by the format"},
        remarks=remarks, cables=names,
        left_out=dict.fromkeys(("error", "state", "speed"), LEFT_OUT),
    )  # fmt: skip


def _graffiti_cells(line: str) -> list[float] | None:
    """Mode, two positions and four numbers of each cable; None if a line is another."""
    parts = [part.strip() for part in line.split("|")]
    start = re.match(r"(-?\d+): (\S+) (\S+) - (\S+) (\S+)$", parts[0])
    if start is None or len(parts) < 4 or any(len(part.split()) != 4 for part in parts[1:-1]):
        return None
    cells = [*start.groups(), *(cell for part in parts[1:-1] for cell in part.split())]
    values, bad = numbers(cells)
    return values.tolist() if bad is None and np.isfinite(values).all() else None


# Files of MATLAB: GRAB's parsed logs, and any with a mapping.

MAT = b"MATLAB 5.0 MAT-file"

GRAB_VARIABLES = {
    "t": SECONDS, "epsilon": ",".join(PARTS[RPY]), "epsilon_r": "roll_deg,pitch_deg,yaw_deg",
    "cable_length": f"{{c}}_{LENGTH}", "swivel": f"{{c}}_{SWIVEL}", "tensions": f"{{c}}_{TENSION}",
    "target_tensions": f"{COMMANDED}{{c}}_{TENSION}",
}  # fmt: skip
"""Headers of the variables of GRAB's tools; with _r behind they are at 1 kHz, epsilon in degrees.

Source: github.com/fzoffoli/UACDPR_SelfCalibration, CdprViconDataHandling/CdprDataHandling.m and
CdprViconDataHandling.m, which makes radians of epsilon_r."""


def read_mat(path: Path, _: str, facts: Facts) -> Log:
    """Reads a log of GRAB's tools, or the variables that a mapping names, as
    `st.tensions: "{c}_tension_n"` with {c} for the names of cables.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(str(path), squeeze_me=True, struct_as_record=False)
    except Exception as problem:  # scipy raises of all kinds on damaged files
        raise unreadable(path, "a file of MATLAB", problem) from problem
    variables = dict(_flat("", {k: v for k, v in content.items() if not k.startswith("__")}))
    fields = {name.split(".")[1] for name in variables if "." in name}
    if fields >= {"EndEffector", "Trasmission"}:  # as their files spell them
        raise refusal(path, "a robot of GRAB's tools", "logs; see cdpr import")
    wanted = _wanted(path, variables, facts)
    tables = {name: _table(path, name, variables[name]) for name in wanted}
    count = max(len(table) for table in tables.values())
    columns: dict[str, Values] = {}
    for name, headers in wanted.items():
        table, width = tables[name], tables[name].shape[1]
        if len(table) != count:
            raise refusal(f"{path}: {name}", f"{len(table)} rows", f"{count}, as the others have")
        if len(headers) == 1 and "{c}" in headers[0]:
            headers = [headers[0].replace("{c}", cable) for cable in facts.names(path, width)]
        if len(headers) != width:
            words = f"{len(headers)}: {', '.join(headers)}"
            raise refusal(f"{path}: {name}", f"{width} columns", words)
        for header, column in zip(headers, table.T, strict=True):
            if header in columns:
                raise refusal(f"{path}: {name}", f"{header} twice", "once")
            columns[header] = column
    columns = dict(sorted(columns.items(), key=lambda item: item[0] != SECONDS))
    rest = [name for name in variables if name not in wanted]
    by = "m, rad, N, s by the format"
    by += "; epsilon_r in deg" if any("roll_deg" in headers for headers in wanted.values()) else ""
    return assemble(
        path, list(columns.items()), facts,
        units={"variables": by if facts.mapping is None else "by the mapping"},
        remarks=[f"variables left out: {', '.join(rest)}"] if rest else [],
        left_out=dict.fromkeys(rest, LEFT_OUT),
    )  # fmt: skip


def _flat(prefix: str, content: dict[str, Any], depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Variables by name, those of structures by structure.name."""
    for name, value in content.items():
        names = getattr(value, "_fieldnames", None)
        if names is not None and depth < 8:
            inner = {key: getattr(value, key) for key in names}
            yield from _flat(f"{prefix}{name}.", inner, depth + 1)
        else:
            yield f"{prefix}{name}", value


def _wanted(path: Path, variables: dict[str, Any], facts: Facts) -> dict[str, list[str]]:
    """Headers of the variables that are read."""
    mapping = facts.mapping
    if mapping is not None and not isinstance(mapping, dict):
        raise refusal(f"{path}: mapping: columns", "a list", "variable: header")
    if mapping is None:
        last = {name: name.rpartition(".")[2] for name in variables}
        known = {n: GRAB_VARIABLES.get(w, GRAB_VARIABLES.get(w.removesuffix("_r"), ""))
                 for n, w in last.items()}  # fmt: skip
        mapping = known if len(list(filter(None, known.values()))) > 1 else {}
    missing = [name for name in mapping if name not in variables]
    wanted = {name: headers for name, headers in mapping.items() if headers}
    if missing or not wanted:
        place = f"{path}: mapping: columns" if missing else path
        words = f"{missing[0]!r}; variables are" if missing else "the variables"
        accepted = f"{', '.join(GRAB_VARIABLES)}, or a mapping that says what they are"
        raise refusal(place, f"{words} {', '.join(variables)[:120] or 'none'}", accepted)
    return {n: [word.strip() for word in headers.split(",")] for n, headers in wanted.items()}


def _table(path: Path, name: str, value: Any) -> Array:
    """A variable with a row an instant, shape (k, n): MATLAB's have a row a cable here."""
    try:
        table = np.atleast_1d(np.asarray(value, float))
    except (TypeError, ValueError) as problem:
        raise LogFileError(f"{path}: {name}: found what are no numbers") from problem
    if table.ndim == 1:
        return table[:, None]
    if table.ndim != 2:
        raise refusal(f"{path}: {name}", f"shape {table.shape}", "rows and columns")
    return table.T if table.shape[0] < table.shape[1] else table
