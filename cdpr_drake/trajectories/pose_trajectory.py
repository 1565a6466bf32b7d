"""Poses as functions of time: quintic laws from rest to rest, steady motions, waypoints.

`PoseTrajectory` takes the platform through poses at which it rests, by quintic time laws; a row of
`MOTION_SIZE` numbers is its pose, velocity and acceleration. A `MovingPose` is the pose of an
object: at constant velocity (`SteadyMotion`) or through waypoints (`WaypointMotion`).

Source: Gazebo thesis (6.16)-(6.21); servoing thesis (A.15)-(A.20).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numba import njit
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.trajectories import PiecewisePose

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector, rotation_vector
from cdpr_drake.trajectories.pose_path import PIECE_NUMBERS, POINT_SIZE, path_point

MOTION_SIZE = 19
"""Length of a motion row: quaternion wxyz and origin of P in W [-, m], V_WP = (w, v) of P in W
[rad/s, m/s], A_WP = (alpha, a) of P in W [rad/s^2, m/s^2]."""

TIMED_NUMBERS = 4 + PIECE_NUMBERS
"""Of a stretch of a `TimedPath`: start and duration [s], ds/dt at its start [m/s], d2s/dt2
[m/s^2], and the path from there on as `pose_path.path_point` takes it."""


@dataclass(frozen=True, eq=False)
class PoseTrajectory:
    """A motion of the platform P in the world W through poses, at rest in each of them.

    Between two poses Po moves on a straight line and P turns about one axis, which is fixed in W
    and in P, both by the same quintic time law s(t) from 0 to 1 that starts and ends without
    velocity and acceleration. Before its start and after its end it rests. The same pose twice is
    a pause. The turn is the shorter one; by exactly half a turn, either way.

    Attributes:
        poses: X_WP at the start and at the end of every stretch, k + 1 poses [m].
        durations: Time of every stretch, k durations, each above 0 [s].
        start_time: When it leaves the first pose [s].

    Source: servoing thesis (A.15)-(A.20). There u of (A.20) is the axis in the first pose of P;
    here it is turned into W, as the angular velocity in W needs.
    """

    poses: tuple[RigidTransform, ...]
    durations: tuple[float, ...]
    start_time: float = 0.0
    _stretches: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Checks the fields.

        Raises:
            TrajectoryError: Poses and durations do not fit, or a time is not accepted.
        """
        if len(self.poses) != len(self.durations) + 1 or not self.durations:
            raise TrajectoryError(
                f"a trajectory of {len(self.durations)} durations needs one pose more and at "
                f"least one duration, found {len(self.poses)} poses"
            )
        for duration in self.durations:
            _check_duration(duration)
        if not np.isfinite(self.start_time):
            raise TrajectoryError(f"a trajectory's start must be finite, found {self.start_time} s")
        starts = self.start_time + np.cumsum([0.0, *self.durations[:-1]])
        pairs = zip(self.poses[:-1], self.poses[1:], strict=True)
        rows = [
            _stretch(float(start), duration, *pair)
            for start, duration, pair in zip(starts, self.durations, pairs, strict=True)
        ]
        object.__setattr__(self, "_stretches", np.array(rows))

    @property
    def end_time(self) -> float:
        """When it reaches the last pose [s]."""
        return float(self._stretches[-1, 0] + self._stretches[-1, 1])

    def pose(self, time: float) -> RigidTransform:
        """X_WP at a time [s]."""
        row = self.motion(time)
        return RigidTransform(Quaternion(row[:4] / np.linalg.norm(row[:4])), row[4:7])

    def velocity(self, time: float) -> Array:
        """V_WP = (w, v) of P in W, v that of Po, at a time [s], shape (6,) [rad/s, m/s]."""
        return self.motion(time)[7:13]

    def acceleration(self, time: float) -> Array:
        """A_WP = (alpha, a) of P in W, a that of Po, at a time [s], shape (6,) [rad/s^2, m/s^2]."""
        return self.motion(time)[13:]

    def motion(self, time: float) -> Array:
        """Pose, velocity and acceleration at a time [s] as one row, shape (`MOTION_SIZE`,)."""
        row = np.empty(MOTION_SIZE)
        write_motion(time, self._stretches, row)
        return row

    def stretches(self) -> Array:
        """The stretches as `write_motion` takes them, shape (k, 16)."""
        return self._stretches


def motion_row(X_WP: RigidTransform, V_WP: Array, A_WP: Array) -> Array:
    """A pose [m], velocity (6,) and acceleration (6,) as one row, shape (`MOTION_SIZE`,)."""
    return np.concatenate([pose_row(X_WP), V_WP, A_WP])


