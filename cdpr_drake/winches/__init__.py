"""Winches: what the drum holds, what the motor does, what friction takes.

Lengths are counted positive when paid out; torques and angles are those of the motor before the
gear unless a name says drum. A winch pulls on its cable with t = (R_g / r_w) times the motor's
torque.

Source: servoing thesis 2.3 and 5.2.3; friction after Coulomb, Stribeck and LuGre's static part.
"""

from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
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

__all__ = [
    "MODES", "TORQUE", "Drum", "FrictionLaw", "WinchGroups", "WinchLaw", "WinchMotion",
    "pack_winch", "resting_motors", "winch_motion", "winch_rates", "winch_torques",
]  # fmt: skip
