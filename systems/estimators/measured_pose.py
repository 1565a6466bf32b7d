"""The platform's pose as it is measured from outside, and one that is always wrong by the same."""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem


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
