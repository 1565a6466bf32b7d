"""Cables as a camera in the world sees them: images of their curves, and slack read from those.

Image points are pixels (u, v), NaN where a point is not in the image. A cable hangs in the vertical
plane through its ends; surplus length is length less the distance of the ends [m].

Source: servoing thesis, perspectives (slack seen by cameras); Irvine, Cable Structures, 1981, 1.1.
"""

from cdpr_drake.cable_sight.catenary import catenary_drop, surplus_of_drops
from cdpr_drake.cable_sight.images import cable_images, even_points
from cdpr_drake.cable_sight.inverse_catenary import SeenSlack, seen_slack, slack_rates

__all__ = [
    "SeenSlack", "cable_images", "catenary_drop", "even_points", "seen_slack", "slack_rates",
    "surplus_of_drops",
]  # fmt: skip
