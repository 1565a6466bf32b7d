"""`cdpr reproduce`: runs every study and writes one report on all that was published."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cdpr_drake.analyses.front.reproduction import Reproduction, StudyOfMany
from cdpr_drake.analyses.front.reproduction import reproduce as reproduce_all
from cdpr_drake.analyses.front.studies import chosen_studies
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.reproduction.digest_pdf import NO_REPORTLAB
from cdpr_drake.analyses.reproduction.rows import FAILED, NOT_ASKED
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.cli.command_session import CommandSession
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import (
    FigureFormats,
    Overwrite,
    ResultsAsJson,
    RunsFrom,
    parse_formats,
)
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import INCOMPLETE, STUDY_FAILED
from cdpr_drake.cli.terminal import print_json, wide_console, working

STOPPING = (
    "Stopping: waits for what the study has begun, then writes the report; Ctrl-C again ends the "
    "study now, and writes the report"
)
"""Answer to the first Ctrl-C."""

WRITING = "The report is being written, from what is there; Ctrl-C again ends this without it"
"""Answer to a Ctrl-C while the report is written, also where one has ended the studies."""


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
    runs_from: RunsFrom = None,
    beside: Annotated[
        Path | None,
        typer.Option(help="Folder of an older report, whose counts are shown beside the new ones."),
    ] = None,
) -> int:
    """Runs every study and writes one report that compares published and computed results.

    Finished studies run again only if the code has changed. The same command continues an
    interrupted one. A study that fails does not stop the others. Figures are PNG files, which the
    report shows, and any other formats you ask for. If reportlab is installed, a digest of about
    twelve pages is written as PDF.
    """
    formats = parse_formats(figure_format)
    asked = None if only is None else [name.strip() for name in only.split(",") if name.strip()]
    chosen_studies(asked)
    folder = out if out is not None else Path("reproduction-quick" if quick else "reproduction")
    with ReproductionSession(STOPPING, folder, "reproduce") as session:
        found = reproduce_all(
            folder, quick, asked, workers=workers, overwrite=overwrite, formats=formats,
            runs_from=runs_from, beside=beside, session=session,
        )  # fmt: skip
    session.say_kept()
    if as_json:
        print_json(found.as_dict())
    else:
        _print(found)
    again = shlex.join(
        ["cdpr", "reproduce", "--out", str(folder), *(["--quick"] if quick else [])]
        + (["--only", only] if only else [])
        + (["--workers", str(workers)] if workers else [])
        + (["--format", figure_format] if figure_format != "png" else [])
        + (["--runs-from", str(runs_from)] if runs_from else [])
        + (["--beside", str(beside)] if beside else [])
    )
    return _ending(session.console, found, again)


class ReproductionSession(CommandSession):
    """What a terminal shows of a reproduction: the study that runs, and how far it is."""

    def progress(self, progress: StudyOfMany) -> None:
        """Moves the bar."""
        words, now = f"{progress.number + 1}/{progress.of} {progress.name}", progress.progress
        if now is None:
            self.show(completed=0, total=None, state=words)
        else:
            self.show(completed=now.done, total=now.total, state=f"{words}: {now.what}")

    @contextmanager
    def doing(self, words: str) -> Iterator[Callable[[str], None]]:
        """Shows words; Ctrl-C has another answer here, also where one has ended the studies."""
        with StopRequest(WRITING).listening(), working(self.console, words) as say:
            yield say


def _print(found: Reproduction) -> None:
    """The scorecard, and where the report and its digest are."""
    card = Scorecard.of(found.rows)
    verdicts = card.shown_facts()
    title = "What was published, repeated: facts, each counted once"
    table = new_table(title, ("source", "chapter"), ("facts", *verdicts))
    for (source, chapter), counts in card.facts.items():
        if set(+counts) == {NOT_ASKED}:
            continue  # the sum has them
        cells = [str(counts[verdict] or "") for verdict in verdicts]
        table.add_row(source.replace("_", " "), chapter, str(counts.total()), *cells)
    table.add_section()
    total = card.total_facts()
    cells = [str(total[verdict]) for verdict in verdicts]
    table.add_row("all sources", "", str(total.total()), *cells)
    printer = wide_console(160)
    printer.print(table)
    printer.print(
        f"{card.independent} facts of the sources are confirmed by runs that could have said "
        f"otherwise; the report has {card.total().total()} figures, tables, numbers and sentences"
    )
    digest = "" if found.digest is None else f", digest: {shown_path(found.digest)}"
    printer.print(f"{len(found.states)} studies, report: {shown_path(found.page)}{digest}")


def _ending(console: Console, found: Reproduction, again: str) -> int:
    """Says what is left to do; returns the exit code."""
    states, left = found.states, found.left
    failed = [state for state in states.values() if state.status == "failed"]
    for state in failed:
        console.print(f"cdpr: {FAILED}: {state.study}: {state.error}")
    pictures = [state for state in states.values() if state.lacks_pictures]
    for state in pictures:
        console.print(
            f"cdpr: {state.study}: the data is complete; not written: {state.error}; the same "
            "command tries again",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
    for name, why in found.failed.items():
        older = " (the one that is there is of an earlier report)"
        there = (found.page.parent / name).exists()
        console.print(
            f"cdpr: {name} was not written{older if there else ''}: {why}",
            soft_wrap=True, markup=False, highlight=False,
        )  # fmt: skip
    if left:
        console.print(f"Interrupted; left: {', '.join(left)}; to continue:\n{again}")
        return INTERRUPTED
    if failed:
        return STUDY_FAILED
    # A library that nobody installed is a choice, and trying again changes nothing.
    incomplete = pictures or any(why != NO_REPORTLAB for why in found.failed.values())
    return INCOMPLETE if incomplete else 0
