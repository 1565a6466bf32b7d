"""Cells of texts of all recorders, and a log of columns: units, names, axes, times, refusals."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from cdpr_drake.analyses.logs.columns import (
    MOST_CABLES,
    PARTS,
    QUATERNION,
    SECONDS,
    SHOWN,
    SI,
    TIME,
    UNITS,
    Column,
    cable_names,
    first_number,
    preference,
    read_header,
    unknown_unit,
)
from cdpr_drake.analyses.logs.log import AS_TOLD, Facts, Log, refusal, same_as_before
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.schema.declarations import LARGEST
from cdpr_drake.schema.input_files import file_size

MOST_BYTES = 500_000_000
"""Of a log; a minute of a hundred columns at 1 kHz has a tenth of that."""

SEPARATORS = (";", "\t", ",")
"""Signs between cells; where none of them is, blanks are."""


Values = Sequence[str] | Array
"""A column: words of a text, or numbers."""

NO_NUMBER = {"", "nan", "na", "n/a", "null", "none", "-"}
"""Values, in small letters, of what was not measured."""

EPOCH = 1e8
"""Larger times are dates: they are counted from the first row [s]."""

_TURN = 1e-2
"""Largest difference of the length of a quaternion from 1."""

READ, WORDS, WORSE, LEFT_OUT = "read", "words", "worse", "left out"
NO_UNIT = "is no unit that is known"
"""Fates of columns; others are in words."""

_ENDS = {"header": " by its header", "told": f", {AS_TOLD}", "dates": "",
         "format": " by the format",
         "assumed": ", since neither header nor user says another"}  # fmt: skip


class Cells(NamedTuple):
    """Rows of cells, all as long as the first, the line of each, and the mark in numbers."""

    rows: list[list[str]]
    lines: list[int]
    decimal: str


def plain_text(raw: bytes, errors: str = "strict") -> str | None:
    """Text with one kind of line ends; None if bytes are no text; errors as of `bytes.decode`."""
    wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not wide and b"\0" in raw:
        return None
    text = raw.decode("utf-16" if wide else "utf-8-sig", errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_bytes(path: Path, most: int = -1) -> bytes:
    """Bytes of a file, or its first ones."""
    try:
        if file_size(path) > MOST_BYTES:
            raise refusal(path, f"more than {MOST_BYTES:,} bytes", "fewer")
        with path.open("rb") as file:
            return file.read(most)
    except OSError as problem:
        raise LogFileError(f"{path}: cannot be read: {problem.strerror}") from problem


def read_text(path: Path) -> str:
    """Text of a file."""
    try:
        text = plain_text(read_bytes(path))
    except UnicodeDecodeError as problem:
        words = f"byte {problem.start} that is not of {problem.encoding}"
        raise refusal(path, words, "text in UTF-8") from problem
    if text is None:
        raise refusal(path, "bytes that are no text", "text")
    return text


def read_cells(path: Path, text: str, separator: str | None = None, skip: int = 0) -> Cells:
    """Cells of a text without lines that are empty, begin with #, or are the first ones to skip;
    separator None: by the first row."""
    numbered = [
        (number, line)
        for number, line in enumerate(text.split("\n"), 1)
        if number > skip and line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise refusal(path, "no rows", "rows of measurements")
    separator = separator or next((sign for sign in SEPARATORS if sign in numbered[0][1]), None)
    lines = [number for number, _ in numbered]
    try:
        rows = [line.split() for _, line in numbered]
        if separator is not None:
            table = csv.reader([line for _, line in numbered], delimiter=separator)
            rows = [[cell.strip() for cell in row] for row in table]
    except csv.Error as problem:
        raise LogFileError(f"{path}: cannot be read as a table: {problem}") from problem
    if len(rows) != len(lines):
        raise refusal(path, "quotes round a line end", "a row a line")
    width = len(rows[0])
    for row, number in zip(rows, lines, strict=True):
        while len(row) > width and not row[-1]:  # a separator at the end of the line
            row.pop()
        if len(row) != width:
            words = f"{width}, as in line {lines[0]}"
            raise refusal(f"{path}:{number}", f"{len(row)} cells", words)
    return Cells(rows, lines, _decimal(rows, separator))


def _decimal(rows: Sequence[Sequence[str]], separator: str | None) -> str:
    """A comma if some cells have one, none has a point, and something else separates cells."""
    if separator == ",":
        return "."
    number = r"[+-]?(\d{{1,3}}({0}\d{{3}})+|\d*){1}\d+([eE][+-]?\d+)?"
    with_comma, with_point = (
        any(re.fullmatch(pattern, cell) for row in rows[:200] for cell in row)
        for pattern in (number.format(r"\.", ","), number.format(",", r"\."))
    )
    return "," if with_comma and not with_point else "."


def assemble(
    path: Path, columns: Sequence[tuple[str, Values]], facts: Facts, *, why: str = "",
    shown: Sequence[str] | None = None, lines: Sequence[int] | None = None,
    units: dict[str, str] | None = None, remarks: Sequence[str] = (), cables: Sequence[str] = (),
    left_out: Mapping[str, str] | None = None, decimal: str = ".",
) -> Log:  # fmt: skip
    """Makes a log of columns with headers, or refuses it.

    Args:
        path: The file.
        columns: Headers of the file, or those that its dialect gives, with their cells; a column
            without a header is left out.
        facts: What the user says.
        why: How the dialect was recognised, where it is not as `Dialect.knows` says.
        shown: Headers as they stand in the file; None: the same.
        lines: Line of the file in which each row stands, for messages; None: rows are counted.
        units: Units in words, where the dialect fixes them; None: each column says its own.
        remarks, cables: Remarks of the dialect, and names of the cables, where it has them.
        left_out: Fates by header of columns that the dialect left out.
        decimal: Mark in numbers, "." or ",".
    """
    headers = [header for header, _ in columns]
    names = list(cables or facts.cables or facts.robot_cables)
    names = names or [f"C{k + 1}" for k in range(MOST_CABLES)]
    if not cables and facts.cables is None:
        names += [name for name in cable_names(headers) if name not in names]
    first = first_number(headers, len(facts.cables or facts.robot_cables) or -1)
    frame: dict[str, Array] = {}
    rows: list[dict[str, str]] = []
    origin: dict[str, dict[str, str]] = {}
    statements = list(remarks)
    for j, (header, cells) in enumerate(columns):
        row = dict.fromkeys(("header", "name", "kind", "unit", "by"), "") | {"fate": LEFT_OUT}
        row["header"] = own = header if shown is None else shown[j]
        rows.append(row)
        if not header:
            continue
        column = read_header(header, names, first)
        values, bad = numbers(cells, decimal)
        if column is not None and column.kind == TIME:
            values, bad, words = _times(cells, values, bad, column.factor)
            statements += words
        if bad is not None and column is None:
            row["fate"] = WORDS
            continue
        if bad is not None:
            place = f"{_place(path, lines, bad)}: {own[:40]}"
            accepted = f"a number up to {LARGEST:g}, or an empty cell"
            raise refusal(place, repr(str(cells[bad])[:40]), accepted)
        name, factor = header, 1.0
        if column is None:
            unit = unknown_unit(header, names, first)
            row["fate"] = f"{unit} {NO_UNIT}" if unit else "unknown"
        else:
            name, row["kind"], row["fate"] = column.name, column.kind, READ
            row["unit"], row["by"], factor = _unit(
                column, facts, cells, units is not None or own != header
            )
        if name in frame:
            here, there = (_rank(row, values), _rank(origin[name], frame[name]))
            if here == there:
                raise refusal(f"{path}: column {own!r}", f"{name} twice", "once")
            worse = origin[name] if here > there else row
            worse |= {"name": "", "by": "", "fate": WORSE}
            if here < there:
                continue
        frame[name], origin[name], row["name"] = factor * values, row, name
    if not any(row["fate"] == READ for row in rows):
        accepted = (
            "time_s, C1_length_m, x_m, qw, C1_tension_n and the like, or a mapping that says so"
        )
        raise refusal(f"{path}: columns", ", ".join(filter(None, headers))[:120], accepted)
    said = dict(_unit_words(rows) if units is None else units)
    if SECONDS not in frame and facts.rate is not None:
        count = len(next(iter(frame.values())))
        frame = {SECONDS: np.arange(count) / facts.rate, **frame}
        said["time"] = f"{facts.rate:g} rows/s, {AS_TOLD}"
    if facts.R_WF is not None:
        said["axes"] = _axes_words(facts.R_WF)
    rows += [{"header": header, "fate": fate} for header, fate in (left_out or {}).items()]
    ledger = pd.DataFrame(rows, columns=["header", "name", "kind", "unit", "by", "fate"]).fillna("")
    log = Log(
        path=path, why=why, frame=_turned(pd.DataFrame(frame), facts.R_WF),
        ledger=ledger, units=said, remarks=(*statements, *_remarks(rows)),
    )  # fmt: skip
    return _settled(log, lines)


def numbers(cells: Values, decimal: str = ".") -> tuple[Array, int | None]:
    """Numbers of cells, NaN where nothing was measured; and the first row without a number."""
    try:
        values = np.array(cells, float)
    except ValueError:
        parsed = [_number(cell, decimal) for cell in cells]
        if None in parsed:
            return np.full(len(parsed), np.nan), parsed.index(None)
        values = np.array(parsed, float)
    beyond = np.flatnonzero(np.abs(values) > LARGEST)
    return values, int(beyond[0]) if len(beyond) else None


def refuse_other_lengths(path: Path, q: Array, lines: Sequence[int] | None = None) -> None:
    """Refuses quaternions, shape (k, 4), that are no rotations."""
    size = np.linalg.norm(q, axis=1)
    off = np.flatnonzero(np.abs(size - 1.0) > _TURN)
    if len(off):
        place = f"{_place(path, lines, int(off[0]))}: quaternion"
        raise refusal(place, f"length {size[off[0]]:.4g}", "1")


def _number(cell: str, decimal: str) -> float | None:
    """Number of a cell, without marks of thousands, NaN if nothing was measured; None: words."""
    word = cell.strip()
    if decimal == "," and "," in word:
        word = re.sub(r"\.(?=\d{3}(\D|$))", "", word).replace(",", ".")
    elif re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", word):
        word = word.replace(",", "")
    try:
        return float("nan" if word.lower() in NO_NUMBER else word)
    except ValueError:
        return None


def is_number(cell: str, decimal: str = ".", finite: bool = False) -> bool:
    """True for a cell with a number, or, unless it must be finite, of what was not measured."""
    value = _number(cell, decimal)
    return value is not None and (abs(value) <= LARGEST if finite else not abs(value) > LARGEST)


def _rank(row: Mapping[str, str], values: Array) -> int:
    """Rank of a column among those of one quantity; of two clocks that grow, the sender's."""
    if row["kind"] == TIME:
        return 2 * bool(np.all(np.diff(values) > 0.0)) + ("stamp" in row["header"])
    return preference(row["header"])


