"""Scenario section `pose_plan`: to the pose that the camera asks for, instead of by its features.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.control import GoalPlan
from cdpr_drake.schema import number


@dataclass(kw_only=True)
class PosePlanSettings:
    """The way of the platform to where it sees the target as desired: straight, quintic in time."""

    speed: float = number("Largest speed of the platform.", "m/s", 0.15, above=0.0)
    rotation_speed_deg: float = number("Largest angular speed.", "deg/s", 20.0, above=0.0)
    gain: float = number(
        "Rate at which what is left fades at the end of the way.", "1/s", 2.0, above=0.0
    )

    def plan(self) -> GoalPlan:
        """The plan."""
        return GoalPlan(self.speed, float(np.radians(self.rotation_speed_deg)), self.gain)
