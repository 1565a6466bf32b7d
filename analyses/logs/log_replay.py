"""A recorded run beside a model of its robot: what the model has for lengths, poses and tensions.

Lengths are compared with those along the model's cables at the measured pose, shortened by their
stretch where tensions were measured; poses with those that the model has for the measured lengths;
tensions, where there are no more cables than degrees of freedom, with those that carry the weight,
else by the force and moment that they leave on the platform at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.logs.recorded_log import (
    ANGLES,
    LENGTH,
    POSITION,
    QUATERNION,
    TENSION,
    TIME,
    RecordedLog,
)
from cdpr_drake.analyses.reporting.exported_logs import Columns, write_columns
from cdpr_drake.analyses.reporting.log_files import finite, write_json
from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import unstrained_lengths
from cdpr_drake.errors import LogFileError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.summaries import Summarized

TOLERANCE = 1.0
"""Lengths that were measured may be off by so much, and still have a pose [m]."""

LEAST_ROWS = 3
"""With a pose and a length, to tell an offset from noise."""

TABLE, SUMMARY = "replay.csv", "summary.json"


@dataclass(frozen=True, eq=False, repr=False)
class LogReplay(Summarized):
    """A run beside its model; rows in which something was not measured have NaN there.

    Attributes:
        robot: The robot.
        log: The log.
        time: Shape (k,) [s], or numbers of rows where there are no times.
        poses: Measured X_WP, shape (k, 7), see `pose_row`.
        poses_by_lengths: The model's, for the measured lengths, shape (k, 7).
        lengths: Measured, shape (k, m) [m].
        predicted_lengths: The model's at the measured poses, shape (k, m) [m].
        tensions: Measured, shape (k, m) [N].
        predicted_tensions: Those that carry the weight, shape (k, m) [N]; NaN with more cables
            than degrees of freedom.
        unbalanced: What measured tensions and weight leave on the platform, along its degrees of
            freedom, (moment, force), shape (k, n) [N m, N].
        frame: X_WF of the tracker that was fitted; None: it was taken to be W.
    """

    robot: Robot
    log: RecordedLog
    time: Array
    poses: Array
    poses_by_lengths: Array
    lengths: Array
    predicted_lengths: Array
    tensions: Array
    predicted_tensions: Array
    unbalanced: Array
    frame: RigidTransform | None = None

    @cached_property
    def length_residuals(self) -> Array:
        """Measured minus predicted, shape (k, m) [m]."""
        return self.lengths - self.predicted_lengths

    @cached_property
    def distances(self) -> Array:
        """Between measured poses and those by lengths, shape (k,) [m]."""
        return np.asarray(np.linalg.norm(self.poses[:, 4:] - self.poses_by_lengths[:, 4:], axis=1))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        by_cable = {}
        for k, cable in enumerate(self.robot.cables):
            lengths, tensions = self.length_residuals[:, k], self.tensions - self.predicted_tensions
            by_cable[cable.name] = {
                "length_offset_m": _mean(lengths),
                "length_residual_rms_m": _rms(lengths - (_mean(lengths) or 0.0)),
                "length_residual_largest_m": _most(lengths),
                "tension_residual_rms_n": _rms(tensions[:, k]),
            }
        moments = self.robot.motion_type().num_turns
        size: Array = np.linalg.norm(self.unbalanced[:, moments:], axis=1)
        told: dict[str, Any] = finite(
            {
                "robot": self.robot.name,
                "log": str(self.log.path),
                "rows": self.log.row_report().as_dict(),
                "rows_with_pose": int(np.count_nonzero(np.isfinite(self.poses[:, 4]))),
                "rows_with_pose_by_lengths": int(
                    np.count_nonzero(np.isfinite(self.poses_by_lengths[:, 4]))
                ),
                "cables": by_cable,
                "position_by_lengths_rms_m": _rms(self.distances),
                "position_by_lengths_largest_m": _most(self.distances),
                "unbalanced_force_rms_n": _rms(size),
                "tracker_frame": None
                if self.frame is None
                else {
                    "position_m": self.frame.translation().tolist(),
                    "angles_deg": np.degrees(RollPitchYaw(self.frame.rotation()).vector()).tolist(),
                },
            }
        )
        return told

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself."""
        told = self.as_dict()
        rows = [("rows", self.log.row_report().words())]
        if self.frame is not None:
            rows.append(("tracker", "its frame was fitted to the positions by lengths"))
        for key, words, unit, factor in (
            ("position_by_lengths_rms_m", "position", "mm", 1e3),
            ("unbalanced_force_rms_n", "force left", "N", 1.0),
        ):
            if told[key] is not None:
                rows.append((words, f"{factor * told[key]:.4g} {unit} rms"))
        for name, found in told["cables"].items():
            parts = []
            if found["length_offset_m"] is not None:
                parts.append(f"length off by {1e3 * found['length_offset_m']:.2f} mm")
                parts.append(f"{1e3 * found['length_residual_rms_m']:.2f} mm rms about that")
            if found["tension_residual_rms_n"] is not None:
                parts.append(f"tension {found['tension_residual_rms_n']:.3g} N rms")
            rows.append((name, ", ".join(parts) or "nothing to compare"))
        return f"{self.log.path.name} beside {self.robot.name}", rows

    def write(self, folder: Path) -> dict[str, Any]:
        """Writes table and summary into a folder; returns the summary."""
        told = self.as_dict()
        columns: Columns = {TIME: self.time}
        for k, cable in enumerate(self.robot.cables):
            for name, values in (
                ("length_m", self.lengths),
                ("predicted_length_m", self.predicted_lengths),
                ("tension_n", self.tensions),
                ("predicted_tension_n", self.predicted_tensions),
            ):
                columns[f"{cable.name}_{name}"] = values[:, k]
        for prefix, rows in (("", self.poses), ("by_lengths_", self.poses_by_lengths)):
            for k, name in enumerate((*QUATERNION, *POSITION)):
                columns[f"{prefix}{name}"] = rows[:, k]
        write_columns(folder / TABLE, columns)
        write_json(folder / SUMMARY, told)
        return told

    def picture_log(self) -> dict[str, Array]:
        """What a replay page shows: measured poses, else those by lengths; tensions, else 0."""
        poses = np.where(np.isfinite(self.poses[:, 4:5]), self.poses, self.poses_by_lengths)
        rows = np.flatnonzero(np.isfinite(poses).all(axis=1))
        tensions = np.nan_to_num(self.tensions[rows])
        model = np.where(
            np.isfinite(self.poses_by_lengths[rows]), self.poses_by_lengths[rows], poses[rows]
        )
        return {
            "time": self.time[rows], "X_WP": poses[rows], "tensions": tensions,
            "X_WP_by_lengths": model,
        }  # fmt: skip