@njit(cache=True)
def write_motion(time: float, stretches: Array, out: Array) -> None:
    """Writes the motion row of a trajectory at a time [s] to `out`, shape (`MOTION_SIZE`,).

    Args:
        time: Time [s].
        stretches: `PoseTrajectory.stretches`; of each its start and duration [s], quaternion wxyz
            and origin of its first pose [m], rotation vector [rad] and path of Po [m] in W,
            angle [rad]; or those of a `TimedPath`, `TIMED_NUMBERS` each.
        out: The row, overwritten.
    """
    if stretches.shape[1] == TIMED_NUMBERS:
        _write_timed_motion(time, stretches, out)
        return
    i = stretches.shape[0] - 1
    while i > 0 and time < stretches[i, 0]:
        i -= 1
    row = stretches[i]
    T = row[1]
    x = min(max((time - row[0]) / T, 0.0), 1.0)
    s = x * x * x * (10.0 + x * (-15.0 + 6.0 * x))
    s_dot = 30.0 * x * x * (1.0 + x * (-2.0 + x)) / T
    s_ddot = 60.0 * x * (1.0 + x * (-3.0 + 2.0 * x)) / (T * T)
    # R_WP = exp(s [theta u_W]x) R_WS, as quaternions.
    half = 0.5 * s * row[15]
    share = np.sin(half) / row[15] if row[15] > 0.0 else 0.0
    aw, ax, ay, az = np.cos(half), share * row[9], share * row[10], share * row[11]
    bw, bx, by, bz = row[2], row[3], row[4], row[5]
    out[0] = aw * bw - ax * bx - ay * by - az * bz
    out[1] = aw * bx + ax * bw + ay * bz - az * by
    out[2] = aw * by - ax * bz + ay * bw + az * bx
    out[3] = aw * bz + ax * by - ay * bx + az * bw
    for k in range(3):
        out[4 + k] = row[6 + k] + s * row[12 + k]
    for k in range(6):
        out[7 + k] = s_dot * row[9 + k]
        out[13 + k] = s_ddot * row[9 + k]


@njit(cache=True)
def _write_timed_motion(time: float, stretches: Array, out: Array) -> None:
    """`write_motion` of a `TimedPath`; its stretches are many, and are searched by halves."""
    low, high = 0, stretches.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if time < stretches[middle, 0]:
            high = middle
        else:
            low = middle
    row = stretches[low]
    since = min(max(time - row[0], 0.0), row[1])
    speed, growth = row[2] + row[3] * since, row[3]
    last = low == stretches.shape[0] - 1  # elsewhere rounding alone ends a stretch too early
    if time < stretches[0, 0] or (last and time - row[0] >= row[1]):  # at rest before and after it
        speed, growth = 0.0, 0.0
    point = np.empty(POINT_SIZE)
    path_point(row[4:], (row[2] + 0.5 * row[3] * since) * since, point)
    for k in range(7):
        out[k] = point[k]
    for k in range(6):
        out[7 + k] = speed * point[7 + k]
        out[13 + k] = growth * point[7 + k] + speed * speed * point[13 + k]


def _check_duration(duration: float) -> None:
    if not (np.isfinite(duration) and duration > 0.0):
        raise TrajectoryError(
            f"a trajectory's duration must be above 0 s and finite, found {duration} s"
        )


def _stretch(start: float, duration: float, X_WS: RigidTransform, X_WE: RigidTransform) -> Array:
    """One row of `PoseTrajectory.stretches`, from pose S to pose E."""
    turn = rotation_vector(X_WS.rotation().inverse() @ X_WE.rotation())
    return np.concatenate(
        [
            [start, duration],
            pose_row(X_WS),
            X_WS.rotation().matrix() @ turn,
            X_WE.translation() - X_WS.translation(),
            [float(np.linalg.norm(turn))],
        ]
    )


class MovingPose(Protocol):
    """A pose X_WO of an object in W as a function of time."""

    def at(self, time: float) -> RigidTransform:
        """X_WO at a time [s]."""

    def is_moving(self) -> bool:
        """Whether it ever changes."""


class SteadyMotion:
    """An object that moves on a straight line and turns at constant rates, or rests."""

    def __init__(self, X_WO: RigidTransform, v_WO: Array, w_WO: Array) -> None:
        """From the pose at time 0, with velocity [m/s] and angular velocity [rad/s] in W."""
        self._X_WO, self._v, self._w = X_WO, np.asarray(v_WO, float), np.asarray(w_WO, float)
        self._turns, self._moves = bool(np.any(self._w)), self.is_moving()

    def at(self, time: float) -> RigidTransform:
        """X_WO at a time [s]."""
        if not self._moves:
            return self._X_WO
        R = self._X_WO.rotation()
        if self._turns:
            R = rotation_from_vector(self._w * time) @ R
        return RigidTransform(R, self._X_WO.translation() + self._v * time)

    def is_moving(self) -> bool:
        """Whether it ever changes."""
        return bool(np.any(self._v) or np.any(self._w))


class WaypointMotion:
    """An object that passes poses at given times, at constant velocity in between."""

    def __init__(
        self, times: Sequence[float], poses: Sequence[RigidTransform], repeat: bool = False
    ) -> None:
        """With growing times from 0 [s]; after the last one it rests there, or begins again."""
        self._path = PiecewisePose.MakeLinear(list(times), list(poses))
        self._end, self._repeat = float(times[-1]), repeat

    def at(self, time: float) -> RigidTransform:
        """X_WO at a time [s]."""
        if self._repeat:
            time = time % self._end
        return RigidTransform(self._path.GetPose(min(max(time, 0.0), self._end)))

    def is_moving(self) -> bool:
        """Whether it ever changes."""
        return True
