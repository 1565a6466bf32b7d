"""A camera that projects the corners of a tag instead of rendering an image; for long runs."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import Context

from cdpr_drake.apriltag import tag_corners
from cdpr_drake.arrays import Array
from cdpr_drake.pinhole import Pinhole
from cdpr_drake.systems.tag_measurement import TagMeasurement

VISIBLE_BORDER = 1.0
"""Corners must lie this far inside the image [px]."""


class ProjectedCamera(TagMeasurement):
    """Projects the tag's corners through the pinhole model and adds pixel noise.

    =========== ==================== ==== ====================================================
    port        type                 unit meaning
    =========== ==================== ==== ====================================================
    body_poses  list[RigidTransform] m    in, from MultibodyPlant
    corners     vector(8)            px   out, as `TagMeasurement`
    X_CO        RigidTransform       m    out, as `TagMeasurement`
    found       vector(1)            -    out, as `TagMeasurement`
    =========== ==================== ==== ====================================================

    The tag is found while all corners lie in the image and its face is turned to the camera.
    The noise of an image depends on the seed and the image's number only, so a run can be
    repeated, or continued from a copy of its context.
    """

    def __init__(
        self,
        camera_body: RigidBody,
        X_BC: RigidTransform,
        tag_body: RigidBody,
        X_TO: RigidTransform,
        size: float,
        pinhole: Pinhole,
        rate: float,
        latency_frames: int = 0,
        pixel_noise: float = 0.0,
        seed: int = 0,
    ) -> None:
        """For a camera at X_BC on one body and a tag of edge `size` [m] at X_TO on another.

        Images at `rate` [Hz], latency in whole frames; `pixel_noise` is the standard deviation of
        each coordinate of a corner [px].
        """
        super().__init__(size, pinhole, rate, latency_frames)
        self._camera_body, self._X_BC = int(camera_body.index()), X_BC
        self._tag_body, self._X_TO = int(tag_body.index()), X_TO
        self._p_OK = tag_corners(size)
        self._pinhole = pinhole
        self._rate = rate
        self._noise = pixel_noise
        self._seed = seed
        self._poses = self.DeclareAbstractInputPort("body_poses", Value([RigidTransform()]))

    def find_corners(self, context: Context) -> Array | None:
        """Projected corners (u, v) with noise, shape (2, 4) [px], or None if out of view."""
        poses = self._poses.Eval(context)
        X_WC = poses[self._camera_body] @ self._X_BC
        X_CO = X_WC.inverse() @ poses[self._tag_body] @ self._X_TO
        towards = -float(X_CO.rotation().matrix()[:, 2] @ X_CO.translation())
        uv = self._pinhole.project(
            X_CO.rotation().matrix() @ self._p_OK + X_CO.translation()[:, np.newaxis]
        )
        if towards <= 0.0 or not self._pinhole.sees(uv, VISIBLE_BORDER):
            return None
        if self._noise > 0.0:
            number = round(context.get_time() * self._rate)
            random = np.random.default_rng([self._seed, number])
            uv = uv + self._noise * random.standard_normal(uv.shape)
        return uv
