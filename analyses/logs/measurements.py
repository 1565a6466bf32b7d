"""Logs bound to a robot: the one way from a log to lengths, poses, tensions for all commands."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.logs.assembly import LEFT_OUT, READ, refuse_other_lengths
from cdpr_drake.analyses.logs.columns import (
    CABLE_QUANTITIES,
    COMMANDED,
    ESTIMATED,
    MARKERS,
    PARTS,
    POSITION,
    QUATERNION,
    ROTATIONS,
    RPY,
    TAIT,
    TURN,
)
from cdpr_drake.analyses.logs.dialects import AUTO, read_log
from cdpr_drake.analyses.logs.log import Facts, Log, refusal
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.geometry.poses import rotation_from_angles, rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_schema import Robot

MOST_ROWS = 20_000
"""Rows that fits take; more are of a motion that was sampled fast, and tell no more."""

_NOT_FITTED = (COMMANDED.strip("_"), ESTIMATED.strip("_"), MARKERS)
"""Kinds of quantities that no fit reads."""

_SAID_OTHERWISE = "columns with words|left out, since|the unit of the forces"
"""Remarks of logs on columns that are not read; measurements have one remark on all of them."""

Columns: TypeAlias = Mapping[str, Array] | pd.DataFrame
"""Columns by name."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured of a robot, by rows.

    Attributes:
        path, count: The file, and its rows k.
        time: Shape (k,) [s]; None without times.
        lengths, angles, swivels, tensions, torques: Of the m cables, angles and torques of their
            motors, which are positive if they pay out, shape (k, m) [m, rad, rad, N, N m], NaN
            where not measured; None without any.
        poses: X_WP of a tracker, None in rows without; None.
        corners: Images of a tag's corners by its number, shape (k, 4, 2) [px].
        remarks: What was left out, in words.
        tilts: Roll, pitch and yaw of an inclinometer or IMU, without positions beside them, shape
            (k, 3) [rad], NaN where not measured; None.
        headers: Headers of the file by kind of quantity: `LENGTHS` and the like.
        points: Positions of a tracker without rotations, shape (k, 3) [m], NaN in rows without, and
            in coordinates that the file does not have; None.
    """

    path: Path
    count: int
    time: Array | None = None
    lengths: Array | None = None
    angles: Array | None = None
    swivels: Array | None = None
    tensions: Array | None = None
    poses: list[RigidTransform | None] | None = None
    corners: dict[int, Array] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    torques: Array | None = None
    tilts: Array | None = None
    headers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    points: Array | None = None

    def only(self, rows: npt.NDArray[np.intp]) -> Measurements:
        """Some of the rows, numbers from 0 that grow."""
        parts: dict[str, Any] = {
            name: value[rows] for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        poses = None if self.poses is None else [self.poses[k] for k in rows]
        corners = {tag: uv[rows] for tag, uv in self.corners.items()}
        return replace(self, count=len(rows), poses=poses, corners=corners, **parts)

    def wound(self, robot: Robot) -> Array | None:
        """Unstrained lengths as winches count them, or as motor angles say, shape (k, m) [m];
        None: the log has neither."""
        if self.lengths is None and self.angles is not None:
            return robot.drum().paid_out(self.angles)
        return self.lengths

    def positions(self, robot: Robot) -> Array | None:
        """Positions without rotations, shape (k, 3) [m]; in a plane those across it may be missing.

        Raises:
            LogFileError: A coordinate is missing along which the platform moves.
        """
        if self.points is None:
            return None
        points, normal = self.points.copy(), off_plane(robot)
        for axis in np.flatnonzero(~np.isfinite(points).any(axis=0)):
            if normal is None or abs(normal[axis]) < 1.0:
                accepted = "x_m, y_m and z_m, or those in which the platform moves"
                raise refusal(f"{self.path}: position", f"no {'xyz'[axis]}", accepted)
            present = np.isfinite(np.delete(points, axis, axis=1)).all(axis=1)
            points[present, axis] = robot.home.position[axis]
        return points

    def platform_poses(self, robot: Robot) -> list[RigidTransform | None] | None:
        """X_WP as a tracker in W has it, None in rows without; positions of a point mass are poses.

        Raises:
            LogFileError: As `positions`.
        """
        if self.poses is not None or self.points is None or not robot.motion_type().is_point:
            return self.poses
        points, home = self.positions(robot), robot.home.transform().rotation()
        assert points is not None
        return [
            on_motion(robot, RigidTransform(home, p)) if np.isfinite(p).all() else None
            for p in points
        ]

    def shifted(self, late: float) -> Measurements:
        """The same, of a tracker that was late by a time [s]: poses between are interpolated.

        Raises:
            LogFileError: There are no times, or no poses.
        """
        time = self.time
        if time is not None and self.points is not None:
            rows = np.isfinite(self.points).all(axis=1)
            moved = [np.interp(time + late, time[rows], column, np.nan, np.nan)
                     for column in self.points[rows].T]  # fmt: skip
            return replace(self, points=np.column_stack(moved))
        if time is None or self.poses is None:
            missing = "time" if time is None else "poses"
            raise LogFileError(f"{self.path}: found no {missing} to shift a tracker by")
        times = time[[X is not None for X in self.poses]]
        poses = [X for X in self.poses if X is not None]
        return replace(self, poses=[_between(times, poses, t) for t in time + late])


def _between(times: Array, poses: Sequence[RigidTransform], t: float) -> RigidTransform | None:
    """The pose at a time between others; None before the first and after the last."""
    k = int(np.searchsorted(times, t)) - 1
    if not 0 <= k < len(times) - 1:
        return None
    share = (t - times[k]) / (times[k + 1] - times[k])
    X, Y = poses[k], poses[k + 1]
    turn = (X.rotation().inverse() @ Y.rotation()).ToAngleAxis()
    turn.set_angle(share * turn.angle())
    R = RotationMatrix.ProjectToRotationMatrix(X.rotation().matrix() @ turn.rotation())
    return RigidTransform(R, X.translation() + share * (Y.translation() - X.translation()))


def on_motion(robot: Robot, X_WP: RigidTransform) -> RigidTransform:
    """The pose nearest to one that the platform can have, by its motion type and home pose [m].

    A point mass keeps the orientation of home, a body in a plane turns about its normal; lines and
    planes go through the home position. Bodies in space and in horizontal planes stay as they are.
    """
    motion = robot.motion_type()
    if motion.num_turns == 3 or motion.is_horizontal_body:
        return X_WP
    home = robot.home.transform()
    step = X_WP.translation() - home.translation()
    B = motion.basis(home.rotation().matrix())[3:, motion.num_turns :]
    place = home.translation() + B @ (B.T @ step)
    if motion.num_turns == 2:
        return RigidTransform(X_WP.rotation(), place)
    R = home.rotation()
    if motion.num_turns == 1:
        axis = np.asarray(motion.axis)
        angle = float(axis @ rotation_vector(X_WP.rotation() @ R.inverse()))
        R = RotationMatrix(rotation_from_vector(angle * axis) @ R)
    return RigidTransform(R, place)


def off_plane(robot: Robot) -> Array | None:
    """The normal of the plane in which a platform moves, shape (3,); None: it does in none."""
    motion = robot.motion_type()
    return np.asarray(motion.axis, float) if motion.is_plane else None


def read_measurements(
    path: Path | str, cables: Sequence[str], facts: Facts | None = None, dialect: str = AUTO
) -> Measurements:
    """Reads a log of a robot for a fit.

    Args:
        path: The log, in any dialect.
        cables: Names of the robot's cables.
        facts: What is known of the log beside its file; None: nothing.
        dialect: As of `read_log`.

    Raises:
        LogFileError: As `read_log` and `bind_log`, or the log has more than `MOST_ROWS` rows.
    """
    facts = replace(Facts() if facts is None else facts, robot_cables=tuple(cables))
    log = read_log(path, facts, dialect)
    if len(log.frame) > MOST_ROWS:
        raise refusal(path, f"{len(log.frame)} rows", f"at most {MOST_ROWS}, such as every tenth")
    return bind_log(log, cables)


def bind_log(log: Log, cables: Sequence[str]) -> Measurements:
    """Binds a log to a robot with these cables; by their order if the log names as many otherwise.

    Raises:
        LogFileError: No cable is one of the robot's, or the log has parts of a pose or of a tag's
            corners, or quaternions that are no rotations.
    """
    frame, lost, words = _robot_columns(log, cables)
    path, count = log.path, len(frame)
    names = [[f"{cable}_{ending}" for cable in cables] for ending, _ in CABLE_QUANTITIES.values()]
    lengths, angles, swivels, torques, tensions = (
        _table(frame, columns) if set(columns) & set(frame) else None for columns in names
    )
    kinds = [kind for kind in ROTATIONS if set(PARTS[kind]) & set(frame)]
    points = _table(frame, PARTS[POSITION]) if set(PARTS[POSITION]) & set(frame) else None
    poses = tilts = None
    if points is not None and kinds:
        poses, points = poses_of(path, frame), None
    elif RPY in kinds:
        tilts = _table(frame, PARTS[RPY])
    elif kinds:
        rotations, none = _rotations(path, kinds[0], frame), np.full(3, np.nan)
        tilts = np.array([none if R is None else RollPitchYaw(R).vector() for R in rotations])
    ledger = log.ledger
    used = (ledger["fate"] == READ) & ~ledger["kind"].isin(_NOT_FITTED) & ~ledger["name"].isin(lost)
    unread = ledger["header"][~used & (ledger["fate"] != LEFT_OUT)].tolist()
    remarks = [f"columns not read: {', '.join(unread)}"] if unread else []
    remarks += [f"{log.repeated} repeated rows left out"] if log.repeated else []
    remarks += [remark for remark in log.remarks if not re.match(_SAID_OTHERWISE, remark)]
    headers = ledger[used].groupby("kind", sort=False)["header"].agg(tuple).to_dict()
    return Measurements(
        path, count, log.time, lengths=lengths, angles=angles, swivels=swivels, torques=torques,
        tensions=tensions, poses=poses, corners=_corners(path, frame), tilts=tilts, points=points,
        headers=headers, remarks=(*remarks, *words),
    )  # fmt: skip


def _table(frame: pd.DataFrame, names: Sequence[str]) -> Array:
    """Columns beside each other, shape (k, n); NaN for those that are not there."""
    return np.array(frame.reindex(columns=list(names)), float)


def _robot_columns(log: Log, names: Sequence[str]) -> tuple[pd.DataFrame, set[str], list[str]]:
    """A frame whose cables have the robot's names, columns of no cable of it, and remarks."""
    cables = log.cables()
    if set(cables) <= set(names):
        return log.frame, set(), []
    endings = [ending for ending, _ in CABLE_QUANTITIES.values()]
    by_order = [own if own in names else name for own, name in zip(cables, names, strict=False)]
    if len(cables) == len(names) and by_order == list(names):
        new = dict(zip(cables, names, strict=True))
        columns = {f"{c}_{end}": f"{name}_{end}" for c, name in new.items() for end in endings}
        pairs = ", ".join(f"{c} is {name}" for c, name in new.items() if c != name)
        return log.frame.rename(columns=columns), set(), [
            f"cables of the log are bound to the robot's by their order: {pairs}"
        ]  # fmt: skip
    if not set(cables) & set(names):
        robots = f"those of the robot, {', '.join(names)[:120]}"
        accepted = f"{robots}, or as many cables in the same order"
        raise refusal(f"{log.path}: cables", ", ".join(cables)[:80], accepted)
    return log.frame, {f"{c}_{end}" for c in set(cables) - set(names) for end in endings}, []


