"""Work in processes of their own: a `cdpr` command each, a few at a time.

Drake and numba hold Python's lock, and what kills a run must not kill the server. A job belongs to
the server, not to a page: whoever reloads a page, or opens another, finds it as it is. Jobs and
their manager belong to the server's event loop; no other thread calls them.
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
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import IO, Any, TypeVar

import cdpr_drake
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

COMMAND = (sys.executable, "-P", "-m", "cdpr_drake")
"""The command line; Python does not look for modules in the working folder: what lies there is
data."""

PROGRESS_PERIOD, PROGRESS = "CDPR_PROGRESS_PERIOD", "progress: "
"""Environment variable of the time between lines of progress [s], and how such a line begins, see
`cli.terminal`."""

LIFELINE = "CDPR_LIFELINE"
"""Environment variable of the file descriptor at which a command sees the end of who started it,
see `cli.process`."""

LOOK_PERIOD = 0.1
"""Time between looks at what a process says [s]."""

MOST_LINES, LONGEST_LINE, LONGEST_MESSAGE = 200, 2000, 500
"""Lines of messages that are kept, and characters of a line and of a job's message."""

LARGEST_OUTPUT = 64 * 2**20
"""Bytes of results in JSON that are read."""

INTERRUPTED, INCOMPLETE, CLIENT_ENDED = 130, 3, 4
"""Exit codes of `cdpr` for work that was stopped and kept, and for complete data with a remark."""

MOST_JOBS = 200
"""Jobs that are remembered; the oldest that are over are forgotten."""

LONGEST_END = 20.0
"""Time that jobs have to put away what they have when the server ends [s]."""

_SHARE = re.compile(r"^(?P<what>.*?): +(?P<percent>\d{1,3}) %, (?P<words>.*)$")
_ERROR = "cdpr: "
_numbers = itertools.count(1)


class JobError(CdprError):
    """A job cannot be asked for that, or not now."""


class JobState(StrEnum):
    """How a job stands."""

    QUEUED, RUNNING, PAUSED, STOPPING = "queued", "running", "paused", "stopping"
    FINISHED, FAILED, STOPPED = "finished", "failed", "stopped"

    @property
    def is_over(self) -> bool:
        """Whether nothing will change it any more."""
        return self in (JobState.FINISHED, JobState.FAILED, JobState.STOPPED)


