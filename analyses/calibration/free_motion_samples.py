"""What a log has of stretches in which a platform moves freely on standing winches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError, IdentificationError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot

RATE = 50.0
"""Instants at which motions are compared, of logs that are as fast [1/s]."""

STANDS = 1e-3
"""By so much lengths may change that winches count, and the winches stand still [m]."""

SHORTEST = 0.5
"""A stretch [s]; shorter ones have not half of a swing."""

MISSED = 4.0
"""An instant farther than so many usual steps from what was measured has no measurement."""

HEIGHTS = 200
"""At which the weight is compared with what tensions carry."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recorded:
    """Turns and positions of a log, at their own times.

    Attributes:
        time: Shape (k,) [s].
        quaternions: wxyz, each near the one before, shape (k, 4).
        positions: Shape (k, 3) [m]; None: a sensor of turns alone.
    """

    time: Array
    quaternions: Array
    positions: Array | None

    def turns_at(self, time: Array) -> Rotation:
        """Rotations at times, between rows on the way of their quaternions."""
        q = np.column_stack([np.interp(time, self.time, self.quaternions[:, j]) for j in range(4)])
        return Rotation.from_quat(q[:, [1, 2, 3, 0]])

    def positions_at(self, time: Array) -> Array | None:
        """Positions at times, shape (n, 3) [m]."""
        if self.positions is None:
            return None
        return np.column_stack([np.interp(time, self.time, self.positions[:, j]) for j in range(3)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Stretch:
    """A part of a log, at even instants.

    Attributes:
        time: Shape (n,) [s].
        recorded: Turns and positions of the whole log.
        known: 1 where turns were measured near, else 0, shape (n,).
        tensions: Between rows, not means, which would damp them; shape (n, m) [N], NaN: none.
    """

    time: Array
    recorded: Recorded
    known: Array
    tensions: Array = field(repr=False)

    @property
    def count(self) -> int:
        """Instants n."""
        return len(self.time)

    @property
    def step(self) -> float:
        """Between instants [s]."""
        return float(self.time[1] - self.time[0])

    def first(self, duration: float) -> Stretch:
        """The beginning of it."""
        n = max(min(self.count, round(duration / self.step) + 1), 2)
        return Stretch(
            time=self.time[:n], recorded=self.recorded, known=self.known[:n],
            tensions=self.tensions[:n],
        )  # fmt: skip


def recorded_turns(log: Measurements) -> Recorded:
    """Poses of a tracker, or turns of a sensor.

    Raises:
        IdentificationError: The log has no times, or neither.
    """
    if log.time is None:
        raise IdentificationError(f"{log.path}: time: found none; accepted: a column time_s")
    positions = None
    if log.poses is not None:
        kept = np.array([k for k, X in enumerate(log.poses) if X is not None], int)
        rows = np.array([pose_row(X) for X in log.poses if X is not None])
        q, positions = rows[:, :4], rows[:, 4:]
    elif log.tilts is not None:
        kept = np.flatnonzero(np.isfinite(log.tilts).all(axis=1))
        turns = Rotation.from_euler("ZYX", log.tilts[kept][:, ::-1])
        q = turns.as_quat()[:, [3, 0, 1, 2]]
    else:
        raise IdentificationError(
            f"{log.path}: turns: found none; accepted of a free motion: poses, or roll, pitch and "
            "yaw"
        )
    if len(kept) < 2:
        raise IdentificationError(f"{log.path}: turns: found {len(kept)} rows; accepted: 2 or more")
    flips = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0))
    q = q.copy()
    q[1:] *= flips[:, None]
    # Sensors that are slower than the log repeat their rows: the first of them is the measurement.
    rows = q if positions is None else np.hstack([q, positions])
    new = np.concatenate([[True], np.any(rows[1:] != rows[:-1], axis=1)])
    return Recorded(
        time=log.time[kept][new], quaternions=q[new],
        positions=None if positions is None else positions[new],
    )  # fmt: skip


