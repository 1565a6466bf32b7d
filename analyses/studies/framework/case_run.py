"""One run of a configuration, and what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cdpr_drake.analyses.simulation.run_stability import stability_along
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.run_traces import estimate_jump, run_traces
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_loader import load_robot, robot_reference
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
class Recipe:
    """How a configuration is run, beside the changes of its scenario.

    Attributes:
        scenario: Name of the scenario.
        own: A study's own metrics by name.
        stability: Tension from which a cable counts in the criterion along the run [N], see
            `stability_traces`; None: the traces do not have it.
        platform: Arrays of the section `platform` that replace those of the robot's file.
    """

    scenario: str
    own: Mapping[str, OwnMetric] = field(default_factory=dict)
    stability: float | None = None
    platform: Mapping[str, Any] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        """What the numbers of a run depend on, for JSON."""
        told = {"scenario": self.scenario, "own": list(self.own), "stability": self.stability}
        return told | ({"platform": dict(self.platform)} if self.platform else {})


LEFT_OUT = ("wall_time_s", "realtime_factor", "versions")
"""What of a run's summary is another in each session, or the same for the whole study."""


def measure_run(case: Case, seed: int) -> dict[str, Any]:
    """Runs a configuration, by the compiled loop where that can do it, which the summary says.

    Returns:
        outcome, message; the metrics of `METRICS` and the study's own, SI units, None where there
        is none; summary, as `cdpr simulate` writes it, without `LEFT_OUT`; features,
        names of the components of "error"; stop_position_m, the measured distance at which a run
        counts as converged; the arrays of `run_traces` and of `stability_traces`.
    """
    recipe: Recipe = case.data
    items = [*case.changes, f"seed={seed}"]
    scenario = load_scenario(recipe.scenario, items)
    robot = load_robot(scenario.robot)
    given: dict[str, Any] = {key: np.asarray(value) for key, value in recipe.platform.items()}
    robot.platform = replace(robot.platform, **given)
    with robot_reference(robot if recipe.platform else scenario.robot) as name:
        scenario = load_scenario(recipe.scenario, [*items, f"robot={name}"])
        result = run_scenario(choose_compiled_loop(scenario))
    traces = run_traces(result)
    if recipe.stability is not None:
        traces |= stability_traces(result, recipe.stability)
    summary = summarize(result)
    return {
        "outcome": summary["outcome"],
        "message": result.message,
        **_metrics(summary, traces),
        **{name: metric.of(traces) for name, metric in recipe.own.items()},
        "summary": {name: value for name, value in summary.items() if name not in LEFT_OUT},
        "features": list(result.servo.feature_names),
        "stop_position_m": result.servo.scenario.stop.position,
        **traces,
    }


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


def converged(runs: Runs, configuration: str) -> bool:
    """Whether all runs of a configuration converged."""
    return all(run["outcome"] == CONVERGED for run in runs(configuration=configuration))


def outcomes(runs: Runs, configuration: str) -> str:
    """Words such as `5 converged` or `3 converged, 2 target_lost`."""
    return runs.counted("outcome", configuration=configuration)
