"""The verb import_log: a log of any recorder as one that all commands read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from cyclopts import Parameter
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    InputFile,
    Names,
    RobotWord,
    Switch,
    names,
    one_of,
    whole,
    words,
)
from cdpr_drake.analyses.logs.clocks import join_logs, without_packets
from cdpr_drake.analyses.logs.columns import COMMANDED, ESTIMATED, UNITS
from cdpr_drake.analyses.logs.dialects import AUTO, DIALECTS, LOG_SUFFIXES, read_log, recognise
from cdpr_drake.analyses.logs.log import AS_TOLD, Facts, Log, refusal
from cdpr_drake.arrays import Array
from cdpr_drake.errors import (
    CdprError,
    LogFileError,
    OutputFolderError,
    accepted_names,
    why_not_read,
)
from cdpr_drake.formats.grab_mat import is_grab_mat
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.schema.input_files import file_size
from cdpr_drake.schema.yaml_files import load_yaml


def checked_units(units: Mapping[str, str]) -> dict[str, str]:
    """Units by dimension, in small letters."""
    for dimension, unit in units.items():
        known = [name for name, (of, _) in UNITS.items() if of == dimension]
        if not known:
            accepted = accepted_names(dimension, sorted({of for of, _ in UNITS.values()}))
            raise LogFileError(f"unit: found {dimension!r}; {accepted}")
        if unit.lower() not in known:
            accepted = accepted_names(unit, known)
            raise LogFileError(f"unit of {dimension}: found {unit!r}; {accepted}")
    return {dimension: unit.lower() for dimension, unit in units.items()}


def axes_rotation(word: str) -> Array:
    """R_WF from which axes of the file x, y and z of W are, as `z,x,y` or `-z,-x,y`."""
    parts = [part.strip().lower() for part in word.split(",")]
    R = np.array([
        [(-1.0 if part.startswith("-") else 1.0) * (part.lstrip("+-") == axis) for axis in "xyz"]
        for part in parts
    ])  # fmt: skip
    if len(parts) != 3 or not np.isclose(np.linalg.det(R), 1.0):
        accepted = "the axes of the file that are x, y and z of W, right-handed, as z,x,y or x,-z,y"
        raise refusal("axes", repr(word), accepted)
    return R


def _units(word: str) -> dict[str, str]:
    pairs = [item.strip().partition("=") for item in word.split(",")]
    if not all(mark for _, mark, _ in pairs):
        raise ValueError(word)
    return {dimension: unit for dimension, _, unit in pairs}


def _topics(word: str) -> list[str]:
    topics = names(word)
    if not all(topic.startswith("/") for topic in topics):
        raise ValueError(word)
    return topics


LogFormat: TypeAlias = Annotated[str, one_of((*DIALECTS, AUTO))]
Units: TypeAlias = Annotated[
    Mapping[str, str] | None,
    words(_units, "DIMENSION=UNIT, as length=mm, or several with commas", "DIMENSION=UNIT,..."),
]
MappingFile: TypeAlias = Annotated[
    Path | str | None, words(Path, "the path of a YAML file", "FILE")
]
Rate: TypeAlias = Annotated[float | None, words(float, "above 0 [1/s]", "RATE")]
Axes: TypeAlias = Annotated[Any, words(axes_rotation, "three axes, as -z,-x,y", "AXIS,AXIS,AXIS")]
Topics: TypeAlias = Annotated[
    Sequence[str] | None, words(_topics, "topics with commas, as /tracker/pose", "TOPIC,...")
]
OutFile: TypeAlias = Annotated[Path | str | None, words(Path, "the path of a file", "FILE")]


def facts_of(
    cables: Sequence[str] | None = None, *, unit: Mapping[str, str] | None = None,
    mapping: Path | str | None = None, rate: float | None = None, body: str | None = None,
    axes: Any = None, topic: Sequence[str] | None = None,
) -> Facts:  # fmt: skip
    """What is known of a log beside its file; arguments and errors as of `import_log`."""
    if cables is not None and (not all(cables) or len(set(cables)) < len(cables)):
        raise refusal("cables", f"{', '.join(cables)!r}", "different names, as A,B,C,D")
    if rate is not None and not 0.0 < rate < np.inf:
        raise refusal("rate", f"{rate!r}", "above 0 [1/s]")
    facts = Facts(
        cables=None if cables is None else tuple(cables), units=checked_units(unit or {}),
        rate=rate, body=body, topics=None if topic is None else tuple(topic),
        R_WF=axes_rotation(axes) if isinstance(axes, str) else axes,
    )  # fmt: skip
    return facts if mapping is None else with_mapping(facts, Path(mapping))


_MOST_MAPPING = 1_000_000
"""Bytes of a mapping file."""


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
        if file_size(path) > _MOST_MAPPING:
            raise refusal(path, f"more than {_MOST_MAPPING:,} bytes", "fewer")
        content = load_yaml(path.read_text(encoding="utf-8"))
        mapping = _Mapping.model_validate(content)
    except ValidationError as problem:
        errors = sorted(problem.errors(), key=lambda error: error["type"] != "extra_forbidden")
        key, known = str((*errors[0]["loc"], "columns")[0]), _Mapping.model_fields
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


@verb()
def import_log(
    file: InputFile, /, *, out: OutFile = None,
    beside: Annotated[Path | None, Parameter(name="--with")] = None,
    log_format: LogFormat = AUTO, with_format: LogFormat = AUTO, robot: RobotWord = None,
    cables: Names | None = None, unit: Units = None, mapping: MappingFile = None,
    rate: Rate = None, body: str | None = None, topic: Topics = None, axes: Axes = None,
    start: Annotated[float | None, Parameter(name="--from")] = None, until: float | None = None,
    every: Annotated[int, whole(1)] = 1, overwrite: Switch = False,
) -> Log:  # fmt: skip
    """Reads a log as a machine or a tracker wrote it, and writes one that calibrate and identify
    take.

    READERS

    --with FILE is what another recorder wrote of the same motion: its clock is read as the first
    one's, and shift and drift are told with their standard deviations. Without --out it says what
    is in the log, and what became of each column of the file.

    Args:
        file: The log.
        out: CSV file to write.
        beside: Log of the same motion by another recorder.
        log_format: Reader; auto says which and why.
        unit: Units that the file does not state, as length=mm,force=N.
        mapping: YAML file of what columns are: columns: [time_s, C1_length_mm, ''], or name:
            header; skip_rows, separator, rate_hz.
        rate: Rows per second, for files without times [1/s].
        body: Rigid body of a tracker that is the platform.
        topic: Topics of a bag of ROS that are read, as /tracker/pose,/winches; default: all.
        axes: Axes of a tracker's file that are x,y,z of W, as z,x,y or -z,-x,y.
        with_format: Reader of the other log.
        robot: Robot whose cable names the columns take.
        cables: Names of the cables in the order of the log, as A,B,C,D.
        start: First instant [s].
        until: Last instant [s].
        every: Keep every n-th row.
        overwrite: Replace the file.

    Raises:
        LogFileError: A file or an argument is not accepted; one line.
        ClockError: Both logs are not of one motion, or it repeats itself.
        OutputFolderError: The file to write is one of the logs, is there, or cannot be written.
    """
    target = None if out is None else Path(out)
    if target is not None:
        if target.resolve() in [Path(source).resolve() for source in (file, beside) if source]:
            raise OutputFolderError(f"out: found {out}, the log itself; accepted: another file")
        if target.exists() and not overwrite:
            raise OutputFolderError(f"out: found {out}; accepted: a new file, or add overwrite")
    if robot is not None and cables is not None:
        raise CdprError("cables: found with robot; accepted: one of them")
    if robot is not None:
        cables = [cable.name for cable in as_robot(robot, "import_log").cables]
    facts = facts_of(cables, unit=unit, mapping=mapping, rate=rate, body=body, axes=axes,
                     topic=topic)  # fmt: skip
    log = without_packets(read_log(file, facts, log_format))
    unused = unused_facts(log, facts)
    if beside is not None:
        second = read_log(beside, replace(facts, mapping=None, skip_rows=0, separator=None),
                          with_format)  # fmt: skip
        unused = [remark for remark in unused if remark in unused_facts(second, facts)]
        log = join_logs(log, without_packets(second))
    log = log.with_remarks(*unused).part(start, until, every)
    if target is not None:
        log.write(target)
    return replace(log, written=target)


READERS = "\n    ".join(f"- {name}: {how.title}" for name, how in DIALECTS.items())
import_log.__doc__ = (import_log.__doc__ or "").replace("READERS", READERS)


def unused_facts(log: Log, facts: Facts) -> list[str]:
    """Remarks on what a user said of a log that changed nothing, and why."""
    unused = []
    if facts.rate is not None and not log.units.get("time", "").endswith(f"rows/s, {AS_TOLD}"):
        unused.append(f"a rate of {facts.rate:g} 1/s, since the file has times")
    if facts.body is not None and log.dialect != "motive":
        unused.append(f"the rigid body {facts.body}, since only motive files have some")
    if facts.topics is not None and log.dialect not in ("rosbag", "mcap"):
        unused.append(f"the topics {', '.join(facts.topics)[:80]}, since only bags have some")
    stems = [name.removeprefix(COMMANDED).removeprefix(ESTIMATED) for name in log.frame]
    if facts.cables and not any(s.startswith(f"{c}_") for c in facts.cables for s in stems):
        unused.append(f"the cables {', '.join(facts.cables)[:80]}, since no column is of one")
    return [f"not used: {words}" for words in unused]


def is_log(path: Path) -> bool:
    """True if a file is a log of a machine: by its ending, and by a reader that knows it."""
    if path.suffix.lower() not in LOG_SUFFIXES or not path.is_file() or is_grab_mat(path):
        return False
    return bool(recognise(path)[0])


def checked_log(path: Path) -> tuple[str, list[str], Log] | None:
    """What a log is, notes on it, and the log, for `check_files`; None of all other files."""
    if not is_log(path):
        return None
    log = import_log(path)
    first, *notes = log.lines()
    return "log, " + first.removeprefix(f"{path}: "), [note.strip() for note in notes], log
