"""Makes the winches that settings ask for."""

from typing import Any

from cdpr_drake.arrays import Array
from cdpr_drake.models import Robot
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.settings import WinchSettings
from cdpr_drake.systems.robots.velocity_winch import VelocityWinch


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
