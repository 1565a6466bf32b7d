"""`cdpr doctor`: checks what this machine has, and compiles what first runs would wait for."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from cdpr_drake.analyses.installation import LISTED, compilation_steps, compile_step, examine
from cdpr_drake.analyses.sweeps.worker_pool import run_jobs
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console


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
    """Checks Drake, EGL and OpenCV and names the remedy; exit code 1 if something is missing."""
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
    """Does every step of `compilation_steps`, on all processors, and says how long that took."""
    names, began = [LISTED, *(name for name, _ in compilation_steps())], time.perf_counter()
    with progress_bar(message_console()) as progress:
        task = progress.add_task("", total=len(names), state="beginning")
        for index, _ in run_jobs(compile_step, names):
            progress.update(task, state=f"{names[index]}: done")
            progress.advance(task)
    seconds = time.perf_counter() - began
    if as_json:
        print_json({"steps": names, "wall_time_s": seconds})
    else:
        message_console().print(f"Kernels are compiled and kept; that took {seconds:.0f} s.")
    return 0
