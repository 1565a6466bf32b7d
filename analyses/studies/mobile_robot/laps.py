"""One run of the study: a scenario for some laps, and what is kept of each."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.seeded_study import over_seeds
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

COLUMNS = (
    "most_slack", "estimate_m", "estimate_rad", "estimate_z_m", "seen", "tension_n", "path_m",
    "one_slack", "two_slack", "underactuated_s", "at_threshold", "estimate_at", "slack_at_estimate",
    "path_at",
)  # fmt: skip
"""What is kept of each lap: the most cables slack at once; largest error of the pose estimate,
position [m] and rotation [rad], and how far it is too high at the end [m]; share of images with the
tag; largest tension [N]; largest distance from the path of lap `REFERENCE` [m]; share of the lap
with a slack cable, and with two or more; longest time with more than two [s]; mean number of cables
within `SLACK` of `THRESHOLD`; where in the lap the estimate is worst, from 0 to 1, and the most
cables slack at once in the time `BEFORE` that; where the path is farthest away, from 0 to 1."""


@dataclass(frozen=True)
class LapsTask:
    """The scenario with changes, for some laps; the item is the seed.

    Attributes:
        changes: Items "key=value" of the scenario.
        laps: After which it ends.
        friction: Of the winches, over that of the robot's file.
    """

    changes: tuple[str, ...]
    laps: int
    friction: float = 1.0

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Arrays of `run_laps`, stacked."""
        return over_seeds(partial(run_laps, self), start, stop)


def run_laps(task: LapsTask, seed: int) -> dict[str, Array]:
    """A run of a task.

    Returns:
        end: outcome, and laps until it ended, shape (2,); laps: `COLUMNS` of each lap, shape
        (laps, 14); sums: of the unstrained lengths at moments of each lap, shape (laps, `PHASES`)
        [m]; paths: positions of the platform at these moments of the laps `SHOWN` and the last
        whole one, shape (4, `PHASES`, 3) [m]; tensions: at these moments of the laps
        `TENSION_LAPS` and the last whole one, shape (6, `PHASES`, m) [N]; underactuated_at_end:
        for how long more than two cables had been slack when it ended, shape (1,) [s]. What did
        not happen is NaN.
    """
    with tempfile.TemporaryDirectory() as folder:
        changes = [*task.changes, f"seed={seed}"]
        if task.friction != 1.0:
            changes.append(f"robot={_with_friction(Path(folder), task.friction)}")
        scenario = load_scenario(SCENARIO, changes)
        assert scenario.target.motion is not None
        assert scenario.target.motion.mobile_robot is not None
        lap_time = scenario.target.motion.mobile_robot.lap_time
        scenario.duration, scenario.log_rate = task.laps * lap_time, LOG_RATE
        result = run_scenario(choose_compiled_loop(scenario))
    return laps_of(result, task.laps, lap_time)


def _with_friction(folder: Path, factor: float) -> Path:
    """A file of the scenario's robot with other friction of its winches."""
    robot: Robot = load_robot("acrobot_large")
    friction = robot.winch.friction
    assert friction is not None
    for name in ("coulomb", "static", "viscous"):
        setattr(friction, name, factor * getattr(friction, name))
    file = folder / "acrobot_large.yaml"
    file.write_text(yaml_dump_typed(robot), encoding="utf-8")
    return file


def laps_of(result: RunResult, laps: int, lap_time: float) -> dict[str, Array]:
    """What `run_laps` keeps of a run, for so many laps of a time [s]."""
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

    table = np.full((laps, len(COLUMNS)), np.nan)
    lengths = np.full((laps, PHASES), np.nan)
    reference = at_phases(REFERENCE - 1, positions)
    for lap in range(min(laps, int(number[-1]) + 1)):
        rows = np.flatnonzero(number == lap)
        lengths[lap] = at_phases(lap, sums)
        away = np.linalg.norm(at_phases(lap, positions) - reference, axis=1)
        worst = rows[np.argmax(distance[rows])]
        before = (times > times[worst] - BEFORE) & (times <= times[worst])
        table[lap] = [
            np.max(slack[rows]), np.max(distance[rows]), np.max(angle[rows]), high[rows][-1],
            np.mean(seen[rows]), np.max(tensions[rows]),
            np.max(away) if np.all(np.isfinite(away)) else np.nan,
            np.mean(slack[rows] >= 1), np.mean(slack[rows] >= 2), np.max(under[rows]),
            np.mean(near[rows]), times[worst] / lap_time - lap, np.max(slack[before]),
            phases[np.argmax(away)] / lap_time if np.all(np.isfinite(away)) else np.nan,
        ]  # fmt: skip
    done = result.sim_time / lap_time
    last = max(int(done + 1e-9), 1)
    paths = [at_phases(lap - 1, positions) for lap in (*SHOWN, last)]
    return {
        "tensions": np.array([at_phases(lap - 1, tensions) for lap in (*TENSION_LAPS, last)]),
        "underactuated_at_end": under[-1:],
        "end": np.array([float(result.outcome), done]),
        "laps": table,
        "sums": lengths,
        "paths": np.array(paths),
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


def failed(ends: Array) -> np.ndarray:
    """Which runs ended before their laps were done, from their "end", shape (n, 2)."""
    return np.asarray(ends[:, 0] != float(Outcome.TIMEOUT))
