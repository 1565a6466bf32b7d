"""Where cables leave the frame and reach the platform: exit points on rails, pulleys at both ends.

`Rail` is for reconfigurable robots: it says where a cable leaves the frame in a configuration.
`Pulley` and `PlatformPulley` are schemas of swivelling pulleys.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.declarations import LONGEST, Direction, In, Refusal, Scope, settings, values

MARK = "@"
"""Between the name of a robot and where its exit points stand on their rails."""


@settings
class Rail:
    """A straight rail on which an exit point can be put; it stands still while the robot moves."""

    axis: Annotated[Direction, "Direction in W in which the coordinate grows; of any length."]
    lower: Annotated[float, In("m"), "Smallest coordinate."]
    upper: Annotated[float, In("m"), "Largest coordinate."]
    at: Annotated[float, In("m"), "Coordinate, counted from `exit_point`."] = 0.0

    def shift(self) -> Array:
        """From `exit_point` to where the cable leaves, shape (3,) [m]."""
        return np.asarray(self.at * self.axis / np.linalg.norm(self.axis), float)

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A rail without length, and a coordinate beyond its ends."""
        if not self.lower < self.upper:
            yield "", f"lower {self.lower:g}, upper {self.upper:g}", "lower < upper"
        elif not self.lower <= self.at <= self.upper:
            yield "at", f"{self.at:g}", f"{self.lower:g} to {self.upper:g} [m]"


def split_name(words: str) -> tuple[str, dict[str, float]]:
    """Name of a robot, and coordinates by cables, of words such as `name@C1=0.3,C2=-0.1`.

    Raises:
        RobotFileError: What stands behind the mark are no coordinates.
    """
    name, mark, rest = words.rpartition(MARK)
    if not mark or "/" in rest or Path(words).exists():  # a path may have the mark in it
        return words, {}
    found: dict[str, float] = {}
    for item in rest.split(","):
        cable, equals, value = item.partition("=")
        try:
            number_ = float(value)
        except ValueError:
            number_ = np.nan
        if not (cable.strip() and equals and np.isfinite(number_)) or cable.strip() in found:
            raise RobotFileError(
                f"robot {words}: found {item!r} behind {MARK}; accepted: coordinates of exit "
                f"points on rails, each cable once, as in {name}{MARK}C1=0.3,C2=-0.1 [m]"
            )
        found[cable.strip()] = number_
    return name, found


@settings
class Pulley:
    """The swivelling pulleys at the exit points."""

    radius: Annotated[float, In("m", ge=0.0, le=LONGEST), "Radius of the groove."]
    swivel_axis: Annotated[
        Direction,
        "Direction in W in which the cable arrives at the exit point from its winch, and "
        "about which the pulley swivels; of any length.",
    ] = values(0.0, 0.0, 1.0)
    arm: Annotated[
        float,
        In("m", ge=0.0),
        "Length of arms in the place of pulleys, across the swivel axis, about which they"
        " swivel: cables begin at their ends. Of a platform that does not turn, arms at "
        "its anchor points are the same.",
    ] = 0.0


@settings
class PlatformPulley:
    """Swivelling pulleys at the anchor points, where the platform has them."""

    radius: Annotated[float, In("m", ge=0.0), "Radius of the groove."]
    swivel_axis: Annotated[
        Direction,
        "Direction in P in which the cable arrives at the anchor point from where it is "
        "fixed, and about which the pulley swivels; of any length.",
    ] = values(0.0, 0.0, 1.0)
