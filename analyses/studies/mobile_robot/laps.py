"""One run of the study: a scenario for some laps, and what is kept of each."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome

SCENARIO = "acrobot_mobile_robot"

PHASES = 40
"""Moments of a lap of which sums of lengths are kept."""

LOG_RATE = 5.0
"""Rows of the log per second [Hz]."""

SLACK = 0.24
"""Tension at which a cable counts as slack [N]: the accuracy of the sensors, thesis table A.6."""

REFERENCE = 10
"""The lap with which paths are compared, as in the thesis."""

SHOWN = (1, 10, 20)
"""Laps of which the path is kept, and the last whole one."""

FREE = 2
"""Cables of eight that may be slack while six hold the platform."""

TENSION_LAPS = (1, 2, 10, 20, 30)
"""Laps of which tensions are kept, and the last whole one."""

THRESHOLD = 1.0
"""Tension below which the scenario corrects [N], 5.3.1."""

BEFORE = 1.0
"""Time before the worst estimate of a lap in which slack cables are counted [s]."""


def measure(case: Case, seed: int) -> dict[str, Any]:
    """The scenario with changes, for some laps, see `row_of`.

    Args:
        case: Its keys have asked_laps, after which it ends, and friction of the winches over that
            of the robot's file.
        seed: Its seed.
    """
    laps, friction = case.keys["asked_laps"], case.keys["friction"]
    with tempfile.TemporaryDirectory() as folder:
        changes = [*case.changes, f"seed={seed}"]
        if friction != 1.0:
            changes.append(f"robot={with_friction(Path(folder), friction)}")
        scenario = load_scenario(SCENARIO, changes)
        assert scenario.target.motion is not None
        assert scenario.target.motion.mobile_robot is not None
        lap_time = scenario.target.motion.mobile_robot.lap_time
        scenario.duration, scenario.log_rate = laps * lap_time, LOG_RATE
        result = run_scenario(choose_compiled_loop(scenario))
    return row_of(result, laps, lap_time)


def with_friction(folder: Path, factor: float) -> Path:
    """A file of the scenario's robot with other friction of its winches."""
    robot: Robot = load_robot("acrobot_large")
    friction = robot.winch.friction
    assert friction is not None
    for name in ("coulomb", "static", "viscous"):
        setattr(friction, name, factor * getattr(friction, name))
    file = folder / "acrobot_large.yaml"
    file.write_text(yaml_dump_typed(robot), encoding="utf-8")
    return file


def row_of(result: RunResult, laps: int, lap_time: float) -> dict[str, Any]:
    """What is kept of a run, for so many laps of a time [s]; what did not happen is NaN.

    Returns:
        outcome; failed: whether it ended before its laps were done; laps_done: until it ended;
        underactuated_at_end_s: for how long more than two cables had been slack then. Of each lap,
        shape (laps,): most_slack: the most cables slack at once; estimate_m, estimate_rad: largest
        error of the pose estimate; estimate_z_m: how far it is too high at the end; seen: share of
        images with the tag; tension_n: largest tension; path_m: largest distance from the path of
        lap `REFERENCE`; one_slack, two_slack: share of the lap with a slack cable, and with two or
        more; underactuated_s: longest time with more than two; at_threshold: mean number of cables
        within `SLACK` of `THRESHOLD`; estimate_at: where in the lap the estimate is worst, from 0
        to 1; slack_at_estimate: the most cables slack at once in the time `BEFORE` that; path_at:
        where the path is farthest away, from 0 to 1. sums_m: of the unstrained lengths at moments
        of each lap, shape (laps, `PHASES`); paths_m: positions of the platform at these moments of
        the laps `SHOWN` and the last whole one, shape (4, `PHASES`, 3); tensions_n: at these
        moments of the laps `TENSION_LAPS` and the last whole one, shape (6, `PHASES`, m).
    """
    log = result.log
    times, poses, estimates = log["time"], log["X_WP"], log["X_WP_estimated"]
    sums, tensions = np.sum(log["unstrained_lengths"], axis=1), log["tensions"]
    distance, angle = pose_rows_distance(poses, estimates)
    positions, high = poses[:, 4:], estimates[:, 6] - poses[:, 6]
    seen, slack = log["found"][:, 0], np.sum(tensions < SLACK, axis=1)
    under = times_beyond(times, slack > FREE)
    near = np.sum(np.abs(tensions - THRESHOLD) < SLACK, axis=1)
    phases = (np.arange(PHASES) + 0.5) / PHASES * lap_time
    number = np.floor(times / lap_time + 1e-9).astype(int)

    def at_phases(lap: int, values: Array) -> Array:
        """Values at moments of a lap, from 0, NaN beyond the end; shape (PHASES, ...)."""
        when = lap * lap_time + phases
        columns = values.reshape(len(values), -1).T
        found = np.array([np.interp(when, times, c, right=np.nan) for c in columns])
        return found.T.reshape(PHASES, *values.shape[1:])

    rows_of_laps: list[dict[str, float]] = []
    lengths = np.full((laps, PHASES), np.nan)
    reference = at_phases(REFERENCE - 1, positions)
    for lap in range(min(laps, int(number[-1]) + 1)):
        rows = np.flatnonzero(number == lap)
        lengths[lap] = at_phases(lap, sums)
        away = np.linalg.norm(at_phases(lap, positions) - reference, axis=1)
        worst = rows[np.argmax(distance[rows])]
        before = (times > times[worst] - BEFORE) & (times <= times[worst])
        whole = np.all(np.isfinite(away))
        rows_of_laps.append({
            "most_slack": np.max(slack[rows]), "estimate_m": np.max(distance[rows]),
            "estimate_rad": np.max(angle[rows]), "estimate_z_m": high[rows][-1],
            "seen": np.mean(seen[rows]), "tension_n": np.max(tensions[rows]),
            "path_m": np.max(away) if whole else np.nan,
            "one_slack": np.mean(slack[rows] >= 1), "two_slack": np.mean(slack[rows] >= 2),
            "underactuated_s": np.max(under[rows]), "at_threshold": np.mean(near[rows]),
            "estimate_at": times[worst] / lap_time - lap,
            "slack_at_estimate": np.max(slack[before]),
            "path_at": phases[np.argmax(away)] / lap_time if whole else np.nan,
        })  # fmt: skip
    done = result.sim_time / lap_time
    last = max(int(done + 1e-9), 1)
    never = [np.nan] * (laps - len(rows_of_laps))
    return {
        "outcome": Outcome(result.outcome).name.lower(),
        "failed": bool(result.outcome != Outcome.TIMEOUT),
        "laps_done": done,
        "underactuated_at_end_s": under[-1],
        **{
            name: np.array([*(row[name] for row in rows_of_laps), *never], float)
            for name in rows_of_laps[0]
        },
        "sums_m": lengths,
        "paths_m": np.array([at_phases(lap - 1, positions) for lap in (*SHOWN, last)]),
        "tensions_n": np.array([at_phases(lap - 1, tensions) for lap in (*TENSION_LAPS, last)]),
    }


def times_beyond(times: Array, beyond: np.ndarray) -> Array:
    """For how long something has been so without a break, at each time, shape (n,) [s].

    Args:
        times: Times of rows, shape (n,) [s].
        beyond: Whether it is so in each, shape (n,).
    """
    last = np.maximum.accumulate(np.where(beyond, -1, np.arange(len(times))))
    since = np.where(last >= 0, times[np.maximum(last, 0)], times[0])
    return np.where(beyond, times - since, 0.0)
