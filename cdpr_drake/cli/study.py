"""`cdpr study`: runs a study and writes its numbers and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.frame.folder import free_folder
from cdpr_drake.analyses.reporting.tables import frame_table
from cdpr_drake.analyses.studies.study import (
    MOST_SEEDS,
    STUDIES,
    Form,
    arguments_of,
    run_study,
    study_named,
)
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

OPTIONS = {"seeds": "--seeds", "recipe": "--recipe", "runs_from": "--runs-from"}
"""Options by the arguments of `run_study`."""

PIPE_WIDTH = 160
"""Width of tables where there is no terminal [characters]."""


def help_words() -> str:
    """What `cdpr study --help` says above the options."""
    return (
        "Runs a study and writes results.json, tables and figures; Ctrl-C keeps what is finished."
        "\n\nRun again with the same --out, it continues where it was stopped or killed."
    )


def study(
    name: Annotated[
        str,
        typer.Argument(
            help="Which study: " + ", ".join(STUDIES) + ".", autocompletion=words_among(STUDIES)
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Results folder; default: one below studies/.")
    ] = None,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    seeds: Annotated[
        int | None,
        typer.Option(help="How often what depends on chance is measured.", min=1, max=MOST_SEEDS),
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
        str, typer.Option(help="Another recipe for the same rows, for studies that have some.")
    ] = "",
) -> int:
    """Runs a study and writes results.json and figures; Ctrl-C keeps what is finished."""
    study_named(name)
    formats, form = parse_formats(figure_format), Form(quick, seeds, recipe)
    usual = Path("studies") / "-".join(filter(None, (name, recipe)))
    folder = out or free_folder(usual, arguments_of(name, form))
    with named_options(OPTIONS), following(name) as follow:
        result = run_study(
            name, folder, quick, seeds=seeds, recipe=recipe,
            workers=workers if scheduler is None else scheduler, overwrite=overwrite,
            formats=formats, runs_from=runs_from, follow=follow,
        )  # fmt: skip
    if as_json:
        print_json(result.as_dict())
    else:
        printer = wide_console(PIPE_WIDTH)
        for title, table in result.tables().items():
            printer.print(frame_table(title, table))
        printer.print(f"results: {folder}")
    console = message_console()
    for file, why in result.undrawn.items():
        console.print(f"cdpr: {folder / file}: not written: {why}")
    for words in result.failed.values():
        console.print(f"cdpr: failed: {words}")
    if result.stopped:
        console.print(f"Interrupted; the same command with --out {folder} goes on")
        return INTERRUPTED
    if result.failed:
        return STUDY_FAILED
    return INCOMPLETE if result.undrawn else 0
