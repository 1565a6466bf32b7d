"""The pose that a platform shall reach, from what its camera sees, and how fast it goes there.

Source: servoing thesis 5.2.4, Figs 5.9, 5.10, (5.9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_vector

QUINTIC_PEAK = 15.0 / 8.0
"""Largest speed of a way by the quintic time law from rest to rest, per its mean speed."""


def goal_pose(
    X_WP: RigidTransform, X_PC: RigidTransform, X_CO: RigidTransform, X_CdO: RigidTransform
) -> RigidTransform:
    """X_WP* = X_WP X_PC X_CO (X_C*O)^-1 X_PC^-1, from where the object is seen as desired.

    Args:
        X_WP: Pose of the platform, measured or believed.
        X_PC: Camera on the platform.
        X_CO: Object in the camera, as it is seen.
        X_CdO: Object in the camera, as it shall be seen.

    Source: servoing thesis (5.9), whose last factor is printed as C_T_P and whose object has a
    star in both poses: the object rests, the camera moves.
    """
    return X_WP @ X_PC @ X_CO @ X_CdO.inverse() @ X_PC.inverse()


def goal_offset(X_WP: RigidTransform, X_WPd: RigidTransform) -> Array:
    """What is left to a goal: rotation vector and translation, in P, shape (6,) [rad, m].

    Both fade along a straight line and about one axis if the twist of P is this times a number.
    """
    X_PD = X_WP.inverse() @ X_WPd
    return np.concatenate([rotation_vector(X_PD.rotation()), X_PD.translation()])


@dataclass(frozen=True)
class GoalPlan:
    """How fast a platform goes to a goal that is corrected on its way.

    What is left of the way fades at the rate

        k(t) = s'(t) / (1 - s(t)),   s the quintic time law from rest to rest over a time T,

    so that a goal that stays is reached on the quintic's way, and one that is seen better from
    nearby is headed for from where the platform is by then: no plan has to be thrown away. Near
    the end k grows beyond all numbers; it ends at a gain, with which the rest fades.

    Attributes:
        speed: Largest speed of Po on the way [m/s].
        rotation_speed: Largest angular speed [rad/s].
        gain: Largest k [1/s].
    """

    speed: float
    rotation_speed: float
    gain: float

    def duration(self, offset: Array) -> float:
        """T for a way of `goal_offset`, shape (6,) [rad, m], in [s]."""
        turn, way = float(np.linalg.norm(offset[:3])), float(np.linalg.norm(offset[3:]))
        return QUINTIC_PEAK * max(turn / self.rotation_speed, way / self.speed)

    def rate(self, passed: float, duration: float) -> float:
        """k [1/s] when `passed` [s] of a `duration` [s] are over."""
        if passed >= duration:
            return self.gain
        x = passed / duration
        # 1 - s = (1 - x)^3 (1 + 3 x + 6 x^2), and s' = 30 x^2 (1 - x)^2 / T.
        left = duration * (1.0 - x) * (1.0 + x * (3.0 + 6.0 * x))
        return min(30.0 * x * x / left, self.gain) if left > 0.0 else self.gain

    def twist(self, offset: Array, passed: float, duration: float) -> Array:
        """Twist (w, v) of P in P, shape (6,) [rad/s, m/s], for an offset, shape (6,) [rad, m]."""
        return self.rate(passed, duration) * np.asarray(offset)
