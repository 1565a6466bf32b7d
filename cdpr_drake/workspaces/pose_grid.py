"""Grids of platform poses over a box: positions on axes, each in one or several orientations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorkspaceGridError
from cdpr_drake.geometry.poses import pose_from_angles, pose_rows, rotation_from_angles

STEP_ROUNDING = 1e-6
"""A box that is a whole number of steps up to this share of a step ends with a point."""

NO_TURN = (0.0, 0.0, 0.0)
"""Angles of a platform that is not turned [rad]."""


@dataclass(frozen=True, eq=False)
class WorkspaceGrid:
    """Positions (x, y, z) of Po in W, each in every one of some orientations.

    Poses are numbered with z running fastest, then y, x and the orientation, so an array over the
    poses reshapes to `shape`.

    Attributes:
        axes: Coordinates along x, y and z, each ascending and evenly spaced, shape (n,) [m].
        angles: Angles (phi, theta, psi) of the platform, shape (k, 3) [rad].

    Raises:
        WorkspaceGridError: An axis is empty, not finite or not ascending, or there is no
            orientation.
    """

    axes: tuple[Array, Array, Array]
    angles: Array

    def __post_init__(self) -> None:
        """Converts to arrays and checks them."""
        axes = tuple(np.array(axis, float).reshape(-1) for axis in self.axes)
        for name, axis in zip("xyz", axes, strict=True):
            if len(axis) == 0:
                raise WorkspaceGridError(f"grid: {name}: found no points; accepted: at least one")
            if not np.all(np.isfinite(axis)):
                raise WorkspaceGridError(
                    f"grid: {name}: found NaN or infinity; accepted: finite numbers [m]"
                )
            if np.any(np.diff(axis) <= 0.0):
                raise WorkspaceGridError(f"grid: {name}: accepted: ascending coordinates [m]")
        angles = np.array(self.angles, float).reshape(-1, 3)
        if len(angles) == 0 or not np.all(np.isfinite(angles)):
            raise WorkspaceGridError(
                f"grid: found {len(angles)} orientations, or one that is not finite; accepted: at "
                "least one, of finite angles (phi, theta, psi) [rad]"
            )
        object.__setattr__(self, "axes", axes)
        object.__setattr__(self, "angles", angles)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of orientations and of points along x, y, z."""
        nx, ny, nz = (len(axis) for axis in self.axes)
        return len(self.angles), nx, ny, nz

    @property
    def size(self) -> int:
        """Number of poses."""
        return int(np.prod(self.shape))

    @property
    def lower(self) -> Array:
        """Lower corner of the box, shape (3,) [m]."""
        return np.array([axis[0] for axis in self.axes])

    @property
    def upper(self) -> Array:
        """Upper corner of the box, shape (3,) [m]."""
        return np.array([axis[-1] for axis in self.axes])

    @property
    def steps(self) -> Array:
        """Distances between neighbours along x, y, z, 0 along an axis of one point, (3,) [m]."""
        return np.array(
            [(axis[-1] - axis[0]) / (len(axis) - 1) if len(axis) > 1 else 0.0 for axis in self.axes]
        )

    def positions(self, start: int = 0, stop: int | None = None) -> Array:
        """p_WP of the poses start to stop, shape (n, 3) [m]."""
        _, *indices = np.unravel_index(self._range(start, stop), self.shape)
        return np.stack([axis[i] for axis, i in zip(self.axes, indices, strict=True)], axis=-1)

    def rotations(self, start: int = 0, stop: int | None = None) -> Array:
        """R_WP of the poses start to stop, shape (n, 3, 3)."""
        turns = np.array([rotation_from_angles(angles).matrix() for angles in self.angles])
        which = np.unravel_index(self._range(start, stop), self.shape)[0]
        return np.asarray(turns[which], float)

    def poses(self, start: int = 0, stop: int | None = None) -> list[RigidTransform]:
        """X_WP of the poses start to stop [m]."""
        return [
            RigidTransform(RotationMatrix(R), p)
            for R, p in zip(self.rotations(start, stop), self.positions(start, stop), strict=True)
        ]

    def pose_rows(self, start: int = 0, stop: int | None = None) -> Array:
        """X_WP of the poses start to stop as (qw, qx, qy, qz, x, y, z), shape (n, 7) [-, m]."""
        turns = pose_rows(pose_from_angles(np.zeros(3), angles) for angles in self.angles)[:, :4]
        which = np.unravel_index(self._range(start, stop), self.shape)[0]
        return np.concatenate([turns[which], self.positions(start, stop)], axis=1)

    def columns(self) -> dict[str, Array]:
        """Positions and angles of all poses by name, shape (n,) each [m, rad]."""
        which = np.unravel_index(self._range(0, None), self.shape)[0]
        named = zip(("x_m", "y_m", "z_m"), self.positions().T, strict=True)
        turned = zip(("phi_rad", "theta_rad", "psi_rad"), self.angles[which].T, strict=True)
        return {**dict(named), **dict(turned)}

    def _range(self, start: int, stop: int | None) -> np.ndarray:
        return np.arange(*slice(start, stop).indices(self.size))


