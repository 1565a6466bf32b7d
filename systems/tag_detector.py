"""Finds an AprilTag in the images of a camera."""

from __future__ import annotations

from pydrake.common.value import Value
from pydrake.systems.framework import Context
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.apriltag import TagFinder
from cdpr_drake.arrays import Array
from cdpr_drake.pinhole import Pinhole
from cdpr_drake.systems.tag_measurement import TagMeasurement


class TagDetector(TagMeasurement):
    """Finds an AprilTag 36h11 by OpenCV, with sub-pixel corners, and its pose by IPPE_SQUARE.

    ============ ============== ==== ========================================================
    port         type           unit meaning
    ============ ============== ==== ========================================================
    color_image  ImageRgba8U    -    in, as from Drake's RgbdSensor
    corners      vector(8)      px   out, as `TagMeasurement`
    X_CO         RigidTransform m    out, as `TagMeasurement`
    found        vector(1)      -    out, as `TagMeasurement`
    ============ ============== ==== ========================================================
    """

    def __init__(
        self, tag_id: int, size: float, pinhole: Pinhole, rate: float, latency_frames: int = 0
    ) -> None:
        """For one tag of edge `size` [m], images at `rate` [Hz], latency in whole frames."""
        super().__init__(size, pinhole, rate, latency_frames)
        self._finder = TagFinder(tag_id)
        self._image = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U()))

    def find_corners(self, context: Context) -> Array | None:
        """Corners (u, v) in the image at the input, shape (2, 4) [px], or None."""
        return self._finder.find(self._image.Eval(context).data)
