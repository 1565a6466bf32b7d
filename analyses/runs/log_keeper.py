"""Takes the log out of a running simulation, so that memory and a killed run hold little of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from pydrake.systems.framework import Context

from cdpr_drake.analyses.reporting import Log, LogOnDisk
from cdpr_drake.arrays import Array
from cdpr_drake.systems.monitoring import RunLog

MOST_ROWS = 2000
"""Rows that are in memory at most, but for those of one report period."""

LONGEST_WAIT = 2.0
"""Time after which rows go to disk however few they are [s]."""


class LogKeeper:
    """Moves rows of a run's log to a folder as it goes; without a folder it leaves them alone."""

    def __init__(
        self,
        rows: Callable[[], int],
        read: Callable[[], dict[str, Array]],
        clear: Callable[[], None],
        folder: Path | None,
    ) -> None:
        """With what counts, reads and clears the rows that are held, and a folder to be made."""
        self._rows, self._read, self._clear = rows, read, clear
        self._folder, self._kept = folder, None if folder is None else time.perf_counter()
        self._on_disk: LogOnDisk | None = None

    @classmethod
    def of_sink(
        cls,
        log: RunLog,
        context: Context,
        read: Callable[[Context], dict[str, Array]],
        folder: Path | None,
    ) -> LogKeeper:
        """Of a diagram's sink and root context, with what reads its rows."""
        return cls(
            lambda: log.rows(context), lambda: read(context), lambda: log.clear(context), folder
        )

    def __call__(self) -> None:
        """Moves rows, if it is time; raises OSError where they cannot be written."""
        if self._kept is None:
            return
        waited = time.perf_counter() - self._kept
        if waited >= LONGEST_WAIT or self._rows() >= MOST_ROWS:
            self._move()

    def finish(self) -> Log:
        """The whole log, after the run; raises OSError where it cannot be written."""
        if self._folder is None:
            return self._read()
        self._move()
        assert self._on_disk is not None
        return self._on_disk

    def _move(self) -> None:
        assert self._folder is not None
        if self._rows() > 0:
            rows = self._read()
            if self._on_disk is None:
                self._on_disk = LogOnDisk.create(self._folder, rows)
            else:
                self._on_disk.append(rows)
            self._clear()
        self._kept = time.perf_counter()
