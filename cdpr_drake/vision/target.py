"""What a camera looks at: one interface for tags, bundles of tags, dots, circles and textures.

A `Target` is an object O with a pattern in its plane z = 0; `PointTarget` is one whose marks are
points. `pose_from_points` finds X_CO. A `Plate` is a square with a picture on it, which a target
carries; `blank_picture`, `draw_disc` and `picture_png` make such pictures.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import cv2
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.vision.pinhole import (
    Pinhole,
    is_faced,
    is_pictured,
    normalize_points,
    take_picture,
)
from cdpr_drake.vision.planar_pose_kernel import planar_pose

VISIBLE_BORDER = 1.0
"""What is seen must lie this far inside the image [px]."""

PICTURE_PIXELS = 640
"""Edge of a picture that is drawn here."""


class Target(ABC):
    """An object O with a pattern in its plane z = 0, and how it is found in images.

    An image gives marks, one flat vector: (u, v) of each point, or (u, v, n20, n11, n02) of
    each ellipse [px, px^2].

    Attributes:
        mark: What the marks are, "corners" (points) or "ellipses".
        size: Numbers in the vector of marks.
        quality: What `follow` tells beside the marks on how well they are known, names with units.
        outline: Points around the pattern in O, shape (3, n) [m], which must be in view.
    """

    mark: str = "corners"
    size: int
    quality: tuple[str, ...] = ()
    outline: Array

    @abstractmethod
    def project(
        self, X_CO: RigidTransform, pinhole: Pinhole, noise: float, random: NormalNumbers
    ) -> Array | None:
        """Marks that a camera would find, shape (size,), or None where it does not see O.

        Args:
            X_CO: Pose of O in the camera.
            pinhole: The camera.
            noise: Standard deviation of the coordinates of what is measured in the image [px].
            random: Where the noise comes from.
        """

    @abstractmethod
    def find(self, rgb: np.ndarray) -> Array | None:
        """Marks in an image, shape (size,), or None; NaN where a part of the target is not seen.

        Args:
            rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
        """

    def follow(self, rgb: np.ndarray, before: Array | None) -> Array | None:
        """Marks in an image as `find`, and how well they are known, looking first where it was.

        What is not found there is looked for everywhere, so nothing is missed that `find` finds.

        Args:
            rgb: Image, shape (height, width, 3 or 4), 8 bits a channel.
            before: Marks in the image before, in pixels of this one, shape (size,); None: it was
                not seen.

        Returns:
            Marks and the numbers that `quality` names, shape (size + len(quality),), or None.
        """
        return self.find(rgb)

    @abstractmethod
    def solve(self, marks: Array, pinhole: Pinhole) -> RigidTransform | None:
        """Pose X_CO from marks, shape (size,), or None where there is none."""

    @abstractmethod
    def normalized(self, marks: Array, pinhole: Pinhole) -> Array:
        """Marks at unit focal length: points, shape (2, n), or ellipses, shape (n, 5) [-]."""

    def write_normalized(self, marks: Array, pinhole: Pinhole, out: Array) -> None:
        """Writes the same row by row to `out`, shape (size,)."""
        out[:] = self.normalized(marks, pinhole).ravel()

    @abstractmethod
    def ideal_marks(self, X_CO: RigidTransform) -> Array:
        """Normalized marks at a pose, whether in view or not; as `normalized` returns them."""

    @abstractmethod
    def plates(self) -> list[Plate]:
        """What it looks like."""

    def complete(self, marks: Array, X_CO: RigidTransform, pinhole: Pinhole) -> Array:
        """Marks in which those not seen are filled by their images at the pose X_CO."""
        return marks

    def center(self, marks: Array, X_CO: RigidTransform, pinhole: Pinhole) -> Array:
        """Image of the origin of O at unit focal length, shape (2,) [-]: that of the pose."""
        p = X_CO.translation()
        return p[:2] / p[2]

    def centers(self, marks: Array, places: Array, pinhole: Pinhole) -> Array:
        """`center` of many images, shape (n, 2) [-].

        Args:
            marks: A row for each, shape (n, size).
            places: Positions p_CO, shape (n, 3) [m].
            pinhole: The camera.
        """
        return np.asarray(places[:, :2] / places[:, 2:])

    def in_view(self, X_CO: RigidTransform, pinhole: Pinhole) -> bool:
        """Whether all of it is in the image and its face is turned to the camera."""
        if pinhole.distortion is not None:
            # A lens bends edges, so that corners alone do not tell where they are.
            halfway = 0.5 * (self.outline + np.roll(self.outline, 1, axis=1))
            around = pinhole.project(X_CO @ np.hstack([self.outline, halfway]))
            return faces_camera(X_CO) and pinhole.sees(around, VISIBLE_BORDER)
        return bool(is_pictured(self.outline, _columns(X_CO), pinhole.numbers, VISIBLE_BORDER))


class PointTarget(Target):
    """A target whose marks are points.

    Attributes:
        points: The points in O, shape (3, n) [m].
    """

    points: Array

    def project(
        self, X_CO: RigidTransform, pinhole: Pinhole, noise: float, random: NormalNumbers
    ) -> Array | None:
        """As the base class says."""
        if pinhole.distortion is not None:
            if not self.in_view(X_CO, pinhole):
                return None
            uv = pinhole.project(X_CO @ self.points)
            if noise > 0.0:
                uv = uv + noise * random.standard_normal(uv.shape)
            return uv.T.ravel()
        X, camera, uv = _columns(X_CO), pinhole.numbers, np.empty((2, self.points.shape[1]))
        if not take_picture(self.points, self.outline, X, camera, VISIBLE_BORDER, uv):
            return None
        if noise > 0.0:
            uv += noise * random.standard_normal(uv.shape)
        return uv.T.ravel()

    def solve(self, marks: Array, pinhole: Pinhole) -> RigidTransform | None:
        """As the base class says."""
        points, image = self._rows, np.ascontiguousarray(marks).reshape(-1, 2)
        if math.isfinite(sum(marks.tolist())):
            return _pose_from_rows(points, image, pinhole, self._in_space)
        seen = np.all(np.isfinite(image), axis=1)
        points = points[seen]
        return _pose_from_rows(points, image[seen], pinhole, bool(np.any(points[:, 2])))

    @cached_property
    def _rows(self) -> Array:
        """The points as rows, shape (n, 3) [m]."""
        return np.ascontiguousarray(self.points.T)

    @cached_property
    def _in_space(self) -> bool:
        """Whether a point is off the plane z = 0."""
        return bool(np.any(self.points[2]))

    def normalized(self, marks: Array, pinhole: Pinhole) -> Array:
        """As the base class says."""
        xy = np.empty(len(marks))
        normalize_points(marks, pinhole.numbers, xy)
        return xy.reshape(2, -1)

    def write_normalized(self, marks: Array, pinhole: Pinhole, out: Array) -> None:
        """As the base class says."""
        normalize_points(marks, pinhole.numbers, out)

    def ideal_marks(self, X_CO: RigidTransform) -> Array:
        """As the base class says."""
        p_CK = X_CO @ self.points
        return p_CK[:2] / p_CK[2]


class NormalNumbers(Protocol):
    """Gives independent standard normal numbers, as numpy's Generator does."""

    def standard_normal(self, size: Any) -> Any:
        """An array of a shape."""