class Job:
    """Runs `cdpr SUBCOMMAND ...`, with what it prints as JSON as the result.

    What it says and prints goes to files, so that it never waits for who reads. Of a server that
    was killed it hears by the end of a pipe that only the server has, and stops by itself.

    Attributes:
        program: What is run with the arguments.
        number: Its number among the jobs of this server, from 1.
        title: What it is, in a few words.
        arguments: Of the command, from the name of the subcommand on.
        working: Folder that it is run in.
        folder: Where its results will be; None: nowhere.
        state: How it stands.
        message: Why it failed, or what else is to be said about its end, in one line; else empty.
        progress: Share of the work that is done, from 0 to 1, or None; and words about it.
        changed: Called when `state` has changed.
    """

    program: Sequence[str] = COMMAND

    def __init__(
        self,
        title: str,
        arguments: Sequence[str],
        working: Path,
        folder: Path | None = None,
        *,
        done_with: Path | None = None,
    ) -> None:
        """Queued; arguments as the attributes, an option --json is up to the caller.

        `done_with` is a file that is removed when the work is done, or left no folder.
        """
        self.number = next(_numbers)
        self.title, self.arguments, self.working = title, tuple(arguments), working
        self.folder, self._done_with = folder, done_with
        self.state, self.message = JobState.QUEUED, ""
        self.progress: tuple[float | None, str] = (None, "")
        self.changed: Callable[[], None] = lambda: None
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        self._says_progress = True
        self._read, self._rest, self._output = 0, b"", b""
        self._process: asyncio.subprocess.Process | None = None
        self._lifeline = -1
        self._wish: signal.Signals | None = None
        self._over = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._started = self._ended = 0.0

    @property
    def process_id(self) -> int | None:
        """Of the process; None where there is none yet."""
        return None if self._process is None else self._process.pid

    @property
    def lines(self) -> list[str]:
        """What it said besides its progress, the newest `MOST_LINES` lines."""
        return list(self._lines)

    @property
    def elapsed(self) -> float:
        """Time that it has been running, or took [s]."""
        return (self._ended or time.monotonic()) - self._started if self._started else 0.0

    def result(self) -> Any:
        """What it printed as JSON; None where that was none."""
        try:
            return load_json(self._output)
        except ValueError:
            return None

    async def wait(self, seconds: float | None = None) -> bool:
        """Waits until it is over, at most so long; returns whether it is."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._over.wait(), seconds)
        return self.state.is_over

    def begin(self) -> None:
        """Starts to work; a failure of that is one of the job."""
        if self.state == JobState.QUEUED:
            self._started = time.monotonic()
            self._task = asyncio.create_task(self._work(), name=f"job {self.number}")
            self.set_state(JobState.RUNNING)

    def stop(self) -> None:
        """Asks it to stop and to keep what it has; one that is queued never begins."""
        self._end_by(signal.SIGTERM)

    def kill(self) -> None:
        """Ends it at once, with all that it started."""
        self._end_by(signal.SIGKILL)

    def set_state(self, state: JobState, message: str = "") -> None:
        """Changes how it stands; what is over stays as it is."""
        if self.state.is_over:
            return
        line = " ".join(message.split())
        longest = LONGEST_MESSAGE - 4
        self.message = line if len(line) <= LONGEST_MESSAGE else f"{line[:longest]} ..."
        self.state = state
        if state.is_over:
            self._ended = time.monotonic()
            self._over.set()
        self.changed()

    def _end_by(self, wish: signal.Signals) -> None:
        if self.state.is_over or self._wish in (wish, signal.SIGKILL):
            return
        self._wish = wish
        if self.state == JobState.QUEUED:
            self.set_state(JobState.STOPPED)
            return
        self.set_state(JobState.STOPPING)
        self._signal(wish)

    def _signal(self, number: signal.Signals) -> None:
        """Commands take SIGTERM as a wish; SIGKILL goes to the whole group."""
        process = self._process
        if process is not None and process.returncode is None:
            with suppress(ProcessLookupError, PermissionError):
                (os.killpg if number == signal.SIGKILL else os.kill)(process.pid, number)

    async def _work(self) -> None:
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            try:
                code = await self._run(out, err)
            except (OSError, ValueError) as problem:
                self.set_state(JobState.FAILED, f"cannot be started: {problem}")
                return
            if os.fstat(out.fileno()).st_size <= LARGEST_OUTPUT:
                self._output = os.pread(out.fileno(), LARGEST_OUTPUT, 0)
        self._end(code)

    async def _run(self, out: IO[bytes], err: IO[bytes]) -> int:
        """Runs the process to its end, and returns its exit code, negative for a signal."""
        theirs, self._lifeline = os.pipe()  # which no other child inherits
        try:
            try:
                self._process = process = await self._start(out, err, (theirs,))
            finally:
                os.close(theirs)
            if self._wish is not None:
                self._signal(self._wish)
            ending = asyncio.create_task(process.wait())
            while not ending.done():
                await asyncio.wait([ending], timeout=LOOK_PERIOD)
                self._hear(err)
            self._hear(err, ended=True)
            return ending.result()
        finally:
            os.close(self._lifeline)
            if self._process is not None and self._process.returncode is None:
                self._signal(signal.SIGKILL)  # the event loop is ending
                await self._process.wait()

    async def _start(
        self, out: IO[bytes], err: IO[bytes], kept: Sequence[int], more: Sequence[str] = ()
    ) -> asyncio.subprocess.Process:
        """Starts the process, which gets some file descriptors, the first its lifeline."""
        home = str(Path(cdpr_drake.__file__).resolve().parent.parent)
        before = os.environ.get("PYTHONPATH", "")
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(part for part in (home, before) if part),
            PROGRESS_PERIOD: "1", LIFELINE: str(kept[0]),
        }  # fmt: skip
        return await asyncio.create_subprocess_exec(
            *self.program, *self.arguments, *more, cwd=self.working, env=environment,
            stdin=asyncio.subprocess.DEVNULL, stdout=out, stderr=err, pass_fds=kept,
            start_new_session=True,
        )  # fmt: skip

    def _hear(self, err: IO[bytes], *, ended: bool = False) -> None:
        """Takes the lines that are new; an unfinished one when it is whole, or at the end."""
        piece = os.pread(err.fileno(), os.fstat(err.fileno()).st_size - self._read, self._read)
        self._read += len(piece)
        *whole, self._rest = (self._rest + piece + b"\n" * ended).split(b"\n")
        for words in whole:
            line = words.decode(errors="replace")[:LONGEST_LINE].rstrip()
            progress = progress_of(line)
            if progress is None and line:
                self._lines.append(line)
            elif progress is not None and self._says_progress:
                self.progress = progress

    def _end(self, code: int) -> None:
        """Says how it ended, by its exit code."""
        done, lines = code in (0, INCOMPLETE, CLIENT_ENDED), self.lines
        if self._done_with is not None and (done or not (self.folder and self.folder.is_dir())):
            with suppress(OSError):
                self._done_with.unlink(missing_ok=True)
        if done:
            self.progress = (1.0, "")
            self.set_state(JobState.FINISHED, reason(lines, code) if code and lines else "")
        elif self._wish is not None:
            self.set_state(JobState.STOPPED, lines[-1] if code == INTERRUPTED and lines else "")
        else:
            self.set_state(JobState.FAILED, reason(lines, code))


def progress_of(line: str) -> tuple[float | None, str] | None:
    """Share from 0 to 1, None where it says none, and words of a line of progress; None: no such
    line."""
    if not line.startswith(PROGRESS):
        return None
    words = line.removeprefix(PROGRESS)
    found = _SHARE.match(words)
    if found is None:
        return None, words
    return min(int(found["percent"]) / 100.0, 1.0), f"{found['what']}: {found['words']}"


def reason(lines: Sequence[str], code: int) -> str:
    """Why a command failed, in one line, from its messages and its exit code."""
    said = [line.removeprefix(_ERROR) for line in lines if line.startswith(_ERROR)]
    if said:
        more = len(said) - 1
        return said[0] + (f"; and {more} more" if more else "")
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        return f"the process was ended by {name}"
    return f"exit code {code}: {lines[-1] if lines else 'it said nothing'}"


J = TypeVar("J", bound=Job)


class JobManager:
    """The jobs of a server, in the order in which they were asked for.

    Attributes:
        at_once: How many of them work at a time; what is paused takes no place.
        jobs: All that are remembered, the oldest first.
    """

    def __init__(self, at_once: int | None = None) -> None:
        """None: a processor is left for server and browser, where there are several."""
        self.at_once = at_once or max(1, len(os.sched_getaffinity(0)) - 1)
        self.jobs: list[Job] = []
        self._closed = False

    def job(self, number: int) -> Job | None:
        """The job of a number; None: there is none any more."""
        return next((job for job in self.jobs if job.number == number), None)

    @property
    def is_busy(self) -> bool:
        """Whether a job works."""
        return self._count() > 0

    def submit(self, job: J) -> J:
        """Takes a job over, and begins it when there is room.

        Raises:
            JobError: The server is ending.
        """
        if self._closed:
            raise JobError("the server is ending; nothing new is begun")
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
        names = (base.with_name(f"{base.name}-{number}") for number in itertools.count(2))
        return next(
            folder for folder in itertools.chain([base], names)
            if not folder.exists() and folder not in taken
        )  # fmt: skip

    async def close(self, seconds: float = LONGEST_END) -> None:
        """Stops all jobs, lets them put away what they have, and returns when they are over.

        Those that need longer are killed; what they had on disk stays there.
        """
        self._closed = True
        left = [job for job in self.jobs if not job.state.is_over]
        for job in left:
            job.stop()
        await asyncio.gather(*(job.wait(seconds) for job in left))
        for job in left:
            job.kill()
        await asyncio.gather(*(job.wait(1.0) for job in left))

    def _begin_next(self) -> None:
        for job in self.jobs:
            if self._closed or self._count() >= self.at_once:
                return
            if job.state == JobState.QUEUED:
                job.begin()

    def _count(self) -> int:
        return sum(job.state in (JobState.RUNNING, JobState.STOPPING) for job in self.jobs)
