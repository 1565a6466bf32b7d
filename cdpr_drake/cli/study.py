"""`cdpr study`: runs a study and writes its numbers and figures."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.studies import chosen_studies
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import continued_folder, results_folder
from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry, studies_that, write_study
from cdpr_drake.analyses.sweeps.workers import check_scheduler
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import FigureFormats, Overwrite, ResultsAsJson, Scheduler, parse_formats
from cdpr_drake.cli.process import INTERRUPTED, StopRequest
from cdpr_drake.cli.run_endings import (
    SayContinued,
    report_failures,
    report_kept_files,
    report_recovered,
    shown_path,
)
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest

RECIPES = sorted({recipe for entry in STUDIES.values() for recipe in entry.recipes})
"""Names of recipes of all studies."""

REPEATING = studies_that(lambda entry: entry.repeats)
"""Studies that take a number of seeds, in words."""

STOPPING = (
    "Stopping: waits for what has been begun, then writes what is finished; Ctrl-C again ends this "
    "now"
)
"""Answer to the first Ctrl-C."""

MOST_SEEDS = 10_000
"""Runs of each configuration at the most: every one of them is listed before the first begins."""

PIPE_WIDTH = 160
"""Width of tables where there is no terminal [characters]."""


def help_words() -> str:
    """What `cdpr study --help` says above the options."""
    return (
        "Runs a study and writes results.json and figures; Ctrl-C keeps what is finished.\n\n"
        f"{studies_that(lambda entry: entry.continues)} continue where they were stopped or "
        "killed when they are run again with the same --out."
    )


def study(
    name: Annotated[
        str,
        typer.Argument(
            help="Which study: " + ", ".join(STUDIES) + ".", autocompletion=words_among(STUDIES)
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Results folder; without it, a new one below studies/.")
    ] = None,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    seeds: Annotated[
        int | None,
        typer.Option(help=f"Runs of each configuration; for {REPEATING}.", min=1, max=MOST_SEEDS),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; without it, one for each processor.", min=1)
    ] = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    scheduler: Scheduler = None,
    recipe: Annotated[
        str | None,
        typer.Option(
            help=f"Another recipe alone, on all rows, for control-stability: {', '.join(RECIPES)}.",
            autocompletion=words_among(RECIPES),
        ),
    ] = None,
) -> int:
    """Runs a study and writes results.json and figures; Ctrl-C keeps what is finished."""
    chosen_studies([name])
    if scheduler is not None:
        if not STUDIES[name].spreads:
            raise CdprError(f"--scheduler: study {name} is computed here; leave it out")
        check_scheduler(scheduler)
    if seeds is not None and not STUDIES[name].repeats:
        raise CdprError(f"--seeds: accepted with {REPEATING}, not with {name}")
    formats = parse_formats(figure_format)
    entry = _by_recipe(name, recipe)
    called = name if recipe is None else f"{name}-{recipe}"
    folder = out if out is not None else free_folder(Path("studies") / called)
    console = message_console()
    stop = StopRequest(STOPPING)
    prepared = continued_folder if entry.continues else results_folder
    with stop.listening(), prepared(folder, overwrite) as results:
        report_recovered(console, results)
        with progress_bar(console) as bar:
            task = bar.add_task(name, total=None, state="starting")
            say_continued = SayContinued(bar.console, folder)

            def show(progress: WorkProgress) -> None:
                say_continued(progress)
                bar.update(
                    task,
                    completed=progress.done,
                    total=progress.total,
                    state=f"{progress.speed:.1f} {progress.rate}, {progress.what}",
                )

            session = StudySession(results.path, show, stop, workers, seeds, scheduler)
            result = entry.run(quick, session)
        with working(console, "Writing results"):
            failed = write_study(result, results.path, formats)
            results.unfinished = result.interrupted
            folder = shown_path(results.publish())
    report_kept_files(console, results.kept)
    if as_json:
        print_json(result.as_dict())
    else:
        printer = wide_console(PIPE_WIDTH)
        for table in result.tables():
            printer.print(table)
        printer.print(f"results: {folder}")
    if result.interrupted:
        words = f"Interrupted; what was finished is in {folder}"
        if entry.continues:
            words += f"; to continue:\n{_command(name, folder, quick, as_json, formats)}"
            given = {
                "--seeds": seeds, "--workers": workers, "--scheduler": scheduler,
                "--recipe": recipe,
            }  # fmt: skip
            for option, value in given.items():
                words += f" {option} {value}" if value is not None else ""
        console.print(words)
        report_failures(console, failed, folder, None)
        return INTERRUPTED
    return report_failures(console, failed, folder, None)


def _by_recipe(name: str, recipe: str | None) -> StudyEntry:
    """The study, or that of another recipe of it.

    Raises:
        CdprError: It has no recipes, or not this one.
    """
    entry = STUDIES[name]
    if recipe is None:
        return entry
    if not entry.recipes:
        able = studies_that(lambda other: bool(other.recipes))
        raise CdprError(f"--recipe: accepted with {able}, not with {name}")
    if recipe not in entry.recipes:
        raise CdprError(f"--recipe: {recipe!r} is unknown; {closest(recipe, entry.recipes)}")
    return replace(entry, run=entry.recipes[recipe])


def _command(name: str, folder: Path, quick: bool, as_json: bool, formats: Sequence[str]) -> str:
    """The command that continues a study."""
    options = ["--quick"] * quick + ["--json"] * as_json
    if tuple(formats) != DEFAULT_FORMATS:
        options += ["--format", ",".join(formats)]
    return shlex.join(["cdpr", "study", name, "--out", str(folder), *options])
