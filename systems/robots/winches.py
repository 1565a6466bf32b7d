"""Winches of a robot: an ideal one, which follows a commanded cable velocity at once.

`make_winches` makes the winches that settings ask for, ideal ones or such with motors.
"""

from typing import Any

import numpy as np
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Integrator, MatrixGain, Saturation

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.failures import JAMMED
from cdpr_drake.systems.robots.motor_winch import MotorWinch
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
    ) -> None:
        """With unstrained lengths at time 0, shape (m,) [m], and a largest cable speed [m/s]."""
        super().__init__()
        shared = groups is not None and groups.are_shared()
        limit = np.full(groups.count if shared and groups else len(initial_lengths), rated_speed)
        builder = DiagramBuilder()
        speed = builder.AddNamedSystem("rated_speed", Saturation(-limit, limit))
        self._drums = builder.AddNamedSystem("drums", Integrator(initial_lengths))
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
        builder.Connect(rates, self._drums.get_input_port())
        builder.ExportInput(speed.get_input_port(), "cable_velocities")
        builder.ExportOutput(self._drums.get_output_port(), "unstrained_lengths")
        builder.ExportOutput(rates, "unstrained_length_rates")
        builder.BuildInto(self)

    def set_unstrained_lengths(self, context: Context, lengths: Array) -> None:
        """Sets the lengths, shape (m,) [m], in this diagram's own context."""
        self._drums.set_integral_value(
            self.GetMutableSubsystemContext(self._drums, context), lengths
        )

    def hold(self, context: Context, lengths: Array, tensions: Array) -> None:
        """Sets the lengths, shape (m,) [m]; an ideal winch holds any tensions, shape (m,) [N]."""
        self.set_unstrained_lengths(context, lengths)


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


def make_winches(robot: Robot, settings: WinchSettings, home: Array, may_fail: bool = False) -> Any:
    """The winches of a robot, `VelocityWinch` or `MotorWinch`.

    Args:
        robot: The robot.
        settings: Which ones.
        home: Unstrained lengths at the home pose, shape (m,) [m].
        may_fail: Whether they have inputs for what fails.

    Raises:
        RobotFileError: The winches have motors, of which the robot's file does not say enough.
    """
    if settings.has_motors():
        return MotorWinch(robot.winch_law(), settings.mode, home, may_fail)
    rated = robot.winch.rated_cable_speed()
    return VelocityWinch(home, rated, robot.winch_groups(), may_fail)
