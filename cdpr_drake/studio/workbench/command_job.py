"""A job that is a `cdpr` command."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.workbench.job import Event, Job, JobState
from cdpr_drake.studio.workbench.job_process import COMMAND, Child, progress_of, reason

LOOK_PERIOD = 0.1
"""Time between looks at a process [s]."""

MOST_LINES = 200
"""Lines of messages that are kept."""

INTERRUPTED, INCOMPLETE, CLIENT_ENDED = 130, 3, 4
"""Exit codes of `cdpr` for work that was stopped and kept, and for complete data with a remark."""


class CommandJob(Job):
    """Runs `cdpr SUBCOMMAND ...`, with what it prints as JSON as the result.

    Attributes:
        arguments: Of the command, from the name of the subcommand on.
        working: Folder that it is run in.
        folder: Where its results will be; None: nowhere.
    """

    program: Sequence[str] = COMMAND
    """What is run with the arguments."""

    def __init__(
        self,
        title: str,
        arguments: Sequence[str],
        working: Path,
        folder: Path | None = None,
        *,
        done_with: Path | None = None,
    ) -> None:
        """Not begun; arguments as the attributes. An option --json is up to the caller.

        Args:
            title: What it is, in a few words.
            arguments: As the attribute.
            working: As the attribute.
            folder: As the attribute.
            done_with: A file that is removed when the work is done, or left no folder.
        """
        super().__init__(title)
        self._done_with = done_with
        self.arguments, self.working, self.folder = tuple(arguments), working, folder
        self._child: Child | None = None
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        self._wish = False
        self._output = b""

    @property
    def process_id(self) -> int | None:
        """Of the process; None where there is none yet."""
        return None if self._child is None else self._child.process_id

    @property
    def lines(self) -> list[str]:
        """What it said besides its progress, the newest `MOST_LINES` lines."""
        return list(self._lines)

    def result(self) -> Any:
        """What it printed as JSON; None where that was none."""
        try:
            return load_json(self._output)
        except ValueError:
            return None

    def begin(self) -> None:
        """Starts the process; a failure of that is one of the job."""
        with self._lock:
            if self.state != JobState.QUEUED:
                return
            try:
                self._child = self._start()
            except OSError as problem:
                self.set_state(JobState.FAILED, f"cannot be started: {problem}")
                return
            self.set_state(JobState.RUNNING)
        threading.Thread(target=self._watch, daemon=True, name=f"job {self.number}").start()

    def stop(self) -> None:
        """As the base class says, by SIGTERM."""
        with self._lock:
            if self.state.is_over or self._wish:
                return
            self._wish = True
            if self._child is None:
                self.set_state(JobState.STOPPED)
                return
            self.set_state(JobState.STOPPING)
        self._child.ask_to_stop()

    def kill(self) -> None:
        """As the base class says, by SIGKILL, with all processes that it started."""
        with self._lock:
            if self._child is None:
                self.set_state(JobState.STOPPED)
            elif not self.state.is_over:
                self._child.kill()

    def _start(self) -> Child:
        return Child([*self.program, *self.arguments], self.working)

    def _attend(self, seconds: float) -> None:
        """Waits so long for the process, or does what it asks for meanwhile."""
        self._over.wait(seconds)

    def _watch(self) -> None:
        child = self._child
        assert child is not None
        while (code := child.ended()) is None:
            self._hear(child.lines())
            self._attend(LOOK_PERIOD)
        self._attend(0.0)
        self._hear(child.lines())
        if child.last_words():
            self._hear([child.last_words()])
        self._output = child.output()
        child.close()
        self._end(code)

    def _hear(self, lines: Sequence[str]) -> None:
        for line in lines:
            found = progress_of(line)
            if found is not None:
                self.set_progress(*found)
                continue
            self._lines.append(line)
            self.emit(Event("line", {"text": line}))

    def _end(self, code: int) -> None:
        """Says how it ended, by its exit code."""
        lines = self.lines
        done = code in (0, INCOMPLETE, CLIENT_ENDED)
        if self._done_with is not None and (done or not (self.folder and self.folder.is_dir())):
            with suppress(OSError):
                self._done_with.unlink(missing_ok=True)
        if done:
            self.set_progress(1.0, "")
            said = "" if code == 0 or not lines else reason(lines, code)
            self.set_state(JobState.FINISHED, said)
        elif self._wish:
            self.set_state(JobState.STOPPED, lines[-1] if code == INTERRUPTED and lines else "")
        else:
            self.set_state(JobState.FAILED, reason(lines, code))
