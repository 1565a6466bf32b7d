"""One run of the study: a servo on the fused pose, with errors drawn as the filter is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.study import Case
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


def trial_scenario(changes: Sequence[str], duration: float, seed: int) -> Scenario:
    """The scenario of a run: what is wrong is drawn normally, by what the filter is told.

    Args:
        changes: Items "key=value" of the scenario.
        duration: How long it runs [s].
        seed: By which it is drawn.
    """
    told = f"{{position: {TOLD['position']}, rotation_deg: {TOLD['rotation_deg']}}}"
    base = [
        "camera.fault=null", "perturbations={}", "estimator.compare=[]", "stop.hold=1000",
        "stop.target_lost=1000", "integration.engine=compiled", f"log_rate={RATE}",
        f"duration={duration}", f"seed={seed}",
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
    poses = []
    for name, (distance, angle) in drawn.items():
        poses.append(_pose(name, distance * random.standard_normal(3),
                           angle * random.standard_normal(3)))  # fmt: skip
    poses.append(
        _pose(
            "initial_pose", start.position + t.start_position * random.standard_normal(3),
            start.angles_deg + t.start_rotation_deg * random.standard_normal(3),
        )
    )  # fmt: skip
    return load_scenario(SCENARIO, [*base, *poses, *changes])


def _pose(name: str, position: Array, angles_deg: Array) -> str:
    """A pose among the perturbations; small angles are as good as a rotation vector."""
    p, a = ([round(float(v), 9) for v in values] for values in (position, angles_deg))
    return f"perturbations.{name}={{position: {p}, angles_deg: {a}}}"


def measure_fusion(case: Case, seed: int) -> dict[str, Any]:
    """A run of a configuration, see `row_of`."""
    duration = case.keys["duration_s"]
    return row_of(run_scenario(trial_scenario(case.changes, duration, seed)), duration)


def row_of(result: RunResult, duration: float) -> dict[str, Any]:
    """What is kept of a run; rows of curves after an early end are NaN.

    Returns:
        servo_m, servo_rad: of the target in the camera from where it should be, at the end;
        final_m, final_rad, mean_m, mean_rad, largest_m, largest_rad: error of the estimate at the
        end, in the mean, and at most; nees: normalized error squared at the end [-]; on_board,
        external, lengths, external_left_out: share of steps at which a source was used, and at
        which the camera in the world was left out; lost_s: time without a target to steer by;
        expected_m: what the filter expects its error to be at the end, by its covariance;
        wrong_on_board, wrong_external: how probable it finds it in the end that a camera is worse
        than told, NaN where nobody doubts it; nis: of each of five sources in the mean over the
        run, over its degrees of freedom [-]; curves estimate_m, target_m, nees_by_row of shape
        (rows of the log,): distance of the estimate from the truth, of the target in the camera
        from where it should be, normalized error squared [-].
    """
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
    nis = log["fusion_nis"][later]
    there = np.any(np.isfinite(nis), axis=0)
    means = np.full(nis.shape[1], np.nan)
    means[there] = np.nanmean(nis[:, there], axis=0)
    used = np.mean(sources[:, :3] > 0.0, axis=0)
    wrong = log["fusion_calibration"][-1].reshape(2, -1)[:, 0]
    return {
        "servo_m": seen[-1, 0], "servo_rad": seen[-1, 1],
        "final_m": distance[-1], "final_rad": angle[-1],
        "mean_m": np.mean(distance[later]), "mean_rad": np.mean(angle[later]),
        "largest_m": np.max(distance[later]), "largest_rad": np.max(angle[later]),
        "nees": nees[-1], "on_board": used[0], "external": used[1], "lengths": used[2],
        "external_left_out": np.mean(sources[:, 1] < 0.0), "lost_s": np.sum(stopped) / RATE,
        "expected_m": np.sqrt(np.trace(log["fusion_covariance"][-1].reshape(6, 6)[3:, 3:])),
        "wrong_on_board": wrong[0], "wrong_external": wrong[1], "nis": means.tolist(),
        "estimate_m": _padded(distance, rows), "target_m": _padded(seen[:, 0], rows),
        "nees_by_row": _padded(nees, rows),
    }  # fmt: skip


def _padded(values: Array, rows: int) -> Array:
    """So many rows, NaN where there are none."""
    found = np.full(rows, np.nan)
    found[: min(rows, len(values))] = values[:rows]
    return found