def replay_log(robot: Robot, log: RecordedLog, fit_frame: bool = False) -> LogReplay:
    """Puts a model's lengths, poses and tensions beside those of a log.

    Args:
        robot: The robot, whose cables the log names.
        log: The log.
        fit_frame: Whether the tracker's frame is the one in which its positions are nearest to
            those by lengths; else it is W.

    Raises:
        LogFileError: The log has neither poses with lengths or tensions, nor lengths that
            determine a pose.
    """
    m, k = len(robot.cables), log.count
    time = np.arange(1.0, k + 1.0) if log.time is None else log.time
    lengths, tensions = _of_cables(robot, log, LENGTH), _of_cables(robot, log, TENSION)
    poses = _measured_poses(robot, log)
    by_lengths = _poses_by_lengths(robot, lengths)
    has_pose, has_model = np.isfinite(poses[:, 4]), np.isfinite(by_lengths[:, 4])
    if not has_pose.any() and not has_model.any():
        raise LogFileError(
            f"{log.path}: found {', '.join(list(log.columns)[:6])}; accepted for {robot.name}: "
            "poses, or lengths of as many cables as degrees of freedom, as "
            f"{robot.cables[0].name}_{LENGTH}"
        )
    frame = None
    if fit_frame:
        frame = _fitted_frame(log, poses, by_lengths, has_pose & has_model)
        for row in np.flatnonzero(has_pose):
            moved = pose_row(frame @ pose_from_row(poses[row]))
            poses[row, 4:] = moved[4:]
            if not robot.motion_type().is_point:
                poses[row, :4] = moved[:4]
    motion, cables = robot.motion_type(), robot.cable_set()
    predicted, held = np.full((k, m), np.nan), np.full((k, m), np.nan)
    unbalanced = np.full((k, motion.freedom), np.nan)
    com, gravity = robot.center_of_mass(), robot.gravity_vector()
    at = np.where(has_pose[:, None], poses, by_lengths)
    for row in np.flatnonzero(has_pose | has_model):
        X = pose_from_row(at[row])
        paths = cable_paths(X, cables)
        if has_pose[row]:
            t = tensions[row]
            predicted[row] = np.where(
                np.isfinite(t),
                unstrained_lengths(paths.lengths, np.nan_to_num(t), cables.stiffness),
                paths.lengths,
            )
        R = X.rotation().matrix()
        W = -motion.columns(paths.J, R).T
        weight = motion.components(gravity_wrench(X, robot.platform.mass, com, gravity), R)
        if np.isfinite(tensions[row]).all():
            unbalanced[row] = W @ tensions[row] + weight
            if m <= motion.freedom:
                held[row] = np.linalg.lstsq(W, -weight, rcond=None)[0]
    return LogReplay(
        robot, log, time, poses, by_lengths, lengths, predicted, tensions, held, unbalanced, frame
    )


