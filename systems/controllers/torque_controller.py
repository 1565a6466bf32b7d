"""Commands winches by torque, behind a visual servo."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.control.torque_law import TorqueServoLaw


class TorqueController(LeafSystem):
    """Motor torques that move the platform as a visual servo wants it.

    ================= ============== ======== ===================================================
    port              type           unit     meaning
    ================= ============== ======== ===================================================
    platform_velocity vector(6)      rad/s,   in, the servo's twist (w, v) of P in P
                                     m/s
    X_WP              RigidTransform m        in, believed pose of the platform
    tensions          vector(m)      N        in, measured
    length_rates      vector(m)      m/s      in, of the unstrained lengths, as the drives know them
    left_out          vector(m)      -        in, may stay open: not 0 for each cable that is
                                              broken, of which nothing is asked
    halted            vector(1)      -        in, may stay open: not 0 while the platform is to
                                              stay where it is, whatever the servo wants
    halted_twist      vector(6)      rad/s,   in, may stay open: twist (w, v) of P in P that is
                                     m/s      wanted then in place of none
    braking           vector(1)      -        in, may stay open: not 0 while motion is to end,
                                              wherever that is, see `TorqueServoLaw.without`
    motor_torques     vector(m)      N m      out, to the winches, positive pays out
    wanted_tensions   vector(m)      N        out, what the torques are for
    desired_wrench    vector(6)      N m, N   out, F_P_W about Po for the servo's acceleration
    platform_twist    vector(6)      rad/s,   out, twist of P in P that the winches' speeds tell
                                     m/s
    relaxed           vector(1)      -        out, 1 while no tensions within the limits give the
                                              wrench: those are asked for of which it is nearest
    relaxed_steps     vector(1)      -        out, at how many steps that was so
    ================= ============== ======== ===================================================

    Samples its inputs at a rate of its own, much faster than the servo's, and holds its torques.
    The law is that of `torque_law.TorqueServoLaw`.

    Source: servoing thesis 5.2.3, Figs 5.5 to 5.7.
    """

    def __init__(self, law: TorqueServoLaw, rate: float) -> None:
        """With a law that is made for steps at a rate [Hz]."""
        super().__init__()
        self.law, m = law, law.cable_count
        self._others: dict[tuple[bytes, bool], TorqueServoLaw] = {}
        self._twist = self.DeclareVectorInputPort("platform_velocity", 6).Eval
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform())).Eval
        self._tensions = self.DeclareVectorInputPort("tensions", m).Eval
        self._rates = self.DeclareVectorInputPort("length_rates", m).Eval
        self._left_out = self.DeclareVectorInputPort("left_out", m)
        self._halted = self.DeclareVectorInputPort("halted", 1)
        self._halted_twist = self.DeclareVectorInputPort("halted_twist", 6)
        self._braking = self.DeclareVectorInputPort("braking", 1)
        self._outputs = {
            name: self.DeclareDiscreteState(size)
            for name, size in (
                ("motor_torques", m), ("wanted_tensions", m), ("desired_wrench", 6),
                ("platform_twist", 6), ("relaxed", 1),
            )
        }  # fmt: skip
        self._memory = self.DeclareDiscreteState(law.fresh_memory())
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        for name, index in self._outputs.items():
            self.DeclareStateOutputPort(name, index)
        self.DeclareVectorOutputPort(
            "relaxed_steps", 1, self._calc_relaxed, {self.discrete_state_ticket(self._memory)}
        )

    def steps(self, context: Context) -> tuple[int, int]:
        """How many steps there were, and in how many the fallback answered; its own context."""
        return self.law.steps(context.get_discrete_state(self._memory).value())

    def largest_rate(self, context: Context) -> float:
        """Largest rate of a taut cable's wanted tension so far [N/s], from its own context."""
        return self.law.largest_rate(context.get_discrete_state(self._memory).value())

    def _calc_relaxed(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.steps(context)[1])])

    def _law_now(self, context: Context) -> TorqueServoLaw:
        if not self._left_out.HasValue(context):
            return self.law
        flags = self._left_out.Eval(context) != 0.0
        if not np.any(flags):
            return self.law
        braking = self._braking.HasValue(context) and self._braking.Eval(context)[0] != 0.0
        key = flags.tobytes(), bool(braking)
        if key not in self._others:
            self._others[key] = self.law.without(flags, braking=bool(braking))
        return self._others[key]

    def _update(self, context: Context, state: DiscreteValues) -> None:
        readings = np.array([self._tensions(context), self._rates(context)])
        twist = self._twist(context)
        if self._halted.HasValue(context) and self._halted.Eval(context)[0] != 0.0:
            asked = self._halted_twist
            twist = asked.Eval(context) if asked.HasValue(context) else np.zeros(6)
        command, memory = self._law_now(context).step(
            context.get_discrete_state(self._memory).value(),
            twist,
            self._X_WP(context),
            readings,
            context.get_time(),
        )
        state.set_value(self._memory, memory)
        for name, value in (
            ("motor_torques", command.torques), ("wanted_tensions", command.tensions),
            ("desired_wrench", command.wrench), ("platform_twist", command.V_P),
            ("relaxed", [float(command.relaxed)]),
        ):  # fmt: skip
            state.set_value(self._outputs[name], value)
