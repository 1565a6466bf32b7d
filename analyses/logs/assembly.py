"""A log from the columns of a file: units, names, axes, times and refusals of all dialects."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from decimal import Decimal, InvalidOperation
from pathlib import Path

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
from cdpr_drake.schema.declarations import LARGEST

Cells = Sequence[str] | Array
"""A column: words of a text, or numbers."""

NO_NUMBER = {"", "nan", "na", "n/a", "null", "none", "-"}
"""Cells, in small letters, of what was not measured."""

EPOCH = 1e8
"""Larger times are dates: they are counted from the first row [s]."""

READ, WORDS, WORSE, LEFT_OUT = "read", "words", "worse", "left out"
"""Fates of columns; others are in words."""

_ENDS = {"header": " by its header", "told": f", {AS_TOLD}", "dates": "",
         "format": " by the format",
         "assumed": ", since neither header nor user says another"}  # fmt: skip


def assemble(
    path: Path, dialect: str, why: str, columns: Sequence[tuple[str, Cells]], facts: Facts, *,
    shown: Sequence[str] | None = None, lines: Sequence[int] | None = None,
    units: dict[str, str] | None = None, remarks: Sequence[str] = (), cables: Sequence[str] = (),
    left_out: Mapping[str, str] | None = None, decimal: str = ".",
) -> Log:  # fmt: skip
    """Makes a log of columns with headers, or refuses it.

    Args:
        path, dialect, why: The file, the name of its dialect, and how that was recognised.
        columns: Headers of the file, or those that its dialect gives, with their cells; a column
            without a header is left out.
        facts: What the user says.
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
            place = f"{path}:{_place(lines, bad)}: {own[:40]}"
            accepted = f"a number up to {LARGEST:g}, or an empty cell"
            raise refusal(place, repr(str(cells[bad])[:40]), accepted)
        name, factor = header, 1.0
        if column is None:
            unit = unknown_unit(header, names, first)
            row["fate"] = f"{unit} is no unit that is known" if unit else "unknown"
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
    rows += [
        dict.fromkeys(("name", "kind", "unit", "by"), "") | {"header": header, "fate": fate}
        for header, fate in (left_out or {}).items()
    ]
    ledger = pd.DataFrame(rows, columns=["header", "name", "kind", "unit", "by", "fate"])
    log = Log(
        path=path, dialect=dialect, why=why, frame=_turned(pd.DataFrame(frame), facts.R_WF),
        ledger=ledger, units=said, remarks=(*statements, *_remarks(rows)),
    )  # fmt: skip
    return _settled(log, lines)


def numbers(cells: Cells, decimal: str = ".") -> tuple[Array, int | None]:
    """Numbers of cells, NaN where nothing was measured; and the first row without a number."""
    try:
        values = np.array(cells, float)
    except ValueError:
        words = [plain_number(cell, decimal) for cell in cells]
        bad = next((k for k, word in enumerate(words) if not _is_float(word)), None)
        values = np.full(len(words), np.nan) if bad is not None else np.array(words, float)
        if bad is not None:
            return values, bad
    beyond = np.flatnonzero(np.abs(values) > LARGEST)
    return values, int(beyond[0]) if len(beyond) else None


def plain_number(cell: str, decimal: str = ".") -> str:
    """A cell as Python writes numbers, without the marks of thousands."""
    word = cell.strip()
    if word.lower() in NO_NUMBER:
        return "nan"
    if decimal == "," and "," in word:
        word = re.sub(r"\.(?=\d{3}(\D|$))", "", word).replace(",", ".")
    elif re.fullmatch(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?", word):
        word = word.replace(",", "")
    return word


def is_number(cell: str, decimal: str = ".") -> bool:
    """True for a cell with a number, or of what was not measured."""
    word = plain_number(cell, decimal)
    return _is_float(word) and not abs(float(word)) > LARGEST


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _rank(row: Mapping[str, str], values: Array) -> int:
    """Rank of a column among those of one quantity; of two clocks that grow, the sender's."""
    if row["kind"] == TIME:
        return 2 * bool(np.all(np.diff(values) > 0.0)) + ("stamp" in row["header"])
    return preference(row["header"])


def _times(
    cells: Cells, values: Array, bad: int | None, factor: float
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


def _unit(column: Column, facts: Facts, cells: Cells, fixed: bool) -> tuple[str, str, float]:
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
        headers = [row["header"] for row in rows if row["fate"] == fate]
        remarks += [f"{words}: {', '.join(headers)}"] if headers else []
    doubt = [row for row in rows if row["fate"].endswith("is no unit that is known")]
    return remarks + [f"kept as it is: {row['header']}, {row['fate']}" for row in doubt]


def _turned(frame: pd.DataFrame, R_WF: Array | None) -> pd.DataFrame:
    """Points and quaternions of a frame F with the axes of W; body axes are renamed alike."""
    if R_WF is None:
        return frame
    stems = [name.removesuffix("x_m") for name in frame if name.endswith("x_m")]
    groups = [[f"{stem}{axis}_m" for axis in "xyz"] for stem in stems]
    whole = all(name in frame for name in PARTS[QUATERNION])
    for names in [*groups, *([list(PARTS[QUATERNION][1:])] if whole else [])]:
        if all(name in frame for name in names):
            turned = R_WF @ frame[names].to_numpy().T
            frame = frame.assign(**dict(zip(names, turned, strict=True)))
    return frame


def _axes_words(R_WF: Array) -> str:
    axes = []
    for row in R_WF:
        k = int(np.argmax(np.abs(row)))
        axes.append(f"{'-' if row[k] < 0.0 else ''}{'xyz'[k]}")
    return f"x, y, z of W are {', '.join(axes)} of the file"


def _settled(log: Log, lines: Sequence[int] | None) -> Log:
    """A log whose times grow: rows that are there twice are left out, and counted."""
    time, path = log.time, log.path
    if not len(log.frame):
        raise refusal(path, "no rows of measurements", "at least one")
    if time is None:
        return log
    finite = np.isfinite(time)
    if not finite.all():
        place = _place(lines, int(np.argmin(finite)))
        raise refusal(f"{path}:{place}: time", "no number", "a time in each row")
    twice = np.concatenate([[False], same_as_before(log.frame.to_numpy(float))])
    rows = np.flatnonzero(~twice)
    back = np.flatnonzero(np.diff(time[rows]) <= 0.0)
    if len(back):
        before, after = rows[back[0]], rows[back[0] + 1]
        words = f"{time[after]:.9g} s after {time[before]:.9g} s"
        accepted = "times that grow, and rows twice only where all of them is the same"
        raise refusal(f"{path}:{_place(lines, int(after))}: time", words, accepted)
    frame = log.frame.iloc[rows].reset_index(drop=True)
    return replace(log, frame=frame, repeated=int(twice.sum()))


def _place(lines: Sequence[int] | None, row: int) -> str:
    return f"row {row + 1}" if lines is None else str(lines[row])
