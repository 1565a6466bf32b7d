"""An AprilTag of twice the edge that is told."""

from __future__ import annotations

from cdpr_drake.vision.apriltags import TagTarget

LARGE_ID = 7
"""Its number in the family 36h11."""


class LargeTag(TagTarget):
    """Tag `LARGE_ID`, of twice the edge."""

    def __init__(self, size: float) -> None:
        """For half of the edge [m]."""
        super().__init__(LARGE_ID, 2.0 * size)
