"""Runs a case study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.analyses.reporting.progress import DEFAULT_STUDY_SESSION, StudySession, WorkProgress
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks
from cdpr_drake.analyses.studies.framework.case_definition import CaseStudy
from cdpr_drake.analyses.studies.framework.case_figures import case_drawings
from cdpr_drake.analyses.studies.framework.case_run import CaseRun, CaseRuns, do_case_job
from cdpr_drake.analyses.studies.framework.case_tables import case_tables, configuration_numbers
from cdpr_drake.analyses.studies.framework.run_store import RunStore
from cdpr_drake.analyses.sweeps.worker_pool import default_workers
from cdpr_drake.analyses.sweeps.workers import run_jobs_somewhere
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, write_figures
from cdpr_drake.models.rendered_camera import probe_rendering

SIMULATED = "s of simulated time"
"""What the progress counts."""


@dataclass(frozen=True, eq=False)
class CaseResult:
    """What a case study found.

    Attributes:
        case: The case study.
        quick: Whether it was the quick form.
        runs: The runs that were finished, in the order of the configurations.
        statements: The thesis' statements that these runs judge.
        interrupted: Whether it was stopped before the end.
        wall_time: Time it took [s].
    """

    case: CaseStudy
    quick: bool
    runs: tuple[CaseRun, ...]
    statements: tuple[Statement, ...]
    interrupted: bool
    wall_time: float

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, runs, statistics, statements; what is not
        finite is null."""
        case, found = self.case, CaseRuns(self.runs)
        present = {run.job.configuration for run in self.runs}
        told: dict[str, Any] = {
            "study": case.name,
            "title": case.title,
            "source": case.source,
            "quick": self.quick,
            "interrupted": self.interrupted,
            "wall_time_s": self.wall_time,
            "versions": package_versions(),
            "loops": dict(Counter(run.summary["loop"] for run in self.runs)),
            "assumptions": list(case.assumptions),
            "configurations": [
                {
                    "name": c.name,
                    "label": c.label,
                    "group": c.group,
                    "scenario": c.scenario or case.scenario,
                    "changes": [*case.changes, *c.changes],
                    "published": dict(c.published),
                    "found": finite(configuration_numbers(found, c.name, case.metrics())),
                }
                for c in case.configurations
                if c.name in present
            ],
            "runs": [run.as_dict() for run in self.runs],
            "statements": [statement.as_dict() for statement in self.statements],
        }
        cleaned: dict[str, Any] = finite(told)
        return cleaned

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        return case_tables(self.case, self.runs, self.statements)

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes `results.json`, then the figures, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        write_json(folder / "results.json", self.as_dict())
        return write_figures(folder, self.drawings(), formats)

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """See `case_drawings`; all traces are in the study's `traces.npz`."""
        return case_drawings(self.case, self.runs)


def run_case_study(
    case: CaseStudy,
    quick: bool = False,
    session: StudySession = DEFAULT_STUDY_SESSION,
) -> CaseResult:
    """Runs a case study in parallel processes.

    Args:
        case: The case study.
        quick: Every configuration once, none with rendered images.
        session: How it is run.

    Raises:
        OutputFolderError: The folder belongs to another study, or cannot be written.
        RenderingError: Some runs have rendered images, and nothing can be rendered here.
        SweepError: A local process died, or the scheduler does not answer or got lost.
    """
    began = time.perf_counter()
    jobs = case.jobs(quick, session.seeds)
    store = None
    if session.folder is not None:
        store = RunStore(session.folder, case.name, quick, jobs)
    found: dict[int, CaseRun] = {}
    for index, job in enumerate(jobs):
        run = None if store is None else store.load(index, job)
        if run is not None:
            found[index] = run
    missing = [index for index in range(len(jobs)) if index not in found]
    if any(jobs[index].rendered for index in missing):
        probe_rendering()
    before = simulated = sum(float(run.summary["sim_time_s"]) for run in found.values())

    def tell(what: str) -> None:
        # What is left is taken to last as long as the runs so far.
        left = len(jobs) - len(found)
        total = simulated + left * (simulated / len(found) if found else 1.0)
        passed = time.perf_counter() - began
        words = f"{len(found)}/{len(jobs)} {what}"
        session.tell(WorkProgress(words, simulated, total, passed, found=before, items=SIMULATED))

    tell("runs")
    pool = session.workers or (1 if quick else default_workers())
    asked = [jobs[index] for index in missing]
    for number, run in run_jobs_somewhere(
        do_case_job, asked, pool, session.scheduler, session.should_stop
    ):
        found[missing[number]] = run
        if store is not None:
            store.store(missing[number], run)
        simulated += float(run.summary["sim_time_s"])
        tell(f"{run.job.configuration}: {run.outcome}")
    runs = tuple(found[index] for index in sorted(found))
    interrupted = len(found) < len(jobs)
    if store is not None and not interrupted:
        store.finish(runs)
    said = evaluate_checks(case.judges, CaseRuns(runs), quick and not interrupted)
    statements = tuple(said)
    passed = time.perf_counter() - began
    return CaseResult(case, quick, runs, statements, interrupted, passed)
