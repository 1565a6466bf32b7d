"""`cdpr doctor`: checks what this machine has, and compiles what first runs would wait for."""

from __future__ import annotations

import time
from dataclasses import asdict
from functools import partial
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from cdpr_drake.analyses.compilation import compilation_steps
from cdpr_drake.analyses.doctor import examine
from cdpr_drake.cli.first_use import GROUPS
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console
from cdpr_drake.kernel_cache import compile_needed


def doctor(
    as_json: AsJson = False,
    compile_all: Annotated[
        bool,
        typer.Option(
            "--compile",
            help="Compile the kernels of simulations and tension methods now, once, for later "
            "runs; nothing is examined then.",
        ),
    ] = False,
) -> int:
    """Checks Drake, EGL and OpenCV, and says the remedy; exit code 1 if something is missing."""
    if compile_all:
        return _compile(as_json)
    with message_console().status("Looking"):
        findings = examine()
    if as_json:
        print_json([asdict(finding) for finding in findings])
    else:
        table = Table(title="cdpr doctor")
        for heading in ("check", "", "found", "remedy"):
            table.add_column(heading)
        for f in findings:
            mark = Text("ok", "green") if f.passed else Text("missing", "red")
            table.add_row(f.check, mark, f.found, f.remedy)
        wide_console().print(table)
    return 0 if all(finding.passed for finding in findings) else 1


def _compile(as_json: bool) -> int:
    """Does every step of `compilation_steps`, and says how long that took.

    Meanwhile the processes that were started before all else compile from the last step on; what
    only they know of is waited for in the end.
    """
    steps, began = compilation_steps(), time.perf_counter()
    steps.append(("what is left", partial(compile_needed, GROUPS)))
    with progress_bar(message_console()) as progress:
        task = progress.add_task("", total=len(steps), state="beginning")
        for name, step in steps:
            progress.update(task, state=name)
            step()
            progress.advance(task)
    seconds = time.perf_counter() - began
    if as_json:
        print_json({"steps": [name for name, _ in steps], "wall_time_s": seconds})
    else:
        message_console().print(f"Kernels are compiled and kept; that took {seconds:.0f} s.")
    return 0
