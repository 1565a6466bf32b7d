"""What a servo sees and wants at every pose of a workspace: the error and the object's pose."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_vector


@dataclass(frozen=True, eq=False)
class TargetRows:
    """The state of the features at N poses.

    Attributes:
        theta_u: Rotation vectors of R_CdC, shape (N, 3) [rad].
        error: e_t = p_CO - p_CdO, shape (N, 3) [m].
        p_CO: Position of the object in the camera frame, shape (N, 3) [m]; NaN where unknown.
        R_CO: Orientation of the object, shape (N, 3, 3); NaN where unknown.
    """

    theta_u: Array
    error: Array
    p_CO: Array
    R_CO: Array


class ServoTarget(Protocol):
    """What gives the features at a camera pose."""

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""


@dataclass(frozen=True, eq=False)
class FixedError:
    """The same error at every pose.

    Attributes:
        theta_u: Rotation vector of R_CdC, shape (3,) [rad].
        error: e_t, shape (3,) [m].
        p_CO: Position of the object in the camera frame, shape (3,) [m]; None: unknown.
        R_CO: Orientation of the object, shape (3, 3); None: unknown.
    """

    theta_u: Array = field(default_factory=lambda: np.zeros(3))
    error: Array = field(default_factory=lambda: np.zeros(3))
    p_CO: Array | None = None
    R_CO: Array | None = None

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""
        count = len(p_WC)
        return TargetRows(
            np.tile(np.asarray(self.theta_u, float), (count, 1)),
            np.tile(np.asarray(self.error, float), (count, 1)),
            np.full((count, 3), np.nan if self.p_CO is None else self.p_CO, float),
            np.full((count, 3, 3), np.nan if self.R_CO is None else self.R_CO, float),
        )


@dataclass(frozen=True, eq=False)
class OppositeCorner:
    """The longest path: from every pose to the opposite corner of a box.

    e_t is the corner farthest from the camera minus the camera's position, in the camera frame.

    Attributes:
        lower: Lower corner of the box in W, shape (3,) [m].
        upper: Upper corner of the box in W, shape (3,) [m].
        theta_u: Rotation vector of R_CdC, shape (3,) [rad].
        p_CO: Position of the object in the camera frame, shape (3,) [m]; None: unknown.
        R_CO: Orientation of the object, shape (3, 3); None: unknown.
    """

    lower: Array
    upper: Array
    theta_u: Array = field(default_factory=lambda: np.array([0.0, 0.0, np.pi]))
    p_CO: Array | None = None
    R_CO: Array | None = None

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        corner = np.where(p_WC > (lower + upper) / 2.0, lower, upper)
        return FixedPlace(corner, self.theta_u, self.p_CO, self.R_CO).rows(R_WC, p_WC)


@dataclass(frozen=True, eq=False)
class FixedPlace:
    """From every pose to one point: e_t is the point minus the camera's, in the camera frame.

    Attributes:
        place: The point in W, shape (3,), or one for each pose, shape (N, 3) [m].
        theta_u: Rotation vector of R_CdC, shape (3,) [rad].
        p_CO: Position of the object in the camera frame, shape (3,) [m]; None: unknown.
        R_CO: Orientation of the object, shape (3, 3); None: unknown.
    """

    place: Array
    theta_u: Array = field(default_factory=lambda: np.array([0.0, 0.0, np.pi]))
    p_CO: Array | None = None
    R_CO: Array | None = None

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""
        error = np.einsum("nij,ni->nj", R_WC, np.asarray(self.place, float) - p_WC)
        same = FixedError(self.theta_u, np.zeros(3), self.p_CO, self.R_CO).rows(R_WC, p_WC)
        return TargetRows(same.theta_u, error, same.p_CO, same.R_CO)


@dataclass(frozen=True, eq=False)
class FixedObject:
    """An object that stands in the world and a wanted view of it: a real task.

    Attributes:
        X_WO: Pose of the object.
        X_CdO: Pose of the object in the desired camera frame.
    """

    X_WO: RigidTransform
    X_CdO: RigidTransform

    def rows(self, R_WC: Array, p_WC: Array) -> TargetRows:
        """Features for camera orientations, shape (N, 3, 3), and positions, shape (N, 3) [m]."""
        R_CO = np.einsum("nji,jk->nik", R_WC, self.X_WO.rotation().matrix())
        p_CO = np.einsum("nji,nj->ni", R_WC, self.X_WO.translation() - p_WC)
        theta_u = np.empty((len(p_WC), 3))
        for n, R in enumerate(R_CO):
            R_CdC = self.X_CdO.rotation().matrix() @ R.T
            theta_u[n] = rotation_vector(RotationMatrix.ProjectToRotationMatrix(R_CdC))
        return TargetRows(theta_u, p_CO - self.X_CdO.translation(), p_CO, R_CO)
