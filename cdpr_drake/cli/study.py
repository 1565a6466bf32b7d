"""`cdpr study`: runs a study and writes its numbers and figures."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.front.studies import chosen_studies, run_study
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.published.recipe_variants import RECIPES
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.cli.command_session import CommandSession, shown
from cdpr_drake.cli.completion import words_among
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
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import print_json, wide_console

NAMES = sorted(RECIPES)
"""Of the recipes of control-stability."""

STOPPING = (
    "Stopping: waits for what has been begun, then writes what is finished; Ctrl-C again ends this "
    "now"
)
"""Answer to the first Ctrl-C."""

MOST_SEEDS = 10_000
"""Runs of each configuration at the most: every one of them is listed before the first begins."""

OPTIONS = {"seeds": "--seeds", "recipe": "--recipe", "runs_from": "--runs-from"}
"""Options by the arguments of `run_study`."""

PIPE_WIDTH = 160
"""Width of tables where there is no terminal [characters]."""


def help_words() -> str:
    """What `cdpr study --help` says above the options."""
    return (
        "Runs a study and writes results.json and figures; Ctrl-C keeps what is finished.\n\n"
        "Run again with the same --out, it continues where it was stopped or killed."
    )


def study(
    name: Annotated[
        str,
        typer.Argument(
            help="Which study: " + ", ".join(STUDIES) + ".", autocompletion=words_among(STUDIES)
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Results folder; default: a new one below studies/.")
    ] = None,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    seeds: Annotated[
        int | None,
        typer.Option(
            help="Runs of each configuration, where a study repeats them.", min=1, max=MOST_SEEDS
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Processes; default: one for each processor, for long work.", min=1),
    ] = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
    scheduler: Scheduler = None,
    runs_from: RunsFrom = None,
    recipe: Annotated[
        str | None,
        typer.Option(
            help=f"Another recipe alone, on all rows, for control-stability: {', '.join(NAMES)}.",
            autocompletion=words_among(NAMES),
        ),
    ] = None,
) -> int:
    """Runs a study and writes results.json and figures; Ctrl-C keeps what is finished."""
    chosen_studies([name])
    formats = parse_formats(figure_format)
    called = name if recipe is None else f"{name}-{recipe}"
    folder = out if out is not None else free_folder(Path("studies") / called)
    with (
        named_options(OPTIONS),
        CommandSession(STOPPING, folder, name) as session,
    ):
        found = run_study(
            name, folder, quick, seeds=seeds, recipe=recipe, workers=scheduler or workers,
            overwrite=overwrite, formats=formats, runs_from=runs_from, session=session,
        )  # fmt: skip
    console, folder = session.console, shown(found.folder)
    session.say_kept()
    if as_json:
        print_json(found.as_dict())
    else:
        printer = wide_console(PIPE_WIDTH)
        for table in found.tables():
            printer.print(table)
        printer.print(f"results: {folder}")
    if found.interrupted:
        words = f"Interrupted; what was finished is in {folder}; to continue:\n"
        words += _command(name, folder, quick, as_json, formats)
        given = {
            "--seeds": seeds, "--workers": workers, "--scheduler": scheduler,
            "--recipe": recipe, "--runs-from": runs_from,
        }  # fmt: skip
        for option, value in given.items():
            words += f" {option} {value}" if value is not None else ""
        console.print(words)
        report_failures(console, found.failed, folder, None)
        return INTERRUPTED
    return report_failures(console, found.failed, folder, None)


def _command(name: str, folder: Path, quick: bool, as_json: bool, formats: Sequence[str]) -> str:
    """The command that continues a study."""
    options = ["--quick"] * quick + ["--json"] * as_json
    if tuple(formats) != DEFAULT_FORMATS:
        options += ["--format", ",".join(formats)]
    return shlex.join(["cdpr", "study", name, "--out", str(folder), *options])
