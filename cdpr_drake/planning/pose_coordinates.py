"""Coordinates of the platform in a program, and what they make of a motion's pose and rates.

Constraints of the platform (`pose_constraint`) are written for changes of its pose, velocity and
acceleration in W. Whoever has other coordinates in a program adds a class of `Coordinates` here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_row, rotation_vector
from cdpr_drake.geometry.straight_cables import ALL_ROWS
from cdpr_drake.planning.pose_coordinates_kernel import (
    SEEDS,
    angle_points,
    body_points,
    relative_points,
)
from cdpr_drake.trajectories.pose_path import POINT_SIZE

LARGEST_TURN = 3.0
"""Of a pose from the start: g grows without end towards half a turn [rad]."""


class Coordinates(ABC):
    """How a program describes the platform.

    Attributes:
        sizes: Numbers of a pose, of a pose with its velocity, and of both with the acceleration.
    """

    sizes: tuple[int, int, int]

    def points(self, x: Array) -> tuple[Array, Array]:
        """Points of a motion and their seeds, see `pose_coordinates_kernel`.

        Args:
            x: Coordinates, one set a row, shape (N, k), k one of `sizes`.

        Returns:
            Points, shape (N, 19), and their derivatives by x, shape (N, 18, k). Velocities and
            accelerations that are not given are 0.

        Raises:
            PlanningError: There are other numbers of coordinates.
        """
        if x.shape[1] not in self.sizes:
            raise PlanningError(
                f"variables: found {x.shape[1]}; accepted: {self.sizes[0]} of a pose, "
                f"{self.sizes[1]} with its velocity, {self.sizes[2]} with its acceleration, too"
            )
        points = np.zeros((len(x), POINT_SIZE))
        seeds = np.zeros((len(x), SEEDS, x.shape[1]))
        self._write(x, points, seeds)
        return points, seeds

    @abstractmethod
    def _write(self, x: Array, points: Array, seeds: Array) -> None:
        """Writes both."""


class RelativePose(Coordinates):
    """(g, d), or those of them that the platform can move, and their derivatives by time.

    The quaternion (1, g) turns P in W from its pose at the start, g = u tan(theta / 2), and d is
    the way of Po in W [m]. They are regular below half a turn, and polynomials of them are pieces
    of a `PosePath`.

    Attributes:
        rows: Components of (g, d) that the platform can move.
    """

    def __init__(self, start: RigidTransform, rows: Sequence[int] = ALL_ROWS) -> None:
        """With the pose that coordinates count from [m]."""
        self.rows, self._start = list(rows), start
        n = len(self.rows)
        self.sizes = (n, 2 * n, 3 * n)
        w, x, y, z = pose_row(start)[:4]
        # (1, g) times the quaternion of the start, as a linear map of (1, g).
        turn = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
        every = np.zeros((7, 6))
        every[:4, :3], every[4:, 3:] = turn[:, 1:], np.eye(3)
        self._basis = np.ascontiguousarray(every[:, self.rows])
        self._origin = pose_row(start)

    def coordinates(self, X_WP: RigidTransform) -> Array:
        """Coordinates of a pose, shape (n,).

        Raises:
            PlanningError: It is turned too far from the start, or out of the platform's plane.
        """
        theta = rotation_vector(X_WP.rotation() @ self._start.rotation().inverse())
        angle = float(np.linalg.norm(theta))
        if angle > LARGEST_TURN:
            raise PlanningError(
                f"goal: found a turn of {np.degrees(angle):.4g} deg from the start; accepted: to "
                f"{np.degrees(LARGEST_TURN):.4g} deg"
            )
        g = theta * (np.tan(0.5 * angle) / angle if angle > 0.0 else 0.5)
        six = np.concatenate([g, X_WP.translation() - self._origin[4:]])
        still = np.delete(six, self.rows)
        if np.any(np.abs(still) > 1e-9):
            raise PlanningError("goal: found a pose out of the platform's plane; accepted: in it")
        return np.asarray(six[self.rows])

    def numbers(self, coordinates: Array, power: int) -> Array:
        """Quaternion and place, shape (7,), or with power > 0 what a derivative adds to them."""
        moved: Array = self._basis @ coordinates
        return moved + self._origin if power == 0 else moved

    def _write(self, x: Array, points: Array, seeds: Array) -> None:
        relative_points(x, self._origin, self._basis, points, seeds)


class PlaceAndAngles(Coordinates):
    """(x, y, z, phi, theta, psi) [m, rad], R = Rx(phi) Ry(theta) Rz(psi), and their derivatives."""

    sizes = (6, 12, 18)

    def _write(self, x: Array, points: Array, seeds: Array) -> None:
        angle_points(x, points, seeds)


class BodyState(Coordinates):
    """Quaternion wxyz and place of Po, then V_WP, then A_WP, as a floating body of a plant has it.

    The quaternion may have any length but zero.
    """

    sizes = (7, 13, 19)

    def _write(self, x: Array, points: Array, seeds: Array) -> None:
        body_points(x, points, seeds)
