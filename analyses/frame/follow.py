"""Who follows long work: it hears how far the work is, and may stop it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cdpr_drake.errors import StoppedError


@dataclass(frozen=True)
class Progress:
    """Where long work stands.

    Attributes:
        what: What was finished last, in a few words.
        done: Work done, in what `unit` counts.
        total: All work, the same.
        found: Of the work done, what an earlier command left in the folder.
        unit: Word for what is counted, such as "runs"; "s" is simulated time.
        seconds: Time since the work began [s].
    """

    what: str
    done: float
    total: float
    found: float = 0.0
    unit: str = "runs"
    seconds: float = 0.0

    @property
    def left(self) -> float | None:
        """Time left at the speed so far [s]; None before anything is done."""
        done = self.done - self.found
        return self.seconds * (self.total - self.done) / done if done > 0 else None


@dataclass(frozen=True)
class Follow:
    """Who follows long work; no number depends on it.

    Attributes:
        progress: Called at the start and after each piece.
        stop: Asked often; True ends the work after the pieces under way, and what is done is kept.
        say: Gets a line on what happens.
        results: Folder below which results are kept that nobody gave a folder; None: none are.
        prepare: Gets a run, Drake's simulator and the diagram before the run starts.
        acts: True if what was prepared may change the run, which then cannot go on after a kill.
        connect: Brings a process outside to its place in the loop of a run.
        ended: Gets a run when it has ended, before its files are written.
    """

    progress: Callable[[Progress], None] = lambda progress: None
    stop: Callable[[], bool] = lambda: False
    say: Callable[[str], None] = lambda words: None
    results: Path | None = None
    prepare: Callable[[Any, Any, Any], None] | None = None
    acts: bool = False
    connect: Callable[[Any], None] | None = None
    ended: Callable[[Any], None] = lambda run: None

    def doing(self, words: str) -> None:
        """Tells what is done now, of work of which nobody knows how long it takes.

        Raises:
            StoppedError: It should stop.
        """
        if self.stop():
            raise StoppedError("stopped; nothing was kept")
        self.progress(Progress(words, 0.0, 1.0))


NOBODY = Follow()
"""Nobody follows."""


@dataclass
class Count:
    """Counts pieces of work, and tells who follows it."""

    follow: Follow
    total: float
    found: float = 0.0
    unit: str = "runs"
    done: float = field(init=False)
    began: float = field(default_factory=time.perf_counter, init=False)

    def __post_init__(self) -> None:
        """Tells the start, and what an earlier command has left."""
        self.done = self.found
        if self.found:
            words = f"{self.found:.0f} of {self.total:.0f} {self.unit} were there already"
            self.follow.say(words)
        self.add(0.0, "starting")

    def add(self, more: float, what: str) -> None:
        """Tells that more work is done."""
        self.done += more
        seconds = time.perf_counter() - self.began
        self.follow.progress(Progress(what, self.done, self.total, self.found, self.unit, seconds))
