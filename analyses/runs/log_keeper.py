"""Takes the log out of a running simulation, so that memory and a killed run hold little of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting import Log, LogOnDisk
from cdpr_drake.arrays import Array
from cdpr_drake.systems.loops import LoopLog
from cdpr_drake.systems.monitoring import RunLog

MOST_ROWS = 2000
"""Rows that are in memory at most, but for those of one report period."""

LONGEST_WAIT = 2.0
"""Time after which rows go to disk however few they are [s]."""


class LogKeeper:
    """Moves rows of a run's log to a folder as it goes; without a folder it leaves them alone."""

    def __init__(
        self,
        log: RunLog | LoopLog,
        context: Any,
        read: Callable[[Any], dict[str, Array]],
        folder: Path | None,
    ) -> None:
        """With the sink, the run's root context, None for a loop's log, what reads its rows, and a
        folder to be made."""
        self._log, self._context, self._read = log, context, read
        self._folder, self._kept = folder, None if folder is None else time.perf_counter()
        self._on_disk: LogOnDisk | None = None

    def __call__(self) -> None:
        """Moves rows, if it is time; raises OSError where they cannot be written."""
        if self._kept is None:
            return
        waited = time.perf_counter() - self._kept
        if waited >= LONGEST_WAIT or self._log.rows(self._context) >= MOST_ROWS:
            self._move()

    def finish(self) -> Log:
        """The whole log, after the run; raises OSError where it cannot be written."""
        if self._folder is None:
            return self._read(self._context)
        self._move()
        assert self._on_disk is not None
        return self._on_disk

    def _move(self) -> None:
        assert self._folder is not None
        if self._log.rows(self._context) > 0:
            rows = self._read(self._context)
            if self._on_disk is None:
                self._on_disk = LogOnDisk.create(self._folder, rows)
            else:
                self._on_disk.append(rows)
            self._log.clear(self._context)
        self._kept = time.perf_counter()
