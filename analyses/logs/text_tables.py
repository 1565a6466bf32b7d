"""Text with columns as recorders of all kinds write it: cells, separators, decimal marks."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.schema.fields import LARGEST
from cdpr_drake.schema.input_files import file_size

MOST_BYTES = 500_000_000
"""A minute of a hundred columns at 1 kHz has a tenth of that."""

SHOWN = 40
"""Letters of a cell that a message shows."""

SEPARATORS = (";", "\t", ",", None)
"""What may stand between cells; None: blanks."""


@dataclass(frozen=True)
class CellTable:
    """Cells of a text, all rows as long as the first.

    Attributes:
        path: The file.
        separator: Between cells; None: blanks.
        decimal: The mark in numbers, "." or ",".
        rows: The cells.
        lines: Line of the file in which each row stands.
    """

    path: Path
    separator: str | None
    decimal: str
    rows: list[list[str]]
    lines: list[int]

    def number(self, row: int, column: int) -> float:
        """A cell as a number, NaN where it is empty; raises LogFileError where it is none."""
        cell = self.rows[row][column]
        value = parsed(cell, self.decimal)
        if value is None:
            raise LogFileError(
                f"{self.path}:{self.lines[row]}: column {column + 1}: found "
                f"{cell[:SHOWN]!r}; accepted: a number up to {LARGEST:g}, or an empty cell"
            )
        return value

    def numbers(self, first: int = 0) -> Array:
        """All cells from a row on, shape (k, columns); raises as `number`."""
        width = len(self.rows[0])
        table = np.empty((len(self.rows) - first, width))
        for k in range(first, len(self.rows)):
            for j in range(width):
                table[k - first, j] = self.number(k, j)
        return table


def parsed(cell: str, decimal: str = ".") -> float | None:
    """A number, NaN of an empty cell, None of what is none or larger than `LARGEST`."""
    if not cell:
        return float("nan")
    try:
        value = float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return None
    return value if abs(value) <= LARGEST else None


def log_text(path: Path) -> str:
    """The text of a file, with one kind of line endings.

    Raises:
        LogFileError: It cannot be read, is too large, or is no text.
    """
    try:
        if file_size(path) > MOST_BYTES:
            raise LogFileError(f"{path}: found more than {MOST_BYTES:,} bytes; accepted: fewer")
        raw = path.read_bytes()
    except OSError as problem:
        raise LogFileError(f"{path}: cannot be read: {problem.strerror}") from problem
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        coding = "utf-16"
    else:
        coding = "utf-8-sig"
        if b"\0" in raw:
            raise LogFileError(f"{path}: found bytes that are no text; accepted: text")
    try:
        text = raw.decode(coding)
    except UnicodeDecodeError as problem:
        raise LogFileError(
            f"{path}: found byte {problem.start} that is not of {coding}; accepted: text in UTF-8"
        ) from problem
    return text.replace("\r\n", "\n").replace("\r", "\n")


def cell_table(path: Path, text: str, separator: str | None = "", skip: int = 0) -> CellTable:
    """Cells of a text; lines that are empty or begin with # are left out.

    Args:
        path: The file, for messages.
        text: Its content.
        separator: Between cells; None: blanks; empty: told by the first row.
        skip: Lines to leave out at the top.

    Raises:
        LogFileError: There are none, or a row has another number of cells than the first.
    """
    kept = [
        (number, line)
        for number, line in enumerate(text.split("\n"), 1)
        if number > skip and line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise LogFileError(f"{path}: found no rows; accepted: rows of measurements")
    if separator == "":
        separator = next(one for one in SEPARATORS if one is None or one in kept[0][1])
    lines = [line for _, line in kept]
    try:
        if separator is None:
            rows = [line.split() for line in lines]
        else:
            rows = [
                [cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)
            ]
    except csv.Error as problem:
        raise LogFileError(f"{path}: cannot be read as a table: {problem}") from problem
    if len(rows) != len(kept):
        raise LogFileError(f"{path}: found quotes round a line end; accepted: a row a line")
    width = len(rows[0])
    for row, (number, _) in zip(rows, kept, strict=True):
        while len(row) > width and not row[-1]:  # a separator at the end of the line
            row.pop()
        if len(row) != width:
            raise LogFileError(
                f"{path}:{number}: found {len(row)} cells; accepted: {width}, as in line "
                f"{kept[0][0]}"
            )
    return CellTable(path, separator, _decimal(rows, separator), rows, [n for n, _ in kept])


def _decimal(rows: list[list[str]], separator: str | None) -> str:
    """A comma where cells are apart by something else and have one, and none has a point."""
    if separator == ",":
        return "."
    cells = [cell for row in rows[:200] for cell in row]
    with_comma = any(re.fullmatch(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?", cell) for cell in cells)
    with_point = any(re.fullmatch(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?", cell) for cell in cells)
    return "," if with_comma and not with_point else "."
