"""`cdpr study`: runs a study and writes its numbers and figures."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from cdpr_drake.analyses.output_folder import free_folder, results_folder
from cdpr_drake.analyses.studies import STUDIES
from cdpr_drake.analyses.study_progress import StudyProgress
from cdpr_drake.cli.stop_request import INTERRUPTED, StopRequest
from cdpr_drake.errors import CdprError
from cdpr_drake.typed_yaml import closest

PIPE_WIDTH = 160
"""Width of tables where there is no terminal [characters]."""


def study(
    name: Annotated[str, typer.Argument(help="Which study: " + ", ".join(STUDIES) + ".")],
    out: Annotated[
        Path | None, typer.Option(help="Results folder; without it, a new one below studies/.")
    ] = None,
    quick: Annotated[bool, typer.Option(help="A short form, to see that it works.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the results as JSON.")] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace results in the folder.")] = False,
) -> int:
    """Runs a study and writes results.json and figures; Ctrl-C keeps what is finished."""
    if name not in STUDIES:
        raise CdprError(f"study {name!r} is unknown; {closest(name, STUDIES)}")
    folder = out if out is not None else free_folder(Path("studies") / name)
    console = Console(stderr=True)
    stop = StopRequest()
    with results_folder(folder, overwrite) as work:
        with stop.listening(), _progress_bar(console) as bar:
            task = bar.add_task(name, total=None, state="starting")

            def show(progress: StudyProgress) -> None:
                rate = progress.done / max(progress.wall_time, 1e-9)
                bar.update(
                    task,
                    completed=progress.done,
                    total=progress.total,
                    state=f"{rate:.1f} {progress.rate}, {progress.what}",
                )

            result = STUDIES[name](quick, work, show, stop)
        with console.status("Writing results"):
            result.write(work)
    if as_json:
        print(json.dumps(result.as_dict(), indent=2))
    else:
        printer = Console(width=None if sys.stdout.isatty() else PIPE_WIDTH)
        for table in result.tables():
            printer.print(table)
        printer.print(f"results: {folder}")
    if result.interrupted:
        console.print(f"Interrupted; what was finished is in {folder}")
        return INTERRUPTED
    return 0


def _progress_bar(console: Console) -> Progress:
    return Progress(
        BarColumn(bar_width=10),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[state]}"),
        console=console,
        transient=True,
    )