def axis_by_step(lower: float, upper: float, step: float, name: str = "axis") -> Array:
    """lower, lower + step, ... up to upper, which counts if a whole number of steps away, (n,) [m].

    Raises:
        WorkspaceGridError: The numbers are not finite, step is not positive, or upper < lower.
    """
    if not (np.all(np.isfinite([lower, upper, step])) and step > 0.0 and upper >= lower):
        raise WorkspaceGridError(
            f"grid: {name}: found {lower:g} to {upper:g} by {step:g}, which has no points; "
            "accepted: lower <= upper and a step > 0 [m]"
        )
    count = int(np.floor((upper - lower) / step + STEP_ROUNDING)) + 1
    return np.asarray(lower + step * np.arange(count), float)


def axis_by_count(lower: float, upper: float, count: int, name: str = "axis") -> Array:
    """`count` points from lower to upper, both included; the middle if one, shape (n,) [m].

    Raises:
        WorkspaceGridError: The numbers are not finite, count < 1, or upper < lower.
    """
    if not (np.all(np.isfinite([lower, upper])) and count >= 1 and upper >= lower):
        raise WorkspaceGridError(
            f"grid: {name}: found {count} points from {lower:g} to {upper:g}; "
            "accepted: at least one point, lower <= upper [m]"
        )
    if count == 1 or upper == lower:
        return np.array([0.5 * (lower + upper)])
    return np.linspace(lower, upper, count)


def grid_by_step(
    lower: Array, upper: Array, step: Array, angles: Sequence[Sequence[float]] = (NO_TURN,)
) -> WorkspaceGrid:
    """The grid of a box from lower to upper by step, each shape (3,) [m]; `axis_by_step`.

    Args:
        lower: Lower corner.
        upper: Upper corner.
        step: Distance between neighbours along x, y, z.
        angles: Angles (phi, theta, psi) of the platform, k times three [rad].
    """
    x, y, z = (
        axis_by_step(float(a), float(b), float(h), name)
        for a, b, h, name in zip(lower, upper, step, "xyz", strict=True)
    )
    return WorkspaceGrid((x, y, z), np.array(angles, float))


def grid_by_count(
    lower: Array,
    upper: Array,
    counts: Sequence[int],
    angles: Sequence[Sequence[float]] = (NO_TURN,),
) -> WorkspaceGrid:
    """The grid of a box from lower to upper, shape (3,) [m], of some points; `axis_by_count`.

    Args:
        lower: Lower corner.
        upper: Upper corner.
        counts: Numbers of points along x, y, z.
        angles: Angles (phi, theta, psi) of the platform, k times three [rad].
    """
    x, y, z = (
        axis_by_count(float(a), float(b), n, name)
        for a, b, n, name in zip(lower, upper, counts, "xyz", strict=True)
    )
    return WorkspaceGrid((x, y, z), np.array(angles, float))
