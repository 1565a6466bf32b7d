"""A job that runs a scenario, can be looked at and steered."""

from __future__ import annotations

import asyncio
import math
import socket
import struct
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from cdpr_drake.analyses.runs.steering import (
    BREAK,
    FASTEST_SPEED,
    LARGEST_MESSAGE,
    PUSH,
    SLOWEST_SPEED,
    Message,
    head_of,
    pieces,
)
from cdpr_drake.studio.jobs import Job, JobError, JobState

MOST_SAMPLES = 3000
"""Samples that are kept; beyond, every second one is left out, and so on."""

MOST_EVENTS = 256
"""Messages that wait for a listener; the oldest make room for new ones."""

LAST_WORDS = 1.0
"""Time in which what a run has shown at its end is taken [s]."""

_SIZE = struct.Struct("!i")
"""What `multiprocessing.connection` sends before bytes."""


class Samples:
    """Samples in the order of time, evenly thinned where there are many.

    Attributes:
        last: The newest one.
    """

    def __init__(self, limit: int = MOST_SAMPLES) -> None:
        """With room for so many."""
        self._limit, self._stride, self._count = limit, 1, 0
        self._kept: list[dict[str, Any]] = []
        self.last: dict[str, Any] | None = None

    def add(self, sample: dict[str, Any]) -> None:
        """Adds the newest one."""
        if self._count % self._stride == 0:
            self._kept.append(sample)
            if len(self._kept) > self._limit:
                self._kept = self._kept[::2]
                self._stride *= 2
        self._count += 1
        self.last = sample

    def all(self) -> list[dict[str, Any]]:
        """Those that are kept, the newest in any case the last."""
        if self.last is None or self._kept[-1] is self.last:
            return list(self._kept)
        return [*self._kept, self.last]


class Listener:
    """What a run has shown since the last look: the newest `MOST_EVENTS` messages, and one image.

    Attributes:
        lost: Messages that had to make room.
    """

    def __init__(self) -> None:
        """Without any."""
        self._events: deque[Message] = deque(maxlen=MOST_EVENTS)
        self._image: list[Message] = []
        self.lost = 0

    def put(self, message: Message) -> None:
        """Adds a message."""
        if message.kind == "image":
            self._image = [message]
            return
        self.lost += len(self._events) == MOST_EVENTS
        self._events.append(message)

    def take(self) -> list[Message]:
        """All messages that are there, which are then gone."""
        found = [*self._events, *self._image]
        self._events.clear()
        self._image = []
        return found


class RunJob(Job):
    """`cdpr simulate` of one scenario, with the same results as that command alone would write.

    Attributes:
        scenario: Its name or the path of its file.
        settings: Items key=value that replace what the file says.
        samples: What it has shown so far.
        header: What it said at its beginning, see `analyses.runs.steering`; empty before.
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
        """Not begun; at a speed in simulated seconds per second, None: as fast as possible.

        `paused`: it stands at the start until it is told to go.

        Raises:
            JobError: The speed is not accepted.
        """
        options = [f"--set={item}" for item in settings]
        title = Path(scenario).stem if scenario.endswith((".yaml", ".yml")) else scenario
        super().__init__(
            title, ["simulate", *options, f"--out={folder}", "--json"], working, folder
        )
        self.scenario, self.settings = scenario, tuple(settings)
        self.samples = Samples()
        self.header: dict[str, Any] = {}
        self.image = b""
        self.events: list[dict[str, Any]] = []
        self.pace: dict[str, Any] = {"paused": paused, "speed": _checked_speed(speed)}
        self._listeners: list[Listener] = []
        self._writer: asyncio.StreamWriter | None = None
        self._listening: asyncio.Task[None]

    def listen(self) -> Listener:
        """A listener to what is shown from now on; `forget` it in the end."""
        self._listeners.append(Listener())
        return self._listeners[-1]

    def forget(self, listener: Listener) -> None:
        """Tells a listener nothing more."""
        self._listeners.remove(listener)

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

    def take(self, message: Message) -> None:
        """Keeps what a run shows, and passes it on."""
        data = message.data
        if message.kind == "begin":
            self.header = data
        elif message.kind == "sample":
            self.samples.add(data)
            duration = float(self.header.get("duration") or 0.0)
            if duration > 0.0:
                self._says_progress = False  # samples say more
                self.progress = min(data["t"] / duration, 1.0), _words(data)
        elif message.kind == "image":
            self.image = message.blob
        elif message.kind == "event":
            self.events.append(data)
        elif message.kind == "pace":
            self.pace = data
            if self.state in (JobState.RUNNING, JobState.PAUSED):
                self.set_state(JobState.PAUSED if data["paused"] else JobState.RUNNING)
        for listener in self._listeners:
            listener.put(message)

    def _tell(self, **words: Any) -> None:
        """Tells the run something, or remembers how it is to start."""
        if self._writer is None:
            if words["what"] in ("pause", "go"):
                self.pace["paused"] = words["what"] == "pause"
            elif words["what"] == "speed":
                self.pace["speed"] = words["factor"]
        elif not self._writer.is_closing():
            for piece in pieces(Message("do", words)):
                self._writer.write(_SIZE.pack(len(piece)) + piece)

    async def _start(
        self, out: IO[bytes], err: IO[bytes], kept: Sequence[int], more: Sequence[str] = ()
    ) -> asyncio.subprocess.Process:
        ours, theirs = socket.socketpair()
        with theirs:
            try:
                end = theirs.fileno()
                steered = (f"--steered-by={end}", "--", self.scenario)
                process = await super()._start(out, err, (*kept, end), steered)
            except BaseException:
                ours.close()
                raise
        reader, self._writer = await asyncio.open_unix_connection(sock=ours)
        self._listening = asyncio.create_task(self._listen(reader))
        self.set_speed(self.pace["speed"])
        if self.pace["paused"]:
            self.pause()
        return process

    async def _run(self, out: IO[bytes], err: IO[bytes]) -> int:
        try:
            code = await super()._run(out, err)
            await asyncio.wait([self._listening], timeout=LAST_WORDS)
            return code
        finally:
            if self._writer is not None:
                self._listening.cancel()
                self._writer.close()

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        """Takes what the run shows, until it closes its end or sends no message."""

        async def piece() -> bytes:
            (size,) = _SIZE.unpack(await reader.readexactly(_SIZE.size))
            if not 0 <= size <= LARGEST_MESSAGE:
                raise ValueError(f"found {size} bytes of a message")
            return await reader.readexactly(size)

        with suppress(asyncio.IncompleteReadError, OSError, ValueError):
            while True:
                message, has_blob = head_of(await piece())
                self.take(replace(message, blob=await piece()) if has_blob else message)


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