def poses_of(path: Path, columns: Columns) -> list[RigidTransform | None]:
    """Poses of columns of positions and of a rotation; None in rows without."""
    kind = next((kind for kind in ROTATIONS if set(PARTS[kind]) & set(columns)), None)
    if kind is None:
        raise LogFileError(
            f"{path}: pose: found x, y, z without a rotation; accepted: qw, qx, qy, qz, or "
            "phi_deg, theta_deg, psi_deg (R = Rx Ry Rz), or rx, ry, rz (rotation vector), or "
            "roll, pitch, yaw, beside them"
        )
    p = _whole(path, POSITION, columns)
    return [
        None if R is None or not np.isfinite(x).all() else RigidTransform(R, x)
        for R, x in zip(_rotations(path, kind, columns), p, strict=True)
    ]


def _whole(path: Path, kind: str, columns: Columns) -> Array:
    """All parts of a kind, shape (k, n)."""
    present = [columns[name] for name in PARTS[kind] if name in columns]
    if len(present) < len(PARTS[kind]):
        raise refusal(f"{path}: {kind}", f"{len(present)} columns", f"all {len(PARTS[kind])}")
    return np.column_stack(present)


def _rotations(path: Path, kind: str, columns: Columns) -> list[RotationMatrix | None]:
    """Rotations of each row; None in rows without."""
    table = _whole(path, kind, columns)
    if kind == QUATERNION:
        refuse_other_lengths(path, table)
    make: Callable[[Array], RotationMatrix] = {
        QUATERNION: _of_quaternion, TAIT: rotation_from_angles, TURN: rotation_from_vector,
        RPY: lambda values: RotationMatrix(RollPitchYaw(values)),
    }[kind]  # fmt: skip
    return [make(row) if np.isfinite(row).all() else None for row in table]


def _of_quaternion(values: Array) -> RotationMatrix:
    w, x, y, z = values / float(np.linalg.norm(values))
    R = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return RotationMatrix.ProjectToRotationMatrix(np.array(R))


def _corners(path: Path, frame: pd.DataFrame) -> dict[int, Array]:
    """Images of the corners of each tag, shape (k, 4, 2) [px]."""
    tags = sorted({int(found[1]) for name in frame if (found := re.match(r"tag(\d+)_[uv]", name))})
    corners = {}
    for tag in tags:
        names = [f"tag{tag}_{axis}{corner}_px" for corner in (1, 2, 3, 4) for axis in "uv"]
        uv = _table(frame, names)
        seen = np.isfinite(uv).sum(axis=1)
        partly = np.flatnonzero((seen > 0) & (seen < 8))
        if len(partly):
            k = int(partly[0])
            words = f"{seen[k]} of 8 coordinates of its corners"
            accepted = "tag{n}_u1 to u4 and v1 to v4, all or none in a row"
            raise refusal(f"{path}: row {k + 1}: tag {tag}", words, accepted)
        corners[tag] = uv.reshape(-1, 4, 2)
    return corners
