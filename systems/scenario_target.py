"""Scenario section `target`: what the camera servos on.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.apriltag import TAG_COUNT
from cdpr_drake.fields import number, section, whole
from cdpr_drake.models import Pose


@dataclass(kw_only=True)
class Target:
    """The AprilTag 36h11 that the camera servos on."""

    tag_id: int = whole("Identity of the tag.", 0, at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag frame O in W: x right, y up, z out of the tag.", Pose)
