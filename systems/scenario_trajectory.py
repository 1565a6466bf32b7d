"""Scenario section `trajectory`: a way of the features that the servo tracks.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.feature_trajectory import PROFILES
from cdpr_drake.fields import number, sections, text
from cdpr_drake.models import Pose


@dataclass(kw_only=True)
class FeatureTrajectory:
    """The way from the features that are seen first to the desired ones."""

    duration: float | None = number(
        "Time that it takes; null: from the speeds.", "s", None, above=0.0
    )
    speed: float = number("Mean speed of features in metres.", "m/s", 0.05, above=0.0)
    rotation_speed_deg: float = number("Mean speed of angles.", "deg/s", 10.0, above=0.0)
    image_speed: float = number(
        "Mean speed of features of the image, at unit focal length.", "1/s", 0.05, above=0.0
    )
    profile: str = text(
        "constant: constant speed; smooth: from rest to rest.", "constant", choices=PROFILES
    )
    waypoints: list[Pose] = sections(
        "Poses of the target in the camera to pass on the way; none: straight in the features.",
        required=False,
    )
    replan_error: float | None = number(
        "Norm of the features' error beyond which the way is planned again; null: never.",
        "-",
        None,
        above=0.0,
    )
