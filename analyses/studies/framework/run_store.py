"""Finished runs of a case study on disk, from which it continues."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.studies.framework.case_run import CaseJob, CaseRun
from cdpr_drake.analyses.sweeps.folder import SweepFolder, load_arrays, store_arrays
from cdpr_drake.arrays import Array

RUNS = "runs"
"""Name of the runs among the chunks of the folder."""

RECORD = "record"
"""Name of a run's words and numbers, as JSON, among its traces."""

TRACES = "traces.npz"
"""The traces and records of all runs, `configuration/seed/name` each, once all are finished."""


class RunStore:
    """Keeps each run of a case study in a file of its own while it runs, all in one at the end.

    Files appear whole or not at all, so whatever ends the program, the same command finds what was
    finished.
    """

    def __init__(self, folder: Path, study: str, quick: bool, jobs: list[CaseJob]) -> None:
        """Opens the folder for a study's runs.

        Raises:
            OutputFolderError: The folder belongs to another study or version, holds other files,
                or cannot be written.
        """
        arguments = {"cdpr_drake": code_version(), "study": study, "quick": quick}
        arguments["runs"] = len(jobs)
        self._folder = SweepFolder(folder, arguments)
        self._whole: dict[str, dict[str, Array]] = {}
        for key, array in (load_arrays(folder / TRACES) or {}).items():
            run, _, name = key.rpartition("/")
            self._whole.setdefault(run, {})[name] = array

    def load(self, index: int, job: CaseJob) -> CaseRun | None:
        """The run of a job if it is there."""
        arrays = self._whole.get(run_key(job)) or self._folder.load(RUNS, index, index + 1)
        if arrays is None or RECORD not in arrays:
            return None
        arrays = dict(arrays)
        record = json.loads(str(arrays.pop(RECORD)))
        return CaseRun(job=job, traces=arrays, features=tuple(record.pop("features")), **record)

    def store(self, index: int, run: CaseRun) -> None:
        """Keeps a run.

        Raises:
            OutputFolderError: The folder cannot be written, for instance on a full disk.
        """
        self._folder.store(RUNS, index, index + 1, arrays_of(run))

    def finish(self, runs: tuple[CaseRun, ...]) -> None:
        """Puts all runs into one file, in the place of one file each."""
        if not self._whole:
            store_arrays(
                self._folder.folder / TRACES,
                {f"{run_key(r.job)}/{k}": a for r in runs for k, a in arrays_of(r).items()},
            )
        self._folder.forget_chunks()


def run_key(job: CaseJob) -> str:
    """A run's name in the file of all."""
    return f"{job.configuration}/{'rendered' if job.rendered else job.seed}"


def arrays_of(run: CaseRun) -> dict[str, Array]:
    """A run's traces, and the rest of it as JSON; what is not finite there is null."""
    record: dict[str, Any] = {
        "outcome": run.outcome,
        "message": run.message,
        "metrics": run.metrics,
        "summary": run.summary,
        "features": list(run.features),
        "stop_position": run.stop_position,
    }
    return {**run.traces, RECORD: np.array(json.dumps(finite(record), allow_nan=False))}
