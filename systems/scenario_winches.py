"""The section `winches` of a scenario, and the winches that it asks for.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from typing import Any

from cdpr_drake.arrays import Array
from cdpr_drake.fields import text
from cdpr_drake.models import Robot
from cdpr_drake.systems.motor_winch import COMMAND_PORTS, MotorWinch
from cdpr_drake.systems.velocity_winch import VelocityWinch

IDEAL, MOTOR = "ideal", "motor"


@dataclass(kw_only=True)
class WinchSettings:
    """Which winches a simulated robot has; their values stand in the robot's file."""

    kind: str = text(
        "ideal follows commanded velocities at once; motor has inertia, friction and limits.",
        IDEAL,
        choices=(IDEAL, MOTOR),
    )
    mode: str = text(
        "What the winches are commanded; ideal ones take velocity only. By position, a visual "
        "servo's velocities are integrated from the lengths at the start.",
        "velocity",
        choices=tuple(COMMAND_PORTS),
    )

    def has_motors(self) -> bool:
        """Whether the winches have motors."""
        return self.kind == MOTOR


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
    return VelocityWinch(home, robot.winch.rated_cable_speed())