def _times(
    cells: Values, values: Array, bad: int | None, factor: float
) -> tuple[Array, int | None, list[str]]:
    """Times of a column; dates and times since an epoch are counted from the first row."""
    if isinstance(cells, np.ndarray) or not len(cells):
        return values, bad, []
    try:
        if bad is not None:
            dates = [datetime.fromisoformat(cell) for cell in cells]
            steps = np.array([(date - dates[0]).total_seconds() for date in dates])
            return steps / factor, None, [f"times count from {cells[0]}"]
        if abs(values[0]) * factor > EPOCH:  # as floats they would lose digits
            start = Decimal(cells[0].strip())
            steps = np.array([float(Decimal(cell.strip()) - start) for cell in cells])
            seconds = f"{float(start) * factor:.0f}"
            return steps, None, [f"times count from the first row, {seconds} s of its clock"]
    except (ValueError, TypeError, InvalidOperation):
        pass
    return values, bad, []


def _unit(column: Column, facts: Facts, cells: Values, fixed: bool) -> tuple[str, str, float]:
    """Unit of a column, who said so, and its factor to SI."""
    dimension = column.dimension
    if dimension in ("", "image"):
        return column.unit, "", column.factor
    si = SHOWN.get(SI[dimension], SI[dimension])
    if fixed:
        return column.unit or si, "format", column.factor
    if column.unit:
        return column.unit, "header", column.factor
    if column.kind == TIME and not isinstance(cells, np.ndarray) and not is_number(cells[0]):
        return "dates", "dates", 1.0
    if dimension in facts.units:
        return facts.units[dimension], "told", UNITS[facts.units[dimension]][1]
    return si, "assumed", 1.0


