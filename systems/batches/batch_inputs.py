"""What users hand to a batch, as arrays with a row for each robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose

UNIT = 1e-6
"""By how much the norm of a quaternion may differ from one: what files of six digits keep."""


def per_robot(name: str, given: object, count: int, size: int) -> Array:
    """Numbers for each robot, shape (count, size), from these or from one row for all.

    Raises:
        CdprError: They are of another shape, or not finite.
    """
    try:
        values = np.asarray(given, float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape not in ((size,), (count, size)):
        raise CdprError(
            f"{name}: found shape {values.shape}; accepted: ({size},) or ({count}, {size})"
        )
    if not np.isfinite(values).all():
        raise CdprError(f"{name}: found numbers that are not finite; accepted: finite ones")
    return np.broadcast_to(values, (count, size))


def robot_numbers(given: object, count: int) -> np.ndarray:
    """Which robots are meant, as their numbers, each once.

    Args:
        given: A mask, shape (count,), a number or numbers; None: all.
        count: Number of robots.

    Raises:
        CdprError: It is none of these, or there is no such robot.
    """
    if given is None:
        return np.arange(count)
    values: Any = np.asarray(given)
    if values.dtype == bool and values.shape == (count,):
        return np.flatnonzero(values)
    values = np.atleast_1d(values)
    if values.size == 0:
        return np.zeros(0, dtype=np.int64)
    whole = np.issubdtype(values.dtype, np.integer) and values.ndim == 1
    if not whole or values.min() < 0 or values.max() >= count:
        raise CdprError(
            f"robots: found {given!r}; accepted: a mask of {count}, or numbers from 0 to "
            f"{count - 1}"
        )
    return np.unique(values)


def as_poses(robot: Robot, given: object, count: int) -> list[RigidTransform] | None:
    """A pose for each of some robots.

    Args:
        robot: The robot.
        given: Rows of `pose_row`, shape (count, 7), matrices, shape (count, 4, 4) [m], or one pose
            for all in one of the ways of `as_pose`; None: none.
        count: Number of these robots.

    Raises:
        CdprError: It is none of these.
    """
    if given is None:
        return None
    if isinstance(given, list | tuple) and any(isinstance(X, RigidTransform) for X in given):
        poses = [as_pose(robot, X) for X in given]
        if len(poses) != count:
            raise CdprError(f"poses: found {len(poses)}; accepted: {count}, one for each robot")
        return poses
    values = np.asarray(given) if isinstance(given, np.ndarray | list | tuple) else None
    if values is None or values.shape == (4, 4):
        return [as_pose(robot, given)] * count
    if values.shape == (count, 4, 4):
        return [as_pose(robot, each) for each in values]
    rows = per_robot("poses", values, count, 7)
    norms = np.linalg.norm(rows[:, :4], axis=1)
    if np.any(np.abs(norms - 1.0) > UNIT):
        raise CdprError(
            f"poses: found a quaternion of norm {norms[np.argmax(np.abs(norms - 1.0))]:g}; "
            "accepted: (qw, qx, qy, qz, x, y, z) with one of norm 1"
        )
    return [RigidTransform(Quaternion(row[:4] / np.linalg.norm(row[:4])), row[4:]) for row in rows]
