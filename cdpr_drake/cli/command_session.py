"""What a terminal shows of a call of the front door, and how Ctrl-C stops it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, Self

from rich.progress import Progress as Bar
from rich.progress import TaskID

from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.reporting.output_folder import ResultsFolder, shown_path
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.cli.option_names import SHARED_OPTIONS, with_options
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.cli.run_endings import SayContinued, report_kept_files, report_recovered
from cdpr_drake.cli.terminal import message_console, progress_bar, working


class CommandSession(Session):
    """A bar on stderr while something is computed, words for other work; Ctrl-C ends it early.

    Inside its block it listens to Ctrl-C and SIGTERM.

    Attributes:
        console: Of stderr.
        request: Whether somebody asked to stop.
        folder: Where results go, as the user named it.
        name: Of what is computed.
        total: All work; None: it is not known.
    """

    def __init__(
        self, stopping: str, folder: Path, name: str = "", total: float | None = None
    ) -> None:
        """For one call.

        Args:
            stopping: Answer to the first Ctrl-C.
            folder: Where results go, as the user named it.
            name: Of what is computed.
            total: All work.
        """
        super().__init__()
        self.console, self.request = message_console(), StopRequest(stopping)
        self.folder, self.name, self.total = folder, name, total
        self._results: ResultsFolder | None = None
        self._bar: Bar | None = None
        self._task = TaskID(0)
        self._say_continued = SayContinued(self.console, folder)
        self._open = ExitStack()

    def __enter__(self) -> Self:
        self._open.enter_context(self.request.listening())
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def stop(self) -> bool:
        """Whether somebody asked to stop."""
        return self.request()

    def say(self, words: str) -> None:
        """Prints a line."""
        self.console.print(with_options(words, SHARED_OPTIONS))

    def warn(self, words: str) -> None:
        """Prints a warning."""
        self.say(f"warning: {words}")

    def opened(self, results: ResultsFolder) -> None:
        """Says where results of killed runs went."""
        self._results = results
        report_recovered(self.console, results)

    def say_kept(self) -> None:
        """Says which files of others were kept when results were replaced."""
        report_kept_files(self.console, [] if self._results is None else self._results.kept)

    @contextmanager
    def computing(self, part: str = "") -> Iterator[None]:
        """Shows the bar; a further part has one of its own."""
        with progress_bar(self.console) as self._bar:
            total = None if part else self.total
            self._task = self._bar.add_task(part or self.name, total=total, state="starting")
            yield

    def doing(self, words: str) -> AbstractContextManager[Callable[[str], None]]:
        """Shows words."""
        return working(self.console, words)

    def progress(self, progress: Any) -> None:
        """Moves the bar; says once that earlier work is continued."""
        if isinstance(progress, WorkProgress):
            self._say_continued(progress)
        self.show(**self.fields(progress))

    def fields(self, progress: Any) -> dict[str, Any]:
        """What the bar shows of a progress: `completed`, `total`, `state`."""
        return {
            "completed": progress.done,
            "total": progress.total,
            "state": f"{progress.speed:.1f} {progress.rate}, {progress.what}",
        }

    def show(self, **fields: Any) -> None:
        """Moves the bar."""
        if self._bar is not None:
            self._bar.update(self._task, **fields)


def shown(folder: Path | None) -> Path:
    """Where results are, as it is shown."""
    assert folder is not None
    return shown_path(folder)
