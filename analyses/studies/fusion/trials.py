"""One run of the study: a servo on the fused pose, with errors drawn as the filter is told."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.seeded_study import over_seeds
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import logarithm, pose_from_row, pose_rows_distance
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

SCENARIO = "acrobot_fusion"

RATE = 25.0
"""Rows of the log per second, as many as control steps [Hz]."""

SETTLED = 0.5
"""Time after which errors count [s]: the error of the start is found within it."""

TOLD = {"position": 0.01, "rotation_deg": 1.0}
"""How well the target's pose is known beforehand, as a camera in the world does not see it."""

COLUMNS = (
    "servo_m", "servo_rad", "final_m", "final_rad", "mean_m", "mean_rad", "largest_m",
    "largest_rad", "nees", "on_board", "external", "lengths", "external_left_out", "lost_s",
    "expected_m", "wrong_on_board", "wrong_external",
)  # fmt: skip
"""What is kept of each run: errors of the target in the camera at the end; of the estimate at the
end, in the mean, and at most, position [m] and rotation [rad]; normalized error squared at the end
[-]; share of steps at which each source was used, and at which the camera in the world was left
out; time without a target to steer by [s]; what the filter expects its error to be at the end, by
its covariance [m]; how probable it finds it in the end that a camera is worse than told, NaN where
nobody doubts it."""


@dataclass(frozen=True)
class FusionTrial:
    """The scenario with changes, for some time; the item is the seed.

    Attributes:
        changes: Items "key=value" of the scenario.
        duration: How long it runs [s].
    """

    changes: tuple[str, ...]
    duration: float

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Arrays of `run_trial`, stacked."""
        return over_seeds(partial(run_trial, self), start, stop)


def trial_scenario(trial: FusionTrial, seed: int) -> Scenario:
    """The scenario of a run: what is wrong is drawn normally, by what the filter is told."""
    told = f"{{position: {TOLD['position']}, rotation_deg: {TOLD['rotation_deg']}}}"
    base = [
        "camera.fault=null", "perturbations={}", "estimator.compare=[]", "stop.hold=1000",
        "stop.target_lost=1000", "integration.engine=compiled", f"log_rate={RATE}",
        f"duration={trial.duration}", f"seed={seed}",
        f"estimator.sensor_fusion.told_object={told}",
    ]  # fmt: skip
    scenario = load_scenario(SCENARIO, base)
    t, random = scenario.estimator.sensor_fusion, np.random.default_rng([seed, 31])
    start = scenario.initial_pose
    assert t.told_object is not None
    drawn = {
        "external_camera": (t.external_position, t.external_rotation_deg),
        "camera_pose": (t.on_board_position, t.on_board_rotation_deg),
        "told_object": (t.told_object.position, t.told_object.rotation_deg),
    }
    changes = []
    for name, (distance, angle) in drawn.items():
        changes.append(_pose(name, distance * random.standard_normal(3),
                             angle * random.standard_normal(3)))  # fmt: skip
    changes.append(
        _pose(
            "initial_pose", start.position + t.start_position * random.standard_normal(3),
            start.angles_deg + t.start_rotation_deg * random.standard_normal(3),
        )
    )  # fmt: skip
    return load_scenario(SCENARIO, [*base, *changes, *trial.changes])


def _pose(name: str, position: Array, angles_deg: Array) -> str:
    """A pose among the perturbations; small angles are as good as a rotation vector."""
    p, a = ([round(float(v), 9) for v in values] for values in (position, angles_deg))
    return f"perturbations.{name}={{position: {p}, angles_deg: {a}}}"


def run_trial(trial: FusionTrial, seed: int) -> dict[str, Array]:
    """A run of a trial.

    Returns:
        numbers: `COLUMNS`, shape (17,); distance: of the estimate from the truth at each row of
        the log, shape (n,) [m]; servo: of the target in the camera from where it should be, the
        same; nees: normalized error squared, the same [-]; nis: of each source in the mean over
        the run, over its degrees of freedom, shape (5,) [-].
    """
    return kept_of(run_scenario(trial_scenario(trial, seed)), trial.duration)


def kept_of(result: RunResult, duration: float) -> dict[str, Array]:
    """What `run_trial` keeps of a run; rows after an early end are NaN."""
    log, servo = result.log, result.servo
    rows = round(duration * RATE) + 1
    times = log["time"]
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    seen = np.array(
        [
            servo.seen_error(pose_from_row(row), float(time))
            for row, time in zip(log["X_WP"], times, strict=True)
        ]
    )
    nees = np.full(len(times), np.nan)
    for k in range(1, len(times)):
        x = logarithm(
            pose_from_row(log["X_WP_estimated"][k]).inverse() @ pose_from_row(log["X_WP"][k])
        )
        nees[k] = x @ np.linalg.solve(log["fusion_covariance"][k].reshape(6, 6), x)
    later = times >= min(SETTLED, 0.5 * duration)
    sources = log["fusion_sources"][later]
    stopped = np.linalg.norm(log["cable_velocities"][later], axis=1) == 0.0
    numbers = [
        *seen[-1], distance[-1], angle[-1], np.mean(distance[later]), np.mean(angle[later]),
        np.max(distance[later]), np.max(angle[later]), nees[-1],
        *np.mean(sources[:, :3] > 0.0, axis=0), np.mean(sources[:, 1] < 0.0),
        np.sum(stopped) / RATE,
        np.sqrt(np.trace(log["fusion_covariance"][-1].reshape(6, 6)[3:, 3:])),
        *log["fusion_calibration"][-1].reshape(2, -1)[:, 0],
    ]  # fmt: skip
    nis = log["fusion_nis"][later]
    there = np.any(np.isfinite(nis), axis=0)
    means = np.full(nis.shape[1], np.nan)
    means[there] = np.nanmean(nis[:, there], axis=0)
    return {
        "numbers": np.array(numbers),
        "distance": _padded(distance, rows),
        "servo": _padded(seen[:, 0], rows),
        "nees": _padded(nees, rows),
        "nis": means,
    }


def _padded(values: Array, rows: int) -> Array:
    """So many rows, NaN where there are none."""
    found = np.full(rows, np.nan)
    found[: min(rows, len(values))] = values[:rows]
    return found
