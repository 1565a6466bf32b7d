"""`cdpr doctor`: checks what this machine has."""

from __future__ import annotations

from dataclasses import asdict

from rich.table import Table
from rich.text import Text

from cdpr_drake.analyses.doctor import examine
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import message_console, print_json, wide_console


def doctor(as_json: AsJson = False) -> int:
    """Checks Drake, EGL and OpenCV, and says the remedy; exit code 1 if something is missing."""
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
