"""Winches with motors: inertia, friction, brake, limits, layers on the drum and inner loops."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import (
    BasicVector,
    BasicVector_,
    Context,
    ContinuousState,
    ContinuousStateIndex,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    LeafSystem_,
)
from pydrake.systems.primitives import Demultiplexer
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.arrays import Array
from cdpr_drake.systems.robots.failures import JAMMED, POWERLESS
from cdpr_drake.systems.robots.random_pose import Following
from cdpr_drake.systems.robots.templates import class_for_floats
from cdpr_drake.winches.failed_winches import fail_winches, failed_law, pack_failing_winches
from cdpr_drake.winches.groups import WinchGroups
from cdpr_drake.winches.motor import (
    MODES,
    TORQUE,
    WinchLaw,
    WinchMotion,
    resting_motors,
    winch_motion,
)
from cdpr_drake.winches.motor_kernel import pack_winch, winch_rates, winch_torques

COMMAND_PORTS = {
    "torque": "motor_torques",
    "velocity": "cable_velocities",
    "position": "commanded_lengths",
}
"""Name of the input that commands a winch, by mode."""


class MotorWinch(Diagram):
    """m winches of one kind that pull on cables.

    ======================= ========= ===== ==================================================
    port                    type      unit  meaning
    ======================= ========= ===== ==================================================
    motor_torques           vector(k) N m   in, mode torque: wanted torque of the motors
    cable_velocities        vector(k) m/s   in, mode velocity: wanted cable velocities
    commanded_lengths       vector(k) m     in, mode position: wanted unstrained lengths
    tensions                vector(m) N     in, of the cables at the drums
    brakes                  vector(k) -     in, 1 holds, 0 releases; only if there are brakes
    jammed                  vector(k) -     in, only if they may fail, may stay open: not 0 for
                                            each drum that stands still
    powerless               vector(k) -     in, as jammed, for each motor without power
    unstrained_lengths      vector(m) m     out
    unstrained_length_rates vector(m) m/s   out
    motor_angles            vector(m) rad   out, zero where the cables have their home lengths
    motor_speeds            vector(m) rad/s out
    applied_torques         vector(m) N m   out, of the motors, within their limits
    friction_torques        vector(m) N m   out, what friction and brakes take up
    ======================= ========= ===== ==================================================

    There are k = m winches, but where `WinchLaw.groups` puts several cables on one: it turns by
    the sum of their torques and moves them by the same length. A wanted length then is that of the
    first cable on the winch; outputs tell of each cable, or of the motor that it is on.

    Everything positive pays cable out, so a motor that holds a cable has a negative torque.
    Lengths and their rates are states, so cables may feed `tensions`. The state is continuous;
    `winches.motor` has the equations.
    """

    def __init__(
        self,
        law: WinchLaw,
        mode: str,
        home: Array,
        may_fail: bool = False,
        start: tuple[Array, Array] | None = None,
        following: Following | None = None,
    ) -> None:
        """Builds the winches.

        Args:
            law: Their kind.
            mode: A name of `MODES`.
            home: Unstrained lengths at angle zero, shape (m,) [m].
            may_fail: Whether they have inputs for what fails.
            start: Of default contexts, unstrained lengths and the tensions at the drums that the
                motors hold, shape (m,) each [m, N]; None: `home`, without tension.
            following: How lengths follow a random pose, with an input platform_state; None: they
                do not.
        """
        super().__init__()
        m = len(home)
        builder = DiagramBuilder()
        motors = self._motors = builder.AddNamedSystem(
            "motors", WinchMotors(law, mode, home, may_fail, start=start, following=following)
        )
        parts = builder.AddNamedSystem("parts", Demultiplexer([m] * motors.num_groups()))
        builder.Connect(motors.GetOutputPort("state"), parts.get_input_port())
        for index in range(motors.num_input_ports()):
            port = motors.get_input_port(index)
            builder.ExportInput(port, port.get_name())
        builder.ExportOutput(parts.get_output_port(0), "unstrained_lengths")
        builder.ExportOutput(parts.get_output_port(1), "unstrained_length_rates")
        for name in ("motor_angles", "motor_speeds", "applied_torques", "friction_torques"):
            builder.ExportOutput(motors.GetOutputPort(name), name)
        builder.BuildInto(self)

    def hold(self, context: Context, lengths: Array, tensions: Array) -> None:
        """Stops the motors where cables have these unstrained lengths and holds tensions.

        In mode torque the command has to hold them, and friction helps.

        Args:
            context: This diagram's own context.
            lengths: Unstrained lengths, shape (m,) [m].
            tensions: At the drums, shape (m,) [N].
        """
        motors = self.GetMutableSubsystemContext(self._motors, context)
        motors.SetContinuousState(self._motors.holding_state(lengths, tensions))

    def set_unstrained_lengths(self, context: Context, lengths: Array) -> None:
        """Stops the motors, without torque, at these lengths, shape (m,) [m]."""
        self.hold(context, lengths, np.zeros(len(lengths)))


# With its scope, since Drake would search the whole call stack for it.
@TemplateSystem.define("WinchMotors_", T_list=(float, AutoDiffXd), scope=sys.modules[__name__])
def WinchMotors_(T: Any) -> type[LeafSystem]:
    """The motors of `MotorWinch` for scalars of type T, float or AutoDiffXd."""

    class Impl(LeafSystem_[T]):
        """Motors with drums; inputs and outputs as of `MotorWinch`, and in place of lengths

        ===== ========== ==== =================================================================
        port  type       unit meaning
        ===== ========== ==== =================================================================
        state vector(3m) m    out, unstrained lengths, their rates and, but in mode torque, the
                              integrals of the speed loops [N m]
        ===== ========== ==== =================================================================
        """

        def _construct(
            self,
            law: WinchLaw,
            mode: str,
            home: Array,
            may_fail: bool = False,
            *,
            start: tuple[Array, Array] | None = None,
            following: Following | None = None,
            converter: Any = None,
        ) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._law, self._mode_name, self._mode = law, mode, MODES[mode]
            self._home = np.ascontiguousarray(home, dtype=float)
            m = self._m = len(self._home)
            groups = law.groups or WinchGroups(tuple(range(m)))
            k, self._of_cable = groups.count, list(groups.of_cable)
            self._leaders = list(groups.leaders())
            self._whole = pack_failing_winches(law, m) if may_fail else pack_winch(law)
            self._constants = self._whole.copy()
            self._released = np.zeros(m)
            num_z = 0 if self._mode == TORQUE else m
            self._work = np.zeros(2 * m + num_z)
            self._pairs = np.zeros((2, m))
            self._start = (self._home, np.zeros(m)) if start is None else start
            begin = BasicVector_[T](self.holding_state(*self._start))
            index = self.DeclareContinuousState(begin, num_q=m, num_v=m, num_z=num_z)
            # Looked up once: these are called several thousand times per simulated second.
            self._command = self.DeclareVectorInputPort(COMMAND_PORTS[mode], k).Eval
            self._tensions = self.DeclareVectorInputPort("tensions", m).Eval
            self._brakes = None
            if law.brake_torque > 0.0:
                self._brakes = self.DeclareVectorInputPort("brakes", k).Eval
            self._faults = [
                self.DeclareVectorInputPort(name, k) for name in (JAMMED, POWERLESS) if may_fail
            ]
            self._following = following
            if following is not None:
                following.declare(self, self.holding_state(*self._start))
            # Written by Drake itself, which is quicker than a port of this class.
            self.DeclareStateOutputPort("state", ContinuousStateIndex(index))
            angles = {self.q_ticket()}
            everything = {self.all_input_ports_ticket(), self.xc_ticket()}
            for name, calc, ticket in (
                ("motor_angles", self._calc_angles, angles),
                ("motor_speeds", self._calc_speeds, {*angles, self.v_ticket()}),
                ("applied_torques", self._calc_torques, everything),
                ("friction_torques", self._calc_friction, everything),
            ):
                self.DeclareVectorOutputPort(name, m, calc, ticket)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            may_fail = bool(other._faults)
            Impl._construct(
                self, other._law, other._mode_name, other._home, may_fail, start=other._start,
                following=other._following, converter=converter,
            )  # fmt: skip

        def num_groups(self) -> int:
            """How many vectors of m the state has."""
            return len(self._work) // self._m

        def holding_state(self, lengths: Array, tensions: Array) -> Array:
            """The state at rest at unstrained lengths [m], with torques that hold tensions [N]."""
            return resting_motors(self._law, self._mode, self._home, lengths, tensions)

        def _inputs(self, context: Context) -> tuple[Array, Array, Array, Array]:
            """State, tensions, command and brakes of now."""
            state = context.get_continuous_state_vector().CopyToVector()
            brakes, command = self._released, self._command(context)
            if self._brakes is not None:
                brakes = self._brakes(context)[self._of_cable]
            if self._faults:
                jammed, powerless = self._failed(context)
                brakes = fail_winches(self._whole, brakes, jammed, powerless, self._constants)
            return state, self._tensions(context), command[self._of_cable], brakes

        def _failed(self, context: Context) -> list[Array]:
            """Flags of what stands still and of what has no power, shape (m,) each."""
            flags = []
            for port in self._faults:
                found = port.Eval(context) if port.HasValue(context) else np.zeros(port.size())
                numbers = [float(x.value() if isinstance(x, AutoDiffXd) else x) for x in found]
                flags.append(np.array(numbers)[self._of_cable])
            return flags

        def _motion(self, context: Context) -> WinchMotion:
            state, tensions, command, brakes = self._inputs(context)
            law = failed_law(self._law, *self._failed(context)) if self._faults else self._law
            m = self._m
            z = 0.0 * state[:m] if self._mode == TORQUE else state[2 * m :]
            parts = (state[:m], state[m : 2 * m], z)
            return winch_motion(law, self._mode, parts, tensions, command, brakes, home=self._home)

        def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
            """Length rates, length accelerations and rates of the integrals."""
            if T is float:
                state, tensions, command, brakes = self._inputs(context)
                winch_rates(
                    state, tensions, command, brakes, self._home, self._mode, self._constants,
                    self._work,
                )  # fmt: skip
                derivatives.get_mutable_vector().SetFromVector(self._work)
                return
            motion = self._motion(context)
            rates = context.get_continuous_state_vector().CopyToVector()[self._m : 2 * self._m]
            parts = [rates, motion.length_acceleration]
            if self._mode != TORQUE:
                parts.append(motion.integral_rate)
            derivatives.get_mutable_vector().SetFromVector(np.concatenate(parts))

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

        def _calc_angles(self, context: Context, output: BasicVector) -> None:
            lengths = context.get_continuous_state_vector().CopyToVector()[: self._m]
            angles = self._law.drum.motor_angles(lengths - self._home)
            output.SetFromVector(angles[self._leaders])

        def _calc_speeds(self, context: Context, output: BasicVector) -> None:
            state, m = context.get_continuous_state_vector().CopyToVector(), self._m
            per_angle, _ = self._law.drum.turning(state[:m] - self._home)
            output.SetFromVector(state[m : 2 * m] / per_angle)

        def _calc_torques(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._torques(context)[0])

        def _calc_friction(self, context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._torques(context)[1])

    return Impl


if TYPE_CHECKING:  # what an editor cannot see in a template

    class WinchMotors(LeafSystem):
        """`WinchMotors_` for float."""

        def __init__(
            self,
            law: WinchLaw,
            mode: str,
            home: Array,
            may_fail: bool = False,
            *,
            start: tuple[Array, Array] | None = None,
            following: Following | None = None,
        ) -> None: ...
        def num_groups(self) -> int: ...  # noqa: D102
        def holding_state(self, lengths: Array, tensions: Array) -> Array: ...  # noqa: D102
else:
    WinchMotors = class_for_floats(WinchMotors_)
