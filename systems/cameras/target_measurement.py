"""Measurements of a target by a camera: the ports and delay line that all share, and the detector.

`TargetMeasurement` is the base of the rendered and of the projected camera; `TargetDetector` finds
the target in images.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import write_pose
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.vision.lens_picture import StraightPicture
from cdpr_drake.vision.mark_reading import found_marks, moved_marks, read_marks
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


class TargetMeasurement(LeafSystem):
    """Measures a target at a fixed rate; base of the rendered and of the projected camera.

    ======== ============== ====== ========================================================
    port     type           unit   meaning
    ======== ============== ====== ========================================================
    corners  vector(2 n)    px     out, (u, v) of the target's n points, or instead
    ellipses vector(10)     px,    out, (u, v, n20, n11, n02) of two circles' images
                            px^2
    X_CO     RigidTransform m      out, object frame O in camera frame C; identity if not
                                   found
    found    vector(1)      -      out, 1 or 0
    quality  vector(k)      -      out, numbers that `target.quality` names, NaN where nothing was
                                   told; only of targets that tell
    ======== ============== ====== ========================================================

    Marks are in pixels of the ideal camera: where the lens distorts, or is believed to be another,
    they are read by `Pinhole.read`. Points of a target of which a part is seen are filled by their
    images at the pose X_CO.

    The image of time t is on the ports for a controller that acts at t, since it is taken by an
    unrestricted update, which Drake performs before the discrete updates of the same time; with
    a latency of n frames the ports lag by n periods.
    """

    def __init__(
        self,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        latency_frames: int,
        image_bias: Array | None = None,
    ) -> None:
        """For a target and a camera, images at `rate` [Hz], latency in whole frames.

        Everything in the image is measured `image_bias` (u, v) off, shape (2,) [px]; None: nothing.
        """
        super().__init__()
        self.bias = None if image_bias is None else np.asarray(image_bias, float)
        self.target, self.pinhole = target, pinhole
        # Numbers that one image leaves: found, marks, X_CO (rotation row by row, origin), quality.
        self._marks = slice(1, 1 + target.size)
        self._pose_at = 1 + target.size
        self._quality = slice(13 + target.size, 13 + target.size + len(target.quality))
        self._frame_size = 13 + target.size + len(target.quality)
        self._oldest = latency_frames * self._frame_size
        self._frames = self.DeclareDiscreteState(self.no_frames())
        self.DeclareInitializationPublishEvent(self._check_inputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_image)
        ticket = {self.discrete_state_ticket(self._frames)}
        self.DeclareVectorOutputPort(target.mark, target.size, self._calc_marks, ticket)
        self.DeclareAbstractOutputPort(
            "X_CO", lambda: Value(RigidTransform()), self._calc_pose, ticket
        )
        self.DeclareVectorOutputPort("found", 1, self._calc_found, ticket)
        if target.quality:
            self.DeclareVectorOutputPort("quality", len(target.quality), self._calc_quality, ticket)

    unread: tuple[str, ...] = ()
    """Inputs that may stay open since the block does not read them."""

    def _check_inputs(self, context: Context) -> None:
        """Checks that no input is open, before the first image."""
        ports = [self.get_input_port(k) for k in range(self.num_input_ports())]
        ports = [port for port in ports if port.get_name() not in self.unread]
        open_ports = [port.get_name() for port in ports if not port.HasValue(context)]
        if open_ports:
            raise CdprError(
                f"camera {self.get_name()}: found nothing at its input {', '.join(open_ports)}; "
                f"accepted: all of {', '.join(port.get_name() for port in ports)} connected"
            )

    @abstractmethod
    def find_marks(self, context: Context) -> Array | None:
        """The target's marks in the image of now, and their quality if the camera tells it, as
        `Target.follow` gives them, or None."""

    def look(self, context: Context, state: State) -> Array | None:
        """`find_marks` for the image of an event; a camera that remembers writes that into the
        block's next state."""
        return self.find_marks(context)

    def newest_pose(self, context: Context) -> RigidTransform | None:
        """X_CO of the newest image so far, however late it will be on the ports; None: not seen."""
        values = context.get_discrete_state(self._frames).value()
        return self._pose(values[: self._frame_size])

    def newest_marks(self, context: Context) -> Array | None:
        """Where marks are in the newest image so far, shape (target.size,) [px]; None: not seen."""
        return self.newest_in_image(context.get_discrete_state(self._frames).value())

    def newest_in_image(self, frames: Array) -> Array | None:
        """As `newest_marks`, from the frames in the delay line."""
        if frames[0] == 0.0:
            return None
        marks = np.array(frames[self._marks])
        if not self.pinhole.is_ideal:
            marks = found_marks(marks, self.target.mark, self.target.size, self.pinhole)
        return marks if self.bias is None else shifted_marks(self.target, marks, -self.bias)

    def _take_image(self, context: Context, state: State) -> None:
        frames = state.get_mutable_discrete_state().get_mutable_vector(self._frames)
        frames.SetFromVector(self.next_frames(frames.CopyToVector(), self.look(context, state)))

    def no_frames(self) -> Array:
        """What stands for frames before the first image."""
        frames = np.zeros(self._oldest + self._frame_size)
        frames.reshape(-1, self._frame_size)[:, self._quality] = np.nan
        return frames

    def next_frames(self, frames: Array, marks: Array | None) -> Array:
        """The frames in the delay line after an image with marks, or without the target; marks as
        `Target.follow` gives them, or without their quality."""
        values, target, camera = np.zeros(len(frames)), self.target, self.pinhole.ideal
        if self._oldest:
            values[self._frame_size :] = frames[: -self._frame_size]
        if target.quality:
            values[self._quality] = np.nan
        if marks is None:
            return values
        if len(marks) > target.size:
            values[self._quality] = marks[target.size :]
            marks = marks[: target.size]
        marks = self.read_marks(marks)
        X_CO = target.solve(marks, camera)
        if X_CO is not None:
            values[0] = 1.0
            values[self._marks] = target.complete(marks, X_CO, camera)
            write_pose(X_CO, values[self._pose_at : self._pose_at + 12])
        return values

    def read_marks(self, marks: Array) -> Array:
        """Marks in pixels of the ideal camera, of what was found in an image, bias included."""
        if self.bias is not None:
            marks = shifted_marks(self.target, marks, self.bias)
        if self.pinhole.is_ideal:
            return marks
        return read_marks(marks, self.target.mark, self.target.size, self.pinhole)

    def _frame(self, context: Context) -> Array:
        return self.oldest(context.get_discrete_state(self._frames).value())

    def oldest(self, frames: Array) -> Array:
        """Numbers of the image that is on the ports: found, marks, pose; see `pose_of`."""
        return np.asarray(frames[self._oldest : self._oldest + self._frame_size])

    def marks_of(self, frame: Array) -> Array:
        """Its marks, shape (target.size,)."""
        return frame[self._marks]

    def pose_of(self, frame: Array) -> RigidTransform:
        """Its pose X_CO [m], the identity if the target was not found."""
        X_CO = self._pose(frame)
        return RigidTransform() if X_CO is None else X_CO

    def _calc_marks(self, context: Context, output: BasicVector) -> None:
        output.set_value(self.marks_of(self._frame(context)))

    def _calc_found(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._frame(context)[:1])

    def _calc_quality(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._frame(context)[self._quality])

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.pose_of(self._frame(context)))

    def _pose(self, frame: Array) -> RigidTransform | None:
        """X_CO as one image left it, or None."""
        at = self._pose_at
        if frame[0] == 0.0:
            return None
        R = RotationMatrix.ProjectToRotationMatrix(frame[at : at + 9].reshape(3, 3))
        return RigidTransform(R, frame[at + 9 : at + 12])


