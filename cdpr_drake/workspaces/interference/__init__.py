"""What cables and platform meet: distances between straight cables and boxes, exact.

The platform, the beams of the frame and obstacles are boxes; a cable is a segment with a radius.
Next to its ends a cable touches what carries it, so a length there is left out by name.

Source: Perreault et al., 2010; Ericson, Real-Time Collision Detection, 2005.
"""

from cdpr_drake.workspaces.interference.distance_kernel import (
    BOX_COLUMNS,
    boxes_distance,
    segment_box_distance,
    segment_box_share,
    segments_distance,
    segments_shares,
)
from cdpr_drake.workspaces.interference.surroundings import (
    PART_NAMES,
    Surroundings,
    beams,
    box_row,
    clearances,
)

__all__ = [
    "BOX_COLUMNS", "PART_NAMES", "Surroundings", "beams", "box_row", "boxes_distance", "clearances",
    "segment_box_distance", "segment_box_share", "segments_distance", "segments_shares",
]  # fmt: skip
