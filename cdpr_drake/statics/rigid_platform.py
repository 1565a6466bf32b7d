"""A moving platform as statics and vibrations see it: mass, inertia, weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry import PLANAR_ROWS, gravity_wrench
from cdpr_drake.spatial import cross_matrix

SPATIAL_ROWS = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True, eq=False)
class RigidPlatform:
    """A moving platform.

    Attributes:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        gravity: Acceleration along -z of W [m/s^2].
        planar: Whether only x, y and the turn about z move.
    """

    mass: float
    p_PCo: Array
    I_PPo: Array
    gravity: float = 9.81
    planar: bool = False

    @property
    def rows(self) -> tuple[int, ...]:
        """Components of a spatial vector (rotation, translation) that the platform can move."""
        return PLANAR_ROWS if self.planar else SPATIAL_ROWS

    @property
    def num_turns(self) -> int:
        """How many of `rows` are rotations."""
        return 1 if self.planar else 3

    def packed_weight(self) -> Array:
        """Weight [N] and centre of mass in P [m], shape (4,), for `equilibrium_kernel`."""
        return np.concatenate([[self.mass * self.gravity], self.p_PCo])

    def weight_wrench(self, X_WP: RigidTransform) -> Array:
        """Weight about Po in W, shape (6,) (moment, force) [N m, N]."""
        return gravity_wrench(X_WP, self.mass, self.p_PCo, self.gravity)

    def weight_stiffness(self, X_WP: RigidTransform) -> Array:
        """Minus the derivative of `weight_wrench` by (turn, translation), shape (6, 6).

        The arm of the weight turns with the platform: a low centre of mass rights it.
        """
        K = np.zeros((6, 6))
        f = np.array([0.0, 0.0, -self.mass * self.gravity])
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
