"""Winches with motors: inertia, friction, brake, limits, layers on the drum and inner loops."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import BasicVector, Context, ContinuousState, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.winch_kernel import pack_winch, winch_lengths, winch_rates, winch_torques
from cdpr_drake.winch_law import MODES, TORQUE, WinchLaw, WinchMotion, winch_motion

COMMAND_PORTS = {
    "torque": "motor_torques",
    "velocity": "cable_velocities",
    "position": "commanded_lengths",
}
"""Name of the input that commands a winch, by mode."""


@TemplateSystem.define("MotorWinch_", T_list=(float, AutoDiffXd))
def MotorWinch_(T: Any) -> Any:
    """The class for scalars of type T, float or AutoDiffXd; `MotorWinch` is the one for float."""

    class Impl(LeafSystem_[T]):
        """m winches of one kind that pull on cables.

        ======================= ========= ===== ===============================================
        port                    type      unit  meaning
        ======================= ========= ===== ===============================================
        motor_torques           vector(m) N m   in, mode torque: wanted torque of the motors
        cable_velocities        vector(m) m/s   in, mode velocity: wanted cable velocities
        commanded_lengths       vector(m) m     in, mode position: wanted unstrained lengths
        tensions                vector(m) N     in, of the cables at the drums
        brakes                  vector(m) -     in, 1 holds, 0 releases; need not be connected
        unstrained_lengths      vector(m) m     out
        unstrained_length_rates vector(m) m/s   out
        motor_angles            vector(m) rad   out, zero where the cables have their home lengths
        motor_speeds            vector(m) rad/s out
        applied_torques         vector(m) N m   out, of the motors, within their limits
        friction_torques        vector(m) N m   out, what friction and brakes take up
        ======================= ========= ===== ===============================================

        Everything positive pays cable out, so a motor that holds a cable has a negative torque.
        Lengths and their rates follow from the state alone, so cables may feed `tensions`.
        The state is continuous: angles, speeds and, but in mode torque, the speed loops'
        integrals. `cdpr_drake.winch_law` has the equations.
        """

        def _construct(self, law: WinchLaw, mode: str, home: Array, converter: Any = None) -> None:
            """With a kind of winch, a mode of `MODES` and unstrained lengths at angle zero [m]."""
            LeafSystem_[T].__init__(self, converter=converter)
            self._law, self._mode_name, self._mode = law, mode, MODES[mode]
            self._home = np.ascontiguousarray(home, dtype=float)
            m = self._m = len(self._home)
            self._constants = pack_winch(law)
            self._released = np.zeros(m)
            num_z = 0 if self._mode == TORQUE else m
            self._work = np.zeros(2 * m + num_z)
            self._pairs = np.zeros((2, m))
            self.DeclareContinuousState(num_q=m, num_v=m, num_z=num_z)
            # Looked up once: these are called several thousand times per simulated second.
            self._command = self.DeclareVectorInputPort(COMMAND_PORTS[mode], m).Eval
            self._tensions = self.DeclareVectorInputPort("tensions", m).Eval
            self._brakes = self.DeclareVectorInputPort("brakes", m)
            q, w = {self.q_ticket()}, {self.q_ticket(), self.v_ticket()}
            everything = {self.all_input_ports_ticket(), self.xc_ticket()}
            for name, calc, ticket in (
                ("unstrained_lengths", self._calc_lengths, q),
                ("unstrained_length_rates", self._calc_length_rates, w),
                ("motor_angles", self._calc_angles, q),
                ("motor_speeds", self._calc_speeds, {self.v_ticket()}),
                ("applied_torques", self._calc_torques, everything),
                ("friction_torques", self._calc_friction, everything),
            ):
                self.DeclareVectorOutputPort(name, m, calc, ticket)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            Impl._construct(self, other._law, other._mode_name, other._home, converter=converter)

        def law(self) -> WinchLaw:
            """The kind of winch."""
            return self._law

        def set_unstrained_lengths(self, context: Context, lengths: Array) -> None:
            """Stops the motors, without torque, at these lengths, shape (m,) [m]."""
            self.hold(context, lengths, np.zeros(self._m))

        def hold(self, context: Context, lengths: Array, tensions: Array) -> None:
            """Stops the motors where cables have these unstrained lengths and holds tensions.

            In mode torque the command has to hold them, and friction helps.

            Args:
                context: This system's own context.
                lengths: Unstrained lengths, shape (m,) [m].
                tensions: At the drums, shape (m,) [N].
            """
            q = self._law.drum.motor_angles(np.asarray(lengths, float) - self._home)
            state = [q, np.zeros(self._m)]
            if self._mode != TORQUE:
                state.append(-self._law.drum.length_per_angle(q) * tensions)
            context.SetContinuousState(np.concatenate(state))

        def _inputs(self, context: Context) -> tuple[Array, Array, Array, Array]:
            """State, tensions, command and brakes of now."""
            state = context.get_continuous_state_vector().CopyToVector()
            brakes = self._released
            if self._brakes.HasValue(context):
                brakes = self._brakes.Eval(context)
            return state, self._tensions(context), self._command(context), brakes

        def _lengths(self, context: Context) -> Any:
            """Unstrained lengths and rates, two rows of shape (m,)."""
            state = context.get_continuous_state_vector().CopyToVector()
            m, drum = self._m, self._law.drum
            if T is float:
                winch_lengths(state, self._home, self._constants, self._pairs)
                return self._pairs
            q = state[:m]
            return self._home + drum.paid_out(q), drum.length_per_angle(q) * state[m : 2 * m]

        def _torques(self, context: Context) -> Any:
            """Motor torques and friction, two rows of shape (m,)."""
            if T is float:
                state, tensions, command, brakes = self._inputs(context)
                winch_torques(
                    state, tensions, command, brakes, self._home, self._mode, self._constants,
                    self._pairs,
                )  # fmt: skip
                return self._pairs
            motion = self._motion(context)
            return motion.torque, motion.friction

        def _motion(self, context: Context) -> WinchMotion:
            state, tensions, command, brakes = self._inputs(context)
            m = self._m
            z = 0.0 * state[:m] if self._mode == TORQUE else state[2 * m :]
            parts = (state[:m], state[m : 2 * m], z)
            return winch_motion(self._law, self._mode, parts, tensions, command, brakes, self._home)

        def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
            """Speeds, accelerations and rates of the integrals."""
            if T is float:
                state, tensions, command, brakes = self._inputs(context)
                winch_rates(
                    state, tensions, command, brakes, self._home, self._mode, self._constants,
                    self._work,
                )  # fmt: skip
                derivatives.get_mutable_vector().SetFromVector(self._work)
                return
            motion = self._motion(context)
            w = context.get_continuous_state_vector().CopyToVector()[self._m : 2 * self._m]
            rates = [w, motion.acceleration]
            if self._mode != TORQUE:
                rates.append(motion.integral_rate)
            derivatives.get_mutable_vector().SetFromVector(np.concatenate(rates))

        def _calc_lengths(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._lengths(context)[0])

        def _calc_length_rates(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._lengths(context)[1])

        def _calc_angles(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_continuous_state_vector().CopyToVector()[: self._m])

        def _calc_speeds(self, context: Context, output: BasicVector) -> None:
            state = context.get_continuous_state_vector().CopyToVector()
            output.SetFromVector(state[self._m : 2 * self._m])

        def _calc_torques(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._torques(context)[0])

        def _calc_friction(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._torques(context)[1])

    return Impl


MotorWinch = MotorWinch_[float]
