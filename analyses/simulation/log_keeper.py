"""Takes log and state out of a running simulation, so that whatever ends the program loses little,
and memory stays small."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from cdpr_drake.analyses.reporting.log_on_disk import Log, LogOnDisk
from cdpr_drake.analyses.simulation.checkpoints import Checkpoint, read_checkpoint, write_checkpoint
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CheckpointError
from cdpr_drake.systems.monitoring.context_state import has_arrays_only, restore_state, state_arrays

MOST_ROWS = 2000
"""Rows that are in memory at most, but for those of one report period."""

LONGEST_WAIT = 2.0
"""Time after which rows go to disk however few they are [s]."""

CHECKPOINT_WAIT = 10.0
"""Time between two checkpoints [s]."""


class Rows(Protocol):
    """Rows of a log that are held: a diagram's `RunLog`, or those of a loop without one."""

    def rows(self, context: Any) -> int:
        """Number of rows that are there."""

    def clear(self, context: Any) -> None:
        """Forgets them."""


class Restorable(Protocol):
    """What runs, if its whole state is arrays."""

    def state_arrays(self) -> dict[str, Array]:
        """Its state, by names."""

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        """Puts a state in the place of its own; raises ValueError where it is another's."""


@dataclass(frozen=True)
class _InContext:
    """A diagram's state in its root context."""

    context: Any

    def state_arrays(self) -> dict[str, Array]:
        return state_arrays(self.context)

    def restore_state(self, arrays: Mapping[str, Array]) -> None:
        restore_state(self.context, arrays)


class LogKeeper:
    """Moves rows of a run's log to a folder as it goes; without a folder it leaves them alone.

    Where it knows what the run depends on, it also keeps checkpoints there.

    Attributes:
        earlier: Time that an earlier program took for what is behind [s]; None: there is none.
    """

    earlier: float | None = None

    def __init__(
        self,
        log: Rows,
        context: Any,
        read: Callable[[Any], dict[str, Array]],
        folder: Path | None,
        asked: dict[str, Any] | None = None,
        state: Restorable | None = None,
    ) -> None:
        """For a run that has not begun.

        Args:
            log: The sink.
            context: The run's root context; None for a loop without one.
            read: Reads the rows.
            folder: To be made, or where an earlier program left off, see `restore`.
            asked: All that the run depends on, for JSON; None: no checkpoints.
            state: What checkpoints are of; None: the context, or no checkpoints without one.
        """
        if state is None and context is not None and has_arrays_only(context):
            state = _InContext(context)
        self._log, self._context, self._read = log, context, read
        self._folder, self._kept = folder, None if folder is None else time.perf_counter()
        self._on_disk: LogOnDisk | None = None
        self._state, self._asked = state, None if state is None else asked
        self._saved = self._began = time.perf_counter()
        self._logged = -np.inf

    def restore(self) -> None:
        """Puts the run where the checkpoint in the folder is.

        Rows of the log that came after the checkpoint are taken away; they will come again.

        Raises:
            CheckpointError: There is no checkpoint of this run, or its log is not whole.
        """
        assert self._folder is not None
        assert self._asked is not None
        assert self._state is not None
        found = read_checkpoint(self._folder, self._asked)
        try:
            self._state.restore_state(found.state)
        except ValueError as problem:
            raise CheckpointError(f"{self._folder}: {problem}") from problem
        self._on_disk = LogOnDisk.reopen(self._folder, found.rows)
        self._logged = float(self._on_disk.block("time", found.rows - 1, found.rows)[0])
        self._began -= found.wall_time
        self.earlier = found.wall_time

    def __call__(self) -> None:
        """Moves rows and keeps a checkpoint, if it is time; raises OSError where it cannot."""
        if self._kept is None:
            return
        now = time.perf_counter()
        due = self._asked is not None and now - self._saved >= CHECKPOINT_WAIT
        if due or now - self._kept >= LONGEST_WAIT or self._log.rows(self._context) >= MOST_ROWS:
            self._move()
        if due and self._on_disk is not None:
            self._save(now)

    def finish(self) -> Log:
        """The whole log, after the run; raises OSError where it cannot be written."""
        if self._folder is None:
            return self._read(self._context)
        self._move()
        assert self._on_disk is not None
        return self._on_disk

    def _save(self, now: float) -> None:
        assert self._folder is not None
        assert self._asked is not None
        assert self._on_disk is not None
        assert self._state is not None
        checkpoint = Checkpoint(
            asked=self._asked, state=self._state.state_arrays(), rows=self._on_disk.rows,
            wall_time=now - self._began,
        )  # fmt: skip
        write_checkpoint(self._folder, checkpoint)
        self._saved = now

    def _move(self) -> None:
        assert self._folder is not None
        if self._log.rows(self._context) > 0:
            rows = self._read(self._context)
            if rows["time"][0] <= self._logged:  # a simulator that goes on logs where it stands
                rows = {name: values[1:] for name, values in rows.items()}
            if self._on_disk is None:
                self._on_disk = LogOnDisk.create(self._folder, rows)
            elif len(rows["time"]) > 0:
                self._on_disk.append(rows)
            self._log.clear(self._context)
        self._kept = time.perf_counter()
