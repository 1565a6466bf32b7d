"""A sweep over poses on the command line: where it stands, and how Ctrl-C ends it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from rich.console import Console

from cdpr_drake.analyses.reporting import WorkProgress
from cdpr_drake.analyses.sweeps import STARTING
from cdpr_drake.cli.stop_request import INTERRUPTED, StopRequest
from cdpr_drake.cli.terminal import progress_bar

STOPPING = "Stopping after the chunks under way; Ctrl-C again drops them"
"""Answer to the first Ctrl-C."""


class _Run(Protocol):
    @property
    def progress(self) -> WorkProgress: ...


Run = TypeVar("Run", bound=_Run)


def watched(
    title: str,
    folder: Path,
    console: Console,
    run: Callable[[Callable[[WorkProgress], None], StopRequest], Run],
    dropped: Callable[[WorkProgress], Run],
) -> Run:
    """Runs a sweep, shows how far it is, and leaves what is finished to Ctrl-C.

    Args:
        title: Words before the progress.
        folder: Where finished chunks are kept.
        console: Where to show it.
        run: Takes a function to be told where the sweep stands, and a request to stop to ask.
        dropped: What came of a sweep of which nothing but its last progress is known.
    """
    stop = StopRequest(STOPPING)
    with stop.listening(), progress_bar(console) as bar:
        task = bar.add_task(title, total=None, state=STARTING)
        said: list[str] = []
        seen: list[WorkProgress] = []

        def show(progress: WorkProgress) -> None:
            seen[:] = [progress]
            if not said:
                said.append(_continues(progress, folder))
                if said[0]:
                    bar.console.print(said[0])
            state = f"{progress.done}/{progress.total} poses, {progress.speed:.0f} per s"
            bar.update(
                task,
                completed=progress.done,
                total=progress.total,
                state=STARTING if progress.done == progress.found else state,
            )

        try:
            result = run(show, stop)
        except KeyboardInterrupt:  # the second one; what is under way is lost
            if not seen:
                raise
            result = dropped(seen[0])
    if not said and result.progress.found:
        console.print(f"{folder}: complete already, nothing was computed")
    return result


def interrupted(progress: WorkProgress, folder: Path, console: Console) -> int:
    """Says how a sweep that was stopped goes on; returns the exit code."""
    console.print(
        f"Interrupted after {progress.done} of {progress.total} poses; run again with "
        f"the same arguments to continue in {folder}"
    )
    return INTERRUPTED


def _continues(progress: WorkProgress, folder: Path) -> str:
    if not progress.found:
        return ""
    return f"Continuing in {folder}: {progress.found} of {progress.total} poses were there already"
