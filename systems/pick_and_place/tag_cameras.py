"""Cameras that look for a tag while they are asked to: in images, or by projecting it."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


class AttentiveDetector(TargetDetector):
    """A `TargetDetector` with one port more; no image is drawn while nobody asks for one.

    ======= ========= ==== ================================
    port    type      unit meaning
    ======= ========= ==== ================================
    enabled vector(2) -    in, 1 for each camera that looks
    ======= ========= ==== ================================
    """

    def __init__(self, target: Target, pinhole: Pinhole, rate: float, number: int) -> None:
        """For camera `number` of the port enabled, images at `rate` [Hz]."""
        super().__init__(target, pinhole, rate)
        self._number = number
        self._enabled = self.DeclareVectorInputPort("enabled", 2)

    def find_marks(self, context: Context) -> Array | None:
        """The tag's corners in the image at the input, or None."""
        if not self._enabled.Eval(context)[self._number]:
            return None
        return super().find_marks(context)


class AttentiveProjection(ProjectedCamera):
    """A `ProjectedCamera` with ports more, which a box and a cover can hide the tag from.

    ============ ============== ==== ========================================
    port         type           unit meaning
    ============ ============== ==== ========================================
    enabled      vector(2)      -    in, 1 for each camera that looks
    tag_occluded vector(1)      -    in, 1 while something lies over the tag
    X_WB         RigidTransform m    in, true pose of the box
    ============ ============== ==== ========================================

    Where the tag is it knows from the box's pose or by itself; the port X_WO is not read.
    """

    unread = ("X_WO",)

    def __init__(
        self,
        target: TagTarget,
        mounting: CameraMounting,
        pinhole: Pinhole,
        rate: float,
        *,
        number: int,
        box: Array,
        X_WO: RigidTransform | None,
        X_BO: RigidTransform,
        pixel_noise: float,
        seed: int,
    ) -> None:
        """A camera for a tag in the world or on the box.

        Args:
            target: The tag.
            mounting: Where the camera is.
            pinhole: Its intrinsic parameters.
            rate: Images per second [Hz].
            number: Of the camera, on the port enabled.
            box: Edges of the box, shape (3,) [m].
            X_WO: Tag in the world; None: it is on the box [m].
            X_BO: Tag on the box [m].
            pixel_noise: Standard deviation of each coordinate [px].
            seed: Seed of that.
        """
        super().__init__(target, mounting, pinhole, rate, pixel_noise=pixel_noise, seed=seed)
        self._number, self._box = number, np.asarray(box, float)
        self._X_PC, self._corners = mounting.X_BC, target.points
        self._X_WO, self._X_BO = X_WO, X_BO
        self._enabled = self.DeclareVectorInputPort("enabled", 2)
        self._hidden = self.DeclareVectorInputPort("tag_occluded", 1)
        self.DeclareAbstractInputPort("X_WB", Value(RigidTransform()))

    def find_marks(self, context: Context) -> Array | None:
        """Projected corners with noise, or None if out of view, hidden or not looked for."""
        if not self._enabled.Eval(context)[self._number] or self._hidden.Eval(context)[0]:
            return None

        X_WB, X_WP = (self.GetInputPort(name).Eval(context) for name in ("X_WB", "X_WP"))
        X_WO = X_WB @ self._X_BO if self._X_WO is None else self._X_WO
        X_BW = X_WB.inverse()
        eye = X_BW @ (X_WP @ self._X_PC).translation()
        corners = (X_BW @ X_WO) @ self._corners
        if any(box_hides(self._box, eye, corner) for corner in corners.T):
            return None
        poses = {"X_WP": X_WP, "X_WO": X_WO}
        return self.project(poses.__getitem__, context.get_time())


def box_hides(size: Array, start: Array, end: Array) -> bool:
    """Whether the way between two points passes through a box.

    Args:
        size: Edges of the box, shape (3,) [m].
        start: A point in the box's frame, shape (3,) [m].
        end: The other one; a point on the surface is not hidden by it.
    """
    way = end - start
    enter, leave = 0.0, 1.0
    for axis in range(3):
        half = 0.5 * float(size[axis])
        if way[axis] == 0.0:
            if abs(start[axis]) > half:
                return False
            continue
        one, two = sorted(((-half - start[axis]) / way[axis], (half - start[axis]) / way[axis]))
        enter, leave = max(enter, one), min(leave, two)
    return leave - enter > 1e-9