def faces_camera(X_CO: RigidTransform) -> bool:
    """Whether z of O points to the camera's side of its plane."""
    return bool(is_faced(_columns(X_CO)))


def pose_from_points(p_OK: Array, uv: Array, pinhole: Pinhole) -> RigidTransform | None:
    """X_CO from the images of at least four points, or None where there is none.

    The pose of least squares over the reprojection. For points in the plane z = 0 it is the lower
    of the two minima that `planar_pose_kernel` finds, for points in space that which OpenCV's SQPNP
    begins.

    Args:
        p_OK: Points in O, shape (3, n) [m].
        uv: Their images, shape (2, n) [px].
        pinhole: The camera.
    """
    points, image = np.ascontiguousarray(p_OK.T), np.ascontiguousarray(uv.T)
    return _pose_from_rows(points, image, pinhole, bool(np.any(p_OK[2])))


def _pose_from_rows(
    points: Array, image: Array, pinhole: Pinhole, in_space: bool
) -> RigidTransform | None:
    """As `pose_from_points`, of points and images in rows, shape (n, 3) [m] and (n, 2) [px]."""
    if len(points) < 4:
        return None
    if in_space:
        return _pose_in_space(points, image, pinhole)
    R, p = np.empty((3, 3)), np.empty(3)
    if not planar_pose(points, image, pinhole.numbers, R, p):
        return None
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)


def _columns(X: RigidTransform) -> Array:
    """A pose as the kernels of `pinhole` take it, shape (12,)."""
    return np.asarray(X.GetAsMatrix34().ravel("F"))


def _pose_in_space(points: Array, image: Array, pinhole: Pinhole) -> RigidTransform | None:
    """X_CO of points, shape (n, 3) [m], from their images, shape (n, 2) [px], by OpenCV."""
    K = pinhole.matrix()
    best, best_error = None, np.inf
    count, vectors, positions, _ = cv2.solvePnPGeneric(
        points, image, K, None, flags=cv2.SOLVEPNP_SQPNP
    )
    for r, p in zip(vectors[:count], positions[:count], strict=True):
        r, p = cv2.solvePnPRefineLM(points, image, K, None, r, p)
        again = cv2.projectPoints(points, r, p, K, None)[0].reshape(-1, 2)
        error = float(np.sum(np.square(again - image)))
        if error < best_error and p[2, 0] > 0.0:
            R = RotationMatrix.ProjectToRotationMatrix(cv2.Rodrigues(r)[0])
            best, best_error = RigidTransform(R, np.ravel(p)), error
    return best


@dataclass(frozen=True)
class Plate:
    """A square with a picture on it.

    Attributes:
        X_OT: Pose of its frame T in the object: x right, y up, z out of the picture.
        png: The picture, a PNG file.
        width: Edge [m].
    """

    X_OT: RigidTransform
    png: bytes
    width: float


def blank_picture() -> np.ndarray:
    """A white picture, 8 bits, grey."""
    return np.full((PICTURE_PIXELS, PICTURE_PIXELS), 255, np.uint8)


def draw_disc(picture: np.ndarray, middle: tuple[float, float], radius: float, gray: int) -> None:
    """Draws a disc with smooth edges; positions are from the picture's upper left corner [px]."""
    v, u = np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5
    share = np.clip(radius + 0.5 - np.hypot(u - middle[0], v - middle[1]), 0.0, 1.0)
    picture[:] = np.round((1.0 - share) * picture + share * gray)


def picture_png(picture: np.ndarray) -> bytes:
    """The PNG file of a picture."""
    return bytes(cv2.imencode(".png", picture)[1].tobytes())
