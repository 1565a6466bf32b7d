"""A camera that projects a target instead of rendering an image; for long runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.camera_catalogue import DEAD, FROZEN, CameraFault
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

IMAGES_AHEAD = 16
"""Images for which random numbers are made ready at once."""


class ProjectedCamera(TargetMeasurement):
    """Projects the target through pinhole and lens and adds pixel noise.

    =========== ============== ==== ========================================================
    port        type           unit meaning
    =========== ============== ==== ========================================================
    X_WP        RigidTransform m    in, true pose of the platform
    X_WO        RigidTransform m    in, true pose of the object; only if it is not on the
                                    platform
    X_BC        RigidTransform m    in, true pose of the camera on its carrier; only if it turns
    corners     vector(2 n)    px   out, or `ellipses`: as `TargetMeasurement`
    X_CO        RigidTransform m    out, as `TargetMeasurement`
    found       vector(1)      -    out, as `TargetMeasurement`
    =========== ============== ==== ========================================================

    The target is found while it lies in the image and its face is turned to the camera.
    The noise of an image depends on the seed and the image's number only, so a run can be
    repeated, or continued from a copy of its context.
    """

    def __init__(
        self,
        target: Target,
        mounting: CameraMounting,
        pinhole: Pinhole,
        rate: float,
        *,
        latency_frames: int = 0,
        pixel_noise: float = 0.0,
        seed: int = 0,
        image_bias: Array | None = None,
        focus: tuple[float, float] | None = None,
        fault: CameraFault | None = None,
    ) -> None:
        """For a target, and where it and the camera are fixed.

        Images at `rate` [Hz], latency in whole frames; `pixel_noise` is the standard deviation of
        each coordinate of what is measured [px]; `image_bias` as for `TargetMeasurement`;
        `fault` says when it fails. With a `focus` of share a and period T [s] the focal length
        that it has is 1 + a sin(2 pi t / T) times the one it is believed to have, as where an
        auto-focus goes in and out; None: it is the same. If it turns, an input says where it is.
        """
        super().__init__(target, pinhole, rate, latency_frames, image_bias)
        self._mounting, self._camera, self._focus = mounting, pinhole, focus
        self._rate, self._noise, self._random = rate, pixel_noise, _ImageNoise(seed)
        self._fault = fault
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        if not mounting.is_eye_to_hand():
            self.DeclareAbstractInputPort("X_WO", Value(RigidTransform()))
        if mounting.turns:
            self.DeclareAbstractInputPort("X_BC", Value(RigidTransform()))

    def find_marks(self, context: Context) -> Array | None:
        """Projected marks with noise, or None if out of view."""
        return self.image(
            lambda name: self.GetInputPort(name).Eval(context),
            context.get_time(),
            context.get_discrete_state(self._frames).value(),
        )

    def image(self, read: Callable[[str], Any], time: float, frames: Array) -> Array | None:
        """As `find_marks` at a time [s], from what stands at the inputs, by their names, and the
        frames in the delay line, of which a frozen camera gives the newest again."""
        fault = self._fault
        if fault is None or not fault.holds(time):
            return self.project(read, time)
        if fault.kind == DEAD:
            return None
        if fault.kind == FROZEN:
            return self.newest_in_image(frames)
        return self.project(
            read, time, pose_from_angles(fault.offset, np.radians(fault.angles_deg))
        )

    def project(
        self, read: Callable[[str], Any], time: float, X_off: RigidTransform | None = None
    ) -> Array | None:
        """As `find_marks` of a camera without a fault, at a time [s], from where X_off puts the
        target in the camera frame [m]."""
        X_WO = None if self._mounting.is_eye_to_hand() else read("X_WO")
        mounting = self._mounting
        if mounting.turns:
            mounting = replace(mounting, X_BC=read("X_BC"))
        X_CO = mounting.X_CO(read("X_WP"), X_WO)
        if X_off is not None:
            X_CO = X_off @ X_CO
        random = self._random.of(round(time * self._rate))
        return self.target.project(X_CO, self._zoomed(time), self._noise, random)

    def _zoomed(self, time: float) -> Pinhole:
        """The camera as it is at a time [s]."""
        if self._focus is None:
            return self._camera
        share, period = self._focus
        zoom = 1.0 + share * math.sin(2.0 * math.pi * time / period)
        return replace(self._camera, fx=zoom * self._camera.fx, fy=zoom * self._camera.fy)


class _ImageNoise:
    """Random numbers of each image of a camera, the same by seed and number.

    NumPy's generator takes longer to make than a target to project, and the half of that where
    several are made in a row. So they are made ahead, and only for images that ask; each is used
    once, as an image that is taken again begins anew.
    """

    def __init__(self, seed: int) -> None:
        self._seed, self._number = seed, 0
        self._ahead: dict[int, np.random.Generator] = {}
        self._random: np.random.Generator | None = None

    def of(self, number: int) -> _ImageNoise:
        """Those of an image from now on."""
        self._number, self._random = number, None
        return self

    def standard_normal(self, size: Any) -> Any:
        """As numpy's Generator."""
        if self._random is None:
            number = self._number
            if number not in self._ahead:
                numbers = range(number, number + IMAGES_AHEAD)
                self._ahead = {k: np.random.default_rng([self._seed, k]) for k in numbers}
            self._random = self._ahead.pop(number)
        return self._random.standard_normal(size)
