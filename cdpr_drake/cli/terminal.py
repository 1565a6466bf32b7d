"""How subcommands print: results on stdout, and on stderr how far they are."""

from __future__ import annotations

import json
import sys
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


def print_json(found: Any) -> None:
    """Prints results for other programs."""
    print(json.dumps(found, indent=2))


def wide_console(pipe_width: int) -> Console:
    """Where tables are printed; a pipe has no width, and takes `pipe_width` characters."""
    return Console(width=None if sys.stdout.isatty() else pipe_width)


def progress_bar(console: Console) -> Progress:
    """A bar, the time left, and the field `state` of its task; only on a terminal."""
    return Progress(
        BarColumn(bar_width=10),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[state]}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
