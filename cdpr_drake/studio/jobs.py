"""Work in processes of their own: a `cdpr` command each, a few at a time.

Drake and numba hold Python's lock, and what kills a run must not kill the server. A job belongs to
the server, not to a page: a reload, or another tab, finds it as it is. Jobs and their manager
belong to the server's event loop; no other thread calls them.
"""

from __future__ import annotations

import asyncio
import itertools
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from enum import StrEnum
from pathlib import Path
from typing import Any

import cdpr_drake
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

COMMAND = (sys.executable, "-P", "-m", "cdpr_drake")
"""The command line; Python does not look for modules in the working folder, which is data."""

PROGRESS_PERIOD, PROGRESS = "CDPR_PROGRESS_PERIOD", "progress: "
"""Environment variable of the time between lines of progress [s], and how such a line begins, see
`cli.terminal`."""

HOME = str(Path(cdpr_drake.__file__).resolve().parent.parent)
"""What Python finds the package in."""

LOOK_PERIOD, LONGEST_END = 0.1, 20.0
"""Times between looks at what a process says, and for jobs to put away what they have when the
server ends [s]."""

LONGEST_LINE, LARGEST_TAIL, LARGEST_OUTPUT = 500, 2**16, 64 * 2**20
"""Characters of a line of messages, and bytes of messages, the newest, and of results in JSON that
are read."""

INTERRUPTED, INCOMPLETE, CLIENT_ENDED = 130, 3, 4
"""Exit codes of `cdpr` for work that was stopped and kept, and for complete data with a remark."""

MOST_JOBS = 200
"""Jobs that are remembered; the oldest that are over are forgotten."""

_PROGRESS = re.compile(rf"{PROGRESS}(?:(?P<title>.*?): +(?P<percent>\d+) %, )?(?P<words>.*)")
_ERROR = "cdpr: "


class JobState(StrEnum):
    """State of a job."""

    QUEUED, RUNNING, PAUSED, STOPPING = "queued", "running", "paused", "stopping"
    FINISHED, FAILED, STOPPED = "finished", "failed", "stopped"

    @property
    def is_over(self) -> bool:
        """True if nothing will change it any more."""
        return self in (JobState.FINISHED, JobState.FAILED, JobState.STOPPED)


