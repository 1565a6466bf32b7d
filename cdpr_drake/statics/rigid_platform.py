"""A moving platform as statics and vibrations see it: mass, inertia, weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.geometry.straight_cables import gravity_wrench

DOWN = (0.0, 0.0, -1.0)


@dataclass(frozen=True, eq=False)
class RigidPlatform:
    """A moving platform.

    Attributes:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        gravity: Acceleration [m/s^2].
        motion: Which motions it has.
        down: Direction of gravity in W, a unit vector.
    """

    mass: float
    p_PCo: Array
    I_PPo: Array
    gravity: float = 9.81
    motion: MotionType = FREE
    down: tuple[float, float, float] = DOWN

    def acceleration(self) -> Array:
        """Of a falling body, in W, shape (3,) [m/s^2]."""
        return self.gravity * np.asarray(self.down, float)

    def potential_energy(self, X_WP: RigidTransform) -> float:
        """Of its weight, 0 with the centre of mass at the origin of W [J]."""
        return float(self.packed_weight()[:3] @ X_WP.multiply(self.p_PCo))

    def packed_weight(self) -> Array:
        """Force in W that bears it [N] and centre of mass in P [m], shape (6,), for kernels."""
        return np.concatenate([-self.mass * self.acceleration() + 0.0, self.p_PCo])

    def weight_wrench(self, X_WP: RigidTransform) -> Array:
        """Weight about Po in W, shape (6,) (moment, force) [N m, N]."""
        return gravity_wrench(X_WP, self.mass, self.p_PCo, self.acceleration())

    def weight_stiffness(self, X_WP: RigidTransform) -> Array:
        """Minus the derivative of `weight_wrench` by (turn, translation), shape (6, 6).

        The arm of the weight turns with the platform: a low centre of mass rights it.
        """
        K = np.zeros((6, 6))
        f = self.mass * self.acceleration()
        arm = X_WP.rotation().matrix() @ self.p_PCo
        K[:3, :3] = -cross_matrix(f) @ cross_matrix(arm)
        return K

    def mass_matrix(self, X_WP: RigidTransform) -> Array:
        """Spatial inertia about Po in W, shape (6, 6), rows and columns (rotation, translation)."""
        R = X_WP.rotation().matrix()
        arm = cross_matrix(R @ self.p_PCo)
        M = np.zeros((6, 6))
        M[:3, :3] = R @ self.I_PPo @ R.T
        M[:3, 3:] = self.mass * arm
        M[3:, :3] = -self.mass * arm
        M[3:, 3:] = self.mass * np.eye(3)
        return M
