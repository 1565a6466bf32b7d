"""What all jobs have: a state, progress, and listeners that may be as slow as they like."""

from __future__ import annotations

import itertools
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from cdpr_drake.errors import CdprError

LONGEST_MESSAGE = 500
"""Characters of a job's message."""

MOST_EVENTS = 256
"""Events that wait for a listener; the oldest make room for new ones."""


class JobError(CdprError):
    """A job cannot be asked for that, or not now."""


class JobState(StrEnum):
    """How a job stands."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
    FINISHED = "finished"
    FAILED = "failed"
    STOPPED = "stopped"

    @property
    def is_over(self) -> bool:
        """Whether nothing will change it any more."""
        return self in (JobState.FINISHED, JobState.FAILED, JobState.STOPPED)


@dataclass(frozen=True)
class Event:
    """Something that happened in a job.

    Attributes:
        kind: "state", "progress", "line" (of its messages); of runs also "begin", "sample",
            "image", "pace".
        data: What it says, as JSON could.
        blob: Bytes that belong to it, such as an image.
    """

    kind: str
    data: dict[str, Any] = field(default_factory=dict)
    blob: bytes = b""


class Listener:
    """Events of a job since the last look; the newest `MOST_EVENTS` of them.

    Of events that replace each other, as images and progress do, only the newest is kept.
    """

    def __init__(self, limit: int = MOST_EVENTS) -> None:
        """With room for so many events."""
        self._events: deque[Event] = deque(maxlen=limit)
        self._newest: dict[str, Event] = {}
        self._lock = threading.Lock()
        self.lost = 0

    def put(self, event: Event, *, replaces: bool) -> None:
        """Adds an event, in the place of an older one of its kind if it `replaces` them."""
        with self._lock:
            if replaces:
                self._newest[event.kind] = event
                return
            self.lost += len(self._events) == self._events.maxlen
            self._events.append(event)

    def take(self) -> list[Event]:
        """All events that are there, which are then gone; never waits."""
        with self._lock:
            found = [*self._events, *self._newest.values()]
            self._events.clear()
            self._newest.clear()
        return found


REPLACING = frozenset({"state", "progress", "image", "pace"})
"""Kinds of events of which only the newest counts."""

_numbers = itertools.count(1)


class Job(ABC):
    """One piece of work. What makes it work is up to subclasses: `begin`, `stop`, `kill`.

    Attributes:
        number: Its number among the jobs of this server, from 1.
        title: What it is, in a few words.
        made: When it was made, seconds since 1970.
    """

    def __init__(self, title: str) -> None:
        """Queued."""
        self.number = next(_numbers)
        self.title = title
        self.made = time.time()
        self._lock = threading.RLock()
        self._over = threading.Event()
        self._state, self._message = JobState.QUEUED, ""
        self._fraction: float | None = None
        self._words = ""
        self._listeners: list[Listener] = []
        self._started: float | None = None
        self._ended: float | None = None

    @property
    def state(self) -> JobState:
        """How it stands."""
        return self._state

    @property
    def message(self) -> str:
        """Why it failed, or what else is to be said about its end, in one line; else empty."""
        return self._message

    @property
    def progress(self) -> tuple[float | None, str]:
        """Share of the work that is done, from 0 to 1, or None; and words about it."""
        with self._lock:
            return self._fraction, self._words

    @property
    def elapsed(self) -> float:
        """Time that it has been running, or took [s]."""
        if self._started is None:
            return 0.0
        return (self._ended or time.monotonic()) - self._started

    def listen(self, limit: int = MOST_EVENTS) -> Listener:
        """A listener to what happens from now on; `forget` it in the end."""
        listener = Listener(limit)
        with self._lock:
            self._listeners = [*self._listeners, listener]
        return listener

    def forget(self, listener: Listener) -> None:
        """Tells a listener nothing more."""
        with self._lock:
            self._listeners = [each for each in self._listeners if each is not listener]

    def wait(self, seconds: float | None = None) -> bool:
        """Waits until it is over, at most so long; returns whether it is."""
        return self._over.wait(seconds)

    @abstractmethod
    def begin(self) -> None:
        """Starts to work, and returns at once."""

    @abstractmethod
    def stop(self) -> None:
        """Asks it to stop and to keep what it has; one that is queued never begins."""

    @abstractmethod
    def kill(self) -> None:
        """Ends it at once."""

    def emit(self, event: Event) -> None:
        """Tells all listeners."""
        for listener in self._listeners:
            listener.put(event, replaces=event.kind in REPLACING)

    def set_progress(self, fraction: float | None, words: str) -> None:
        """Says how far it is."""
        with self._lock:
            if (fraction, words) == (self._fraction, self._words):
                return
            self._fraction, self._words = fraction, words
        self.emit(Event("progress", {"fraction": fraction, "words": words}))

    def set_state(self, state: JobState, message: str = "") -> None:
        """Changes how it stands; what is over stays as it is."""
        with self._lock:
            if self._state.is_over or (state, message) == (self._state, self._message):
                return
            self._state = state
            self._message = _one_line(message)
            if state == JobState.RUNNING and self._started is None:
                self._started = time.monotonic()
            if state.is_over:
                self._ended = time.monotonic()
        self.emit(Event("state", {"state": state.value, "message": self._message}))
        if state.is_over:
            self._over.set()


def _one_line(words: str) -> str:
    line = " ".join(words.split())
    if len(line) > LONGEST_MESSAGE:
        line = line[: LONGEST_MESSAGE - 4] + " ..."
    return line