def shifted_marks(target: Target, marks: Array, shift: Array) -> Array:
    """Marks of a target, shape (size,), moved in the image by a shift (u, v), shape (2,) [px].

    What comes after them, their quality, stays.
    """
    moved = np.array(marks)
    each = moved[: target.size].reshape(-1, 2 if target.mark == "corners" else ELLIPSE_SIZE)
    each[:, :2] += shift
    return moved


class TargetDetector(TargetMeasurement):
    """Finds a target in images by OpenCV, to fractions of a pixel, and its pose.

    Where the camera is believed to have a lens it looks in `StraightPicture`s of the images. A
    target that is followed is looked for where the newest image had it, and then everywhere.

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
        reader = pinhole.believed or pinhole
        self._straight = None if reader.distortion is None else StraightPicture(reader)
        self._image = self.DeclareAbstractInputPort("color_image", Value(ImageRgba8U()))

    def find_marks(self, context: Context) -> Array | None:
        """The target's marks in the image at the input, or None."""
        return self.find_in(self._image.Eval(context).data, self.newest_marks(context))

    def find_in(self, image: np.ndarray, before: Array | None = None) -> Array | None:
        """The target's marks in an image, or None.

        Args:
            image: Shape (height, width, 3 or 4), 8 bits a channel.
            before: Where they were in the image before; None: it was not seen.
        """
        straight, size, mark = self._straight, self.target.size, self.target.mark
        if straight is None:
            return self.target.follow(image, before)
        reader = self.pinhole.believed or self.pinhole
        if before is not None:
            before = moved_marks(
                read_marks(before, mark, size, reader), mark, size, straight.from_ideal
            )
        marks = self.target.follow(straight.picture(image), before)
        if marks is None:
            return None
        return found_marks(moved_marks(marks, mark, size, straight.to_ideal), mark, size, reader)