def _unit_words(rows: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """Units, with columns of one unit and origin in one line."""
    headers: dict[str, list[str]] = {}
    for row in rows:
        if row["by"]:
            headers.setdefault(f"{row['unit']}{_ENDS[row['by']]}", []).append(row["header"])
    return {
        f"{each[0]} to {each[-1]}" if len(each) > 2 else ", ".join(each): words
        for words, each in headers.items()
    }


def _remarks(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """What the ledger says of columns that were not read."""
    remarks = []
    for fate, words in (
        (WORDS, "columns with words were left out"),
        (WORSE, "left out, since what is measured, or what winches count, stands for them"),
    ):
        headers = ", ".join(row["header"] for row in rows if row["fate"] == fate)
        remarks += [f"{words}: {headers}"] if headers else []
    return remarks + [
        f"kept as it is: {row['header']}, {row['fate']}"
        for row in rows if row["fate"].endswith(NO_UNIT)
    ]  # fmt: skip


def _turned(frame: pd.DataFrame, R_WF: Array | None) -> pd.DataFrame:
    """Points and quaternions of a frame F with the axes of W; body axes are renamed alike."""
    if R_WF is None:
        return frame
    stems = [name.removesuffix("x_m") for name in frame if name.endswith("x_m")]
    groups = [[f"{stem}{axis}_m" for axis in "xyz"] for stem in stems]
    groups += [list(PARTS[QUATERNION][1:])] if set(PARTS[QUATERNION]) <= set(frame) else []
    for names in groups:
        if set(names) <= set(frame):
            frame[names] = (R_WF @ frame[names].to_numpy().T).T
    return frame


def _axes_words(R_WF: Array) -> str:
    signs = ["-" * bool(row.sum() < 0.0) + "xyz"[np.argmax(np.abs(row))] for row in R_WF]
    return f"x, y, z of W are {', '.join(signs)} of the file"


def _settled(log: Log, lines: Sequence[int] | None) -> Log:
    """A log whose times grow: rows that are there twice are left out, and counted."""
    time, path = log.time, log.path
    if not len(log.frame):
        raise refusal(path, "no rows of measurements", "at least one")
    if time is None:
        return log
    if not np.isfinite(time).all():
        place = _place(path, lines, int(np.argmin(np.isfinite(time))))
        raise refusal(f"{place}: time", "no number", "a time in each row")
    twice = np.concatenate([[False], same_as_before(log.frame.to_numpy(float))])
    rows = np.flatnonzero(~twice)
    back = np.flatnonzero(np.diff(time[rows]) <= 0.0)
    if len(back):
        before, after = rows[back[0]], rows[back[0] + 1]
        words = f"{time[after]:.9g} s after {time[before]:.9g} s"
        accepted = "times that grow, and rows twice only where all of them is the same"
        raise refusal(f"{_place(path, lines, int(after))}: time", words, accepted)
    frame = log.frame.iloc[rows].reset_index(drop=True)
    return replace(log, frame=frame, repeated=int(twice.sum()))


def _place(path: Path, lines: Sequence[int] | None, row: int) -> str:
    return f"{path}: row {row + 1}" if lines is None else f"{path}:{lines[row]}"
