"""A motion of all joints of a plant through positions at which it rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TrajectoryError
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


@dataclass(frozen=True, eq=False)
class PlantMotion:
    """Positions, velocities and accelerations of a plant's joints over time.

    Between two waypoints every joint goes straight in its positions, and every free body turns
    about one axis, which is spherical linear interpolation, all by the quintic law from rest to
    rest of `PoseTrajectory`. Before the first waypoint and after the last one the plant rests.

    Attributes:
        times: Of the waypoints, growing, shape (k + 1,) [s].
        positions: q at the waypoints, shape (k + 1, nq) [rad, m].
        velocity_rows: Of each position which velocity is its rate, shape (nq,); -1 for those of
            quaternions.
        quaternions: First position and first velocity of each free body: positions are its
            quaternion wxyz and origin, velocities (w, v) in the same frame, as Drake has them.
    """

    times: Array
    positions: Array
    velocity_rows: np.ndarray
    quaternions: Sequence[tuple[int, int]] = ()
    _law: PoseTrajectory = field(init=False, repr=False)
    _turns: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Checks the times.

        Raises:
            TrajectoryError: There are less than two, or they do not grow.
        """
        durations = np.diff(self.times)
        if len(durations) < 1 or not np.all(durations > 0.0):
            raise TrajectoryError(
                f"times: found {np.asarray(self.times).tolist()}; accepted: two or more that grow"
            )
        # Its progress from waypoint to waypoint is the motion of a point along x.
        marks = tuple(RigidTransform([float(k), 0.0, 0.0]) for k in range(len(self.times)))
        law = PoseTrajectory(marks, tuple(map(float, durations)), float(self.times[0]))
        object.__setattr__(self, "_law", law)
        turns = np.zeros((len(durations), len(self.quaternions), 3))
        for i, (start, _) in enumerate(self.quaternions):
            R = [_rotation(q[start : start + 4]) for q in self.positions]
            for k in range(len(durations)):  # in the frame that the body's positions are in
                turns[k, i] = rotation_vector(R[k + 1] @ R[k].inverse())
        object.__setattr__(self, "_turns", turns)

    @property
    def end_time(self) -> float:
        """When it reaches the last waypoint [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> tuple[Array, Array, Array]:
        """Positions (nq,) [rad, m], velocities (nv,) and accelerations (nv,) at a time [s]."""
        row = self._law.motion(time)
        k = min(int(row[4]), len(self.times) - 2)
        share, rate, growth = row[4] - k, row[10], row[16]
        first, way = self.positions[k], self.positions[k + 1] - self.positions[k]
        q = first + share * way
        plain = self.velocity_rows >= 0
        direction = np.zeros(int(plain.sum()) + 3 * len(self.quaternions))
        direction[self.velocity_rows[plain]] = way[plain]
        for i, (start, velocity) in enumerate(self.quaternions):
            turn = self._turns[k, i]
            R = rotation_from_vector(share * turn) @ _rotation(first[start : start + 4])
            q[start : start + 4] = R.ToQuaternion().wxyz()
            direction[velocity : velocity + 3] = turn
        return q, rate * direction, growth * direction


def _rotation(wxyz: Array) -> RotationMatrix:
    return RotationMatrix(Quaternion(wxyz / np.linalg.norm(wxyz)))
