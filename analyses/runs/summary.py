"""The numbers that describe a run: `summary.json`."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting import finite, package_versions, spread
from cdpr_drake.analyses.runs.visual_servo_run import RunResult
from cdpr_drake.arrays import Array
from cdpr_drake.spatial import distances_from_line, pose_from_row, pose_rows_distance

THESIS_WIDTH = 1600
"""Width of the image in which the servoing thesis counts pixels."""


def image_path(result: RunResult) -> tuple[Array, Array, Array]:
    """Path of the tag's middle in the image, as measured, and the straight line it should follow.

    Returns:
        Times, shape (n,) [s]; path, shape (n, 2) [px]; the line's start and end, shape (2, 2) [px]:
        the first point of the path and the image of the desired pose. Empty if never found.
    """
    log, servo = result.log, result.servo
    found = log["found"][:, 0] > 0.0
    target, pinhole = servo.target, servo.pinhole
    centers = [
        target.center(marks, pose_from_row(row), pinhole)
        for marks, row in zip(
            log[f"{target.mark}_px"][found], log["X_CO_measured"][found], strict=True
        )
    ]
    path = np.array(centers).reshape(-1, 2) * [pinhole.fx, pinhole.fy] + [pinhole.cx, pinhole.cy]
    desired = pinhole.project(servo.X_CdO.translation()[:, np.newaxis])[:, 0]
    start = path[0] if len(path) else desired
    return log["time"][found], path, np.array([start, desired])


def camera_path(result: RunResult) -> tuple[Array, Array]:
    """True path of the camera's origin as the object sees it, in the frame that the object has at
    the start, shape (n, 3) [m], and the straight line's start and end, shape (2, 3) [m]: its first
    point and where the desired pose puts the camera.

    For an object at rest in the world that frame is W, so that this is the camera's path there.
    """
    log, servo = result.log, result.servo
    hand = servo.mounting.is_eye_to_hand()
    X_WO = RigidTransform() if hand else servo.X_WO
    path = np.array(
        [
            X_WO @ servo.X_CO(pose_from_row(row), time).inverse().translation()
            for row, time in zip(log["X_WP"], log["time"], strict=True)
        ]
    )
    return path, np.array([path[0], X_WO @ servo.X_CdO.inverse().translation()])


@np.errstate(over="ignore", invalid="ignore")  # a diverged run has any numbers
def summarize(result: RunResult) -> dict[str, Any]:
    """The summary of a run; keys and units as README lists them.

    Not finite numbers, which a diverged run may leave, become None.
    """
    log, servo, scenario = result.log, result.servo, result.servo.scenario
    X_true, X_estimated = log["X_WP"], log["X_WP_estimated"]
    position_error, rotation_error = final_errors(result)
    estimate_distance, estimate_angle = pose_rows_distance(X_true, X_estimated)
    planned = log.get("X_WP_planned", X_true[:0])
    plan_distance, plan_angle = pose_rows_distance(X_true[: len(planned)], planned)
    _, path, line = image_path(result)
    pixels = distances_from_line(path, *line)
    track, camera_line = camera_path(result)
    metres = distances_from_line(track, *camera_line)
    if servo.motion.is_moving():  # no line is the ideal one then
        pixels, metres = np.empty(0), np.empty(0)
    tensions = log["tensions"]
    summary: dict[str, Any] = {
        "scenario": scenario.name,
        "robot": servo.robot.name,
        "controller": scenario.controller.scheme if scenario.open_loop is None else "open_loop",
        "estimator": scenario.estimator.kind,
        "camera": scenario.camera.kind,
        "seed": scenario.seed,
        "outcome": result.outcome.name.lower(),
        "message": result.message,
        "sim_time_s": result.sim_time,
        "wall_time_s": result.wall_time,
        "realtime_factor": result.sim_time / result.wall_time if result.wall_time > 0.0 else None,
        "final_position_error_m": position_error,
        "final_rotation_error_rad": rotation_error,
        "final_pose_estimate_error_m": float(estimate_distance[-1]),
        "final_pose_estimate_error_rad": float(estimate_angle[-1]),
        "pose_estimate_error_m": spread(estimate_distance),
        "pose_estimate_error_rad": spread(estimate_angle),
        "plan_deviation_m": spread(plan_distance),
        "plan_deviation_rad": spread(plan_angle),
        "image_deviation_px": spread(pixels),
        "image_deviation_px_1600x1200": spread(pixels * THESIS_WIDTH / servo.pinhole.width),
        "camera_deviation_m": spread(metres),
        "tension_n": {"min": float(np.min(tensions)), "max": float(np.max(tensions))},
        "broken_cables": _broken_cables(result),
        "slack_cable_seconds": float(np.sum(log["slack"][:-1] * np.diff(log["time"])[:, None])),
        "engine": scenario.integration.engine,
        "integration_step_s": servo.max_step,
        "step_error": _step_errors(result),
        "versions": package_versions(),
    }
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def _step_errors(result: RunResult) -> dict[str, float] | None:
    """Largest estimated errors of an integration step; None where the engine does not say."""
    if result.step_errors is None:
        return None
    return {name: float(x) for name, x in zip(("m", "rad"), result.step_errors, strict=True)}


def _broken_cables(result: RunResult) -> list[dict[str, Any]] | None:
    """Cables that passed their breaking load, and when [s]; None where none is known."""
    if result.broken is None:
        return None
    names = [cable.name for cable in result.servo.robot.cables]
    return [
        {"cable": name, "time_s": float(time)}
        for name, time in zip(names, result.broken, strict=True)
        if time >= 0.0
    ]


def final_errors(result: RunResult) -> tuple[float, float]:
    """True distance [m] and angle [rad] of the last logged pose from the desired one."""
    log = result.log
    return result.servo.seen_error(pose_from_row(log["X_WP"][-1]), float(log["time"][-1]))
