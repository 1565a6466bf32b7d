"""Text of recorders of all kinds: codings, line ends, separators, decimal marks, mappings."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cdpr_drake.analyses.logs.log import Facts, refusal
from cdpr_drake.errors import LogFileError, accepted_names, why_not_read
from cdpr_drake.schema.input_files import file_size
from cdpr_drake.schema.yaml_files import load_yaml

MOST_BYTES, MOST_MAPPING = 500_000_000, 1_000_000
"""Of a log, and of a mapping file; a minute of a hundred columns at 1 kHz has a tenth of that."""

SEPARATORS = (";", "\t", ",")
"""Signs between cells; where none of them is, blanks are."""


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


def split_line(line: str, separator: str | None) -> list[str]:
    """Cells of a line; no separator: blanks."""
    if separator is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def separator_of(line: str) -> str | None:
    """The separator of a line; None: blanks."""
    return next((sign for sign in SEPARATORS if sign in line), None)


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
    separator = separator or separator_of(numbered[0][1])
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


class _Mapping(BaseModel):
    """Content of a mapping file; descriptions are what is accepted."""

    model_config = ConfigDict(extra="forbid", strict=True)

    columns: list[str | None] | dict[str, str | None] = Field(
        min_length=1,
        description="a list of headers with their units, as [time_s, C1_length_mm, ''], or name: "
        "header",
    )
    skip_rows: int = Field(0, ge=0, description="a whole number from 0")
    separator: str | None = Field(None, pattern=r'^[^"\n\r.]$', description="one sign, as ';'")
    rate_hz: float | None = Field(None, gt=0.0, allow_inf_nan=False, description="a number above 0")


def with_mapping(facts: Facts, path: Path) -> Facts:
    """Facts with what a mapping file says: YAML with columns, skip_rows, separator, rate_hz."""
    try:
        if file_size(path) > MOST_MAPPING:
            raise refusal(path, f"more than {MOST_MAPPING:,} bytes", "fewer")
        content = load_yaml(path.read_text(encoding="utf-8"))
        mapping = _Mapping.model_validate(content)
    except ValidationError as problem:
        key, known = str((*problem.errors()[0]["loc"], "columns")[0]), _Mapping.model_fields
        if key not in known:
            raise LogFileError(f"{path}: found {key!r}; {accepted_names(key, known)}") from problem
        value = content.get(key) if isinstance(content, dict) else content
        raise refusal(f"{path}: {key}", str(value)[:80], known[key].description) from problem
    except (OSError, ValueError) as problem:
        words = " ".join(why_not_read(problem).split())
        raise LogFileError(f"{path}: cannot be read: {words[:200]}") from problem
    headers: Any = mapping.columns
    named = isinstance(headers, dict)
    return replace(
        facts, skip_rows=mapping.skip_rows, separator=mapping.separator,
        mapping={name: header or "" for name, header in headers.items()} if named
        else [header or "" for header in headers],
        rate=mapping.rate_hz if facts.rate is None else facts.rate,
    )  # fmt: skip
