"""How bodies of the world move: each motion is a pose, a velocity and an acceleration over time."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector
from cdpr_drake.trajectories.pose_trajectory import (
    MovingPose,
    PoseTrajectory,
    SteadyMotion,
    motion_row,
)


class BodyMotion(MovingPose, Protocol):
    """A pose X_WB of a body in W over time, with what a body that is driven along it needs."""

    def motion(self, time: float) -> Array:
        """X_WB, V_WB and A_WB at a time [s] as one row, shape (`MOTION_SIZE`,)."""


class SteadyBody(SteadyMotion):
    """A body that rests, or moves on a straight line and turns, at constant rates."""

    def __init__(self, X_WB: RigidTransform, v_WB: Array, w_WB: Array) -> None:
        """From the pose at time 0 [m], with velocity [m/s] and angular velocity [rad/s] in W."""
        super().__init__(X_WB, v_WB, w_WB)
        self._V = np.concatenate([w_WB, v_WB]).astype(float)

    def motion(self, time: float) -> Array:
        """Pose, velocity and acceleration at a time [s]."""
        return motion_row(self.at(time), self._V, np.zeros(6))


class PathBody:
    """A body that passes poses, at rest in each, by quintic time laws; it may begin again."""

    def __init__(self, path: PoseTrajectory, repeat: bool = False) -> None:
        """With a path from time 0; one that repeats should end where it began."""
        self._path, self._repeat = path, repeat

    def at(self, time: float) -> RigidTransform:
        """X_WB at a time [s]."""
        return self._path.pose(self._within(time))

    def is_moving(self) -> bool:
        """It is."""
        return True

    def motion(self, time: float) -> Array:
        """Pose, velocity and acceleration at a time [s]."""
        return self._path.motion(self._within(time))

    def _within(self, time: float) -> float:
        return time % self._path.end_time if self._repeat else time


class JointedBody:
    """A body on a revolute joint whose angle is driven: theta = rate t + amplitude sin(2 pi t / T).

    The axis stands still in W and in the body; the angle is 0 at time 0.
    """

    def __init__(
        self,
        X_WB: RigidTransform,
        point: Array,
        axis: Array,
        *,
        rate: float,
        amplitude: float,
        period: float,
    ) -> None:
        """A body at X_WB [m] at time 0.

        Args:
            X_WB: Its pose at time 0.
            point: A point of the axis in W, shape (3,) [m].
            axis: Direction of the axis in W, shape (3,), not zero.
            rate: Of turning [rad/s].
            amplitude: Of swinging [rad].
            period: T, of swinging [s].
        """
        self._R, self._point = X_WB.rotation(), np.asarray(point, float)
        self._arm = X_WB.translation() - self._point
        self._axis = np.asarray(axis, float) / np.linalg.norm(axis)
        self._rate, self._amplitude = rate, amplitude
        self._frequency = 2.0 * np.pi / period

    def at(self, time: float) -> RigidTransform:
        """X_WB at a time [s]."""
        turn = rotation_from_vector(self._axis * self._angle(time)[0])
        return RigidTransform(turn @ self._R, self._point + turn @ self._arm)

    def is_moving(self) -> bool:
        """Whether it turns or swings at all."""
        return self._rate != 0.0 or self._amplitude != 0.0

    def motion(self, time: float) -> Array:
        """Pose, velocity and acceleration at a time [s]."""
        X_WB = self.at(time)
        _, first, second = self._angle(time)
        w, alpha, r = self._axis * first, self._axis * second, X_WB.translation() - self._point
        v = np.cross(w, r)
        a = np.cross(alpha, r) + np.cross(w, v)
        return motion_row(X_WB, np.concatenate([w, v]), np.concatenate([alpha, a]))

    def _angle(self, time: float) -> tuple[float, float, float]:
        """Angle [rad] and its first two derivatives at a time [s]."""
        f, A = self._frequency, self._amplitude
        s, c = np.sin(f * time), np.cos(f * time)
        return (
            float(self._rate * time + A * s),
            float(self._rate + A * f * c),
            float(-A * f * f * s),
        )
