"""Sweeps: many items computed in chunks, which are kept, so that a sweep can continue later."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.sweeps.earlier_runs import EarlierRuns, read_taken, take_over
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.worker_pool import PersistentPool
from cdpr_drake.analyses.sweeps.workers import SweepChunk, SweepTask, check_scheduler, computed

Arrays = dict[str, np.ndarray]
Named = tuple[str, SweepChunk]

STARTING = "starting"
"""What there is to say until the first chunk is finished; whether it compiles, commands see."""


@dataclass(frozen=True, eq=False)
class SweepResult:
    """What a sweep computed.

    Attributes:
        finished: Arrays, over all of its items, of each task that was finished.
        progress: Where the sweep stood at the end.
        earlier: Runs that were taken over from an earlier folder.
    """

    finished: dict[str, dict[str, np.ndarray]]
    progress: WorkProgress
    earlier: EarlierRuns = field(default_factory=EarlierRuns)

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
    alone: Collection[str] = (),
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
        alone: Names of tasks that measure times: this process does them, one chunk after the
            other, when all others are finished.
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
    shared = [each for each in missing if each[0] not in alone]
    timed = [each for each in missing if each[0] in alone]
    # A generator does nothing until it is asked: the second begins when the first has ended.
    for (last, chunk), arrays in chain(
        _named(
            shared, computed([chunk for _, chunk in shared], workers, scheduler, stop, standing)
        ),
        _named(timed, computed([chunk for _, chunk in timed], 1, None, stop)),
    ):
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


def _named(
    chunks: Sequence[Named], results: Iterable[tuple[int, Arrays]]
) -> Iterator[tuple[Named, Arrays]]:
    """Results with the chunks that they are of, instead of their numbers."""
    return ((chunks[number], arrays) for number, arrays in results)


def _joined(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


def run_study_sweep(
    tasks: Mapping[str, tuple[SweepTask, int]],
    chunk_size: int,
    items: str,
    arguments: dict[str, Any],
    session: StudySession,
    *,
    alone: Collection[str] = (),
    case_of: Mapping[str, str] | None = None,
) -> SweepResult:
    """As `run_sweep`, by whom a study's session says, in its folder.

    A study that uses it and says so in `analyses.studies.catalogue.STUDIES` continues when it is
    run again:
    its folder is opened for `arguments`, all that the numbers depend on, for JSON. All chunks are
    in one file in the end. `case_of` names by task its case in the arguments, so that runs of an
    earlier folder can be taken over.

    Raises:
        OutputFolderError: The folder belongs to other arguments, which are named, holds other
            files, or cannot be written.
        SweepError: The scheduler does not answer or got lost, or a local process died.
    """
    if session.scheduler is not None:
        check_scheduler(session.scheduler)
    kept = None if session.folder is None else SweepFolder(session.folder, arguments)
    earlier = EarlierRuns()
    if kept is not None and session.earlier is not None:
        earlier = take_over(
            kept, session.earlier, tasks, chunk_size, arguments, case_of=case_of or {}, alone=alone
        )
    elif kept is not None:
        earlier = read_taken(kept.folder, len(tasks))
    result = run_sweep(
        tasks, chunk_size, kept, items=items, workers=session.workers, scheduler=session.scheduler,
        on_progress=session.on_progress, should_stop=session.should_stop, alone=alone,
    )  # fmt: skip
    if kept is not None and result.arrays is not None:
        kept.finish(result.arrays)
    return replace(result, earlier=earlier)
