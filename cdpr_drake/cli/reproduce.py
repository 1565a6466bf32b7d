"""`cdpr reproduce`: runs every study and writes one report on all that was published."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.output_folder import continued_folder
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.reproduction.page import write_report
from cdpr_drake.analyses.reproduction.rows import FAILED, ReportRow, report_rows
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.reproduction.scorecard import Scorecard
from cdpr_drake.analyses.reproduction.states import StudyState, check_folder
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.published.register import published_registers
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import FigureFormats, Overwrite, ResultsAsJson, parse_formats
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import INCOMPLETE, STUDY_FAILED, say_kept, shown_path
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest

STOPPING = (
    "Stopping: waits for what the study has begun, then writes the report; Ctrl-C again ends the "
    "study now, and writes the report"
)
"""Answer to the first Ctrl-C."""

WRITING = "The report is being written, from what is there; Ctrl-C again ends this without it"
"""Answer to a Ctrl-C while the report is written, also where one has ended the studies."""

SUMMARY = "summary.json"
"""All rows and counts of the report."""


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
    studies = chosen_studies(only)
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
            registers = published_registers()
            rows = report_rows(registers, results.path, studies, states)
            summary = _summary(rows, states, quick)
            write_json(results.path / SUMMARY, summary)  # before the page, which is larger
            page = write_report(results.path, registers, rows, states, quick)
            results.unfinished = bool(_left(studies, states))
    say_kept(console, results.kept)
    if as_json:
        print_json(summary)
    else:
        _print(rows, states, shown_path(page))
    again = shlex.join(
        ["cdpr", "reproduce", "--out", str(folder), *(["--quick"] if quick else [])]
        + (["--only", only] if only else [])
        + (["--workers", str(workers)] if workers else [])
        + (["--format", figure_format] if figure_format != "png" else [])
    )
    return _ending(console, studies, states, again)


def chosen_studies(only: str | None) -> dict[str, StudyEntry]:
    """Studies of --only in the order of the catalogue; all without.

    Raises:
        CdprError: One is unknown, or none is named.
    """
    if only is None:
        return dict(STUDIES)
    names = [name.strip() for name in only.split(",") if name.strip()]
    for name in names:
        if name not in STUDIES:
            raise CdprError(f"--only: study {name!r} is unknown; {closest(name, STUDIES)}")
    if not names:
        raise CdprError(f"--only: found {only!r}; accepted: names of studies, with commas")
    return {name: entry for name, entry in STUDIES.items() if name in names}


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


def _summary(
    rows: Sequence[ReportRow], states: dict[str, StudyState], quick: bool
) -> dict[str, Any]:
    """Everything for JSON."""
    return {
        "quick": quick,
        "code": code_version(),
        "versions": package_versions(),
        "scorecard": Scorecard.of(rows).as_dict(),
        "studies": [state.as_dict() for state in states.values()],
        "items": [row.as_dict() for row in rows],
    }


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
    console: Console, studies: dict[str, StudyEntry], states: dict[str, StudyState], again: str
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
    left = _left(studies, states)
    if left:
        console.print(f"Interrupted; left: {', '.join(left)}; to continue:\n{again}")
        return INTERRUPTED
    if failed:
        return STUDY_FAILED
    return INCOMPLETE if pictures else 0


def _left(studies: Iterable[str], states: Mapping[str, StudyState]) -> list[str]:
    """Studies that were not begun, or stopped."""
    return [name for name in studies if name not in states or states[name].unfinished]
