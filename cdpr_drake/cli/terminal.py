"""How subcommands print: results on stdout, and on stderr how far they are."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from cdpr_drake.cli.compiling import FIRST_USE, compiling
from cdpr_drake.cli.process import PROGRESS
from cdpr_drake.errors import plain_words

PROGRESS_PERIOD = "CDPR_PROGRESS_PERIOD"
"""Environment variable of the time between lines of progress [s], for programs that read them."""


def _line_period() -> float:
    try:
        return max(float(os.environ.get(PROGRESS_PERIOD, "")), 0.0)
    except ValueError:
        return 10.0


LINE_PERIOD = _line_period()
"""Time between lines of progress where there is no terminal [s]."""

WIDEST = 200
"""Beyond this width, tables in a pipe wrap their words [characters]."""

LOOK_PERIOD = 0.5
"""Time between looks whether a line is due [s]."""


def print_words(*words: object) -> None:
    """Prints words on stdout, in which names of files control no terminal."""
    print(plain_words(" ".join(map(str, words))))


def message_console() -> Console:
    """Where is said how far something is and what went wrong; paths are words, and never markup."""
    return _Plain(stderr=True, markup=False, highlight=False, soft_wrap=True)


def wide_console(pipe_width: int = 120) -> Console:
    """Where tables are printed; a pipe has no width, and takes `pipe_width` characters.

    In a pipe or file, a table whose columns need more gets it: nothing is cut, and a row is a line
    up to `WIDEST` characters. What users write and units such as [m] are words, and never markup.
    """
    if sys.stdout.isatty():
        return _Plain(markup=False)
    return _Pipe(width=pipe_width, markup=False)


class _Plain(Console):
    """A console that words do not control, also those in the cells of tables."""

    def render_str(self, text: str, **options: Any) -> Text:
        """The words, escaped where they would control the terminal."""
        return super().render_str(plain_words(text), **options)


class _Pipe(_Plain):
    """A console that is as wide as its tables need."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Prints; a table's words may be wrapped as far as they go, and never cut."""
        before = self.width
        for each in objects:
            if isinstance(each, Table):
                self.width = max(self.width, _needed(each))
        super().print(*objects, **options)
        self.width = before


def _needed(table: Table) -> int:
    """Width at which no cell of a table is cut, and none wrapped up to `WIDEST` [characters]."""
    endless = Console(width=1_000_000, markup=False)
    needs = Measurement.get(endless, endless.options, table)
    return max(needs.minimum, min(needs.maximum, WIDEST))


@contextmanager
def working(console: Console, words: str) -> Iterator[Callable[[str], None]]:
    """Says what is done inside the block, also that kernels are compiled.

    On a terminal for as long as it takes, else on a line every `LINE_PERIOD`.

    Yields:
        What changes the words.
    """
    now = [words]

    def say(other: str) -> None:
        now[0] = other

    def shown() -> str:
        note = compiling()
        return f"{now[0]}: {note}" if note else now[0]

    if console.is_terminal:
        with console.status(_Live(shown)):
            yield say
        return
    lines = _Lines(shown)
    with lines.spoken():
        yield say


class _Live:
    """Words that are asked for whenever they are drawn."""

    def __init__(self, words: Callable[[], str]) -> None:
        self._words = words

    def __rich__(self) -> Text:
        return Text(plain_words(self._words()))


def progress_bar(console: Console) -> Progress:
    """A bar, the time left, and the field `state` of its task, or that kernels are compiled.

    Without a terminal, a line on stderr every `LINE_PERIOD` in its place.
    """
    kind = Progress if console.is_terminal else _LineProgress
    return kind(
        BarColumn(bar_width=10),
        TimeRemainingColumn(compact=True),
        _StateColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def state_words(task: Task) -> str:
    """Where a task stands: what it says, or why it does not begin."""
    state = str(task.fields["state"])
    note = compiling()
    if not note and FIRST_USE and not task.completed:  # in other processes, perhaps
        note = "compiling, first use"
    if not note:
        return state
    return note if task.completed else f"{state}, {note}"


class _StateColumn(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(plain_words(state_words(task)))


class _Lines:
    """A line on stderr now and then, none for what is quick; also while the program is busy."""

    def __init__(self, words: Callable[[], str]) -> None:
        self._words = words
        self._said = time.monotonic()
        self._lock = threading.Lock()

    @contextmanager
    def spoken(self) -> Iterator[None]:
        """Lines are printed inside the block."""
        self._said = time.monotonic()
        over = threading.Event()

        def look() -> None:
            self.say_if_due()
            while not over.wait(LOOK_PERIOD):
                self.say_if_due()

        thread = threading.Thread(target=look, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def say_if_due(self) -> None:
        """Says where the work stands, if nothing was said for a while."""
        with self._lock:
            now = time.monotonic()
            if now - self._said >= LINE_PERIOD:
                self._said = now
                words = self._words()
                if words:  # as one piece, for other threads write there, too
                    sys.stderr.write(f"{PROGRESS}{plain_words(words)}\n")
                    sys.stderr.flush()


class _LineProgress(Progress):
    """Progress for files and pipes."""

    def __init__(self, *columns: ProgressColumn, **options: Any) -> None:
        super().__init__(*columns, **options)
        self._lines = _Lines(self._words)
        self._speaking = self._lines.spoken()

    def _words(self) -> str:
        if not self.tasks:
            return ""
        task = self.tasks[-1]
        share = f"{task.percentage:3.0f} %, " if task.total else ""
        return f"{task.description}: {share}{state_words(task)}"

    def start(self) -> None:
        """Begins to say lines."""
        self._speaking.__enter__()
        super().start()

    def stop(self) -> None:
        """Ends the lines."""
        super().stop()
        self._speaking.__exit__(None, None, None)

    def update(self, task_id: TaskID, **fields: Any) -> None:
        """Takes over where the task stands, and says so if nothing was said for a while."""
        super().update(task_id, **fields)
        self._lines.say_if_due()
