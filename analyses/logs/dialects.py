"""How recorders write logs: a table of dialects, and how a file's dialect is recognised.

A dialect of text with columns is data: a pattern of its first line, and patterns of headers with
the headers and units that they stand for. A dialect that is no table has a function that makes one.
Units, names, axes, times and refusals are those of `assemble`, once for all.

Sources: OptiTrack, Data Export: CSV, docs.optitrack.com; wiki.ros.org/rostopic, echo -p; the others
stand at the functions that read them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.logs import machines, ros
from cdpr_drake.analyses.logs.assembly import (
    assemble,
    is_number,
    plain_text,
    read_bytes,
    read_cells,
    read_text,
)
from cdpr_drake.analyses.logs.columns import MOST_CABLES, cable_names, read_header
from cdpr_drake.analyses.logs.log import Facts, Log, refusal
from cdpr_drake.analyses.logs.motive import knows_motive, read_motive
from cdpr_drake.analyses.logs.ros import ROS_COLUMNS, Headers, read_bag, renamed
from cdpr_drake.analyses.reporting.mcap_log import MAGIC
from cdpr_drake.errors import LogFileError, accepted_names

AUTO, CSV = "auto", "csv"

LOG_SUFFIXES = (".csv", ".tsv", ".txt", ".log", ".dat", ".mat", ".mcap", ".bag", ".db3", ".py")
"""Endings of files that may be logs; a reader has to know what is in them, too."""

HEAD = 60_000
"""Bytes at the top of a file by which it is recognised."""


@dataclass(frozen=True)
class Dialect:
    """How a recorder writes.

    Attributes:
        title: What it writes, in words.
        knows: Why the beginning of a file, text or bytes, is of this dialect; empty if it is not.
        read: Makes a log of path, text and facts, or raises LogFileError, in one line with what is
            damaged or missing; None: text with columns, see `columns`.
        columns: Patterns of whole headers, and the headers with units that they stand for, with
            {} for the first group; an empty one leaves columns out.
        above: Number of lines above the headers.
        binary: True if files are no text; `read` then gets an empty text.
    """

    title: str
    knows: Callable[[Any], str]
    read: Callable[[Path, str, Facts], Log] | None = None
    columns: Headers = ()
    above: int = 0
    binary: bool = False


def first_line(pattern: str) -> Callable[[str], str]:
    """Recognises text by a part of its first line."""

    def knows(head: str) -> str:
        found = re.search(pattern, head.partition("\n")[0])
        return f"its first line has {found[0].strip(',')!r}" if found else ""

    return knows


def magic(raw: bytes, words: str = "") -> Callable[[bytes], str]:
    """Recognises files by their first bytes."""
    return lambda head: f"it begins with {words or raw.decode()}" if head.startswith(raw) else ""


def knows_columns(head: str) -> str:
    """Recognises text whose first row has known headers and whose second row has numbers."""
    lines = [line for line in head.split("\n") if line.strip() and not line.startswith("#")][:2]
    try:
        cells = read_cells(Path(), "\n".join(lines))
    except LogFileError:  # its reader says where quotes do not close
        return "its first row has quotes" if '"' in "".join(lines[:1]) else ""
    if len(lines) < 2 or not re.search(r"[A-Za-z_]", lines[0]):
        return ""
    headers, below = cells.rows
    names = [f"C{k + 1}" for k in range(MOST_CABLES)] + cable_names(headers)
    known = [cell for cell in headers if read_header(cell, names) is not None]
    if not known or sum(is_number(cell, cells.decimal) for cell in below) < 0.5 * len(below):
        return ""
    return f"its first row has the headers {', '.join(known[:3])}"


def columns_log(path: Path, text: str, facts: Facts, patterns: Headers = (), above: int = 0) -> Log:
    """Text with columns, by its headers, the patterns of its dialect, or a mapping."""
    cells = read_cells(path, text, facts.separator, facts.skip_rows or above)
    rows, mapping, remarks = cells.rows, facts.mapping, list[str]()
    width, m = len(rows[0]), len(facts.cables or facts.robot_cables)
    headed = not all(is_number(cell, cells.decimal) for cell in rows[0])
    why = "" if mapping is None else "columns as the mapping says"
    if headed and len(rows) < 2:
        raise refusal(path, "a header without rows", "one row at least")
    if isinstance(mapping, dict) and headed:
        missing = [name for name in mapping if name not in rows[0]]
        if missing:
            raise refusal(f"{path}: mapping: columns", f"{missing[0]!r}", ", ".join(rows[0])[:120])
        headers = [mapping.get(name, "") for name in rows[0]]
    elif mapping is not None and not isinstance(mapping, dict):
        if len(mapping) != width:
            raise refusal(
                f"{path}: mapping: columns", len(mapping), f"{width}, one for each column"
            )
        headers = list(mapping)
    elif headed:
        headers = [renamed(cell, patterns) for cell in rows[0]]
    elif m and width in (m, 2 * m):  # as GRAB's tools write
        why = f"it has {width} columns of numbers for {m} cables"
        names = facts.cables or facts.robot_cables
        kinds = ("length_m", "swivel_rad")[: width // m]
        headers = [f"{name}_{kind}" for kind in kinds for name in names]
        remarks.append("no header: lengths [m]" + (" and swivel angles [rad]" if width > m else ""))
    else:
        words = f"{width} columns of numbers without a header"
        lengths = f"{m} lengths, or {m} lengths and {m} swivel angles, " if m else ""
        raise refusal(path, words, f"{lengths}a header, or a mapping with a list of columns")
    shown = rows[0] if headed else [f"column {j + 1}" for j in range(width)]
    if mapping is not None or not headed:
        shown = [header or name for header, name in zip(headers, shown, strict=True)]
    columns = [(header, [row[j] for row in rows[headed:]]) for j, header in enumerate(headers)]
    return assemble(
        path, columns, facts, why=why, shown=shown, lines=cells.lines[headed:],
        decimal=cells.decimal, remarks=remarks,
    )  # fmt: skip


DIALECTS = {
    "hangprinter": Dialect(
        "a Hangprinter's series: motor_pos_samp, xyz_of_samp, force_samp",
        machines.knows_hangprinter, machines.read_hangprinter,
    ),
    "maslow": Dialect(
        "a Maslow's CLBM lines, of its calibration", machines.knows_maslow, machines.read_maslow
    ),
    "grab": Dialect(
        "GRAB's raw log: lines type,time,...", machines.knows_grab, machines.read_grab
    ),
    "gtgraffiti": Dialect(
        "GTGraffiti's controller: mode: x y - x y | ...", machines.knows_graffiti,
        machines.read_graffiti,
    ),
    "motive": Dialect("OptiTrack Motive's CSV", knows_motive, read_motive),
    "ros": Dialect(
        "text of ROS: rostopic echo -p, PlotJuggler", first_line(r"^(%time|__time),"),
        columns=ROS_COLUMNS,
    ),
    CSV: Dialect("text with columns, with headers or a mapping", knows_columns),
    "mat": Dialect(
        "GRAB's parsed .mat, or any with a mapping", magic(machines.MAT), machines.read_mat,
        binary=True,
    ),
    "rosbag": Dialect(
        "bags of ROS 1 and 2: .bag, .db3, .mcap with CDR, or their folder",
        lambda head: magic(ros.ROS1)(head) or magic(ros.SQLITE, "the magic bytes of SQLite")(head),
        read_bag, binary=True,
    ),
    "mcap": Dialect(
        "MCAP with messages in JSON, as runs leave it",
        magic(MAGIC, "the magic bytes of MCAP"), ros.read_mcap, binary=True,
    ),
}  # fmt: skip
"""Dialects by the name of `--log-format`."""


def read_log(path: Path | str, facts: Facts | None = None, dialect: str = AUTO) -> Log:
    """Reads a log of a machine.

    Args:
        path: The file.
        facts: What is known of it besides; None: nothing.
        dialect: A name of `DIALECTS`; `auto`: recognised by the file.

    Raises:
        LogFileError: There is no such dialect, none or several fit the file, or it is damaged; one
            line.
    """
    path, facts = Path(path), Facts() if facts is None else facts
    if (path / "metadata.yaml").is_file() and dialect in (AUTO, "rosbag"):
        return read_bag(path, "", facts)
    if not path.is_file() or not path.stat().st_size:
        what = "a folder" if path.is_dir() else "an empty file" if path.exists() else "no such file"
        raise refusal(path, what, "a log")
    if dialect not in (AUTO, *DIALECTS):
        accepted = accepted_names(dialect, (*DIALECTS, AUTO))
        raise LogFileError(f"log format: found {dialect!r}; {accepted}")
    name = dialect if dialect != AUTO else recognise(path)[0]
    if not name and facts.mapping is None and not facts.robot_cables:
        words = "a file that no reader of logs recognises"
        numbers = "columns of numbers without a header need a mapping"
        raise refusal(path, words, f"{', '.join(DIALECTS)}, named by log_format; {numbers}")
    name = name or CSV
    how = DIALECTS[name]
    text = "" if how.binary else read_text(path)
    why = how.knows(read_bytes(path, HEAD) if how.binary else text)
    if dialect not in (AUTO, CSV) and not why:
        start = "other bytes" if how.binary else f"{text[:30]!r} at the top"
        raise refusal(path, start, how.title)
    read = how.read or partial(columns_log, patterns=how.columns, above=how.above)
    log = read(path, text, facts)
    return replace(log, dialect=log.dialect or name, why=log.why or why or "it has headers")


def recognise(path: Path) -> tuple[str, str]:
    """Name of the dialect of a file, and why; empty if none fits.

    `csv`, whose headers others have too, counts where no other dialect fits.
    """
    raw = read_bytes(path, HEAD)
    text = plain_text(raw, "ignore")
    if text is not None and len(raw) == HEAD:
        text = text.rpartition("\n")[0]
    fits: dict[str, str] = {}
    for name, how in DIALECTS.items():
        head = raw if how.binary else text
        if head is not None:
            why = how.knows(head)
            fits |= {name: why} if why else {}
    if len(fits) > 1:
        fits.pop(CSV, None)
    if len(fits) > 1:
        words = "; ".join(f"{name}, as {why}" for name, why in fits.items())
        words = f"a file that several readers recognise: {words}"
        raise refusal(path, words, "one of them, named by log_format")
    return next(iter(fits.items()), ("", ""))
