"""Estimators of the platform's pose from one reading: a tracker's, or the controller's own output.

`MeasuredPose` passes a measurement from outside on; `ShiftedPose` is always wrong by the same;
`ControlIntegration` integrates what the controller asks for.
"""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator, Read


class MeasuredPose(LeafSystem):
    """Passes on the readings of a tracker, with the ports of an estimator.

    ============= ============== ==== =====================================
    port          type           unit meaning
    ============= ============== ==== =====================================
    X_WP_measured RigidTransform m    in, latest measurement
    X_WP          RigidTransform m    out, the same
    ============= ============== ==== =====================================

    Before its first sample a tracker gives the identity; the estimate is then the pose believed at
    the start.

    Source: servoing thesis 2.3, measurement 1.
    """

    def __init__(self, X_WP0: RigidTransform) -> None:
        """With the pose believed at the start [m]."""
        super().__init__()
        self._X_WP0 = X_WP0
        self._measured = self.DeclareAbstractInputPort("X_WP_measured", Value(RigidTransform()))
        self.DeclareAbstractOutputPort("X_WP", lambda: Value(RigidTransform()), self._calc_pose)

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.passed_on(self._measured.Eval(context)))

    def passed_on(self, X_WP: RigidTransform) -> RigidTransform:
        """The estimate from a reading."""
        return self._X_WP0 if X_WP.IsExactlyIdentity() else X_WP


class ShiftedPose(LeafSystem):
    """A measured pose with a constant error: what analyses of stability assume of an estimate.

    ============= ============== ==== ===========================================
    port          type           unit meaning
    ============= ============== ==== ===========================================
    X_WP_measured RigidTransform m    in, pose of the platform
    X_WP          RigidTransform m    out, the same, shifted in W and turned in P
    ============= ============== ==== ===========================================
    """

    def __init__(self, X_WP0: RigidTransform, believed: RigidTransform) -> None:
        """With a pose of the platform and what is believed there; they define the error [m]."""
        super().__init__()
        self._shift = believed.translation() - X_WP0.translation()
        self._turn = X_WP0.rotation().inverse() @ believed.rotation()
        self._pose = self.DeclareAbstractInputPort("X_WP_measured", Value(RigidTransform()))
        self.DeclareAbstractOutputPort("X_WP", lambda: Value(RigidTransform()), self._calc_pose)

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.passed_on(self._pose.Eval(context)))

    def passed_on(self, X_WP: RigidTransform) -> RigidTransform:
        """The estimate from a reading."""
        return RigidTransform(X_WP.rotation() @ self._turn, X_WP.translation() + self._shift)


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
