"""The numbers that describe a run: `summary.json`."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.log_files import finite, spread
from cdpr_drake.analyses.reporting.log_on_disk import Log, log_block, log_rows
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.simulation.adaptation_report import adaptation_summary
from cdpr_drake.analyses.simulation.pan_tilt_report import pan_tilt_summary
from cdpr_drake.analyses.simulation.run_stability import stability_of_run
from cdpr_drake.analyses.simulation.start_checks import servo_limit_warnings
from cdpr_drake.analyses.simulation.unexpected_end import servo_message
from cdpr_drake.analyses.simulation.visual_servo_run import RunResult
from cdpr_drake.analyses.simulation.worlds import world_summary
from cdpr_drake.analyses.simulation.wrench_report import wrench_summary
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_from_row, pose_row, pose_rows_distance
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.diagrams.calibration_findings import found_calibrations
from cdpr_drake.systems.diagrams.tension_management import used_gain
from cdpr_drake.systems.diagrams.visual_servo import VisualServo
from cdpr_drake.systems.estimators.geometry_learner import LEARNT
from cdpr_drake.systems.robots.failures import FailureSettings
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.robots.settings import simulated_model
from cdpr_drake.systems.scenarios.run_settings import engine_of

ROWS_AT_ONCE = 20_000
"""Poses that are looked at at a time."""

THESIS_WIDTH = 1600
"""Width of the image in which the servoing thesis counts pixels."""


def image_path(result: RunResult) -> tuple[Array, Array, Array]:
    """Path of the tag's middle in the image, as measured, and the straight line it should follow.

    Returns:
        Times, shape (n,) [s]; path, shape (n, 2) [px]; the line's start and end, shape (2, 2) [px]:
        the first point of the path and the image of the desired pose. Empty if never found.
    """
    log, servo = result.log, result.servo
    found = np.flatnonzero(log["found"][:, 0] > 0.0)
    target, pinhole = servo.target, servo.pinhole
    marks, poses = log[f"{target.mark}_px"], log["X_CO_measured"]
    path = np.empty((len(found), 2))  # in pieces, as there may be more rows than memory
    for first in range(0, len(found), ROWS_AT_ONCE):
        part = found[first : first + ROWS_AT_ONCE]
        path[first : first + len(part)] = target.centers(marks[part], poses[part, 4:], pinhole)
    path = path * [pinhole.fx, pinhole.fy] + [pinhole.cx, pinhole.cy]
    desired = pinhole.ideal.project(servo.X_CdO.translation()[:, np.newaxis])[:, 0]
    start = path[0] if len(path) else desired
    return log["time"][found], path, np.array([start, desired])


def camera_path(result: RunResult) -> tuple[Array, Array]:
    """True path of the camera's origin as the object sees it, in the frame that the object has at
    the start, shape (n, 3) [m], and the straight line's start and end, shape (2, 3) [m]: its first
    point and where the desired pose puts the camera.

    For an object at rest in the world that frame is W, so that this is the camera's path there.
    """
    log = result.log
    path = np.empty((len(log["time"]), 3))
    servo = result.servo
    if not servo.mounting.is_eye_to_hand() and not servo.motion.is_moving():
        p_PC = servo.X_PC.translation()
        for start in range(0, len(path), ROWS_AT_ONCE):
            poses = np.ascontiguousarray(log["X_WP"][start : start + ROWS_AT_ONCE])
            turns = rotations_of_quaternions(poses[:, :4])
            path[start : start + len(poses)] = turns @ p_PC + poses[:, 4:]
        return path, camera_line(result)
    for k, (pose, time) in enumerate(zip(log["X_WP"], log["time"], strict=True)):
        path[k] = _camera_place(result, pose, time)
    return path, camera_line(result)


def camera_line(result: RunResult) -> Array:
    """The straight line of `camera_path`, shape (2, 3) [m]."""
    log, servo = result.log, result.servo
    start = _camera_place(result, log["X_WP"][0], log["time"][0])
    return np.array([start, _start_frame(result) @ servo.X_CdO.inverse().translation()])


def camera_ends(result: RunResult) -> Array:
    """The camera's last true pose, and where the desired pose puts it, as rows in the frame of
    `camera_path`, shape (2, 7)."""
    servo, start = result.servo, _start_frame(result)
    X_CO = servo.X_CO(pose_from_row(result.log["X_WP"][-1]), result.log["time"][-1])
    return np.array([pose_row(start @ X_CO.inverse()), pose_row(start @ servo.X_CdO.inverse())])


def _camera_place(result: RunResult, row: Array, time: float) -> Array:
    X_CO = result.servo.X_CO(pose_from_row(row), time)
    return np.asarray(_start_frame(result) @ X_CO.inverse().translation())


def _start_frame(result: RunResult) -> RigidTransform:
    """X_WO at the start; for eye to hand O itself."""
    servo = result.servo
    return RigidTransform() if servo.mounting.is_eye_to_hand() else servo.X_WO


@np.errstate(over="ignore", invalid="ignore")  # a diverged run has any numbers
def summarize(result: RunResult) -> dict[str, Any]:
    """The summary of a run; keys and units as README lists them.

    Not finite numbers, which a diverged run may leave, become None.
    """
    log, servo, scenario = result.log, result.servo, result.servo.scenario
    position_error, rotation_error = final_errors(result)
    # Nothing of a row's length is kept but numbers of each: hours of poses would not fit.
    estimate_distance, estimate_angle = _distance_between(log, "X_WP", "X_WP_estimated")
    plan_distance, plan_angle = _distance_between(log, "X_WP", "X_WP_planned")
    pixels, metres = np.empty(0), np.empty(0)
    if not servo.motion.is_moving():  # no line is the ideal one then
        _, path, line = image_path(result)
        pixels = distances_from_line(path, *line)
        track, camera_line = camera_path(result)
        metres = distances_from_line(track, *camera_line)
    tensions = log["tensions"]
    taut = np.sum(log["slack"] <= 0.0, axis=1)
    freedom = 3 if servo.believed.is_planar() else 6
    lowest, highest = float(np.min(tensions)), float(np.max(tensions))
    del tensions
    along = stability_of_run(result)
    summary: dict[str, Any] = {
        "scenario": scenario.name,
        "robot": servo.robot.name,
        "geometry": scenario.cables.geometry_words(servo.robot, scenario.controller.pulleys),
        "controller": scenario.controller.scheme if scenario.open_loop is None else "open_loop",
        "servo_switches": int(log["servo_mode"][-1, 1]) if "servo_mode" in log else None,
        "estimator": scenario.estimator.kind,
        "camera": scenario.camera.kind,
        "images": _images(result),
        "seed": scenario.seed,
        **result.ending(),
        "message": result.message
        or servo_message(servo, scenario, log, result.outcome, (position_error, rotation_error)),
        "final_position_error_m": position_error,
        "final_rotation_error_rad": rotation_error,
        "final_pose_estimate_error_m": float(estimate_distance[-1]),
        "final_pose_estimate_error_rad": float(estimate_angle[-1]),
        "pose_estimate_error_m": spread(estimate_distance),
        "pose_estimate_error_rad": spread(estimate_angle),
        "pose_estimate_drift_m_per_min": drift(log["time"], estimate_distance),
        "pose_estimate_drift_rad_per_min": drift(log["time"], estimate_angle),
        "plan_deviation_m": spread(plan_distance),
        "plan_deviation_rad": spread(plan_angle),
        "image_deviation_px": spread(pixels),
        "image_deviation_px_1600x1200": spread(pixels * THESIS_WIDTH / servo.pinhole.width),
        "camera_deviation_m": spread(metres),
        "tension_n": {"min": lowest, "max": highest},
        "calibration": _calibration(log),
        "broken_cables": _broken_cables(result),
        "slack_cable_seconds": float(np.sum(log["slack"][:-1] * np.diff(log["time"])[:, None])),
        "taut_cables": {"min": int(np.min(taut)), "end": int(taut[-1])},
        "underactuated_s": float(np.sum(np.diff(log["time"]) * (taut[:-1] < freedom))),
        "least_stability_margin": None if along is None else along.least_margin(),
        "least_jacobian_rank": None if along is None else int(np.min(along.rank)),
        "unstable_s": None if along is None else along.unstable_time(),
        "torque_control": _torque_control(result),
        "simulated": simulated_model(servo.robot, scenario.cables, scenario.damping),
        "world": world_summary(scenario, log),
        "surplus_over_chord_m": spread(log["surplus_lengths"].ravel()),
        "engine": engine_of(scenario),
        "loop": result.loop,
        "integration_step_s": servo.max_step,
        "step_error": _step_errors(result),
        "remarks": servo_limit_warnings(scenario, servo.robot),
        "versions": package_versions(),
    }
    if (gain := _tension_gain(result)) is not None:
        summary["tension_gain"] = gain
    if APPLIED_WRENCH in log:
        summary["disturbances"] = disturbance_summary(log)
    if scenario.failures is not None:
        summary["failures"] = failure_summary(scenario.failures, servo.robot, log)
    estimation = scenario.wrench_estimation
    if isinstance(servo, VisualServo) and servo.wrench is not None and estimation is not None:
        summary["wrench_estimation"] = wrench_summary(log, estimation.kind, servo.wrench.delay)
    if LEARNT in log:
        summary["adaptation"] = adaptation_summary(log, servo.robot, servo.believed)
    if scenario.camera.pan_tilt is not None:
        turned = pan_tilt_summary(log, scenario.camera.pan_tilt, servo.pinhole)
        summary["pan_tilt"] = turned
    if isinstance(servo, VisualServo) and servo.remote is not None:
        summary["remote"] = servo.remote.report()
    cleaned: dict[str, Any] = finite(summary)
    return cleaned


def _tension_gain(result: RunResult) -> dict[str, Any] | None:
    """The gain of a correction of tensions that states none: per length, and at the start."""
    servo, scenario = result.servo, result.servo.scenario
    wanted = scenario.tension_management
    if wanted is None:
        return None
    robot = servo.robot
    found = used_gain(scenario, wanted, robot, servo.believed, scenario.cables.cable_set(robot))
    if found is None:
        return None
    at_start = found.each(result.log["lengths"][0])
    return {"per_length_1_per_ns": found.share.tolist(), "at_start_m_per_ns": at_start.tolist()}


def disturbance_summary(log: Log) -> dict[str, float]:
    """What pushed the platform most, of the log's rows, and when."""
    wrenches = log[APPLIED_WRENCH]
    found = {}
    for name, part in (("force_n", wrenches[:, 3:]), ("moment_nm", wrenches[:, :3])):
        sizes = np.linalg.norm(part, axis=1)
        k = int(np.argmax(sizes))
        found[f"largest_{name}"] = float(sizes[k])
        found[f"largest_{name.split('_')[0]}_at_s"] = float(log["time"][k])
    return found


