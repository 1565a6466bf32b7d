"""Robots by either engine, for tests that command them from event to event."""

from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD


def made(kind, *args, **options):
    """A block of the kind; a compiled one goes from event to event, in as long steps as asked."""
    if kind is CompiledCableRobot:
        options.setdefault("command_period", HELD)
    return kind(*args, **options)
