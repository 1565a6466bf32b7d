"""`cdpr reproduce`: runs every study and writes one report on all that was published."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.reporting.tables import frame_table
from cdpr_drake.analyses.studies.report import Reproduction, print_pdf
from cdpr_drake.analyses.studies.report import reproduce as reproduce_all
from cdpr_drake.analyses.studies.study import STUDIES
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.following import following
from cdpr_drake.cli.options import (
    FigureFormats,
    Overwrite,
    ResultsAsJson,
    RunsFrom,
    Scheduler,
    named_options,
    parse_formats,
)
from cdpr_drake.cli.process import INTERRUPTED
from cdpr_drake.cli.run_endings import INCOMPLETE, STUDY_FAILED
from cdpr_drake.cli.terminal import message_console, print_json, wide_console

OPTIONS = {"only": "--only", "runs_from": "--runs-from", "against": "--against"}
"""Options by the arguments of `reproduce`."""


def reproduce(
    out: Annotated[
        Path | None,
        typer.Option(help="Results folder; default: reproduction or reproduction-quick."),
    ] = None,
    quick: Annotated[
        bool, typer.Option(help="Studies in their short forms, in a quarter of an hour.")
    ] = False,
    only: Annotated[
        str | None,
        typer.Option(
            help="Some studies alone, by name, such as case-9,stability-ranges.",
            autocompletion=words_among(STUDIES),
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Processes; default: one for each processor, for long work.", min=1),
    ] = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    scheduler: Scheduler = None,
    runs_from: RunsFrom = None,
    against: Annotated[
        Path | None,
        typer.Option(help="Folder of an older report: the new one says which verdicts changed."),
    ] = None,
    pdf: Annotated[
        bool, typer.Option(help="Print the report into a PDF, too, by a browser of this machine.")
    ] = False,
) -> int:
    """Runs every study and writes one page on what sources print beside what is found.

    All studies take hours in their full forms. Finished studies run again only if the code has
    changed. The same command continues an interrupted one. A study that fails does not stop the
    others.
    """
    names = None if only is None else [name.strip() for name in only.split(",") if name.strip()]
    folder = out or Path("reproduction-quick" if quick else "reproduction")
    with named_options(OPTIONS), following("reproduce") as follow:
        report = reproduce_all(
            folder, quick, names, workers=workers if scheduler is None else scheduler,
            overwrite=overwrite, formats=parse_formats(figure_format), runs_from=runs_from,
            against=against, follow=follow,
        )  # fmt: skip
    printed = print_pdf(report.page) if pdf else None
    if as_json:
        print_json(report.as_dict())
    else:
        _print(report)
    console = message_console()
    for name, words in report.failed.items():
        console.print(f"cdpr: study failed: {name}: {words}")
    for file, why in report.undrawn.items():
        console.print(f"cdpr: {folder / file}: not written: {why}")
    if pdf and printed is None:
        console.print("cdpr: --pdf: no browser here prints; open the page in one and print it")
    if report.left:
        console.print(f"Interrupted; left: {', '.join(report.left)}; the same command goes on")
        return INTERRUPTED
    if report.failed:
        return STUDY_FAILED
    return INCOMPLETE if report.undrawn or (pdf and printed is None) else 0


def _print(report: Reproduction) -> None:
    """Verdicts of each section, and where the report is."""
    table = report.counts().reset_index()
    printer = wide_console(160)
    printer.print(frame_table("What sources print, beside what is found", table))
    printer.print(f"report: {shown_path(report.page)}")