def failure_summary(settings: FailureSettings, robot: Robot, log: Log) -> dict[str, Any]:
    """What failed, and how far the platform went and the tensions since the first of it.

    Args:
        settings: What fails.
        robot: The robot.
        log: The run's log.
    """
    end = float(log["time"][-1])
    events = [
        {"kind": event.kind, "what": event.words(robot), "time_s": event.begins}
        for event in settings.events
        if event.begins <= end
    ]
    found: dict[str, Any] = {"events": events}
    if not events:
        return found
    # A row holds what stood there before its instant: that of the first failure is the last whole.
    since = log["time"] >= min(event.begins for event in settings.events)
    X_WP, tensions = log["X_WP"][since], log["tensions"][since]
    distance, angle = pose_rows_distance(X_WP, np.broadcast_to(X_WP[0], X_WP.shape))
    if "left_out" in log:
        acts = np.any(log["left_out"] > 0.0, axis=1)
        found["reacts_at_s"] = float(log["time"][np.argmax(acts)]) if np.any(acts) else None
    found |= {
        "largest_excursion_m": float(np.max(distance)),
        "largest_turn_rad": float(np.max(angle)),
        "largest_tension_n": float(np.max(tensions)),
    }
    return found


def _calibration(log: Log) -> dict[str, Any] | None:
    """What a fusion of sensors found of its cameras in the end; None without one."""
    if "fusion_calibration" not in log:
        return None
    return found_calibrations(log["fusion_calibration"][-1])