class Job:
    """Runs `cdpr SUBCOMMAND ...`, with what it prints as JSON as the result.

    What it says and prints goes to files, so that it never waits for a reader. If the server is
    killed, the job sees the end of a pipe that only the server has, and stops by itself.

    Attributes:
        program: What is run with the arguments.
        arguments: Of the command, from the name of the subcommand on.
        working: Folder that it is run in.
        folder: Folder of its results, by which a board finds it; None: there is none.
        descriptors: Files that only its process will have.
        state: Its state.
        message: Why it failed, or another remark about its end, in one line; else empty.
        progress: Share of the work that is done, from 0 to 1, or None; and words about it.
        lines: What it said besides its progress, the newest lines.
        changed: Called when `state` has changed.
        put_away: Called with it in another thread when its process has ended, or never began.
    """

    program: Sequence[str] = COMMAND

    def __init__(self, arguments: Sequence[str], working: Path, folder: Path | None = None) -> None:
        """Queued; arguments as the attributes, an option --json is up to the caller."""
        self.arguments, self.working, self.folder = tuple(arguments), working, folder
        self.descriptors: tuple[int, ...] = ()
        self.state, self.message = JobState.QUEUED, ""
        self.progress: tuple[float | None, str] = (None, "")
        self.lines: list[str] = []
        self.changed: Callable[[], None] = lambda: None
        self.put_away: Callable[[Job], None] = lambda job: None
        self._output = b""
        self._process: asyncio.subprocess.Process | None = None
        self._lifeline = -1
        self._wish: signal.Signals | None = None
        self._over = asyncio.Event()
        self._started = self._ended = 0.0

    @property
    def elapsed(self) -> float:
        """Time that it has been running, or took [s]."""
        return (self._ended or time.monotonic()) - self._started if self._started else 0.0

    def result(self) -> Any:
        """What it printed as JSON; None if that was none."""
        with suppress(ValueError):
            return load_json(self._output)
        return None

    async def wait(self, seconds: float | None = None) -> bool:
        """Waits until it is over, at most so long; returns True if it is."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._over.wait(), seconds)
        return self.state.is_over

    def begin(self) -> None:
        """Starts to work; a failure of that is one of the job."""
        self._started = time.monotonic()
        self._task = asyncio.create_task(self._run())
        self.set_state(JobState.RUNNING)

    async def _run(self) -> None:
        try:
            await self._work()
        except (OSError, ValueError) as problem:  # a full disk, say
            self.set_state(JobState.FAILED, f"cannot be started: {problem}")
        await asyncio.to_thread(self.put_away, self)

    def stop(self, wish: signal.Signals = signal.SIGTERM) -> None:
        """Asks it to stop and to keep what it has; one that is queued never begins.

        SIGKILL ends it at once, with all that it started.
        """
        if wish != self._wish:  # a second SIGTERM would keep nothing
            self._wish = wish
            queued = self.state == JobState.QUEUED
            self.set_state(JobState.STOPPED if queued else JobState.STOPPING)
            self._signal()

    def set_state(self, state: JobState, message: str = "") -> None:
        """Changes its state; what is over stays as it is."""
        if self.state.is_over:
            return
        self.state, self.message = state, _short(" ".join(message.split()))
        if state.is_over:
            self._ended = time.monotonic()
            self._over.set()
        self.changed()

    def _signal(self) -> None:
        """Commands take SIGTERM as a wish; SIGKILL goes to the whole group."""
        process, wish = self._process, self._wish
        if process is not None and process.returncode is None and wish is not None:
            with suppress(ProcessLookupError, PermissionError):
                (os.killpg if wish == signal.SIGKILL else os.kill)(process.pid, wish)

    async def _work(self) -> None:
        """Runs the process to its end, and keeps what it says."""
        with ExitStack() as stack, ExitStack() as given:
            for descriptor in self.descriptors:
                given.callback(os.close, descriptor)
            files = [await asyncio.to_thread(tempfile.TemporaryFile) for _ in range(2)]
            out, err = (stack.enter_context(file).fileno() for file in files)
            # See `cli.process.exit_with_parent`; no other child inherits it.
            theirs, self._lifeline = os.pipe()
            given.callback(os.close, theirs)
            stack.callback(os.close, self._lifeline)
            own = {
                "PYTHONPATH": os.pathsep.join(filter(None, (HOME, os.environ.get("PYTHONPATH")))),
                PROGRESS_PERIOD: "1", "CDPR_LIFELINE": str(theirs),
            }  # fmt: skip
            process = self._process = await asyncio.create_subprocess_exec(
                *self.program, *self.arguments, cwd=self.working, env=os.environ | own,
                stdin=asyncio.subprocess.DEVNULL, stdout=out, stderr=err,
                pass_fds=(*self.descriptors, theirs), start_new_session=True,
            )  # fmt: skip
            given.close()
            self._signal()
            try:
                while process.returncode is None:
                    await asyncio.sleep(LOOK_PERIOD)
                    self._hear(await asyncio.to_thread(_tail, err))
            finally:
                if process.returncode is None:  # the event loop is ending
                    self._wish = signal.SIGKILL
                    self._signal()
                    await process.wait()
            self._output = await asyncio.to_thread(os.pread, out, LARGEST_OUTPUT, 0)
        self._end(process.returncode)

    def _hear(self, said: str) -> None:
        """Takes what was said, the newest of it where it is much."""
        lines = [_short(line.rstrip()) for line in said.split("\n")]
        self.lines = [line for line in lines if line and progress_of(line) is None]
        self.progress = next(filter(None, map(progress_of, reversed(lines))), self.progress)

    def _end(self, code: int) -> None:
        """Says how it ended, by its exit code."""
        last = self.lines[-1] if self.lines else ""
        if code in (0, INCOMPLETE, CLIENT_ENDED):
            self.progress = (1.0, "")
            self.set_state(JobState.FINISHED, reason(self.lines, code) if code and last else "")
        elif self._wish is not None:
            self.set_state(JobState.STOPPED, last if code == INTERRUPTED else "")
        else:
            self.set_state(JobState.FAILED, reason(self.lines, code))


def progress_of(line: str) -> tuple[float | None, str] | None:
    """Share from 0 to 1, or None, and words of a line of progress; None: it is no such line."""
    match = _PROGRESS.match(line)
    if match is None or match["percent"] is None:
        return None if match is None else (None, match["words"])
    return min(int(match["percent"]) / 100.0, 1.0), f"{match['title']}: {match['words']}"


def reason(lines: Sequence[str], code: int) -> str:
    """Why a command failed, in one line, from its messages and its exit code."""
    errors = [line.removeprefix(_ERROR) for line in lines if line.startswith(_ERROR)]
    if errors:
        return errors[0] + (f"; and {len(errors) - 1} more" if errors[1:] else "")
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        return f"the process was ended by {name}"
    return f"exit code {code}: {lines[-1] if lines else 'it said nothing'}"


def _tail(file: int) -> str:
    """The end of a file that a process writes."""
    start = max(os.fstat(file).st_size - LARGEST_TAIL, 0)
    return os.pread(file, LARGEST_TAIL, start).decode(errors="replace")


def _short(line: str) -> str:
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 4]} ..."


class JobManager:
    """The jobs of a server, in the order in which they were submitted.

    Attributes:
        at_once: How many of them work at a time; what is paused takes no place.
        jobs: All that are remembered, the oldest first.
    """

    def __init__(self, at_once: int | None = None) -> None:
        """None: a processor is left for server and browser, where there are several."""
        self.at_once = at_once or max(1, len(os.sched_getaffinity(0)) - 1)
        self.jobs: list[Job] = []
        self._closed = False

    @property
    def is_busy(self) -> bool:
        """True if a job works."""
        return self._count() > 0

    def submit(self, job: Job) -> Job:
        """Takes a job over, and begins it when there is room.

        Raises:
            CdprError: The server is ending.
        """
        if self._closed:
            raise CdprError("the server is ending; nothing new is begun")
        over = [old for old in self.jobs if old.state.is_over]
        for old in over[: max(len(self.jobs) + 1 - MOST_JOBS, 0)]:
            self.jobs.remove(old)
        self.jobs.append(job)
        job.changed = self._begin_next
        self._begin_next()
        return job

    def free_folder(self, base: Path) -> Path:
        """The first of base, base-2, ... that is not there and that no job will write."""
        taken = {job.folder for job in self.jobs if not job.state.is_over}
        later = (base.with_name(f"{base.name}-{number}") for number in itertools.count(2))
        folders = itertools.chain([base], later)
        return next(path for path in folders if not path.exists() and path not in taken)

    async def close(self, seconds: float = LONGEST_END) -> None:
        """Stops all jobs, lets them put away what they have, and returns when they are over.

        Those that need longer are killed; what they had on disk stays there.
        """
        self._closed = True
        left = [job for job in self.jobs if not job.state.is_over]
        for wish, longest in ((signal.SIGTERM, seconds), (signal.SIGKILL, 1.0)):
            for job in left:
                job.stop(wish)
            await asyncio.gather(*(job.wait(longest) for job in left))

    def _begin_next(self) -> None:
        for job in self.jobs:
            if self._closed or self._count() >= self.at_once:
                return
            if job.state == JobState.QUEUED:
                job.begin()

    def _count(self) -> int:
        return sum(job.state in (JobState.RUNNING, JobState.STOPPING) for job in self.jobs)
