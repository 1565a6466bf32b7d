"""Poses as functions of time: at constant velocity, or through waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform
from pydrake.trajectories import PiecewisePose

from cdpr_drake.arrays import Array
from cdpr_drake.spatial import rotation_from_vector


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
