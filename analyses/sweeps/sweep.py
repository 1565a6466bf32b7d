"""Sweeps: many items computed in chunks, which are kept, so that a sweep can continue later."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.worker_pool import PersistentPool
from cdpr_drake.analyses.sweeps.workers import SweepChunk, SweepTask, computed

STARTING = "starting"
"""What there is to say until the first chunk is finished; whether it compiles, commands see."""


@dataclass(frozen=True, eq=False)
class SweepResult:
    """What a sweep computed.

    Attributes:
        finished: Arrays, over all of its items, of each task that was finished.
        progress: Where the sweep stood at the end.
    """

    finished: dict[str, dict[str, np.ndarray]]
    progress: WorkProgress

    @property
    def arrays(self) -> dict[str, dict[str, np.ndarray]] | None:
        """Arrays of all tasks; None if the sweep was stopped before the end."""
        return self.finished if self.progress.done == self.progress.total else None


def run_sweep(
    tasks: Mapping[str, tuple[SweepTask, int]],
    chunk_size: int,
    folder: SweepFolder | None = None,
    *,
    items: str = "items",
    workers: int | None = 1,
    scheduler: str | None = None,
    on_progress: Callable[[WorkProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    standing: PersistentPool | None = None,
) -> SweepResult:
    """Computes all items of some tasks, `chunk_size` at a time.

    A task's numbers may depend on the item only, not on how the items are cut into chunks; then
    they do not depend on the workers, their number or their fate either.

    Args:
        tasks: Per name (good as a file name) the task and its number of items.
        chunk_size: Items per chunk.
        folder: Where finished chunks are kept and found; None: nowhere.
        items: Words for the items, such as "poses".
        workers: Number of local processes, with one this process does it; None: one for each
            processor.
        scheduler: Address of a Dask scheduler, whose workers compute instead.
        on_progress: Called at the start and after every chunk.
        should_stop: Asked often; True ends the sweep once the chunks under way are finished.
        standing: Local processes that are there already and stay, in the place of `workers`.

    Raises:
        SweepError: The scheduler does not answer or got lost, or a local process died.
    """
    began = time.perf_counter()
    parts: dict[str, dict[int, dict[str, np.ndarray]]] = {name: {} for name in tasks}
    missing: list[tuple[str, SweepChunk]] = []
    for name, (task, count) in tasks.items():
        for start in range(0, count, chunk_size):
            chunk = SweepChunk(task, start, min(start + chunk_size, count))
            kept = None if folder is None else folder.load(name, chunk.start, chunk.stop)
            if kept is None:
                missing.append((name, chunk))
            else:
                parts[name][start] = kept
    total = sum(count for _, count in tasks.values())
    found = total - sum(chunk.stop - chunk.start for _, chunk in missing)
    done, last = found, STARTING

    def progress() -> WorkProgress:
        passed = time.perf_counter() - began
        return WorkProgress(last, done, total, passed, rate=f"{items}/s", found=found, items=items)

    if on_progress is not None:
        on_progress(progress())
    never: Callable[[], bool] = lambda: False  # noqa: E731
    stop = should_stop or never
    chunks = [chunk for _, chunk in missing]
    for number, arrays in computed(chunks, workers, scheduler, stop, standing):
        last, chunk = missing[number]
        if folder is not None:
            folder.store(last, chunk.start, chunk.stop, arrays)
        parts[last][chunk.start] = arrays
        done += chunk.stop - chunk.start
        if on_progress is not None:
            on_progress(progress())
    finished = {
        name: _joined([parts[name][start] for start in sorted(parts[name])])
        for name, (_, count) in tasks.items()
        if len(parts[name]) == -(-count // chunk_size)
    }
    return SweepResult(finished, progress())


def _joined(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
