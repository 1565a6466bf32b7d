"""Scenario section `open_loop`: a planned motion of the platform instead of visual servoing.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.models import Pose
from cdpr_drake.schema import number, section, sections


@dataclass(kw_only=True)
class PlatformWaypoint:
    """A pose of the platform to reach and rest in."""

    pose: Pose = section("Pose of the platform in W.", Pose)
    duration: float = number("Time from the pose before.", "s", above=0.0)


@dataclass(kw_only=True)
class OpenLoopSettings:
    """The platform follows a plan from the pose believed at the start; images are only logged."""

    duration: float = number(
        "Time to the pose from which the target is seen as desired; without waypoints.",
        "s",
        10.0,
        above=0.0,
    )
    waypoints: list[PlatformWaypoint] = sections(
        "Poses to pass instead, each at rest.", required=False
    )
