"""Finds a target in the images of a camera."""

from __future__ import annotations

from pydrake.common.value import Value
from pydrake.systems.framework import Context
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.arrays import Array
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.vision import Pinhole, Target


class TargetDetector(TargetMeasurement):
    """Finds a target in images by OpenCV, to fractions of a pixel, and its pose.

    A target that is followed is looked for where the newest image had it, and then everywhere.

    =========== ============== ==== ===================================================
    port        type           unit meaning
    =========== ============== ==== ===================================================
    color_image ImageRgba8U    -    in, as from `SceneCamera` or Drake's RgbdSensor
    corners     vector(2 n)    px   out, or `ellipses`: as `TargetMeasurement`
    X_CO        RigidTransform m    out, as `TargetMeasurement`
    found       vector(1)      -    out, as `TargetMeasurement`
    quality     vector(k)      -    out, as `TargetMeasurement`
    =========== ============== ==== ===================================================
    """

    def __init__(
        self,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        latency_frames: int = 0,
        image_bias: Array | None = None,
    ) -> None:
        """For one target, images at `rate` [Hz], latency in whole frames, bias as the base's."""
        super().__init__(target, pinhole, rate, latency_frames, image_bias)
        self._image = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U()))

    def find_marks(self, context: Context) -> Array | None:
        """The target's marks in the image at the input, or None."""
        return self.target.follow(self._image.Eval(context).data, self.newest_marks(context))
