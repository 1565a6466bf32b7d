"""Why a run did not end as expected: limits that it missed, slack cables, keys to change."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

ARRIVED = (Outcome.CONVERGED, Outcome.COMPLETED)
BY_OTHERS = (Outcome.INTERRUPTED, Outcome.CLIENT_ENDED, Outcome.RUNNING, Outcome.FAILED)
"""Outcomes that say themselves why."""

LAST = 2.0
"""Time at the end over which measured errors are told [s]."""

FALLING = 0.97
"""Measured errors that fall below this share within `LAST` are still becoming smaller [-]."""


def unexpected_end(
    scenario: ScenarioHeader, outcome: Outcome, errors: tuple[float, float]
) -> list[str]:
    """What is not as the scenario expects; nothing expected means that the run arrives.

    Args:
        scenario: The scenario.
        outcome: How its run ended.
        errors: True distance [m] and angle [rad] at the end.
    """
    expected = scenario.expected
    if outcome in BY_OTHERS:
        return []
    if expected is None:
        return [] if outcome in ARRIVED else [f"ended by {outcome.name.lower()}"]
    found = []
    if outcome.name.lower() != expected.outcome:
        found.append(f"ended by {outcome.name.lower()}, expected {expected.outcome}")
    elif expected.position is not None and errors[0] > expected.position:
        found.append(
            f"true distance at the end {1e3 * errors[0]:.3g} mm, expected.position allows "
            f"{1e3 * expected.position:g} mm"
        )
    elif expected.rotation_deg is not None and np.degrees(errors[1]) > expected.rotation_deg:
        found.append(
            f"true angle at the end {np.degrees(errors[1]):.3g} deg, expected.rotation_deg allows "
            f"{expected.rotation_deg:g} deg"
        )
    return found


def servo_message(
    servo: ServoModel, scenario: Scenario, log: Log, outcome: Outcome, errors: tuple[float, float]
) -> str:
    """Why a visual servo did not end as expected, and what to change; empty where it did.

    Args:
        servo: What was run.
        scenario: Its scenario.
        log: Its log.
        outcome: How it ended.
        errors: True distance [m] and angle [rad] at the end.
    """
    parts = unexpected_end(scenario, outcome, errors)
    if not parts:
        return ""
    keys: list[str] = []
    if outcome == Outcome.TIMEOUT:
        parts += _missed_limits(servo, scenario, log, keys)
    elif outcome == Outcome.TARGET_LOST:
        parts.append(
            f"the target was not found for stop.target_lost = {scenario.stop.target_lost:g} s"
        )
        keys += ["initial_pose", "target.pose", "desired", "lower controller.lambda_0"]
    elif outcome == Outcome.DIVERGED:
        parts.append("the platform left the surroundings of its frame")
        keys += ["lower controller.lambda_0", "integration.max_step"]
    slack = slack_words(log, servo.robot)
    if slack:
        parts.append(slack)
        managed = scenario.tension_management
        keys += ["initial_pose (a start with all cables taut: cdpr new scenario --robot)"]
        keys += ["tension_management" + ("" if managed is None else ".threshold (higher)")]
    words = "; ".join(parts)
    return f"{words}; to change: {', '.join(keys)}" if keys else words


def _missed_limits(servo: ServoModel, scenario: Scenario, log: Log, keys: list[str]) -> list[str]:
    """Limits of section `stop` that measured errors missed in the last second."""
    times, stop = log["time"], scenario.stop
    rows = np.flatnonzero((log["found"][:, 0] > 0.0) & (times >= times[-1] - LAST))
    over = f"duration = {scenario.duration:g} s was over"
    if scenario.open_loop is not None or scenario.pose_plan is not None:
        keys.append("duration")
        return [over]
    if not len(rows):
        keys += ["initial_pose", "target.pose", "desired"]
        return [f"{over}, and the target was not found in the last {LAST:g} s"]
    found = np.array([_seen_error(servo, row) for row in log["X_CO_measured"][rows]])
    largest = np.max(found, axis=0)
    limits = np.array([stop.position, np.radians(stop.rotation_deg)])
    names = ("stop.position", "stop.rotation_deg")
    words = [
        f"measured distance up to {1e3 * largest[0]:.3g} mm in the last {LAST:g} s, stop.position "
        f"= {1e3 * stop.position:g} mm",
        f"measured angle up to {np.degrees(largest[1]):.3g} deg, stop.rotation_deg = "
        f"{stop.rotation_deg:g} deg",
    ]
    missed = [k for k in range(2) if largest[k] > limits[k]]
    if not missed:
        keys += ["duration", "stop.hold"]
        return [f"{over} before both limits had held for stop.hold = {stop.hold:g} s"]
    half = len(found) // 2
    falls = []
    if half:
        means = np.mean(found[:half], axis=0), np.mean(found[half:], axis=0)
        falls = [k for k in missed if means[1][k] < FALLING * means[0][k]]
    if falls:
        keys.append("duration (longer)")
    if len(falls) < len(missed):
        keys += [f"{names[k]} (larger)" for k in missed if k not in falls]
        keys += ["target.size (larger)", "controller.lambda_0 (lower)"]
    return [over, *(words[k] for k in missed)]


def _seen_error(servo: ServoModel, row: np.ndarray) -> tuple[float, float]:
    """Distance [m] and angle [rad] of a measured pose from the desired one."""
    return seen_pose_error(pose_from_row(row), servo.X_CdO, servo.free_rotation)


def slack_words(log: Log, robot: Robot) -> str:
    """Which cables were slack, and how long; empty where none was.

    Args:
        log: With `time`, shape (n,) [s], and `slack`, shape (n, m), above 0 where a cable is slack.
        robot: The robot, for the names of cables.
    """
    seconds = np.sum((log["slack"][:-1] > 0.0) * np.diff(log["time"])[:, np.newaxis], axis=0)
    order = [k for k in np.argsort(-seconds, kind="stable") if seconds[k] > 0.0]
    if not order:
        return ""
    named = ", ".join(f"{robot.cables[k].name} {seconds[k]:.1f} s" for k in order[:4])
    more = f" and {len(order) - 4} more" if len(order) > 4 else ""
    return f"cables were slack: {named}{more}"


def tension_control_message(
    scenario: Any, outcome: Outcome, errors: tuple[float, float], infeasible: int
) -> str:
    """Why a run of computed torque did not end as expected; empty where it did.

    Args:
        scenario: The scenario.
        outcome: How it ended.
        errors: True distance [m] and angle [rad] from the desired pose at the end.
        infeasible: Steps of control at which no tensions within the limits gave the wrench.
    """
    parts = unexpected_end(scenario, outcome, errors)
    if not parts:
        return ""
    keys = ["trajectory (nearer poses, longer stretches)"]
    if infeasible:
        parts.append(f"at {infeasible} steps no tensions within the limits gave the wrench")
        keys.append("distribution.limits")
    return f"{'; '.join(parts)}; to change: {', '.join(keys)}"
