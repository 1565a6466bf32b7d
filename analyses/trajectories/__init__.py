"""Motions from rest to rest on elastic cables: collocation, input shaping, multiple shooting.

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
from cdpr_drake.analyses.trajectories.shooting import plan_shot_rest

__all__ = [
    "RestToRest", "ShapedRest", "Swing", "example_robot", "plan_rest_to_rest", "plan_shaped_rest",
    "plan_shot_rest", "simulate_swing",
]  # fmt: skip
