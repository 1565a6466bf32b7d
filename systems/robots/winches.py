"""Winches of a robot: an ideal one, which follows a commanded cable velocity at once.

`make_winches` makes the winches that settings ask for, ideal ones or such with motors.
"""

from functools import partial
from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    ContinuousStateIndex,
    Diagram,
    DiagramBuilder,
    LeafSystem,
)
from pydrake.systems.primitives import Integrator, MatrixGain, Saturation

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.failures import JAMMED
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.random_pose import Following
from cdpr_drake.systems.robots.settings import WinchSettings
from cdpr_drake.winches.groups import WinchGroups


class VelocityWinch(Diagram):
    """Integrates commanded cable velocities, limited by the motors' rated speed.

    ======================= ========= ==== ===================================================
    port                    type      unit meaning
    ======================= ========= ==== ===================================================
    cable_velocities        vector(k) m/s  in, commanded, positive pays out; one for each winch
    jammed                  vector(k) -    in, only if they may fail, may stay open: not 0 for
                                           each winch that stands still
    unstrained_lengths      vector(m) m    out
    unstrained_length_rates vector(m) m/s  out, the commanded ones within the rated speed
    ======================= ========= ==== ===================================================

    There are as many winches as cables, k = m, but where `groups` puts several cables on one.
    """

    def __init__(
        self,
        initial_lengths: Array,
        rated_speed: float,
        groups: WinchGroups | None = None,
        may_fail: bool = False,
        following: Following | None = None,
    ) -> None:
        """With unstrained lengths at time 0, shape (m,) [m], and a largest cable speed [m/s].

        With `following` there is an input platform_state, from which lengths follow as a simulator
        is initialized.
        """
        super().__init__()
        shared = groups is not None and groups.are_shared()
        limit = np.full(groups.count if shared and groups else len(initial_lengths), rated_speed)
        builder = DiagramBuilder()
        speed = builder.AddNamedSystem("rated_speed", Saturation(-limit, limit))
        drums = Integrator if following is None else partial(FollowingDrums, following=following)
        self._drums = builder.AddNamedSystem("drums", drums(initial_lengths))
        rates = speed.get_output_port()
        if may_fail:
            held = builder.AddNamedSystem("held", HeldSpeeds(len(limit)))
            builder.Connect(rates, held.get_input_port(0))
            builder.ExportInput(held.GetInputPort(JAMMED), JAMMED)
            rates = held.get_output_port()
        if shared and groups:
            bundles = builder.AddNamedSystem("bundles", MatrixGain(groups.to_cables()))
            builder.Connect(rates, bundles.get_input_port())
            rates = bundles.get_output_port()
        builder.Connect(rates, self._drums.get_input_port(0))
        if following is not None:
            builder.ExportInput(self._drums.get_input_port(1), "platform_state")
        builder.ExportInput(speed.get_input_port(), "cable_velocities")
        builder.ExportOutput(self._drums.get_output_port(), "unstrained_lengths")
        builder.ExportOutput(rates, "unstrained_length_rates")
        builder.BuildInto(self)

    def set_unstrained_lengths(self, context: Context, lengths: Array) -> None:
        """Sets the lengths, shape (m,) [m], in this diagram's own context."""
        self.GetMutableSubsystemContext(self._drums, context).SetContinuousState(lengths)

    def hold(self, context: Context, lengths: Array, tensions: Array) -> None:
        """Sets the lengths, shape (m,) [m]; an ideal winch holds any tensions, shape (m,) [N]."""
        self.set_unstrained_lengths(context, lengths)


class FollowingDrums(LeafSystem):
    """Lengths from their rates, which begin where they hold a platform; see `Following`.

    ============== ========= ==== ======================================
    port           type      unit meaning
    ============== ========= ==== ======================================
    rates          vector(m) m/s  in
    platform_state vector    m    in, as `CableForces` takes it
    lengths        vector(m) m    out
    ============== ========= ==== ======================================
    """

    def __init__(self, initial_lengths: Array, following: Following) -> None:
        """With lengths of default contexts, shape (m,) [m]."""
        super().__init__()
        m = len(initial_lengths)
        index = self.DeclareContinuousState(BasicVector(initial_lengths))
        self._rates = self.DeclareVectorInputPort("rates", m).Eval
        following.declare(self, initial_lengths)
        self.DeclareStateOutputPort("lengths", ContinuousStateIndex(index))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """The rates."""
        derivatives.get_mutable_vector().SetFromVector(self._rates(context))


class HeldSpeeds(LeafSystem):
    """Cable speeds of ideal winches some of which stand still.

    ====== ========= ==== ============================================
    port   type      unit meaning
    ====== ========= ==== ============================================
    speeds vector(k) m/s  in, of all winches
    jammed vector(k) -    in, may stay open: not 0 for each that stands still
    held   vector(k) m/s  out
    ====== ========= ==== ============================================
    """

    def __init__(self, count: int) -> None:
        """For k = `count` winches."""
        super().__init__()
        self._speeds = self.DeclareVectorInputPort("speeds", count)
        self._jammed = self.DeclareVectorInputPort(JAMMED, count)
        self.DeclareVectorOutputPort("held", count, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        speeds = self._speeds.Eval(context)
        if self._jammed.HasValue(context):
            speeds = np.where(self._jammed.Eval(context) != 0.0, 0.0, speeds)
        output.SetFromVector(speeds)


def make_winches(
    robot: Robot,
    settings: WinchSettings,
    home: Array,
    may_fail: bool = False,
    start: Any = None,
    following: Following | None = None,
) -> Any:
    """The winches of a robot, `VelocityWinch` or `MotorWinch`.

    Args:
        robot: The robot.
        settings: Which ones.
        home: Unstrained lengths at the home pose, shape (m,) [m].
        may_fail: Whether they have inputs for what fails.
        start: `assembly.DefaultStart` of default contexts; None: `home` without tension.
        following: How lengths follow a random pose; None: they do not.

    Raises:
        RobotFileError: The winches have motors, of which the robot's file does not say enough.
    """
    lengths, drums = (home, 0.0 * home) if start is None else (start.lengths, start.drum_tensions)
    if settings.has_motors():
        return MotorWinch(
            robot.winch_law(), settings.mode, home, may_fail, (lengths, drums), following
        )
    rated = robot.winch.rated_cable_speed()
    return VelocityWinch(lengths, rated, robot.winch_groups(), may_fail, following)
