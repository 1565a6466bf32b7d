"""Motions from rest to rest on elastic cables: by direct collocation, and by input shaping.

Source: Tedrake, Underactuated Robotics, direct collocation, as Drake has it.
"""

from cdpr_drake.analyses.trajectories.rest_to_rest import (
    RestToRest,
    example_robot,
    plan_rest_to_rest,
)
from cdpr_drake.analyses.trajectories.shaped_rest import (
    ShapedRest,
    Swing,
    plan_shaped_rest,
    simulate_swing,
)

__all__ = [
    "RestToRest", "ShapedRest", "Swing", "example_robot", "plan_rest_to_rest", "plan_shaped_rest",
    "simulate_swing",
]  # fmt: skip
