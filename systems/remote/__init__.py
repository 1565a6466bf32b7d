"""Blocks in whose place a process outside stands, and the scenario section that asks for one.

Each is the block that it replaces, with the same ports, so that logs and figures stay; where that
would decide, it asks a `Remote`, which knows a driver of `cdpr_drake.bridge` while a run is driven.
"""

from cdpr_drake.systems.remote.ports import (
    CONTROLLER,
    DISTRIBUTOR,
    SERVO,
    SERVO_PLACES,
    TENSION_PLACES,
    TRAJECTORY,
    TWIST,
    servo_ports,
    tension_ports,
)
from cdpr_drake.systems.remote.remote import Remote
from cdpr_drake.systems.remote.remote_servo import RemoteServo
from cdpr_drake.systems.remote.remote_tensions import RemoteDistributor, RemoteTracking
from cdpr_drake.systems.remote.service import tension_service
from cdpr_drake.systems.remote.settings import RemoteSettings, check_place, check_servo_place

__all__ = [
    "CONTROLLER", "DISTRIBUTOR", "SERVO", "SERVO_PLACES", "TENSION_PLACES", "TRAJECTORY", "TWIST",
    "Remote", "RemoteDistributor", "RemoteServo", "RemoteSettings", "RemoteTracking", "check_place",
    "check_servo_place", "servo_ports", "tension_ports", "tension_service",
]  # fmt: skip
