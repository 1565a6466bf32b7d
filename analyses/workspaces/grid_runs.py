"""Runs of questions over poses: computed in chunks, kept as they come, found again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.sweeps.folder import SweepFolder, check_sweep_folder
from cdpr_drake.analyses.sweeps.sweep import run_sweep
from cdpr_drake.analyses.sweeps.workers import check_scheduler

ARRAYS = "workspace.npz"
"""All arrays of a result, with what they were computed for as JSON in the array `about`."""

ITEMS = "poses"
"""Words for what is counted."""


class GridResult(Protocol):
    """What comes of a question."""

    def save(self, folder: Path) -> Path:
        """Writes `ARRAYS` into a folder that exists, and returns its path."""


Result = TypeVar("Result", bound=GridResult)


@dataclass(frozen=True)
class SweepOptions:
    """How a question is computed.

    Attributes:
        folder: Where finished chunks are kept and found, and the result; None: nowhere.
        workers: Number of local processes, with one this process does it; None: one for each
            processor.
        scheduler: Address of a Dask scheduler, whose workers compute instead.
        on_progress: Called at the start and after every chunk, or once where all was there.
        should_stop: Asked often; True ends the sweep once the chunks under way are finished.
    """

    folder: Path | None = None
    workers: int | None = 1
    scheduler: str | None = None
    on_progress: Callable[[WorkProgress], None] | None = None
    should_stop: Callable[[], bool] | None = None


@dataclass(frozen=True, eq=False)
class PoseRun(Generic[Result]):
    """What came of a question.

    Attributes:
        result: The result; None if the sweep was stopped before the end.
        progress: Where the sweep stood at the end.
    """

    result: Result | None
    progress: WorkProgress


def run_poses(
    arguments: dict[str, Any],
    tasks: Mapping[str, tuple[Any, int]],
    chunk: int,
    assemble: Callable[[Mapping[str, Mapping[str, np.ndarray]]], Result],
    load: Callable[[Path], Result],
    how: SweepOptions,
) -> PoseRun[Result]:
    """Computes a question, or reads what was computed for the same.

    Args:
        arguments: All that the numbers depend on, for JSON.
        tasks: By name what computes some poses, and how many there are.
        chunk: Poses of a chunk.
        assemble: Makes the result of the tasks' arrays.
        load: Reads a result from its folder.
        how: How it is computed.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: The scheduler does not answer or got lost, or a local process died.
    """
    if how.folder is not None:
        check_sweep_folder(how.folder)  # before anything is compiled
    for task, _ in tasks.values():
        task(0, 1)  # what is not accepted shows before a folder is made
    if how.scheduler is not None:
        check_scheduler(how.scheduler)
    kept = None if how.folder is None else SweepFolder(how.folder, arguments)
    if how.folder is not None and (how.folder / ARRAYS).is_file():
        total = sum(count for _, count in tasks.values())
        result = load(how.folder)
        progress = WorkProgress("", total, total, 0.0, found=total, items=ITEMS)
        if how.on_progress is not None:
            how.on_progress(progress)
        return PoseRun(result, progress)
    swept = run_sweep(
        dict(tasks), chunk, kept, items=ITEMS, workers=how.workers, scheduler=how.scheduler,
        on_progress=how.on_progress, should_stop=how.should_stop,
    )  # fmt: skip
    if swept.arrays is None:
        return PoseRun(None, swept.progress)
    result = assemble(swept.arrays)
    if how.folder is not None and kept is not None:
        result.save(how.folder)
        kept.forget_chunks()
    return PoseRun(result, swept.progress)