def _distance_between(log: Log, one: str, other: str) -> tuple[Array, Array]:
    """Distance [m] and angle [rad] between two logged poses, shape (n,); empty where one is not."""
    shared = one in log and other in log
    rows = min(log_rows(log, one), log_rows(log, other)) if shared else 0
    distance, angle = np.empty(rows), np.empty(rows)
    for start in range(0, rows, ROWS_AT_ONCE):
        part = slice(start, min(start + ROWS_AT_ONCE, rows))
        poses = [log_block(log, name, part.start, part.stop) for name in (one, other)]
        distance[part], angle[part] = pose_rows_distance(*poses)
    return distance, angle


def drift(times: Array, errors: Array) -> float | None:
    """How fast an estimate gets worse: the slope of its error over time, per minute.

    A straight line fitted by least squares to the second half of the run, in which what the start
    was wrong by has settled. Near 0 for an estimate that keeps its error, whatever that is.

    Args:
        times: Shape (n,) [s].
        errors: Distances [m] or angles [rad], not negative, shape (n,).

    Returns:
        Per minute [m/min] or [rad/min]; None where the second half has fewer than three rows.
    """
    later = times >= 0.5 * (times[0] + times[-1])
    t, e = times[later] - np.mean(times[later]), errors[later]
    if len(t) < 3:
        return None
    return float(60.0 * (t @ e) / (t @ t))


def _images(result: RunResult) -> dict[str, int] | None:
    """Images of a region of interest, and how many had to be drawn whole; None of other cameras."""
    if result.images is None:
        return None
    return dict(zip(("taken", "whole"), result.images, strict=True))


def _torque_control(result: RunResult) -> dict[str, Any] | None:
    """What a servo by torque did at every step of its control; None for others."""
    report, scenario = result.torque, result.servo.scenario
    if report is None:
        return None
    settings, excess = scenario.torque_control or TorqueControl(), report.excess()
    seen = report.extremes
    return {
        "steps": report.steps,
        "relaxed_share": report.relaxed_steps / max(report.steps, 1),
        "taut_after_s": seen.taut_since,
        "tension_limits_n": list(report.limits),
        "within_limits": excess == 0.0,
        "largest_excess_n": excess,
        "lowest_tension_n": float(np.min(seen.lowest)),
        "highest_tension_n": float(np.max(seen.highest)),
        "largest_rate_n_per_s": report.largest_rate,
        "rate_limit_n_per_s": settings.tension_rate,
        "rates_within_limit": report.largest_rate <= settings.tension_rate * (1.0 + ROUNDING),
    }


ROUNDING = 1e-9
"""Share of a limit that a rate of wanted tensions may be beyond it: differences of sums."""


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
