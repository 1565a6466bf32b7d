"""Why a run did not end as expected: limits that it missed, slack cables, keys to change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.analyses.runs.log import Log
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader

if TYPE_CHECKING:
    from cdpr_drake.analyses.runs.servo import ServoRun
    from cdpr_drake.analyses.runs.tension import TensionRun

ARRIVED = (Outcome.CONVERGED, Outcome.COMPLETED)
BY_OTHERS = (Outcome.INTERRUPTED, Outcome.CLIENT_ENDED, Outcome.RUNNING, Outcome.FAILED)
"""Outcomes that need no further words."""

LAST = 2.0
"""Time at the end over which measured errors are looked at [s]."""

FALLING = 0.97
"""Measured errors that fall below this share within `LAST` are still becoming smaller [-]."""


def unexpected_end(
    scenario: ScenarioHeader, outcome: Outcome, errors: tuple[float, float]
) -> list[str]:
    """What is not as the scenario expects; a scenario without expectations expects to arrive.

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
    words = []
    if outcome.name.lower() != expected.outcome:
        words.append(f"ended by {outcome.name.lower()}, expected {expected.outcome}")
    elif expected.position is not None and errors[0] > expected.position:
        words.append(
            f"true distance at the end {1e3 * errors[0]:.3g} mm, expected.position allows "
            f"{1e3 * expected.position:g} mm"
        )
    elif expected.rotation_deg is not None and np.degrees(errors[1]) > expected.rotation_deg:
        words.append(
            f"true angle at the end {np.degrees(errors[1]):.3g} deg, expected.rotation_deg allows "
            f"{expected.rotation_deg:g} deg"
        )
    return words


def servo_message(run: ServoRun) -> str:
    """Why a visual servo did not end as expected, and what to change; empty if it did."""
    scenario, log = run.scenario, run.log
    parts = unexpected_end(scenario, run.outcome, run.end_error())
    if not parts:
        return ""
    keys: list[str] = []
    if run.outcome == Outcome.TIMEOUT:
        parts += _missed_limits(run, keys)
    elif run.outcome == Outcome.TARGET_LOST:
        parts.append(
            f"the target was not found for stop.target_lost = {scenario.stop.target_lost:g} s"
        )
        keys += ["initial_pose", "target.pose", "desired", "lower controller.lambda_0"]
    elif run.outcome == Outcome.DIVERGED:
        parts.append("the platform left the surroundings of its frame")
        keys += ["lower controller.lambda_0", "integration.max_step"]
    slack = slack_words(log, run.robot)
    if slack:
        parts.append(slack)
        managed = scenario.tension_management
        keys += ["initial_pose (a start with all cables taut: cdpr new scenario --robot)"]
        keys += ["tension_management" + ("" if managed is None else ".threshold (higher)")]
    words = "; ".join(parts)
    return f"{words}; to change: {', '.join(keys)}" if keys else words


def _missed_limits(run: ServoRun, keys: list[str]) -> list[str]:
    """Limits of section `stop` that measured errors missed in the last seconds."""
    scenario, log = run.scenario, run.log
    times, stop = log["time"], scenario.stop
    rows = np.flatnonzero((log["found"][:, 0] > 0.0) & (times >= times[-1] - LAST))
    over = f"duration = {scenario.duration:g} s was over"
    if scenario.open_loop is not None or "X_WP_goal" in log:  # by a plan
        keys.append("duration")
        return [over]
    if not len(rows):
        keys += ["initial_pose", "target.pose", "desired"]
        return [f"{over}, and the target was not found in the last {LAST:g} s"]
    goal, free = run.built.X_CdO, run.built.free_rotation
    measured = map(pose_from_row, log["X_CO_measured"][rows])
    errors = np.array([seen_pose_error(X_CO, goal, free) for X_CO in measured])
    largest = np.max(errors, axis=0)
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
    half = len(errors) // 2
    falls = []
    if half:
        means = np.mean(errors[:half], axis=0), np.mean(errors[half:], axis=0)
        falls = [k for k in missed if means[1][k] < FALLING * means[0][k]]
    if falls:
        keys.append("duration (longer)")
    if len(falls) < len(missed):
        keys += [f"{names[k]} (larger)" for k in missed if k not in falls]
        keys += ["target.size (larger)", "controller.lambda_0 (lower)"]
    return [over, *(words[k] for k in missed)]


def slack_words(log: Log, robot: Robot) -> str:
    """Which cables were slack, and how long; empty if none was.

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


def tension_message(run: TensionRun) -> str:
    """Why a run of dynamic control did not end as expected; empty if it did."""
    parts = unexpected_end(run.scenario, run.outcome, run.end_error())
    if not parts:
        return ""
    keys = ["trajectory (nearer poses, longer stretches)"]
    infeasible = int(run.log["failures"][-1, 0])
    if infeasible:
        parts.append(f"at {infeasible} steps no tensions within the limits gave the wrench")
        keys.append("distribution.limits")
    return f"{'; '.join(parts)}; to change: {', '.join(keys)}"
