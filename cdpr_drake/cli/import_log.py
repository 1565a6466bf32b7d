"""`cdpr import-log`: a log as recorders write it, as one that calibrate and identify take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cdpr_drake.analyses.frame.words import Names, RobotWord, whole, words
from cdpr_drake.analyses.front.logs import import_log as read_logs
from cdpr_drake.analyses.logs.log_formats import AUTO, LOG_READERS
from cdpr_drake.cli.log_options import Axes, LogFormat, Mapping, Rate, Units, log_request
from cdpr_drake.cli.sessions import Answer
from cdpr_drake.errors import CdprError, OutputFolderError, why_not_read
from cdpr_drake.models.robot_loader import load_robot


def import_log(
    file: Path, /, *,
    out: Annotated[Path | None, words(Path, "the path of a file", "FILE")] = None,
    beside: Annotated[Path | None, Parameter(name="--with")] = None,
    log_format: LogFormat = AUTO, with_format: LogFormat = AUTO, robot: RobotWord = None,
    cables: Names | None = None, unit: Units = None, mapping: Mapping = None, rate: Rate = None,
    body: str | None = None, axes: Axes = None,
    start: Annotated[float | None, Parameter(name="--from")] = None, until: float | None = None,
    every: Annotated[int, whole(1)] = 1, overwrite: bool = False,
) -> Answer:  # fmt: skip
    """Reads a log as a machine or a tracker wrote it, and writes one that calibrate and identify
    take.

    READERS

    --with FILE is what another recorder wrote of the same motion: its clock is read as the first
    one's, and shift and drift are told with their standard deviations. Without --out it says what
    is in the log.

    Args:
        file: The log.
        out: CSV file to write.
        beside: Log of the same motion by another recorder.
        log_format: Reader; auto says which and why.
        with_format: Reader of the other log.
        robot: Robot whose cable names the columns take.
        cables: Names of the cables in the order of the log, as A,B,C,D.
        unit: Units that the file does not state, as length=mm,force=N.
        mapping: YAML file of what columns are: columns: [time_s, C1_length_mm, ''], or name:
            header; skip_rows, separator, rate_hz.
        rate: Rows per second, for files without times [1/s].
        body: Rigid body of a tracker that is the platform.
        axes: Axes of a tracker's file that are x,y,z of W, as z,x,y or -z,-x,y.
        start: First instant [s].
        until: Last instant [s].
        every: Keep every n-th row.
        overwrite: Replace the file.
    """
    for read in (file, beside):
        if out is not None and read is not None and out.resolve() == read.resolve():
            raise OutputFolderError(f"out: found {out}, the log itself; accepted: another file")
    if out is not None and out.exists() and not overwrite:
        raise OutputFolderError(f"out: found {out}; accepted: a new file, or --overwrite")
    if robot is not None and cables is not None:
        raise CdprError("cables: found beside --robot; accepted: one of them")
    if robot is not None:
        cables = [cable.name for cable in load_robot(robot, "cdpr import-log").cables]
    log = read_logs(
        file, log_request(cables, unit=unit, mapping=mapping, rate=rate, body=body, axes=axes),
        format=log_format, beside=beside, beside_format=with_format, start=start, end=until,
        every=every,
    )  # fmt: skip
    if out is not None:
        try:
            log.write(out)
        except OSError as problem:
            raise OutputFolderError(
                f"{out}: cannot be written: {why_not_read(problem)}"
            ) from problem
    return Answer(
        numbers={**log.as_dict(), "written": None if out is None else str(out)},
        printed=[*log.lines(), *([] if out is None else [str(out)])], drawing=log.plot,
    )  # fmt: skip


import_log.__doc__ = (import_log.__doc__ or "").replace(
    "READERS", "\n    ".join(f"- {name}: {reader.title}" for name, reader in LOG_READERS.items())
)
