"""`cdpr doctor`: checks what this machine has."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.doctor import examine


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Checks Drake, EGL and OpenCV, and says the remedy; exit code 1 if something is missing."""
    with Console(stderr=True).status("Looking"):
        findings = examine()
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings], indent=2))
    else:
        table = Table(title="cdpr doctor")
        for heading in ("check", "", "found", "remedy"):
            table.add_column(heading)
        for f in findings:
            mark = "[green]ok[/green]" if f.passed else "[red]missing[/red]"
            table.add_row(f.check, mark, f.found, f.remedy)
        Console().print(table)
    return 0 if all(finding.passed for finding in findings) else 1
