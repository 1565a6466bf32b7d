"""Paths as users write them: tables of poses, and G-code."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.errors import DataFileError
from cdpr_drake.geometry.poses import pose_from_angles

COLUMNS = ("x", "y", "z", "phi", "theta", "psi")
"""Of a table: position in W [m], and angles, R = Rx(phi) Ry(theta) Rz(psi) [deg]."""

G_CODE = (".gcode", ".nc", ".ngc", ".tap")
"""Endings of G-code."""

AXES = "XYZABC"
"""Words of G-code for `COLUMNS`: lengths in the file's unit, angles [deg]."""

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?)\s*")
_COMMENT = re.compile(r"\([^)]*\)|;.*$")

MODES = {17, 18, 19, 40, 49, 54, 61, 64, 80, 94}
"""Numbers of G words that do not change where straight lines lead, and are left out."""


@dataclass(frozen=True)
class PathFile:
    """What a file of a path says.

    Attributes:
        poses: X_WP, one after the other [m].
        remarks: What was left out, a line each.
    """

    poses: list[RigidTransform]
    remarks: tuple[str, ...] = ()


def read_path(path: Path, height: float | None = None) -> PathFile:
    """Reads poses from a table (.csv) or from lines of G-code (see `G_CODE`).

    Args:
        path: The file.
        height: z where a file of G-code gives none [m]; None: it must.

    Raises:
        DataFileError: It cannot be read, or a line is not accepted; names the line.
    """
    ending = path.suffix.lower()
    if ending != ".csv" and ending not in G_CODE:
        raise DataFileError(
            f"{path}: found the ending {ending!r}; accepted: .csv, {', '.join(G_CODE)}"
        )
    if not path.is_file():
        raise DataFileError(f"{path}: there is no such file of a path")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise DataFileError(f"{path}: cannot be read as text: {problem}") from problem
    found = _read_table(path, lines) if ending == ".csv" else _read_g_code(path, lines, height)
    if len(found.poses) < 2:
        raise DataFileError(f"{path}: found {len(found.poses)} poses; accepted: at least 2")
    return found


def _read_table(path: Path, lines: list[str]) -> PathFile:
    """Rows of `COLUMNS`, or of the first three; a head with these names may stand above them."""
    poses: list[RigidTransform] = []
    size = 0
    for number, row in _rows(lines):
        words = [word.strip() for word in row]
        if not size and words[0].isidentifier():
            names = tuple(word.lower() for word in words)
            if names not in (COLUMNS[:3], COLUMNS):
                raise DataFileError(
                    f"{path}: line {number}: found the columns {', '.join(words)[:80]}; accepted: "
                    f"{', '.join(COLUMNS[:3])} [m], or {', '.join(COLUMNS)} [m, deg]"
                )
            size = len(names)
            continue
        values = [_number(word) for word in words]
        accepted = (size,) if size else (3, 6)
        if len(values) not in accepted or not np.all(np.isfinite(values)):
            raise DataFileError(
                f"{path}: line {number}: found {','.join(words)[:80]!r}; accepted: "
                f"{' or '.join(str(k) for k in accepted)} finite numbers, x,y,z [m] and "
                "phi,theta,psi [deg]"
            )
        size = len(values)
        poses.append(_pose(values))
    return PathFile(poses)


def _rows(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Number and words of the lines that say something."""
    for number, row in enumerate(csv.reader(lines), 1):
        if any(word.strip() for word in row) and not row[0].lstrip().startswith("#"):
            yield number, row


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return np.nan


def _pose(values: list[float]) -> RigidTransform:
    angles = np.radians(values[3:] or [0.0, 0.0, 0.0])
    return pose_from_angles(np.array(values[:3]), angles)


class _Machine:
    """What lines of G-code have set so far."""

    def __init__(self, height: float | None) -> None:
        self.unit, self.absolute, self.moves = 1e-3, True, False
        unknown = np.nan if height is None else height
        self.place: list[float] = [np.nan, np.nan, unknown, 0.0, 0.0, 0.0]


def _read_g_code(path: Path, lines: list[str], height: float | None) -> PathFile:
    """Straight moves, G0 and G1; the first one is where the path begins.

    X, Y, Z are Po in W, A, B, C the angles (phi, theta, psi), in millimetres until G20, absolute
    until G91. Feed rates, spindle, tools and auxiliary functions are left out, as a remark says.
    """
    machine = _Machine(height)
    poses: list[list[float]] = []
    left_out: dict[str, int] = {}
    for number, line in enumerate(lines, 1):
        words = _words(path, number, line)
        given: dict[str, float] = {}
        for letter, value in words:
            if letter == "G":
                _set_mode(path, number, machine, value, left_out)
            elif letter in AXES:
                if letter in given:
                    raise DataFileError(
                        f"{path}: line {number}: found {letter} twice; accepted: once"
                    )
                given[letter] = value
            elif letter in "FSTM":
                left_out[letter] = left_out.get(letter, 0) + 1
            elif letter != "N":
                raise DataFileError(
                    f"{path}: line {number}: found the word {letter}{value:g}; accepted: G0, G1, "
                    "X, Y, Z, A, B, C, and F, S, T, M, N, which are left out"
                )
        if given:
            _move(path, number, machine, given)
            if not poses or poses[-1] != machine.place:
                poses.append(list(machine.place))
    remarks = [f"{letter} words left out: {count}" for letter, count in sorted(left_out.items())]
    return PathFile([_pose(place) for place in poses], tuple(remarks))


def _words(path: Path, number: int, line: str) -> list[tuple[str, float]]:
    """Letters and numbers of a line, without comments."""
    rest = _COMMENT.sub("", line).strip().upper()
    if rest == "%":
        return []
    words = []
    while rest:
        match = _WORD.match(rest)
        if match is None:
            raise DataFileError(
                f"{path}: line {number}: found {rest[:40]!r}; accepted: words such as G1 X10.5"
            )
        words.append((match[1], float(match[2])))
        rest = rest[match.end() :]
    return words


def _set_mode(
    path: Path, number: int, machine: _Machine, code: float, left_out: dict[str, int]
) -> None:
    if code in (0.0, 1.0):
        machine.moves = True
    elif code in (20.0, 21.0):
        machine.unit = 0.0254 if code == 20.0 else 1e-3
    elif code in (90.0, 91.0):
        machine.absolute = code == 90.0
    elif code in MODES:
        left_out[f"G{code:g}"] = left_out.get(f"G{code:g}", 0) + 1
    else:
        raise DataFileError(
            f"{path}: line {number}: found G{code:g}; accepted: straight lines, G0 and G1, units "
            "G20 and G21, and coordinates G90 and G91"
        )


def _move(path: Path, number: int, machine: _Machine, given: dict[str, float]) -> None:
    if not machine.moves:
        raise DataFileError(
            f"{path}: line {number}: found coordinates before any G0 or G1; accepted: after one"
        )
    for letter, value in given.items():
        k = AXES.index(letter)
        scaled = value * machine.unit if k < 3 else value
        machine.place[k] = scaled if machine.absolute else machine.place[k] + scaled
    unknown = [AXES[k] for k in range(6) if not np.isfinite(machine.place[k])]
    if unknown:
        raise DataFileError(
            f"{path}: line {number}: {', '.join(unknown)} is not known there; accepted: a first "
            "move to X, Y and Z"
        )
