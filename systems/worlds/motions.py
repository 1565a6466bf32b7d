"""How bodies of the world move: each motion is a pose, a velocity and an acceleration over time."""

from __future__ import annotations

from itertools import pairwise
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.trajectories.pose_trajectory import (
    MovingPose,
    PoseTrajectory,
    SteadyMotion,
    motion_row,
)
from cdpr_drake.workspaces.moving_shapes import PoseSpan

LARGEST_TURN, MOST_POSES = 0.25, 32
"""Between two poses of a span a body turns by no more than this [rad], unless that takes more than
so many poses: then spans are larger than they need be."""


class BodyMotion(MovingPose, Protocol):
    """A pose X_WB of a body in W over time, with what a body that is driven along it needs."""

    def motion(self, time: float) -> Array:
        """X_WB, V_WB and A_WB at a time [s] as one row, shape (`MOTION_SIZE`,)."""

    def span(self, first: float, last: float) -> PoseSpan:
        """Poses round which all those from a first to a last time [s] lie."""

    def settled(self) -> float:
        """From when on it rests for ever [s]; infinite: never."""


class SteadyBody(SteadyMotion):
    """A body that rests, or moves on a straight line and turns, at constant rates."""

    def __init__(self, X_WB: RigidTransform, v_WB: Array, w_WB: Array) -> None:
        """From the pose at time 0 [m], with velocity [m/s] and angular velocity [rad/s] in W."""
        super().__init__(X_WB, v_WB, w_WB)
        self._V = np.concatenate([w_WB, v_WB]).astype(float)

    def motion(self, time: float) -> Array:
        """Pose, velocity and acceleration at a time [s]."""
        return motion_row(self.at(time), self._V, np.zeros(6))

    def span(self, first: float, last: float) -> PoseSpan:
        """As `BodyMotion` has it."""
        angle = float(np.linalg.norm(self._V[:3])) * (last - first)
        times = np.linspace(first, last, _steps(angle) + 1)
        return PoseSpan(tuple(self.at(t) for t in times), _bend(angle / (len(times) - 1)))

    def settled(self) -> float:
        """As `BodyMotion` has it."""
        return np.inf if self.is_moving() else 0.0


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

    def span(self, first: float, last: float) -> PoseSpan:
        """As `BodyMotion` has it. Where it begins again, with the jump, if there is one."""
        path, round_trip = self._path, self._path.end_time
        rounds = [0]
        if self._repeat:
            rounds = list(range(int(first // round_trip), int(last // round_trip) + 1))
        poses: list[RigidTransform] = []
        widest = 0.0
        knots = np.cumsum([path.start_time, *path.durations])
        for number in rounds:
            shift = number * round_trip if self._repeat else 0.0
            low = max(first - shift, 0.0) if self._repeat else first - shift
            high = min(last - shift, round_trip) if self._repeat else last - shift
            inner = knots[(knots > low) & (knots < high)]
            for a, b in pairwise([low, *inner.tolist(), high]):
                ends = path.pose(a), path.pose(b)
                angle = _turn(*ends)
                times = np.linspace(a, b, _steps(angle) + 1)
                found = [path.pose(t) for t in times]
                widest = max([widest, *(_turn(*pair) for pair in pairwise(found))])
                poses += found
        return PoseSpan(tuple(poses), _bend(widest))

    def settled(self) -> float:
        """As `BodyMotion` has it."""
        return np.inf if self._repeat else self._path.end_time

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
        return self._turned(self._angle(time)[0])

    def _turned(self, angle: float) -> RigidTransform:
        turn = rotation_from_vector(self._axis * angle)
        return RigidTransform(turn @ self._R, self._point + turn @ self._arm)

    def span(self, first: float, last: float) -> PoseSpan:
        """As `BodyMotion` has it."""
        angles = [self._angle(t)[0] for t in (first, last, *self._turnarounds(first, last))]
        low, high = min(angles), max(angles)
        count = _steps(high - low)
        poses = tuple(self._turned(angle) for angle in np.linspace(low, high, count + 1))
        return PoseSpan(poses, _bend((high - low) / count), float(np.linalg.norm(self._arm)))

    def settled(self) -> float:
        """As `BodyMotion` has it."""
        return np.inf if self.is_moving() else 0.0

    def _turnarounds(self, first: float, last: float) -> list[float]:
        """Times between at which it does not turn: cos(f t) = -rate / (amplitude f)."""
        f, A = self._frequency, self._amplitude
        if A == 0.0 or abs(self._rate) > A * f:
            return []
        phase = float(np.arccos(-self._rate / (A * f)))
        period = 2.0 * np.pi / f
        found = []
        for t in (phase / f, -phase / f):
            start = t + np.ceil((first - t) / period) * period
            # beyond one period the angles only shift, by no more than the ends have
            found += np.arange(start, last, period).tolist()
        return found

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


def _turn(X_WA: RigidTransform, X_WB: RigidTransform) -> float:
    """Angle between two poses [rad]."""
    return float(np.linalg.norm(rotation_vector(X_WA.rotation().inverse() @ X_WB.rotation())))


def _steps(angle: float) -> int:
    """Into how many steps a turn is divided."""
    return int(np.clip(np.ceil(abs(angle) / LARGEST_TURN), 1, MOST_POSES))


def _bend(angle: float) -> float:
    """How far an arc is from its chord at most, over its radius: angle^2 / 8."""
    return angle * angle / 8.0
