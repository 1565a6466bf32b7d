"""`cdpr reproduce`: runs every study and writes one report on all that was published."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cdpr_drake.analyses.front.studies import chosen_studies, write_reproduction
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.reproduction.rows import FAILED, ReportRow
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import FigureFormats, Overwrite, ResultsAsJson, parse_formats
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import INCOMPLETE, STUDY_FAILED, report_kept_files, shown_path
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working

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
        typer.Option(help="Results folder; without it, reproduction or reproduction-quick."),
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
        int | None, typer.Option(help="Processes; without it, one for each processor.", min=1)
    ] = None,
    figure_format: FigureFormats = "png",
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
) -> int:
    """Runs every study and writes one report on all that was published beside what is found.

    A study that is finished is not run again unless the code has changed; what was stopped or
    killed continues when the same command is given again. One that fails does not end the others.
    Figures are in PNG, which the report shows, and in the formats that are asked for beside.
    """
    # The report shows those in PNG.
    formats = tuple(dict.fromkeys(("png", *parse_formats(figure_format))))
    studies = chosen_studies(
        None if only is None else [name.strip() for name in only.split(",") if name.strip()]
    )
    folder = out if out is not None else Path("reproduction-quick" if quick else "reproduction")
    console = message_console()
    stop = StopRequest(STOPPING)
    with stop.listening(), continued_folder(folder, overwrite) as results:
        check_folder(results.path, quick)
        with progress_bar(console) as bar:
            states = run_studies(
                studies,
                results.path,
                replace(_settings(quick, workers, stop, bar, len(studies)), formats=formats),
            )
        with StopRequest(WRITING).listening(), working(console, "Writing the report"):
            found = write_reproduction(results.path, studies, states, quick)
            left = found.unfinished(list(studies))
            results.unfinished = bool(left)
    report_kept_files(console, results.kept)
    if as_json:
        print_json(found.as_dict())
    else:
        _print(found.rows, states, shown_path(found.page))
    again = shlex.join(
        ["cdpr", "reproduce", "--out", str(folder), *(["--quick"] if quick else [])]
        + (["--only", only] if only else [])
        + (["--workers", str(workers)] if workers else [])
        + (["--format", figure_format] if figure_format != "png" else [])
    )
    return _ending(console, left, states, again)


def _settings(
    quick: bool, workers: int | None, stop: StopRequest, bar: Any, count: int
) -> RunSettings:
    """Studies say how far they are by the bar."""
    task = bar.add_task("reproduce", total=None, state="starting")

    def tell(name: str, number: int, progress: WorkProgress | None) -> None:
        words = f"{number + 1}/{count} {name}"
        if progress is None:
            bar.update(task, completed=0, total=None, state=words)
        else:
            bar.update(
                task, completed=progress.done, total=progress.total,
                state=f"{words}: {progress.what}",
            )  # fmt: skip

    return RunSettings(quick, workers, tell, bar.console.print, stop)


def _print(rows: Sequence[ReportRow], states: dict[str, StudyState], page: Path) -> None:
    """The scorecard, what failed, and where the report is."""
    card = Scorecard.of(rows)
    verdicts = card.shown()
    table = new_table("What was published, repeated", ("source", "chapter"), ("items", *verdicts))
    for (source, chapter), counts in card.chapters.items():
        cells = [str(counts[verdict] or "") for verdict in verdicts]
        table.add_row(source.replace("_", " "), chapter, str(counts.total()), *cells)
    table.add_section()
    total = card.total()
    table.add_row("all", "", str(total.total()), *(str(total[verdict]) for verdict in verdicts))
    printer = wide_console(160)
    printer.print(table)
    printer.print(f"{len(states)} studies, report: {page}")


def _ending(
    console: Console, left: Sequence[str], states: dict[str, StudyState], again: str
) -> int:
    """Says what is left to do; returns the exit code."""
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
    if left:
        console.print(f"Interrupted; left: {', '.join(left)}; to continue:\n{again}")
        return INTERRUPTED
    if failed:
        return STUDY_FAILED
    return INCOMPLETE if pictures else 0
