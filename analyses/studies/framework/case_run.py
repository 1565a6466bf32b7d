"""One run of a case study, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdpr_drake.analyses.simulation.run_stability import stability_along
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.run_traces import estimate_jump, run_traces
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.arrays import Array
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop

CONVERGED = "converged"


@dataclass(frozen=True)
class Metric:
    """A number that describes a run: heading of its column, factor to its unit, format."""

    heading: str
    factor: float
    format: str


METRICS: dict[str, Metric] = {
    "time_s": Metric("time [s]", 1.0, ".1f"),
    "position_error_m": Metric("final error [mm]", 1e3, ".2f"),
    "rotation_error_rad": Metric("final error [deg]", 180.0 / np.pi, ".2f"),
    "image_max_px": Metric("image, max [px]", 1.0, ".1f"),
    "image_mean_px": Metric("image, mean [px]", 1.0, ".1f"),
    "camera_max_m": Metric("camera, max [mm]", 1e3, ".1f"),
    "camera_mean_m": Metric("camera, mean [mm]", 1e3, ".1f"),
    "estimate_max_m": Metric("estimate, max [mm]", 1e3, ".1f"),
    "estimate_max_rad": Metric("estimate, max [deg]", 180.0 / np.pi, ".2f"),
    "estimate_jump_m": Metric("estimate, jump [mm]", 1e3, ".2f"),
}
"""What describes a run, by name: time; true error at the end; largest and mean distance of the
object's centre from its straight line in an image 1600 px wide, and of the camera's origin from
its own; largest error of the platform's pose estimate, and its largest change between two rows of
the log beside that of the true pose."""


@dataclass(frozen=True)
class OwnMetric(Metric):
    """A metric of one study, with what reckons it from a run's traces, in SI units."""

    of: Callable[[dict[str, Array]], float]


@dataclass(frozen=True)
class CaseJob:
    """A run to do: a scenario, what changes in it, and what it is called in the study.

    `own` are a study's own metrics by name; with a tension `stability` [N] the traces have the
    criterion along the run, see `stability_traces`.
    """

    configuration: str
    scenario: str
    changes: tuple[str, ...]
    seed: int
    rendered: bool
    own: Mapping[str, OwnMetric] = field(default_factory=dict)
    stability: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseRun:
    """A run that was done.

    Attributes:
        job: What was asked for.
        outcome: How it ended, in the words of `summary.json`.
        message: Why, where there is more to say.
        metrics: Numbers by the names of `METRICS`; None where there is none.
        summary: The run's summary, as `cdpr simulate` writes it.
        traces: Arrays for figures, see `run_traces`.
        features: Names of the components of "error" in the traces.
        stop_position: Measured distance at which a run counts as converged [m].
    """

    job: CaseJob
    outcome: str
    message: str
    metrics: dict[str, float | None]
    summary: dict[str, Any]
    traces: dict[str, Array]
    features: tuple[str, ...]
    stop_position: float

    def as_dict(self) -> dict[str, Any]:
        """Everything but the traces, for JSON."""
        return {
            "configuration": self.job.configuration,
            "seed": self.job.seed,
            "camera": "rendered" if self.job.rendered else "projected",
            "scenario": self.job.scenario,
            "changes": list(self.job.changes),
            "outcome": self.outcome,
            "message": self.message,
            "metrics": self.metrics,
            "summary": self.summary,
        }


def do_case_job(job: CaseJob) -> CaseRun:
    """Runs a job; a free function of plain data, so that a worker process can do it.

    By the compiled loop where that can do it, which the summary says.
    """
    result = run_scenario(choose_compiled_loop(load_scenario(job.scenario, job.changes)))
    traces = run_traces(result)
    if job.stability is not None:
        traces |= stability_traces(result, job.stability)
    summary = summarize(result)
    return CaseRun(
        job=job,
        outcome=summary["outcome"],
        message=summary["message"],
        metrics={
            **_metrics(summary, traces),
            **{name: metric.of(traces) for name, metric in job.own.items()},
        },
        summary=summary,
        traces=traces,
        features=tuple(result.servo.feature_names),
        stop_position=result.servo.scenario.stop.position,
    )


def stability_traces(result: RunResult, threshold: float) -> dict[str, Array]:
    """The criterion along a run: stability_time (k,) [s], taut_cables, jacobian_rank,
    stability_margin (k,) [-], with cables below a tension `threshold` [N] left out; lengths,
    unstrained_lengths (n, m) [m], slack (n, m), X_WP (n, 7), and, where they are logged,
    measured_tensions, tension_thresholds (n, m) [N] and tension_corrections (n, m) [m/s].
    """
    along = stability_along(result, threshold)
    log = result.log
    names = (
        "lengths", "unstrained_lengths", "slack", "measured_tensions", "X_WP",
        "tension_corrections", "tension_thresholds",
    )  # fmt: skip
    return {
        "stability_time": along.time,
        "taut_cables": along.taut,
        "jacobian_rank": along.rank,
        "stability_margin": along.margin,
        **{name: log[name] for name in names if name in log},
    }


def _metrics(summary: dict[str, Any], traces: dict[str, Array]) -> dict[str, float | None]:
    image, camera = summary["image_deviation_px_1600x1200"], summary["camera_deviation_m"]
    return {
        "time_s": summary["sim_time_s"],
        "position_error_m": summary["final_position_error_m"],
        "rotation_error_rad": summary["final_rotation_error_rad"],
        "image_max_px": image["max"],
        "image_mean_px": image["mean"],
        "camera_max_m": camera["max"],
        "camera_mean_m": camera["mean"],
        "estimate_max_m": float(np.max(traces["estimate_distance"])),
        "estimate_max_rad": float(np.max(traces["estimate_angle"])),
        "estimate_jump_m": estimate_jump(traces),
    }


class CaseRuns:
    """Finds runs by their configuration; projected ones unless said."""

    def __init__(self, runs: Iterable[CaseRun]) -> None:
        """With the runs that were done."""
        self._runs: dict[tuple[str, bool], list[CaseRun]] = {}
        for run in runs:
            self._runs.setdefault((run.job.configuration, run.job.rendered), []).append(run)

    def of(self, configuration: str, rendered: bool = False) -> Sequence[CaseRun]:
        """The runs of a configuration.

        Raises:
            KeyError: There are none.
        """
        return self._runs[configuration, rendered]

    def has(self, configuration: str, rendered: bool = False) -> bool:
        """Whether a configuration was run."""
        return (configuration, rendered) in self._runs

    def values(self, configuration: str, metric: str) -> Array:
        """A metric of all runs of a configuration, NaN where it has none."""
        values = [run.metrics[metric] for run in self.of(configuration)]
        return np.array([np.nan if v is None else v for v in values], float)

    def mean(self, configuration: str, metric: str) -> float:
        """Mean of a metric over the runs of a configuration, in SI units."""
        return float(np.mean(self.values(configuration, metric)))

    def largest(self, configuration: str, metric: str) -> float:
        """Largest of a metric over the runs of a configuration, in SI units."""
        return float(np.max(self.values(configuration, metric)))

    def converged(self, configuration: str) -> bool:
        """Whether all runs of a configuration converged."""
        return all(run.outcome == CONVERGED for run in self.of(configuration))

    def outcomes(self, configuration: str) -> str:
        """Words such as `5 converged` or `3 converged, 2 target_lost`."""
        found = [run.outcome for run in self.of(configuration)]
        return ", ".join(f"{found.count(name)} {name}" for name in dict.fromkeys(found))
