"""Logs of machines whose files are no tables: Hangprinter, Maslow, GRAB, GTGraffiti."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from cdpr_drake.analyses.logs.assembly import LEFT_OUT, assemble, is_number
from cdpr_drake.analyses.logs.columns import (
    COMMANDED,
    ESTIMATED,
    LENGTH,
    SECONDS,
    SWIVEL,
    TENSION,
)
from cdpr_drake.analyses.logs.log import AS_TOLD, Facts, Log, refusal
from cdpr_drake.analyses.logs.text import read_cells
from cdpr_drake.arrays import Array

_LOOKED = 20
"""Lines by which a file is recognised."""


def _top(head: str) -> list[str]:
    return [line for line in head.split("\n", _LOOKED)[:_LOOKED] if line.strip()]


# Hangprinter: github.com/tobbelobb/auto-calibration-simulation-for-hangprinter, simulation.py.

_ARRAYS = ("motor_pos_samp", "xyz_of_samp", "force_samp")
_MOTOR, _FORCE = re.compile(r"motor_([A-Za-z0-9]+)_deg"), re.compile(r"force_([A-Za-z0-9]+)")
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
    name_of = dict(zip(letters, names, strict=True))
    stated = "force" in facts.units
    headers, forces = list[str](), 0
    for cell in own:
        motor, force = _MOTOR.fullmatch(cell), _FORCE.fullmatch(cell)
        if motor:
            headers.append(f"{name_of[motor[1]]}_motor_deg")
        elif force and force[1] in name_of:
            forces += 1
            headers.append(f"{name_of[force[1]]}_tension" if stated else f"raw_{cell}")
        else:
            headers.append(cell)
    units = {"motor angles": "deg by the format"}
    units |= {"positions": "mm by the format"} if "x_mm" in own else {}
    units |= {"forces": f"{facts.units['force']}, {AS_TOLD}"} if forces and stated else {}
    return assemble(
        path, list(zip(headers, columns, strict=True)), facts, shown=own, lines=lines, units=units,
        cables=names, decimal=decimal,
        remarks=[_NO_FORCE_UNIT] if forces and not stated else [],
    )  # fmt: skip


def _series(path: Path, text: str, name: str) -> list[list[str]]:
    """Rows of an array of a script; signs may be doubled, --7945.95, as its scripts accept it."""
    plain = re.sub(r"#[^\n]*", "", text)
    starts = [found.end() for found in re.finditer(
        rf"^[ \t]*{name}\s*=\s*(?:np\.array\s*\()?\s*(?=\[)", plain, re.MULTILINE
    )]  # fmt: skip
    if len(starts) > 1:
        places = ", ".join(str(plain.count("\n", 0, start) + 1) for start in starts)
        raise refusal(f"{path}: {name}", f"{len(starts)} times, in lines {places}", "once")
    if not starts:
        return []
    depths = np.cumsum([{"[": 1, "]": -1}.get(sign, 0) for sign in plain[starts[0] :]])
    if depths.all():
        raise refusal(f"{path}: {name}", "brackets that do not close", "[[...], ...]")
    begin, end = starts[0] + 1, starts[0] + int(np.argmin(depths != 0))
    rows = []
    for found in re.finditer(r"\[([^\[\]]*)\]", plain[begin:end]):
        cells = [cell.strip() for cell in found[1].strip().rstrip(",").split(",")]
        for k, cell in enumerate(cells):
            signs = re.match(r"[+\-\s]*", cell)[0]  # type: ignore[index]
            word = ("-" if signs.count("-") % 2 else "") + cell[len(signs) :]
            if cell.count("-") - signs.count("-") > 1 or not word or not is_number(word):
                line = plain.count("\n", 0, begin + found.start(1)) + 1
                accepted = "numbers, or nan where nothing was measured"
                raise refusal(f"{path}:{line}: {name}", repr(cell[:40]), accepted)
            cells[k] = "" if word.lstrip("-").lower() == "nan" else word
        rows.append(cells)
    if not rows and plain[begin:end].strip():
        raise refusal(f"{path}: {name}", "no table of numbers", "[[...], ...]")
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
    widths = [len(line) for line in lines if line[0] == _ACTUATOR and len(line) in _LAYOUTS]
    width_of = {_ACTUATOR: (widths or [0])[0], _INCLINOMETER: _TILT_CELLS}
    known = [line for line in lines if len(line) == width_of.get(line[0])]
    values = all(is_number(cell) and cell.strip() for line in known for cell in line)
    if len(lines) < 2 or not widths or not values or len(known) < 0.6 * len(lines):
        return ""
    words = f"{widths[0]} cells of actuators (3), {_TILT_CELLS} of the inclinometer (5)"
    return f"its lines are type,time,... with {words}"


def read_grab(path: Path, text: str, facts: Facts) -> Log:
    """Reads lengths [m], swivel angles [rad], tensions, wanted tensions [N], and roll, pitch, yaw
    [deg]; one time is one row. Lengths and swivels count from where encoders were switched on.
    """
    rows: dict[float, dict[tuple[str, int], float]] = {}  # by time
    at_line: list[int] = []
    other = Counter[str]()
    width = latest = 0
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
        values = _line_numbers(path, number, cells, (width or 14) if actuator else _TILT_CELLS)
        key = int(values[2])
        if actuator and not (key == values[2] and 0 <= key < _MOST_ACTUATORS):
            raise refusal(f"{path}:{number}: actuator", cells[2], "a whole number from 0")
        time = values[1]
        if time not in rows and rows and actuator and width < 14:
            before = next(reversed(rows))
            if 0.0 < time - before < _JITTER and (LENGTH, key) not in rows[before]:
                time = before
                latest += 1
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

    def column(what: str, key: int) -> Array:
        return np.array([row.get((what, key), np.nan) for row in rows.values()])

    columns = [(SECONDS, np.array(list(rows)))]
    for what in _LAYOUTS[width or 14]:
        header = f"{COMMANDED}{{}}_{TENSION}" if what == COMMANDED else f"{{}}_{what}"
        for name, key in zip(names, keys, strict=True):
            columns.append((header.format(name), column(what, key)))
    if any((_INCLINOMETER, 0) in row for row in rows.values()):
        angles = ("roll_deg", "pitch_deg", "yaw_deg")
        columns += [(angle, column(_INCLINOMETER, k)) for k, angle in enumerate(angles)]
    remarks = ["lengths and swivel angles count from where the encoders were switched on"]
    if other:
        told = ", ".join(f"{count} of type {kind}" for kind, count in sorted(other.items()))
        remarks.append(f"lines of other devices were left out: {told}")
    if latest:
        late = f"{latest} lines that came up to {1e3 * _JITTER:g} ms"
        remarks.append(f"{late} after the first one of their row stand in that row")
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


def _line_numbers(path: Path, number: int, cells: list[str], width: int) -> list[float]:
    if len(cells) != width:
        raise refusal(f"{path}:{number}", f"{len(cells)} cells of type {cells[0]}", width)
    for j, cell in enumerate(cells):
        if not is_number(cell, finite=True):
            raise refusal(f"{path}:{number}: cell {j + 1}", f"{cell[:30]!r}", "a finite number")
    return [float(cell) for cell in cells]


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
    known = all(is_number(cell, finite=True) for cell in cells)
    return [float(cell) for cell in cells] if known else None
