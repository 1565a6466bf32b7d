"""How subcommands print: results on stdout, and on stderr how far they are."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

LINE_PERIOD = 10.0
"""Time between lines of progress where there is no terminal [s]."""


def print_json(found: Any) -> None:
    """Prints results for other programs."""
    print(json.dumps(found, indent=2))


def wide_console(pipe_width: int = 120) -> Console:
    """Where tables are printed; a pipe has no width, and takes `pipe_width` characters.

    What users write and units such as [m] are words, and never markup.
    """
    return Console(width=None if sys.stdout.isatty() else pipe_width, markup=False)


def progress_bar(console: Console) -> Progress:
    """A bar, the time left, and the field `state` of its task.

    Without a terminal, a line on stderr every `LINE_PERIOD` in its place.
    """
    kind = Progress if console.is_terminal else _Lines
    return kind(
        BarColumn(bar_width=10),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[state]}", markup=False),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


class _Lines(Progress):
    """Progress for files and pipes: one line now and then, none for what is quick."""

    _said = 0.0

    def start(self) -> None:
        """Begins to count time."""
        self._said = time.monotonic()
        super().start()

    def update(self, task_id: TaskID, **fields: Any) -> None:
        """Takes over where the task stands, and says so if it has not for a while."""
        super().update(task_id, **fields)
        now = time.monotonic()
        if now - self._said >= LINE_PERIOD:
            self._said = now
            task = self.tasks[task_id]
            share = f"{task.percentage:3.0f} %, " if task.total else ""
            print(f"{task.description}: {share}{task.fields['state']}", file=sys.stderr, flush=True)
