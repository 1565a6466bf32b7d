"""Two concentric circles as a target: the outlines of a black ring."""

from __future__ import annotations

import cv2
import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.numerics.linear_algebra_kernel import least_squares
from cdpr_drake.servoing.circle_features import (
    ELLIPSE_SIZE,
    circle_images,
    ellipses_interaction,
    plane_of,
)
from cdpr_drake.vision.blob_detection import find_dark_blobs
from cdpr_drake.vision.mark_reading import outline_moments
from cdpr_drake.vision.pinhole import Pinhole, normalize_ellipses
from cdpr_drake.vision.target import (
    NormalNumbers,
    Plate,
    Target,
    blank_picture,
    draw_disc,
    faces_camera,
    picture_png,
)

INNER_SHARE = 0.5
"""Radius of the inner circle, per radius of the outer one."""

PLATE_SHARE = 1.4
"""Edge of the white plate, per diameter of the outer circle."""

_OUTLINE_POINTS = 48
_STEPS = 30


class CircleTarget(Target):
    """A black ring on a white plate; its marks are the ellipses of its outlines, outer first.

    Its pose has five parts: the rotation about z of O cannot be seen; the one with x of O turned
    towards x of the camera is taken.
    """

    mark = "ellipses"

    def __init__(self, diameter: float) -> None:
        """For an outer circle of this diameter [m]."""
        self.radii = diameter / 2.0 * np.array([1.0, INNER_SHARE])
        self.size = 2 * ELLIPSE_SIZE
        self._diameter = diameter
        angle = np.linspace(0.0, 2.0 * np.pi, _OUTLINE_POINTS, endpoint=False)
        self._circle = np.array([np.cos(angle), np.sin(angle), np.zeros(_OUTLINE_POINTS)])
        self.outline = self.radii[0] * self._circle

    def project(
        self, X_CO: RigidTransform, pinhole: Pinhole, noise: float, random: NormalNumbers
    ) -> Array | None:
        """As the base class says; noisy ellipses are fitted to 48 noisy points each."""
        if not self.in_view(X_CO, pinhole):
            return None
        if noise == 0.0 and pinhole.distortion is not None:
            images = [pinhole.project(X_CO @ (radius * self._circle)) for radius in self.radii]
            return np.concatenate([outline_moments(uv) for uv in images])
        if noise == 0.0:
            exact = circle_images(X_CO.rotation().matrix(), X_CO.translation(), self.radii)
            return to_pixels(exact, pinhole).ravel()
        fitted = []
        for radius in self.radii:
            uv = pinhole.project(X_CO @ (radius * self._circle))
            fitted.append(fitted_ellipse(uv + noise * random.standard_normal(uv.shape)))
        return np.concatenate(fitted)

    def ideal_marks(self, X_CO: RigidTransform) -> Array:
        """As the base class says."""
        return np.asarray(circle_images(X_CO.rotation().matrix(), X_CO.translation(), self.radii))

    def find(self, rgb: np.ndarray) -> Array | None:
        """As the base class says."""
        for blob in find_dark_blobs(rgb):
            hole = blob.hole
            if hole is None:
                continue
            share = np.sqrt(hole.area() / blob.area())
            if abs(share - INNER_SHARE) < 0.1:
                return np.concatenate([blob.center, blob.moments, hole.center, hole.moments])
        return None

    def solve(self, marks: Array, pinhole: Pinhole) -> RigidTransform | None:
        """As the base class says, by Gauss-Newton steps with the exact interaction matrix.

        A circle has two poses; the search starts from both and the smaller residual wins.
        """
        ellipses = self.normalized(marks, pinhole)
        if not np.all(np.isfinite(ellipses)):  # out of what a lens is valid for
            return None
        best, best_error = None, np.inf
        for start in starting_poses(ellipses[0], float(self.radii[0])):
            fitted = _refined(start, ellipses, self.radii)
            if fitted is not None and fitted[1] < best_error and faces_camera(fitted[0]):
                best, best_error = fitted
        return None if best is None else untwisted(best)

    def normalized(self, marks: Array, pinhole: Pinhole) -> Array:
        """As the base class says."""
        ellipses = np.empty(len(marks))
        normalize_ellipses(marks, pinhole.numbers, ellipses)
        return ellipses.reshape(-1, ELLIPSE_SIZE)

    def write_normalized(self, marks: Array, pinhole: Pinhole, out: Array) -> None:
        """As the base class says."""
        normalize_ellipses(marks, pinhole.numbers, out)

    def plates(self) -> list[Plate]:
        """What it looks like."""
        picture = blank_picture()
        cells = len(picture)
        for share, gray in ((1.0, 0), (INNER_SHARE, 255)):
            draw_disc(picture, (cells / 2.0, cells / 2.0), share / PLATE_SHARE / 2.0 * cells, gray)
        return [Plate(RigidTransform(), picture_png(picture), PLATE_SHARE * self._diameter)]


