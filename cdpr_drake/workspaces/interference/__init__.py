"""What cables and platform meet: distances between straight cables and boxes, exact.

The platform, the beams of the frame and obstacles are boxes; a cable is a segment with a radius.
Next to its ends a cable touches what carries it, so a length there is left out by name.

Source: Perreault et al., 2010; Ericson, Real-Time Collision Detection, 2005.
"""

from cdpr_drake.workspaces.interference.distance_kernel import (
    boxes_distance,
    segment_box_distance,
    segments_distance,
)
from cdpr_drake.workspaces.interference.surroundings import (
    PART_NAMES,
    Surroundings,
    beams,
    box_row,
    clearances,
)

__all__ = [
    "PART_NAMES", "Surroundings", "beams", "box_row", "boxes_distance", "clearances",
    "segment_box_distance", "segments_distance",
]  # fmt: skip