def _of_cables(robot: Robot, log: RecordedLog, what: str) -> Array:
    """A column of each cable, NaN where the log has none, shape (k, m)."""
    nothing = np.full(log.count, np.nan)
    return np.column_stack([log.columns.get(f"{c.name}_{what}", nothing) for c in robot.cables])


def _measured_poses(robot: Robot, log: RecordedLog) -> Array:
    """Shape (k, 7); what a point mass does not turn is as at home."""
    poses = np.full((log.count, 7), np.nan)
    points = np.full((log.count, 3), np.nan)
    for j, header in enumerate(POSITION):
        if header in log.columns:
            points[:, j] = log.columns[header]
    whole = all(header in log.columns for header in QUATERNION)
    angles = all(header in log.columns for header in ANGLES)
    point = robot.motion_type().is_point
    home = pose_row(robot.home.transform())[:4]
    for row in np.flatnonzero(np.isfinite(points).all(axis=1)):
        if point:
            turn = home
        elif whole:
            turn = np.array([log.columns[header][row] for header in QUATERNION])
        elif angles:
            rpy = np.array([log.columns[header][row] for header in ANGLES])
            turn = RotationMatrix(RollPitchYaw(rpy)).ToQuaternion().wxyz()
        else:
            break
        if np.isfinite(turn).all():
            poses[row, :4], poses[row, 4:] = turn, points[row]
    return poses


def _poses_by_lengths(robot: Robot, lengths: Array) -> Array:
    """Each from the one before, the first from home, shape (k, 7); NaN where none is found."""
    k, m = lengths.shape
    found = np.full((k, 7), np.nan)
    if m < robot.motion_type().freedom:
        return found
    solver = ForwardKinematics(robot.cable_set(), robot.motion_type())
    guess = pose_row(robot.home.transform())
    for row in np.flatnonzero(np.isfinite(lengths).all(axis=1) & np.all(lengths > 0.0, axis=1)):
        fit = solver.poses(lengths[row : row + 1], guess[None], tolerance=TOLERANCE, threads=1)
        if np.isfinite(fit.poses[0]).all():
            found[row] = guess = fit.poses[0]
    return found


def _fitted_frame(
    log: RecordedLog, poses: Array, by_lengths: Array, rows: np.ndarray
) -> RigidTransform:
    """X_WF in which measured positions are nearest to those by lengths (Kabsch 1976)."""
    if np.count_nonzero(rows) < LEAST_ROWS:
        raise LogFileError(
            f"{log.path}: found {np.count_nonzero(rows)} rows with a pose and lengths; accepted: "
            f"at least {LEAST_ROWS}, to fit the tracker's frame"
        )
    p_F, p_W = poses[rows, 4:], by_lengths[rows, 4:]
    middle_F, middle_W = p_F.mean(axis=0), p_W.mean(axis=0)
    U, s, Vt = np.linalg.svd((p_F - middle_F).T @ (p_W - middle_W))
    if s[1] < 1e-6 * s[0]:
        raise LogFileError(f"{log.path}: found positions along a line; accepted: some off a line")
    V = Vt.T
    R = V @ np.diag([1.0, 1.0, np.sign(np.linalg.det(V @ U.T))]) @ U.T
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), middle_W - R @ middle_F)


def _mean(values: Array) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.mean(kept)) if len(kept) else None


def _rms(values: Array) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else None


def _most(values: Array) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.max(np.abs(kept))) if len(kept) else None