def cut(
    robot: Robot, log: Measurements, recorded: Recorded, spans: Sequence[tuple[float, float]]
) -> list[Stretch]:
    """Stretches of a log.

    Args:
        robot: The robot of the log.
        log: The log.
        recorded: Its turns.
        spans: First and last instant of each [s].

    Raises:
        IdentificationError: One is too short or not in the log, or winches turn in it.
    """
    assert log.time is not None
    time, m = log.time, len(robot.cables)
    usual = float(np.median(np.diff(recorded.time)))
    rate = min(RATE, 1.0 / usual)
    lengths = log.wound(robot)
    made = []
    for start, end in spans:
        words = f"{log.path}: stretch {start:g}:{end:g}"
        if not (time[0] <= start and end <= time[-1] and end - start >= SHORTEST):
            raise IdentificationError(
                f"{log.path}: stretch: found {start:g}:{end:g}; accepted: {SHORTEST:g} s or more "
                f"within {time[0]:g} to {time[-1]:g} s"
            )
        inside = (time >= start) & (time <= end)
        if lengths is not None:
            _refuse_turning(words, robot, lengths[inside])
        t = start + np.arange(int((end - start) * rate) + 1) / rate
        nearest = np.searchsorted(recorded.time, t).clip(1, len(recorded.time) - 1)
        away = np.minimum(
            np.abs(recorded.time[nearest] - t), np.abs(recorded.time[nearest - 1] - t)
        )
        tensions = np.full((len(t), m), np.nan)
        if log.tensions is not None:
            for i in range(m):
                good = np.isfinite(log.tensions[:, i])
                if good.any():
                    tensions[:, i] = np.interp(t, time[good], log.tensions[good, i])
        known = np.asarray(away < MISSED * usual, float)
        if not known.any():
            raise IdentificationError(f"{words}: found no turns in it; accepted: a part with some")
        made.append(Stretch(time=t, recorded=recorded, known=known, tensions=tensions))
    return made


def _refuse_turning(words: str, robot: Robot, lengths: Array) -> None:
    for cable, values in zip(robot.cables, lengths.T, strict=True):
        seen = values[np.isfinite(values)]
        if len(seen) and np.ptp(seen) > STANDS:
            raise IdentificationError(
                f"{words}: {cable.name}: found its length changing by {np.ptp(seen):.3g} m; "
                f"accepted of a free motion: winches that stand still, {STANDS:g} m at most"
            )


def start_pose(
    robot: Robot, stretches: Sequence[Stretch], tracked: bool, given: RigidTransform | None
) -> RigidTransform:
    """A pose near which the platform hangs.

    The one that is given; else the mean of a tracker's; else below or above the home pose, where
    tensions that carry the weight are nearest to those measured; else the home pose.

    Args:
        robot: The robot.
        stretches: Parts of the log.
        tracked: Whether poses are those of a tracker in W.
        given: A pose; None.
    """
    if given is not None:
        return given
    home = robot.home.transform()
    if tracked:
        rows = [s.recorded.positions_at(s.time) for s in stretches]
        p = np.mean(np.concatenate([row for row in rows if row is not None]), axis=0)
        turns = Rotation.concatenate([s.recorded.turns_at(s.time) for s in stretches]).mean()
        return RigidTransform(RotationMatrix(turns.as_matrix()), p)
    tensions = np.concatenate([s.tensions for s in stretches])
    if not np.isfinite(tensions).all(axis=1).any():
        return home
    wanted = np.nanmean(tensions, axis=0)
    cables, weight = robot.cable_set(), robot.platform.mass * robot.gravity_vector()
    span = float(np.max(np.ptp(cables.p_WA, axis=1)))
    down = robot.gravity_vector() / np.linalg.norm(robot.gravity_vector())
    best, found = np.inf, home
    for along in np.linspace(-span, span, HEIGHTS):
        X = RigidTransform(home.rotation(), home.translation() + along * down)
        try:
            J = cable_paths(X, cables).J
        except CableGeometryError:
            continue  # no platform is where a cable cannot run
        arm = X.rotation().matrix() @ robot.center_of_mass()
        wrench = np.concatenate([np.cross(arm, weight), weight])
        t = np.linalg.lstsq(J.T, wrench, rcond=None)[0]
        off = float(np.sum((t - wanted) ** 2))
        if np.all(t > 0.0) and off < best:
            best, found = off, X
    return found
