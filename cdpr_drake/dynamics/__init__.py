"""The motion of a whole cable robot, platform, cables and winches, in compiled steps.

`advance_robot` integrates a robot that `pack_robot` made, many steps a call, explicitly or
semi-implicitly; forces, tensions and motors are those of the rooms `cables` and `winches`. `track`
is a whole loop of dynamic control in one call, with the laws of `control` and `tensions`. The
state is MultibodyPlant's of the platform, and behind it that of the winches. MultibodyPlant is the
reference to which this is compared.

Source: Featherstone, 2008, for the body; each kernel names its method.
"""

from cdpr_drake.dynamics.advance_kernel import LARGEST, REPORTED, advance_robot, robot_energy
from cdpr_drake.dynamics.explicit_kernel import METHODS
from cdpr_drake.dynamics.platform_kernel import (
    floating_rates,
    line_rates,
    mass_in_world,
    planar_rates,
)
from cdpr_drake.dynamics.reach_kernel import (
    BACKWARD,
    fresh_memory,
    reach_explicitly,
    reach_explicitly_along,
    reach_semi_implicitly,
    robot_addresses,
)
from cdpr_drake.dynamics.robot_arrays import (
    IDEAL,
    MOTORS,
    PLATFORM,
    SPEEDS,
    TENSIONS,
    Drive,
    RobotArrays,
    pack_robot,
)
from cdpr_drake.dynamics.robot_kernel import GOOD, LOST, ideal_rates, is_plain, robot_rates
from cdpr_drake.dynamics.semi_implicit_kernel import linearise
from cdpr_drake.dynamics.tracking_kernel import (
    ACTS,
    ENDS,
    LOGS,
    MET,
    MISSED,
    ROWS,
    STEPS,
    TIME,
    TrackingMemory,
    due,
    start_tracking,
    track,
    track_on,
)

__all__ = [
    "ACTS", "BACKWARD", "ENDS", "GOOD", "IDEAL", "LARGEST", "LOGS", "LOST", "MET", "METHODS",
    "MISSED", "MOTORS", "PLATFORM", "REPORTED", "ROWS", "SPEEDS", "STEPS", "TENSIONS", "TIME",
    "Drive", "RobotArrays", "TrackingMemory", "advance_robot", "due", "floating_rates",
    "fresh_memory", "ideal_rates", "is_plain", "line_rates", "linearise", "mass_in_world",
    "pack_robot", "planar_rates", "reach_explicitly", "reach_explicitly_along",
    "reach_semi_implicitly", "robot_addresses", "robot_energy", "robot_rates", "start_tracking",
    "track", "track_on",
]  # fmt: skip
