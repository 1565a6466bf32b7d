"""An estimator that believes in the first pose."""

from __future__ import annotations

from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.systems.estimators.pose_estimator import PoseEstimator, Read


class FirstPose(PoseEstimator):
    """The pose believed at the start, for ever.

    ==== ============== ==== ==================================
    port type           unit meaning
    ==== ============== ==== ==================================
    X_WP RigidTransform m    out, estimated pose of the platform
    ==== ============== ==== ==================================
    """

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """As the base class says."""
        return X_WP, extra
