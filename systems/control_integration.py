"""Estimates the platform's pose by integrating what the controller asks for."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.poses import exponential


class ControlIntegration(LeafSystem):
    """Estimator 1: the platform does what it is told, X_WP(t) = X_WP(t_k) exp(V_P (t - t_k)).

    ================= ============== ========== =============================================
    port              type           unit       meaning
    ================= ============== ========== =============================================
    platform_velocity vector(6)      rad/s, m/s in, twist (w, v) of P in P, constant between
                                                 the controller's updates
    X_WP              RigidTransform m          out, estimated pose of the platform
    ================= ============== ========== =============================================

    Source: servoing thesis (2.1).
    """

    def __init__(self, X_WP0: RigidTransform, rate: float) -> None:
        """With the pose at time 0 [m] and the controller's rate [Hz]."""
        super().__init__()
        self._velocity = self.DeclareVectorInputPort("platform_velocity", 6)
        # Time t_k and the pose then (rotation row by row, origin).
        self._known = self.DeclareDiscreteState(_pack(0.0, X_WP0))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareAbstractOutputPort("X_WP", lambda: Value(RigidTransform()), self._calc_pose)

    def _pose(self, context: Context) -> RigidTransform:
        known = context.get_discrete_state(self._known).value()
        R = RotationMatrix.ProjectToRotationMatrix(known[1:10].reshape(3, 3))
        X_WPk = RigidTransform(R, known[10:13])
        elapsed = context.get_time() - known[0]
        return X_WPk @ exponential(self._velocity.Eval(context) * elapsed)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        # The controller updates at this same time; what is read here is its previous output.
        state.set_value(self._known, _pack(context.get_time(), self._pose(context)))

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._pose(context))


def _pack(time: float, X_WP: RigidTransform) -> Array:
    return np.concatenate([[time], X_WP.rotation().matrix().ravel(), X_WP.translation()])
