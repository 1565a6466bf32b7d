"""Scenario section `perturbations`: what the controller believes wrongly.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.fields import number, optional_section
from cdpr_drake.models import Pose


@dataclass(kw_only=True)
class Perturbations:
    """What the controller believes wrongly; the simulated robot stays as its file says."""

    initial_pose: Pose | None = optional_section(
        "Pose of the platform in W that the estimator starts from; null: the true one."
    )
    camera_pose: Pose | None = optional_section(
        "Pose, in the true camera frame, of the camera frame that the controller assumes."
    )
    exit_points: float = number(
        "Distance of each assumed exit point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )
    anchor_points: float = number(
        "Distance of each assumed anchor point from the true one, in a random direction.",
        "m",
        0.0,
        at_least=0.0,
    )
