"""What a terminal shows of work under way, and how Ctrl-C stops it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from cdpr_drake.analyses.frame.follow import Follow, Progress
from cdpr_drake.cli.option_names import with_options
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.cli.terminal import message_console, progress_bar, working

STOPPING = "Stopping: what has begun is finished and kept; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C."""


@contextmanager
def following(name: str, long: bool, options: Mapping[str, str]) -> Iterator[Follow]:
    """Shows a command's work: a bar, and how to stop, if it is long; else that it is under way.

    Args:
        name: The command.
        long: True if its verb tells how far it is, and stops when it is asked to.
        options: Options by the names of its verb's arguments, for what the verb says.
    """
    console = message_console()
    if not long:
        with working(console, f"cdpr {name}"):
            yield Follow()
        return
    request = StopRequest(STOPPING)
    with request.listening(), progress_bar(console) as bar:
        task = bar.add_task(name, total=None, state="starting")

        def progress(now: Progress) -> None:
            speed = (now.done - now.found) / now.seconds if now.seconds else 0.0
            rate = f"{speed:.1f} {'x real time' if now.unit == 's' else f'{now.unit}/s'}"
            state = f"{rate}, {now.what}" if speed else now.what
            bar.update(task, completed=now.done, total=now.total or None, state=state)

        def say(words: str) -> None:
            console.print(with_options(words, options))

        yield Follow(progress, request, say, results=Path(name))
