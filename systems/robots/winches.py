"""Winches of a robot: an ideal one, which follows a commanded cable velocity at once.

`make_winches` makes the winches that settings ask for, ideal ones or such with motors.
"""

from typing import Any

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import Integrator, MatrixGain, Saturation

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.settings import WinchSettings
from cdpr_drake.winches.groups import WinchGroups


class VelocityWinch(Diagram):
    """Integrates commanded cable velocities, limited by the motors' rated speed.

    ======================= ========= ==== ===================================================
    port                    type      unit meaning
    ======================= ========= ==== ===================================================
    cable_velocities        vector(k) m/s  in, commanded, positive pays out; one for each winch
    unstrained_lengths      vector(m) m    out
    unstrained_length_rates vector(m) m/s  out, the commanded ones within the rated speed
    ======================= ========= ==== ===================================================

    There are as many winches as cables, k = m, but where `groups` puts several cables on one.
    """

    def __init__(
        self, initial_lengths: Array, rated_speed: float, groups: WinchGroups | None = None
    ) -> None:
        """With unstrained lengths at time 0, shape (m,) [m], and a largest cable speed [m/s]."""
        super().__init__()
        shared = groups is not None and groups.are_shared()
        limit = np.full(groups.count if shared and groups else len(initial_lengths), rated_speed)
        builder = DiagramBuilder()
        speed = builder.AddNamedSystem("rated_speed", Saturation(-limit, limit))
        self._drums = builder.AddNamedSystem("drums", Integrator(initial_lengths))
        rates = speed.get_output_port()
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


def make_winches(robot: Robot, settings: WinchSettings, home: Array) -> Any:
    """The winches of a robot, `VelocityWinch` or `MotorWinch`.

    Args:
        robot: The robot.
        settings: Which ones.
        home: Unstrained lengths at the home pose, shape (m,) [m].

    Raises:
        RobotFileError: The winches have motors, of which the robot's file does not say enough.
    """
    if settings.has_motors():
        return MotorWinch(robot.winch_law(), settings.mode, home)
    return VelocityWinch(home, robot.winch.rated_cable_speed(), robot.winch_groups())
