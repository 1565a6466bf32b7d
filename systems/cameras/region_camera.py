"""A camera that draws and reads a region of interest: a window round its target."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, State

from cdpr_drake.arrays import Array
from cdpr_drake.errors import LensDistortionError
from cdpr_drake.systems.cameras.scene_picture import draw_image, draw_window
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement, shifted_marks
from cdpr_drake.vision.image_window import ImageWindow, expected_window, target_box, whole_image
from cdpr_drake.vision.lens_picture import StraightPicture, lens_picture, without_lens
from cdpr_drake.vision.mark_reading import found_marks, moved_marks, read_marks
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

_IMAGES, _WHOLE = 0, 1
_BOX = slice(2, 6)


class RegionCamera(TargetMeasurement):
    """Draws a window round where the target will be, and finds the target in that.

    ============ ============== ==== ========================================================
    port         type           unit meaning
    ============ ============== ==== ========================================================
    query_object QueryObject    -    in, of the scene graph
    X_BC         RigidTransform m    in, pose of the camera on B; only if it turns
    corners      vector(2 n)    px   out, or `ellipses`: as `TargetMeasurement`
    X_CO         RigidTransform m    out, as `TargetMeasurement`
    found        vector(1)      -    out, as `TargetMeasurement`
    quality      vector(k)      -    out, as `TargetMeasurement`
    ============ ============== ==== ========================================================

    The window is cut out of the image that the whole camera would give: marks are in that image's
    pixels and noise is the same. It is `expected_window` of the last two images. Where that one
    does not have the target, the whole image of the same moment is drawn and searched: nothing that
    `TargetDetector` finds is missed.

    Drake draws windows only that have the principal point inside, so what is drawn may be larger
    than what is read and searched. Where the lens distorts, windows are of the image as
    `StraightPicture` shows it, and of what is drawn wider no more is drawn than they need.
    """

    def __init__(
        self,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        *,
        parent: FrameId,
        X_BC: RigidTransform,
        latency_frames: int = 0,
        image_bias: Array | None = None,
        turns: bool = False,
    ) -> None:
        """For one target, and a camera of the scene.

        Args:
            target: What is looked for.
            pinhole: The whole camera's intrinsic parameters.
            rate: Images per second [Hz].
            parent: Geometry frame of the body B that carries the camera.
            X_BC: Pose of the camera frame C in B, z forward, y down [m].
            latency_frames: Latency in whole frames.
            image_bias: As for `TargetMeasurement`.
            turns: Whether an input says where it is on B.

        Raises:
            LensDistortionError: The camera is believed to be another, or the lens has no valid
                field in all of the image.
        """
        if pinhole.believed is not None:
            raise LensDistortionError(
                "camera.region: found target with a camera that is believed to be another; "
                "accepted: whole, or the camera as it is"
            )
        super().__init__(target, pinhole, rate, latency_frames, image_bias)
        self._straight = None if pinhole.distortion is None else StraightPicture(pinhole)
        self._searched = pinhole if self._straight is None else self._straight.wide
        self._parent, self._X_BC = parent, X_BC
        self._query = self.DeclareAbstractInputPort(
            "query_object", AbstractValue.Make(QueryObject())
        )
        self._turned = None
        if turns:
            self._turned = self.DeclareAbstractInputPort("X_BC", Value(RigidTransform()))
        self._memory = self.DeclareDiscreteState(np.concatenate([[0.0, 0.0], np.full(4, np.nan)]))

    def images(self, context: Context) -> tuple[int, int]:
        """Images taken, and those of them that were drawn whole, from the block's own context."""
        memory = context.get_discrete_state(self._memory).value()
        return int(memory[_IMAGES]), int(memory[_WHOLE])

    def picture(self, context: Context) -> np.ndarray:
        """The whole image of now, shape (height, width, 4), 8 bits a channel, for people to look
        at, from the block's own context."""
        camera = self.pinhole
        drawn = draw_image(
            self._query.Eval(context), self._parent, self._place(context), without_lens(camera)
        )
        return drawn if camera.distortion is None else lens_picture(drawn, camera)

    def _place(self, context: Context) -> RigidTransform:
        """Where the camera is on B."""
        return self._X_BC if self._turned is None else self._turned.Eval(context)

    def find_marks(self, context: Context) -> Array | None:
        """The target's marks in the scene of now, or None; [px] of the whole image."""
        return self._find(context)[0]

    def look(self, context: Context, state: State) -> Array | None:
        """As the base class says; remembers the box of the last image and what was drawn."""
        marks, whole = self._find(context)
        kept = state.get_mutable_discrete_state().get_mutable_vector(self._memory)
        memory = kept.CopyToVector()
        memory[_IMAGES] += 1.0
        memory[_WHOLE] += float(whole)
        memory[_BOX] = self._last_box(context)
        kept.SetFromVector(memory)
        return marks

    def _find(self, context: Context) -> tuple[Array | None, bool]:
        """Marks, and whether the whole image was drawn."""
        scene = self._query.Eval(context), self._place(context)
        everything = whole_image(self._searched)
        before = context.get_discrete_state(self._memory).value()[_BOX]
        seen = self.newest_marks(context)
        window = expected_window(self._last_box(context), before, self._searched)
        if window is not None and window != everything:
            marks = self._search(scene, window, seen)
            if marks is not None:
                return marks, False
        return self._search(scene, everything, seen), True

    def _last_box(self, context: Context) -> Array:
        """Where the target was in the newest image as it is searched, shape (4,) [px]; NaN where
        it was not seen."""
        X_CO = self.newest_pose(context)
        if X_CO is None:
            return np.full(4, np.nan)
        if self._straight is not None:
            uv = self.pinhole.found_at(self.pinhole.ideal.project(X_CO @ self.target.outline))
            if self.bias is not None:
                uv = uv - self.bias[:, np.newaxis]
            uv = self._straight.from_ideal(self.pinhole.read(uv))
            return np.concatenate([np.min(uv, axis=1), np.max(uv, axis=1)])
        box = target_box(self.target, X_CO, self.pinhole)
        return box if self.bias is None else box - np.tile(self.bias, 2)

    def _search(
        self,
        scene: tuple[QueryObject, RigidTransform],
        window: ImageWindow,
        seen: Array | None,
    ) -> Array | None:
        query, X_BC = scene
        if self._straight is not None:
            return self._search_straight(self._straight, scene, window, seen)
        if window == whole_image(self.pinhole):
            picture = draw_image(query, self._parent, X_BC, self.pinhole)
        else:
            picture = draw_window(query, self._parent, X_BC, self.pinhole, window)
        corner = np.array([window.u, window.v], float)
        before = None if seen is None else shifted_marks(self.target, seen, -corner)
        marks = self.target.follow(picture, before)
        return None if marks is None else shifted_marks(self.target, marks, corner)

    def _search_straight(
        self,
        straight: StraightPicture,
        scene: tuple[QueryObject, RigidTransform],
        window: ImageWindow,
        seen: Array | None,
    ) -> Array | None:
        """As `_search`, in a window of the straight picture; marks are in pixels of the image."""
        (query, X_BC), wide, target = scene, straight.wide, self.target
        if window == whole_image(wide):
            drawn = draw_image(query, self._parent, X_BC, wide)
            picture = straight.picture(lens_picture(drawn, self.pinhole))
        else:
            picture = straight.window(
                window, lambda part: draw_window(query, self._parent, X_BC, wide, part)
            )
        corner, size = np.array([window.u, window.v], float), target.size
        before = None
        if seen is not None:
            ideal = read_marks(seen, target.mark, size, self.pinhole)
            before = moved_marks(ideal, target.mark, size, straight.from_ideal)
            before = shifted_marks(target, before, -corner)
        marks = target.follow(picture, before)
        if marks is None:
            return None
        marks = moved_marks(
            shifted_marks(target, marks, corner), target.mark, size, straight.to_ideal
        )
        return found_marks(marks, target.mark, size, self.pinhole)
