"""Estimates the platform's pose by integrating what the controller asks for."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.spatial import exponential
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator, Read


class ControlIntegration(PoseEstimator):
    """Estimator 1: the platform does what it is told, X_WP(t) = X_WP(t_k) exp(V_P (t - t_k)).

    ================= ============== ========== =============================================
    port              type           unit       meaning
    ================= ============== ========== =============================================
    platform_velocity vector(6)      rad/s, m/s in, twist (w, v) of P in P, constant between
                                                 the controller's updates
    X_WP              RigidTransform m          out, estimated pose of the platform
    ================= ============== ========== =============================================

    With a known tag also its ports, see `PoseEstimator`.

    Source: servoing thesis (2.1).
    """

    def __init__(
        self, X_WP0: RigidTransform, rate: float, known_tag: KnownTag | None = None
    ) -> None:
        """With the pose at time 0 [m] and the controller's rate [Hz]."""
        super().__init__(X_WP0, rate, np.zeros(0), known_tag)
        self.DeclareVectorInputPort("platform_velocity", 6)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """The velocity read now is the controller's previous output, which held until now."""
        return self.between(read, X_WP, elapsed), extra

    def between(self, read: Read, X_WP: RigidTransform, elapsed: float) -> RigidTransform:
        """Moves on with the velocity that holds."""
        if elapsed == 0.0:
            return X_WP
        return X_WP @ exponential(read("platform_velocity") * elapsed)
