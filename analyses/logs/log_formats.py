"""Readers of logs by name, and which of them a file is for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from cdpr_drake.analyses.logs.column_log import knows_columns, read_columns
from cdpr_drake.analyses.logs.grab_log import knows_grab, read_grab_log
from cdpr_drake.analyses.logs.gtgraffiti_log import knows_gtgraffiti, read_gtgraffiti
from cdpr_drake.analyses.logs.hangprinter_log import knows_hangprinter, read_hangprinter
from cdpr_drake.analyses.logs.log_request import TOLD, LogRequest
from cdpr_drake.analyses.logs.mat_log import knows_mat, read_mat
from cdpr_drake.analyses.logs.mcap_log import knows_mcap, read_mcap
from cdpr_drake.analyses.logs.motive import knows_motive, read_motive
from cdpr_drake.analyses.logs.recorded_log import COMMANDED, ESTIMATED, RecordedLog
from cdpr_drake.errors import LogFileError, accepted_names
from cdpr_drake.schema.input_files import file_size

AUTO = "auto"

HEAD = 60_000
"""Bytes at the top by which a file is told."""


@dataclass(frozen=True)
class LogReader:
    """A reader of logs.

    Attributes:
        title: What it reads, in words.
        read: From a path and what was asked to the log.
        of_text: Why a text is one of these, empty where it is not; None: they are no text.
        of_bytes: The same for files that are no text; None.
    """

    title: str
    read: Callable[[Path, LogRequest], RecordedLog]
    of_text: Callable[[str], str] | None = None
    of_bytes: Callable[[bytes], str] | None = None


MOTIVE = "motive"

LOG_READERS = {
    "hangprinter": LogReader(
        "a Hangprinter's series: motor_pos_samp, xyz_of_samp, force_samp", read_hangprinter,
        knows_hangprinter,
    ),
    "grab": LogReader("GRAB's raw log: lines type,time,...", read_grab_log, knows_grab),
    "gtgraffiti": LogReader(
        "GTGraffiti's controller: mode: x y - x y | ...", read_gtgraffiti, knows_gtgraffiti
    ),
    MOTIVE: LogReader("OptiTrack Motive's CSV", read_motive, knows_motive),
    "csv": LogReader("text with columns, with headers or a mapping", read_columns, knows_columns),
    "mat": LogReader(
        "GRAB's parsed .mat, or any with a mapping", read_mat, of_bytes=knows_mat
    ),
    "mcap": LogReader(
        "MCAP with messages in JSON, as runs leave it", read_mcap, of_bytes=knows_mcap
    ),
}  # fmt: skip
"""Readers by the name of `--log-format`."""


class Detected(NamedTuple):
    """Which reader a file is for, and why."""

    format: str
    why: str


def detect_log(path: Path) -> Detected | None:
    """Which reader knows a file; None where none does.

    `csv`, whose headers others have too, is asked last.

    Raises:
        LogFileError: It cannot be read, or several know it.
    """
    try:
        file_size(path)
        with path.open("rb") as file:
            raw = file.read(HEAD)
    except OSError as problem:
        raise LogFileError(f"{path}: cannot be read: {problem.strerror}") from problem
    text = _head_text(raw)
    found: list[Detected] = []
    for name, reader in LOG_READERS.items():
        why = ""
        if reader.of_bytes is not None:
            why = reader.of_bytes(raw)
        elif reader.of_text is not None and text is not None and not (name == "csv" and found):
            why = reader.of_text(text)
        if why:
            found.append(Detected(name, why))
    if len(found) > 1:
        told = "; ".join(f"{each.format}, as {each.why}" for each in found)
        raise LogFileError(f"{path}: found a file that several readers recognise: {told}; "
                           "accepted: one of them, named by --log-format")  # fmt: skip
    return found[0] if found else None


def _head_text(raw: bytes) -> str | None:
    """The beginning of a text with one kind of line endings; None where it is no text."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = raw[: len(raw) // 2 * 2].decode("utf-16", errors="ignore")
    elif b"\0" in raw:
        return None
    else:
        text = raw.decode("utf-8-sig", errors="ignore")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.rpartition("\n")[0] if len(raw) == HEAD else text


def read_recorded(path: Path, format: str = AUTO, asked: LogRequest | None = None) -> RecordedLog:
    """Reads a log of a machine.

    Args:
        path: The file.
        format: A name of `LOG_READERS`, or `AUTO`: told by the file.
        asked: What is known of it beside the file.

    Raises:
        LogFileError: There is no such format, no reader knows the file, several do, or it is
            damaged; one line.
    """
    asked = LogRequest() if asked is None else asked
    if not path.is_file() or not path.stat().st_size:
        what = "a folder" if path.is_dir() else "an empty file" if path.exists() else "no such file"
        raise LogFileError(f"{path}: found {what}; accepted: a log")
    if format != AUTO:
        if format not in LOG_READERS:
            raise LogFileError(
                f"log format: found {format!r}; {accepted_names(format, (*LOG_READERS, AUTO))}"
            )
        return LOG_READERS[format].read(path, asked)
    detected = detect_log(path)
    if detected is None and asked.mapping is not None:
        return read_columns(path, asked)
    if detected is None:
        raise LogFileError(
            f"{path}: found a file that no reader of logs recognises; accepted: "
            f"{', '.join(LOG_READERS)}, named by --log-format; columns of numbers without a header "
            "need --mapping"
        )
    return LOG_READERS[detected.format].read(path, asked)


def unused(log: RecordedLog, asked: LogRequest) -> tuple[str, ...]:
    """What was told beside a file and changed nothing, and why, in words.

    Args:
        log: What was read.
        asked: What was told.
    """
    found = []
    if asked.rate is not None and TOLD not in log.units.get("time", ""):
        found.append(f"a rate of {asked.rate:g} 1/s, since the file has times")
    if asked.body is not None and log.format != MOTIVE:
        found.append(f"the rigid body {asked.body}, since only {MOTIVE} files have some")
    if asked.cables and not any(
        header.removeprefix(COMMANDED).removeprefix(ESTIMATED).startswith(f"{name}_")
        for name in asked.cables
        for header in log.columns
    ):
        found.append(f"the cables {', '.join(asked.cables)[:80]}, since no column is of one")
    return tuple(found)
