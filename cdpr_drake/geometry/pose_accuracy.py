"""How well a pose was reached, and a line kept: accuracy, repeatability, distance from a line.

`repeatability` compares a pose that was reached several times with the desired one.
`distances_from_line` tells how far a path leaves the straight line, the theses' measure of a
servo's quality.

Source: servoing thesis 2.3.6, Fig. 2.13; ISO 9283:1998.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error


@dataclass(frozen=True, kw_only=True)
class Repeatability:
    """How well a pose was reached, several times over.

    Attributes:
        count: Number of poses.
        mean: Mean pose: mean position, and the rotation nearest to all rotations.
        accuracy: Distance of the mean position from the desired one [m].
        rotation_accuracy: Angle of the mean rotation from the desired one [rad].
        repeatability: Largest distance of a position from the mean one [m].
        rotation_repeatability: Largest angle of a rotation from the mean one [rad].
        iso_9283: Mean distance from the mean position and three standard deviations of it, the
            positioning repeatability RP of ISO 9283 [m]; None for one pose.
    """

    count: int
    mean: RigidTransform
    accuracy: float
    rotation_accuracy: float
    repeatability: float
    rotation_repeatability: float
    iso_9283: float | None


def repeatability(poses: Sequence[RigidTransform], desired: RigidTransform) -> Repeatability:
    """Accuracy and repeatability of poses reached, against the desired one in the same frame [m].

    Raises:
        CdprError: There are no poses.

    Source: servoing thesis 2.3.6, Fig. 2.13; ISO 9283:1998 for RP.
    """
    if not poses:
        raise CdprError("accuracy and repeatability need at least one pose, found none")
    mean = mean_pose(poses)
    errors = np.array([pose_error(mean, X) for X in poses])
    distances = errors[:, 0]
    accuracy, rotation_accuracy = pose_error(desired, mean)
    iso = None
    if len(poses) > 1:
        iso = float(np.mean(distances) + 3.0 * np.std(distances, ddof=1))
    return Repeatability(
        count=len(poses),
        mean=mean,
        accuracy=accuracy,
        rotation_accuracy=rotation_accuracy,
        repeatability=float(np.max(distances)),
        rotation_repeatability=float(np.max(errors[:, 1])),
        iso_9283=iso,
    )


def mean_pose(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Mean position, and the rotation with the least sum of squared chordal distances to all."""
    total: Array = np.sum([X.rotation().matrix() for X in poses], axis=0)
    position = np.mean([X.translation() for X in poses], axis=0)
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(total), position)


def distances_from_line(points: Array, start: Array, end: Array) -> Array:
    """Distances of points, shape (n, d), from the line through start and end, shape (d,), as (n,).

    Any dimension and unit. Where start and end coincide, the distances from that point.
    """
    offset = points - start
    along = end - start
    length = float(np.linalg.norm(along))
    if length > 0.0:
        u = along / length
        offset = offset - np.outer(offset @ u, u)
    return np.asarray(np.linalg.norm(offset, axis=1), float)
