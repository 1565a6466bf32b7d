"""Pose-based visual servoing of a cable robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cable_geometry import length_jacobian
from cdpr_drake.pose_feature import pose_feature_error, pose_interaction
from cdpr_drake.poses import adjoint
from cdpr_drake.servo_law import AdaptiveGain, saturation_share, servo_velocity

if TYPE_CHECKING:
    from cdpr_drake.systems.servo_model import ServoModel


@dataclass(frozen=True)
class ServoTuning:
    """Gains of a visual servo.

    Attributes:
        gain: Adaptive gain lambda [1/s].
        sigma: Rate at which the continuous start is forgotten [1/s]; None starts abruptly.
    """

    gain: AdaptiveGain
    sigma: float | None


class PoseServo(LeafSystem):
    """Moves the platform until the camera sees the tag at a desired pose (PBVS).

    ================= ============== ======== ===============================================
    port              type           unit     meaning
    ================= ============== ======== ===============================================
    X_CO              RigidTransform m        in, measured pose of the tag in the camera
    found             vector(1)      -        in, 1 while the tag is seen
    X_WP              RigidTransform m        in, estimated pose of the platform
    cable_velocities  vector(m)      m/s      out, to the winches, positive pays out
    platform_velocity vector(6)      rad/s,   out, the twist (w, v) of P in P that the cables
                                     m/s      are asked for
    error             vector(6)      rad, m   out, (theta u, p_CO - p_CdO), last one measured
    gain              vector(1)      1/s      out, adaptive gain lambda
    ================= ============== ======== ===============================================

    Discrete updates at a rate of its own. While the tag is not found the cables stop; when it is
    found again the continuous start begins anew. Velocities beyond the cables' speed are scaled
    down together, so the direction of motion stays.

    Source: servoing thesis (1.31), (1.35), (1.39), with the exact interaction matrix.
    """

    def __init__(
        self, model: ServoModel, tuning: ServoTuning, X_CdO: RigidTransform, rate: float
    ) -> None:
        """With the desired pose X_CdO of the tag in the camera [m] and a control rate [Hz]."""
        super().__init__()
        self._model, self._tuning, self._X_CdO = model, tuning, X_CdO
        self._to_camera = adjoint(model.X_PC.inverse())[:, list(model.motions)]
        m = model.p_WA.shape[1]
        self._X_CO = self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        self._found = self.DeclareVectorInputPort("found", 1)
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._outputs = {
            name: self.DeclareDiscreteState(size)
            for name, size in (
                ("cable_velocities", m),
                ("platform_velocity", 6),
                ("error", 6),
                ("gain", 1),
            )
        }
        # When the task began (negative: it has not), and L_0^+ e_0 at that time.
        self._begun = self.DeclareDiscreteState(np.array([-1.0]))
        self._start = self.DeclareDiscreteState(len(model.motions))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        for name, index in self._outputs.items():
            self.DeclareStateOutputPort(name, index)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        if self._found.Eval(context)[0] == 0.0:
            state.set_value(self._begun, [-1.0])
            for name in ("cable_velocities", "platform_velocity", "gain"):
                state.get_mutable_vector(self._outputs[name]).SetZero()
            return
        X_CO = self._X_CO.Eval(context)
        error = pose_feature_error(X_CO, self._X_CdO)
        L = pose_interaction(X_CO, self._X_CdO) @ self._to_camera
        gain = self._tuning.gain(error)
        begun, start = self._task_start(context, state, L, error)
        reduced = servo_velocity(
            L, error, gain, start, self._tuning.sigma or 0.0, context.get_time() - begun
        )
        V_P = np.zeros(6)
        V_P[list(self._model.motions)] = reduced
        velocities, V_P = self._cable_velocities(V_P, self._X_WP.Eval(context))
        state.set_value(self._outputs["cable_velocities"], velocities)
        state.set_value(self._outputs["platform_velocity"], V_P)
        state.set_value(self._outputs["error"], error)
        state.set_value(self._outputs["gain"], [gain])

    def _task_start(
        self, context: Context, state: DiscreteValues, L: Array, error: Array
    ) -> tuple[float, Array]:
        """Time when the task began and its L_0^+ e_0; begins it if there is none."""
        begun = float(context.get_discrete_state(self._begun).value()[0])
        start = np.array(context.get_discrete_state(self._start).value())
        if begun < 0.0:
            begun = context.get_time()
            start[:] = 0.0
            if self._tuning.sigma is not None:
                start[:] = np.linalg.pinv(L) @ error
            state.set_value(self._begun, [begun])
            state.set_value(self._start, start)
        return begun, start

    def _cable_velocities(self, V_P: Array, X_WP: RigidTransform) -> tuple[Array, Array]:
        """Cable velocities [m/s] for a platform twist in P, both within the cables' speed."""
        R = X_WP.rotation().matrix()
        V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
        velocities = length_jacobian(X_WP, self._model.p_WA, self._model.p_PB) @ V_WP
        share = saturation_share(velocities, self._model.cable_speed)
        return share * velocities, share * V_P
