"""Sweeps: many items computed in chunks, which are kept, so that a sweep can continue later."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.sweep_folder import SweepFolder
from cdpr_drake.analyses.sweep_workers import SweepChunk, SweepTask, computed


@dataclass(frozen=True)
class SweepProgress:
    """Where a sweep stands.

    Attributes:
        done: Items that are finished, those of earlier sessions included.
        total: All items.
        found: Of the finished ones, those that earlier sessions left in the folder.
        wall_time: Time since this session began [s].
    """

    done: int
    total: int
    found: int
    wall_time: float

    @property
    def rate(self) -> float:
        """Items computed per second in this session [1/s]."""
        return (self.done - self.found) / max(self.wall_time, 1e-9)


@dataclass(frozen=True, eq=False)
class SweepResult:
    """What a sweep computed.

    Attributes:
        arrays: Arrays of each task over all of its items; None if the sweep was stopped.
        progress: Where it stood at the end.
    """

    arrays: dict[str, dict[str, np.ndarray]] | None
    progress: SweepProgress


def run_sweep(
    tasks: Mapping[str, tuple[SweepTask, int]],
    chunk_size: int,
    folder: SweepFolder | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    on_progress: Callable[[SweepProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SweepResult:
    """Computes all items of some tasks, `chunk_size` at a time.

    A task's numbers may depend on the item only, not on how the items are cut into chunks; then
    they do not depend on the workers, their number or their fate either.

    Args:
        tasks: Per name (good as a file name) the task and its number of items.
        chunk_size: Items per chunk.
        folder: Where finished chunks are kept and found; None: nowhere.
        workers: Number of local processes, with one this process does it; None: one for each
            processor.
        scheduler: Address of a Dask scheduler, whose workers compute instead.
        on_progress: Called after every chunk.
        should_stop: Asked often; True ends the sweep once the chunks under way are finished.

    Raises:
        SweepError: The scheduler does not answer or got lost, or a local process died.
    """
    began = time.perf_counter()
    parts: dict[str, dict[str, np.ndarray]] = {}
    missing: dict[str, SweepChunk] = {}
    names: dict[str, list[str]] = {}
    for task_name, (task, count) in tasks.items():
        names[task_name] = []
        for start in range(0, count, chunk_size):
            chunk = SweepChunk(task, start, min(start + chunk_size, count))
            name = f"{task_name}-{chunk.start:07d}-{chunk.stop:07d}"
            names[task_name].append(name)
            kept = None if folder is None else folder.load(name)
            if kept is None:
                missing[name] = chunk
            else:
                parts[name] = kept
    total = sum(count for _, count in tasks.values())
    found = total - sum(chunk.stop - chunk.start for chunk in missing.values())
    done = found

    def progress() -> SweepProgress:
        return SweepProgress(done, total, found, time.perf_counter() - began)

    if on_progress is not None:
        on_progress(progress())
    order = list(missing)
    never: Callable[[], bool] = lambda: False  # noqa: E731
    for number, arrays in computed(
        list(missing.values()), workers, scheduler, should_stop or never
    ):
        name = order[number]
        if folder is not None:
            folder.store(name, arrays)
        parts[name] = arrays
        done += missing[name].stop - missing[name].start
        if on_progress is not None:
            on_progress(progress())
    if done < total:
        return SweepResult(None, progress())
    return SweepResult(
        {task: _joined([parts[n] for n in names[task]]) for task in tasks}, progress()
    )


def _joined(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
