"""A simulated robot driven with the lengths of a log, beside what the machine did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.logs.log_replay import LogReplay
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule


@dataclass(frozen=True, eq=False)
class FollowedLog:
    """What the simulated robot did.

    Attributes:
        time: Shape (q,) [s].
        rows: Rows of the log, shape (q,).
        poses: X_WP, shape (q, 7).
        tensions: Shape (q, m) [N].
        distances: To what was measured, shape (q,) [m].
        tension_errors: Simulated minus measured, NaN where not measured, shape (q, m) [N].
    """

    time: Array
    rows: np.ndarray
    poses: Array
    tensions: Array
    distances: Array
    tension_errors: Array

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        apart = self.distances[np.isfinite(self.distances)]
        off = self.tension_errors[np.isfinite(self.tension_errors)]
        found: dict[str, Any] = finite(
            {
                "rows": len(self.time),
                "position_error_rms_m": float(np.sqrt(np.mean(apart**2))) if len(apart) else None,
                "position_error_largest_m": float(np.max(apart)) if len(apart) else None,
                "tension_error_rms_n": float(np.sqrt(np.mean(off**2))) if len(off) else None,
            }
        )
        return found


def follow_log(replay: LogReplay) -> FollowedLog:
    """Drives the simulated robot with the log's cable lengths, as winches that follow at once.

    It starts at rest at the first measured pose, else at the model's for the first lengths; from
    there on its cables change as those of the log do, so that offsets of lengths do not matter.

    Raises:
        LogFileError: The log has no times, or fewer than two rows with all lengths.
        CdprError: Nothing holds the robot at its first pose.
    """
    robot, lengths = replay.robot, replay.lengths
    rows = np.flatnonzero(np.isfinite(lengths).all(axis=1))
    if replay.log.time is None or len(rows) < 2:
        raise LogFileError(
            f"{replay.log.path}: found {len(rows)} rows with all lengths, and "
            f"{'no times' if replay.log.time is None else 'times'}; accepted: at least two, with "
            "times"
        )
    at = np.where(np.isfinite(replay.poses[:, 4:5]), replay.poses, replay.poses_by_lengths)
    known = rows[np.isfinite(at[rows]).all(axis=1)]
    if not len(known):
        raise LogFileError(f"{replay.log.path}: found no pose to start at; accepted: at least one")
    rows = rows[rows >= known[0]]
    time = replay.time[rows] - replay.time[rows[0]]
    block = CompiledCableRobot(robot, rule=StepRule(), command_period=HELD)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    start = pose_from_row(at[rows[0]])
    if not robot.motion_type().is_free:
        start = robot.joint().nearest(start)
    block.set_at_equilibrium(context, start)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(lengths.shape[1]))
    poses, tensions = np.empty((len(rows), 7)), np.empty((len(rows), lengths.shape[1]))
    for k in range(len(rows)):
        simulator.AdvanceTo(time[k])
        poses[k] = pose_row(block.GetOutputPort("X_WP").Eval(context))
        tensions[k] = block.GetOutputPort("tensions").Eval(context)
        if k + 1 < len(rows):
            rate = (lengths[rows[k + 1]] - lengths[rows[k]]) / (time[k + 1] - time[k])
            block.GetInputPort("cable_velocities").FixValue(context, rate)
    return FollowedLog(
        replay.time[rows], rows, poses, tensions,
        np.linalg.norm(poses[:, 4:] - replay.poses[rows, 4:], axis=1),
        tensions - replay.tensions[rows],
    )  # fmt: skip
