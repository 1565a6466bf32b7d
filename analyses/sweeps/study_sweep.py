"""A study whose work is a sweep: what is finished is kept, and the study continues with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting import StudyProgress
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.analyses.sweeps.sweep import STARTING, SweepProgress, SweepResult, run_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask


def run_study_sweep(
    tasks: Mapping[str, tuple[SweepTask, int]],
    chunk_size: int,
    items: str,
    arguments: dict[str, Any],
    folder: Path | None = None,
    on_progress: Callable[[StudyProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    workers: int | None = None,
) -> SweepResult:
    """Computes the tasks of a study, or what is missing of them in its folder.

    A study that uses it and says so in `analyses.STUDIES` continues when it is run again.

    Args:
        tasks: Per name (good as a file name) the task and its number of items.
        chunk_size: Items per chunk.
        items: Words for the items, such as "poses".
        arguments: All that the numbers depend on, for JSON.
        folder: Where chunks are kept and found, all of them in one file in the end; None: nowhere.
        on_progress: Called at the start and after every chunk.
        should_stop: Asked often; True ends the sweep once the chunks under way are finished.
        workers: Number of local processes, with one this process does it; None: one for each
            processor.

    Raises:
        OutputFolderError: The folder belongs to other arguments, which are named, holds other
            files, or cannot be written.
        SweepError: A local process died.
    """
    kept = None if folder is None else SweepFolder(folder, arguments)

    def show(now: SweepProgress) -> None:
        if on_progress is not None:
            what = now.last or STARTING
            on_progress(
                StudyProgress(
                    what, now.done, now.total, now.wall_time, f"{items}/s", now.found, items
                )
            )

    result = run_sweep(tasks, chunk_size, kept, workers, None, show, should_stop)
    if kept is not None and result.arrays is not None:
        kept.finish(result.arrays)
    return result
