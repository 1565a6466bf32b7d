"""`cdpr import-log`: a log as recorders write it, as one that calibrate and identify take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.logs import ImportedLog
from cdpr_drake.analyses.front.logs import import_log as read_logs
from cdpr_drake.analyses.logs.log_formats import AUTO, LOG_READERS
from cdpr_drake.analyses.logs.log_request import (
    LogRequest,
    axes_rotation,
    checked_units,
    is_rate,
    read_mapping,
)
from cdpr_drake.cli.completion import robot_words, words_among
from cdpr_drake.cli.options import AsJson, check_plots, save_plot
from cdpr_drake.cli.terminal import print_json, print_words
from cdpr_drake.errors import CdprError, OutputFolderError
from cdpr_drake.models.robot_loader import load_robot

FORMATS = (*LOG_READERS, AUTO)

LogFormat = Annotated[
    str,
    typer.Option(
        help=f"Reader: {', '.join(FORMATS)}; auto says which and why.",
        autocompletion=words_among(FORMATS),
    ),
]
LogRobot = Annotated[
    str | None,
    typer.Option(help="Robot whose cable names the columns take.", autocompletion=robot_words),
]
Cables = Annotated[
    str | None, typer.Option(help="Names of the cables in the order of the log, as A,B,C,D.")
]
Units = Annotated[
    str | None,
    typer.Option("--unit", help="Units that the file does not state, as length=mm,force=N."),
]
Mapping = Annotated[
    Path | None,
    typer.Option(
        help="YAML file of what columns are: columns: [time_s, C1_length_mm, ''], or name: "
        "header; skip_rows, separator, rate_hz."
    ),
]
Rate = Annotated[float | None, typer.Option(help="Rows per second, for files without times [1/s].")]
Body = Annotated[str | None, typer.Option(help="Rigid body of a tracker that is the platform.")]
Axes = Annotated[
    str | None,
    typer.Option(help="Axes of a tracker's file that are x,y,z of W, as z,x,y or -z,-x,y."),
]


def help_words() -> str:
    """The help, with the readers that there are."""
    readers = "\n".join(f"- {name}: {reader.title}" for name, reader in LOG_READERS.items())
    return (
        "Reads a log as a machine or a tracker wrote it, and writes one that calibrate and "
        f"identify take.\n\n{readers}\n\n"
        "--with FILE is what another recorder wrote of the same motion: its clock is read as the "
        "first one's, and shift and drift are told with their standard deviations. Without --out "
        "it says what is in the log."
    )


def import_log(
    file: Annotated[Path, typer.Argument(help="The log.")],
    out: Annotated[Path | None, typer.Option(help="CSV file to write.")] = None,
    beside: Annotated[
        Path | None, typer.Option("--with", help="Log of the same motion by another recorder.")
    ] = None,
    log_format: LogFormat = AUTO,
    with_format: LogFormat = AUTO,
    robot: LogRobot = None,
    cables: Cables = None,
    unit: Units = None,
    mapping: Mapping = None,
    rate: Rate = None,
    body: Body = None,
    axes: Axes = None,
    start: Annotated[float | None, typer.Option("--from", help="First instant [s].")] = None,
    until: Annotated[float | None, typer.Option(help="Last instant [s].")] = None,
    every: Annotated[int, typer.Option(min=1, help="Keep every n-th row.")] = 1,
    plot: Annotated[Path | None, typer.Option(help="File for a figure of the log.")] = None,
    overwrite: Annotated[bool, typer.Option(help="Replace the file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Reads a log of a machine or tracker, and writes one that calibrate and identify take."""
    for read in (file, beside):
        if out is not None and read is not None and out.resolve() == read.resolve():
            raise OutputFolderError(f"--out: found {out}, the log itself; accepted: another file")
    if out is not None and out.exists() and not overwrite:
        raise OutputFolderError(f"--out: found {out}; accepted: a new file, or --overwrite")
    check_plots(plot)
    request = log_request(robot, cables, unit, mapping=mapping, rate=rate, body=body, axes=axes)
    found = read_logs(
        file, request, format=log_format, beside=beside, beside_format=with_format, start=start,
        end=until, every=every,
    )  # fmt: skip
    if out is not None:
        try:
            found.write(out)
        except OSError as problem:
            raise OutputFolderError(f"{out}: cannot be written: {problem.strerror}") from problem
    if plot is not None:
        save_plot(found.plot(), plot)
    if as_json:
        print_json({**found.as_dict(), "written": None if out is None else str(out)})
        return
    for line in log_lines(found):
        print_words(line)
    if out is not None:
        print_words(out)


def log_request(
    robot: str | None,
    cables: str | None,
    unit: str | None,
    *,
    mapping: Path | None,
    rate: float | None,
    body: str | None,
    axes: str | None,
) -> LogRequest:
    """What the options say of a log.

    Raises:
        CdprError: One of them makes no sense.
    """
    if robot is not None and cables is not None:
        raise CdprError("--cables: found beside --robot; accepted: one of them")
    if rate is not None and not is_rate(rate):
        raise CdprError(f"--rate: found {rate:g}; accepted: above 0 [1/s]")
    names = None
    if robot is not None:
        names = tuple(c.name for c in load_robot(robot, "cdpr import-log").cables)
    elif cables is not None:
        names = tuple(word.strip() for word in cables.split(","))
        if not all(names) or len(set(names)) < len(names):
            raise CdprError(f"--cables: found {cables!r}; accepted: different names, as A,B,C,D")
    units = {}
    for item in [] if unit is None else unit.split(","):
        dimension, mark, word = item.strip().partition("=")
        if not mark:
            raise CdprError(
                f"--unit: found {item.strip()!r}; accepted: DIMENSION=UNIT, as length=mm"
            )
        units[dimension] = word
    return LogRequest(
        cables=names, units=checked_units(units), body=body, rate=rate,
        mapping=None if mapping is None else read_mapping(mapping),
        R_WF=None if axes is None else axes_rotation(axes),
    )  # fmt: skip


def log_lines(found: ImportedLog) -> list[str]:
    """What a log is and holds, a line each."""
    log = found.log
    said = [
        f"{log.path}: {log.format}, as {log.why}",
        f"  rows: {log.row_report().words()}",
    ]
    if found.joined is not None:
        said.append(f"  clocks: {found.joined.words()}")
    for words, headers in _by_rows(log.measured()).items():
        said.append(f"  {words}: {', '.join(headers)}")
    said += [f"  {what}: {words}" for what, words in log.units.items()]
    return said + [f"  note: {words}" for words in log.remarks]


def _by_rows(measured: dict[str, int]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for header, rows in measured.items():
        found.setdefault(f"in {rows} rows", []).append(header)
    return found