def to_pixels(ellipses: Array, pinhole: Pinhole) -> Array:
    """Ellipses at unit focal length in pixels, shape (n, 5)."""
    fx, fy = pinhole.fx, pinhole.fy
    scale = np.array([fx, fy, fx * fx, fx * fy, fy * fy])
    return np.asarray(ellipses * scale + np.array([pinhole.cx, pinhole.cy, 0.0, 0.0, 0.0]))


def fitted_ellipse(uv: Array) -> Array:
    """(u, v, n20, n11, n02) of the ellipse fitted to points, shape (2, n) [px]."""
    (u, v), (width, height), angle = cv2.fitEllipseDirect(uv.T.astype(np.float32))
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    a, b = (width / 2.0) ** 2 / 4.0, (height / 2.0) ** 2 / 4.0
    return np.array([u, v, a * c * c + b * s * s, (a - b) * s * c, a * s * s + b * c * c])


def starting_poses(ellipse: Array, radius: float) -> list[RigidTransform]:
    """The two poses of a circle in weak perspective, from its ellipse, shape (5,) [-]."""
    x, y, n20, n11, n02 = ellipse
    values, vectors = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
    large, small = np.sqrt(np.maximum(values[::-1], 1e-12))
    Z = radius / (2.0 * large)
    tilt = np.arccos(min(small / large, 1.0))
    axis = np.array([vectors[0, 1], vectors[1, 1], 0.0])  # the long axis stays in the plane
    frontal = RotationMatrix.MakeXRotation(np.pi)
    poses = []
    for angle in (tilt, -tilt):
        R = exponential(np.concatenate([angle * axis, np.zeros(3)])).rotation() @ frontal
        poses.append(RigidTransform(R, Z * np.array([x, y, 1.0])))
    return poses


def _refined(
    X_CO: RigidTransform, ellipses: Array, radii: Array
) -> tuple[RigidTransform, float] | None:
    """Least squares over the ellipses from a start; the pose and its residual."""
    # A moment's error per error of a point of the outline is about 2 sqrt(n).
    size = np.sqrt(np.maximum(ellipses[:, 2] + ellipses[:, 4], 1e-12))
    weights = np.ones_like(ellipses)
    weights[:, 2:] /= 2.0 * size[:, np.newaxis]
    flat = weights.ravel()[:, np.newaxis]
    error = np.inf
    for _ in range(_STEPS):
        R, p = X_CO.rotation().matrix(), X_CO.translation()
        if p[2] <= 0.0:
            return None
        now = circle_images(R, p, radii)
        residual = (weights * (ellipses - now)).ravel()
        error = float(residual @ residual)
        step, _ = least_squares(flat * ellipses_interaction(now, plane_of(R, p)), residual, 5)
        if not np.all(np.isfinite(step)) or np.linalg.norm(step[:3]) > 1.5:
            return None
        X_CO = exponential(-step) @ X_CO
        if float(np.linalg.norm(step)) < 1e-12:
            break
    return X_CO, error


def untwisted(X_CO: RigidTransform) -> RigidTransform:
    """The pose turned about z of O until y of O is at right angles to x of the camera."""
    R = X_CO.rotation().matrix()
    z = R[:, 2]
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x = x / np.linalg.norm(x)
    return RigidTransform(
        RotationMatrix(np.column_stack([x, np.cross(z, x), z])), X_CO.translation()
    )
