"""A job that runs a scenario, can be looked at and steered.

`Samples` are those of its run that are kept, thinned, so that a page that is opened late has all of
the run.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.runs.steering import (
    BREAK,
    FASTEST_SPEED,
    PUSH,
    SLOWEST_SPEED,
    Message,
    receive,
    send,
)
from cdpr_drake.studio.workbench.command_job import CommandJob
from cdpr_drake.studio.workbench.job import Event, JobError, JobState
from cdpr_drake.studio.workbench.job_process import Child, progress_of

MOST_SAMPLES = 3000
"""Samples that are kept; beyond, every second one is left out, and so on."""


class Samples:
    """Samples in the order of time, evenly thinned where there are many."""

    def __init__(self, limit: int = MOST_SAMPLES) -> None:
        """With room for so many."""
        self._limit, self._stride, self._count = limit, 1, 0
        self._kept: list[dict[str, Any]] = []
        self._last: dict[str, Any] | None = None
        self._lock = threading.Lock()

    def add(self, sample: dict[str, Any]) -> None:
        """Adds the newest one."""
        with self._lock:
            if self._count % self._stride == 0:
                self._kept.append(sample)
                if len(self._kept) > self._limit:
                    self._kept = self._kept[::2]
                    self._stride *= 2
            self._count += 1
            self._last = sample

    def all(self) -> list[dict[str, Any]]:
        """Those that are kept, the newest in any case the last."""
        with self._lock:
            found = list(self._kept)
            if self._last is not None and (not found or found[-1] is not self._last):
                found.append(self._last)
        return found

    @property
    def last(self) -> dict[str, Any] | None:
        """The newest one."""
        return self._last


class RunJob(CommandJob):
    """`cdpr simulate` of one scenario, with the same results as that command alone would write.

    Attributes:
        scenario: Its name or the path of its file.
        settings: Items key=value that replace what the file says.
        samples: What it has shown so far.
        header: What it said at its beginning, see `analyses.runs.steering`; empty
            before.
        image: The newest image as JPEG; empty where there is none.
        events: What was done to it by hand, or refused, see `analyses.runs.steering`.
        pace: Whether it stands, and its speed, as it said last.
    """

    def __init__(
        self,
        scenario: str,
        working: Path,
        folder: Path,
        *,
        settings: Sequence[str] = (),
        speed: float | None = None,
        paused: bool = False,
    ) -> None:
        """Not begun.

        Args:
            scenario: As the attribute.
            working: Folder that it is run in, from which paths count.
            folder: Where its results will be.
            settings: As the attribute.
            speed: Simulated seconds per second; None: as fast as possible.
            paused: Whether it stands at the start until it is told to go.

        Raises:
            JobError: The speed is not accepted.
        """
        options = [f"--set={item}" for item in settings]
        arguments = ["simulate", *options, f"--out={folder}", "--json"]
        title = Path(scenario).stem if scenario.endswith((".yaml", ".yml")) else scenario
        super().__init__(title, arguments, working, folder)
        self.scenario, self.settings = scenario, tuple(settings)
        self.samples = Samples()
        self.header: dict[str, Any] = {}
        self.image = b""
        self.events: list[dict[str, Any]] = []
        self.pace: dict[str, Any] = {"paused": paused, "speed": _checked_speed(speed)}
        self._connection: Connection | None = None

    def pause(self) -> None:
        """Lets it stand between two steps."""
        self._tell(what="pause")

    def go(self) -> None:
        """Lets it go on."""
        self._tell(what="go")

    def step(self, seconds: float | None = None) -> None:
        """Lets it go on for so many simulated seconds, and stand then; None: a row of its log."""
        self._tell(what="step", seconds=seconds)

    def set_speed(self, factor: float | None) -> None:
        """Simulated seconds per second; None: as fast as possible.

        Raises:
            JobError: It is not accepted.
        """
        self._tell(what="speed", factor=_checked_speed(factor))

    def break_cable(self, number: int) -> None:
        """Lets a cable break, by its number from 0."""
        self._tell(what=BREAK, cable=number)

    def push(self, force: Sequence[float], seconds: float) -> None:
        """Pushes the platform by a half sine with this peak in W [N], so long [s]."""
        self._tell(what=PUSH, force=list(force), seconds=seconds)

    def _tell(self, **words: Any) -> None:
        """Tells the run something, or keeps in mind how it is to start."""
        with self._lock:
            if self.state.is_over:
                return
            if self._connection is None:
                if words["what"] in ("pause", "go"):
                    self.pace["paused"] = words["what"] == "pause"
                elif words["what"] == "speed":
                    self.pace["speed"] = words["factor"]
                return
            with suppress(OSError):  # it has just ended
                send(self._connection, Message("do", words))

    def _start(self) -> Child:
        ours, theirs = Pipe()
        try:
            end = theirs.fileno()
            steered = [*self.arguments, f"--steered-by={end}", "--", self.scenario]
            child = Child([*self.program, *steered], self.working, keeps_open=(end,))
        except OSError:
            ours.close()
            raise
        finally:
            theirs.close()
        self._connection = ours
        self._tell(what="speed", factor=self.pace["speed"])
        if self.pace["paused"]:
            self._tell(what="pause")
        return child

    def _attend(self, seconds: float) -> None:
        connection = self._connection
        if connection is None or connection.closed:
            super()._attend(seconds)
            return
        try:
            while connection.poll(seconds):
                self._take(receive(connection))
                seconds = 0.0
        except (EOFError, OSError, ValueError):
            with self._lock:
                connection.close()

    def _take(self, message: Message) -> None:
        """Keeps what a run shows, and passes it on."""
        data = message.data
        if message.kind == "begin":
            self.header = data
        elif message.kind == "sample":
            self.samples.add(data)
            duration = float(self.header.get("duration") or 0.0)
            if duration > 0.0:
                self.set_progress(min(data["t"] / duration, 1.0), _words(data))
        elif message.kind == "image":
            self.image = message.blob
        elif message.kind == "event":
            self.events.append(data)
        elif message.kind == "pace":
            self.pace = data
            if self.state in (JobState.RUNNING, JobState.PAUSED):
                self.set_state(JobState.PAUSED if data["paused"] else JobState.RUNNING)
        self.emit(Event(message.kind, data, message.blob))

    def _hear(self, lines: Sequence[str]) -> None:
        # Samples say more about progress, once there are any.
        shown = self.samples.last is not None
        super()._hear([line for line in lines if not (shown and progress_of(line))])

    def _end(self, code: int) -> None:
        if self._connection is not None:
            with self._lock:
                self._connection.close()
        super()._end(code)


def _words(sample: dict[str, Any]) -> str:
    distance, angle = sample["position_error"], sample["rotation_error"]
    if distance is None or angle is None:
        return f"{sample['t']:.2f} s"
    where = f"error {1e3 * distance:.2f} mm, {math.degrees(angle):.2f} deg"
    return f"{sample['t']:.2f} s, {where}"


def _checked_speed(factor: float | None) -> float | None:
    if factor is None or SLOWEST_SPEED <= factor <= FASTEST_SPEED:
        return factor
    raise JobError(
        f"speed: found {factor:g}; accepted: {SLOWEST_SPEED:g} to {FASTEST_SPEED:g} times real "
        "time, or as fast as possible"
    )
