"""Tension management beside a visual servo: cable velocities that take up slack.

A servo moves the platform to where the camera wants it, and nobody looks after the tensions. The
laws here add to its cable velocities, negative ones shorten a cable. They are pure functions of
readings; `systems.tension_control.TensionCorrector` is their block.

* `tension_correction`, (5.1): a cable below its threshold is wound up. The threshold is constant,
  grows with how short the cable is (`length_thresholds`), or comes from a tension distribution at
  the believed pose, which `TensionFollower` follows from both sides. The gain is constant or, by
  `adaptive_gains`, (5.3), proportional to what the cable is too long by.
* `length_correction`, (5.5): the cables of least tension are wound up to the length that the
  believed pose asks for.
* `polygon_correction`: tensions that leave the feasible polygon of the believed pose, or come near
  its edges, are brought back by velocities that change tensions and do not move the platform.

Source: Zake, servoing thesis, 5.2. Different from print: (5.3) is clamped at zero, as a cable that
is shorter than expected would be paid out; its gain has another unit than that of (5.1) and
another name here.
"""

from cdpr_drake.tension_management.correction import (
    adaptive_gains,
    length_correction,
    tension_correction,
)
from cdpr_drake.tension_management.polygon_law import (
    null_part,
    polygon_correction,
    polygon_target,
)
from cdpr_drake.tension_management.tension_follower import TensionFollower
from cdpr_drake.tension_management.thresholds import SHAPES, length_thresholds

__all__ = [
    "SHAPES", "TensionFollower", "adaptive_gains", "length_correction", "length_thresholds",
    "null_part", "polygon_correction", "polygon_target", "tension_correction",
]  # fmt: skip
