"""Runs many visual servos in processes, and what they have in common: Monte-Carlo over seeds."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.job import ProcessDied
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.reporting.exported_logs import write_columns
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.simulation.monte_carlo_store import RunRecord, StoredRuns
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.run_traces import run_traces
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pose_accuracy import Repeatability, repeatability
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.schema.input_files import inputs_read_once
from cdpr_drake.systems.diagrams.load import read_inputs
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


@dataclass(frozen=True, eq=False)
class ManyRuns:
    """Runs that were done.

    Attributes:
        records: Those finished, in the order of the scenarios.
        wanted: Number of scenarios.
        lost: Seeds of runs whose process died, for instance out of memory.
        wall_time: Time that they took together [s].
    """

    records: tuple[RunRecord, ...]
    wanted: int
    wall_time: float
    lost: tuple[int, ...] = ()

    @property
    def interrupted(self) -> bool:
        """Whether some were not begun."""
        return len(self.records) + len(self.lost) < self.wanted

    def values(self, metric: str) -> Array:
        """A number of all summaries, shape (n,), NaN where a run has none.

        Args:
            metric: Key of the summary, such as "final_position_error_m" or
                "image_deviation_px.max".
        """
        return np.array([_number(record.summary, metric) for record in self.records])

    def table(self) -> dict[str, Array]:
        """All summaries as columns, shape (n,) each, with a row for each record.

        Columns are `index`, `seed` and every entry of the summaries, those inside others by
        their path, as `image_deviation_px.max`: numbers, NaN where a run has none, or words.
        Lists are left out. `pandas.DataFrame(runs.table())` takes it as it is.
        """
        rows = [_entries(record.summary) for record in self.records]
        names = dict.fromkeys(name for row in rows for name in row if name != "seed")
        columns = {
            "index": np.array([record.index for record in self.records], int),
            "seed": np.array([record.seed for record in self.records], int),
        }
        for name in names:
            columns[name] = _column([row.get(name) for row in rows])
        return columns

    def write_table(self, path: Path) -> None:
        """Writes `table` in the format of the path's ending: .csv, .npz, .mat or .parquet.

        Raises:
            OutputFormatError: Another ending, or Parquet without pyarrow.
        """
        write_columns(path, self.table())

    def repeatability(self) -> Repeatability | None:
        """Accuracy and repeatability of the poses reached; None where no run converged."""
        poses = [pose_from_row(record.end) for record in self.records if record.converged]
        return repeatability(poses, RigidTransform()) if poses else None


@dataclass(frozen=True)
class _Job:
    index: int
    scenario: Scenario
    keep_traces: bool


@inputs_read_once()
def run_many(
    scenarios: Sequence[Scenario],
    workers: int | str | None = None,
    on_progress: Callable[[WorkProgress], None] | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    *,
    keep_traces: bool = False,
    kept: StoredRuns | None = None,
    say: Callable[[str], None] = lambda words: None,
) -> ManyRuns:
    """Simulates scenarios, each until its outcome is known or its duration is over.

    Files that a scenario names are read once, before the first run, and sent to all processes.
    A run's noise and random model errors depend on its scenario's seed only, and its result not on
    how many workers there are, nor on which one does it.

    Args:
        scenarios: What to simulate; see `with_seeds`.
        workers: Number of processes or address of a Dask scheduler, see `finished_jobs`.
        on_progress: Called after every run.
        should_stop: Asked all the time; after True no further run begins, those under way are
            finished and kept.
        keep_traces: Whether to keep the arrays that figures need.
        kept: Where finished runs of these scenarios are kept and found, with their traces if these
            are kept; None: nowhere.
        say: Gets words on what a cluster lacks.

    Raises:
        CdprError: A scenario cannot be built: robot, camera or initial pose.
        SweepError: As `finished_jobs`.
        OutputFolderError: A finished run cannot be written.
    """
    for scenario in {scenario.robot: scenario for scenario in scenarios}.values():
        read_inputs(scenario)
    jobs = [_Job(index, scenario, keep_traces) for index, scenario in enumerate(scenarios)]
    began = time.perf_counter()
    there = [None if kept is None else kept.load(job.index, job.scenario.seed) for job in jobs]
    records = [record for record in there if record is not None]
    missing = [job for job, record in zip(jobs, there, strict=True) if record is None]
    found, lost = len(records), list[int]()

    def tell(what: str) -> None:
        if on_progress is not None:
            passed = time.perf_counter() - began
            on_progress(
                WorkProgress(
                    what, len(records), len(jobs), passed, rate="runs/s", found=found, items="runs"
                )
            )

    if found:
        tell("found in the folder")
    for done in finished_jobs(_do, missing, workers, stop=should_stop, say=say, name="run"):
        if isinstance(done.problem, ProcessDied):
            lost.append(missing[done.number].scenario.seed)
        elif done.problem is not None:
            raise done.problem
        if done.result is None:
            continue
        record = done.result
        if kept is not None:
            kept.store(record)
        records.append(record)
        tell(f"seed {record.seed} {record.summary['outcome']}")
    records.sort(key=lambda record: record.index)
    passed = time.perf_counter() - began
    return ManyRuns(tuple(records), len(jobs), passed, tuple(sorted(lost)))


def with_seeds(scenario: Scenario, seeds: Sequence[int]) -> list[Scenario]:
    """The scenario once for each seed."""
    return [replace(scenario, seed=seed) for seed in seeds]


def _do(job: _Job) -> RunRecord:
    """One run, in whatever process."""
    result = run_scenario(job.scenario)
    log, servo = result.log, result.servo
    desired = servo.desired_platform_pose(float(log["time"][-1]))
    end = desired.inverse() @ pose_from_row(log["X_WP"][-1])
    return RunRecord(
        index=job.index,
        seed=job.scenario.seed,
        summary=summarize(result),
        end=pose_row(end),
        traces=run_traces(result) if job.keep_traces else {},
    )


def _entries(summary: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Numbers, words and None of a summary, by their path in it."""
    found: dict[str, Any] = {}
    for key, value in summary.items():
        if isinstance(value, dict):
            found |= _entries(value, f"{prefix}{key}.")
        elif not isinstance(value, (list, tuple)):
            found[f"{prefix}{key}"] = value
    return found


def _column(values: list[Any]) -> Array:
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values])
    return np.array([np.nan if value is None else value for value in values], float)


def _number(summary: dict[str, Any], metric: str) -> float:
    value: Any = summary
    for key in metric.split("."):
        value = value[key]
    return float("nan") if value is None else float(value)
