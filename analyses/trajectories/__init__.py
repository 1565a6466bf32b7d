"""Motions from rest to rest, and what they ask of the cables: planned by direct collocation.

Source: Tedrake, Underactuated Robotics, direct collocation, as Drake has it.
"""

from cdpr_drake.analyses.trajectories.rest_to_rest import (
    RestToRest,
    example_robot,
    plan_rest_to_rest,
)

__all__ = ["RestToRest", "example_robot", "plan_rest_to_rest"]
