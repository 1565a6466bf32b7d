"""What a terminal shows of long work, and how Ctrl-C stops it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cdpr_drake.analyses.frame.follow import Follow, Progress
from cdpr_drake.cli.option_names import SHARED_OPTIONS, with_options
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.cli.terminal import message_console, progress_bar

STOPPING = "Stopping: what has begun is finished and kept; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C."""


@contextmanager
def following(name: str) -> Iterator[Follow]:
    """Who follows long work: a bar on stderr with its name; the first Ctrl-C asks to stop."""
    console, request = message_console(), StopRequest(STOPPING)
    with request.listening(), progress_bar(console) as bar:
        task = bar.add_task(name, total=None, state="starting")

        def progress(now: Progress) -> None:
            speed = (now.done - now.found) / now.seconds if now.seconds else 0.0
            state = f"{speed:.1f} {now.unit}/s, {now.what}" if speed else now.what
            bar.update(task, completed=now.done, total=now.total, state=state)

        def say(words: str) -> None:
            console.print(with_options(words, SHARED_OPTIONS))

        yield Follow(progress, request, say)
