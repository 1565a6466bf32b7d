"""The pinhole camera: intrinsic parameters, projection, field of view, and marks without pixels.

`Pinhole` is the camera for Python, with the distortion of its lens where it has one. What is found
in its image is read: brought to the pixels of the `ideal` camera, by the lens and the intrinsic
parameters that are believed. All that comes after, kernels too, knows the ideal camera alone.

The kernels take it as `Pinhole.numbers`, fx, fy, cx, cy first,
and a pose X_CO as its matrix (3, 4), column by column, shape (12,) [-, m]: `images_of`, `is_faced`
and `is_pictured` project points; `normalize_points`, `normalize_ellipses` and `crossing_diagonals`
bring marks of targets to unit focal length.

Source: servoing thesis (1.41).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.vision.lens_distortion import LensDistortion

RIM_POINTS = 65
"""Of each edge of an image that are looked at."""


@dataclass(frozen=True)
class Pinhole:
    """Intrinsic parameters of a camera, and the distortion of its lens.

    Pixel coordinates (u, v) count from the middle of the upper left pixel, u to the right and v
    down, as in OpenCV. In the camera frame C, x points right, y down, z forward.

    Attributes:
        width: Image width [px].
        height: Image height [px].
        fx: Focal length along u [px].
        fy: Focal length along v [px].
        cx: Principal point along u [px].
        cy: Principal point along v [px].
        distortion: What its lens does to images; None: nothing.
        believed: The camera as whose its images are read; None: as which they are.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: LensDistortion | None = None
    believed: Pinhole | None = None

    @staticmethod
    def from_view_angles(width: int, height: int, horizontal: float, vertical: float) -> Pinhole:
        """A centred camera that sees the given full angles [rad] along width and height [px]."""
        return Pinhole(
            width,
            height,
            width / 2.0 / np.tan(horizontal / 2.0),
            height / 2.0 / np.tan(vertical / 2.0),
            (width - 1) / 2.0,
            (height - 1) / 2.0,
        )

    @cached_property
    def numbers(self) -> Array:
        """fx, fy, cx, cy, width, height, shape (6,) [px], as kernels take them."""
        return np.array([self.fx, self.fy, self.cx, self.cy, self.width, self.height], float)

    def matrix(self) -> Array:
        """K with (u, v, 1)' ~ K (x, y, 1)', shape (3, 3) [px]."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def project(self, p_CK: Array) -> Array:
        """Pixels (u, v), shape (2, n) [px], of points K in C, shape (3, n) [m].

        Points at or behind the focal plane (z <= 0) give NaN, and those beyond what the lens is
        valid for. Source: servoing thesis (1.41).
        """
        z = np.where(p_CK[2] > 0.0, p_CK[2], np.nan)
        if self.distortion is not None:
            return self._placed(self.distortion.distort(p_CK[:2] / z))
        return np.vstack([self.cx + self.fx * p_CK[0] / z, self.cy + self.fy * p_CK[1] / z])

    @cached_property
    def ideal(self) -> Pinhole:
        """The camera in whose pixels marks are once they are read: without lens and belief."""
        return self if self.is_ideal else replace(self, distortion=None, believed=None)

    @property
    def is_ideal(self) -> bool:
        """Whether what is found in its image is read as it is."""
        return self.distortion is None and self.believed is None

    def read(self, uv: Array) -> Array:
        """Ideal pixels of what is found at pixels uv of the image, both of shape (2, n) [px].

        By the camera that is believed: at unit focal length they are where that one says. NaN where
        the believed lens has no such image.
        """
        if self.is_ideal:
            return uv
        camera = self.believed or self
        xy = camera._normalized(uv)
        if camera.distortion is not None:
            xy = camera.distortion.undistort(xy)
        return self._placed(xy)

    def found_at(self, uv: Array) -> Array:
        """Where in the image is found what is read at ideal pixels uv; the inverse of `read`."""
        if self.is_ideal:
            return uv
        camera, xy = self.believed or self, self._normalized(uv)
        return camera._placed(xy if camera.distortion is None else camera.distortion.distort(xy))

    def blind_share(self) -> float:
        """Share of the image's rim that the valid field of the lens does not reach, 0..1.

        An image must be within: beyond, two directions would share one pixel.
        """
        if self.distortion is None:
            return 0.0
        return float(np.mean(~np.all(np.isfinite(self._rim()), axis=0)))

    def view_slopes(self) -> tuple[float, float]:
        """Largest s_x, s_y such that all (x, y, 1) in C with |x| <= s_x, |y| <= s_y are seen [-].

        Where the image's rim is, a lens bends these sides inwards or outwards; the rectangle is
        within. Not positive where the middle of C is not in the image.
        """
        top, bottom, left, right = np.split(self._rim(), 4, axis=1)
        x = min(float(np.min(-left[0])), float(np.min(right[0])))
        return x, min(float(np.min(-top[1])), float(np.min(bottom[1])))

    def _rim(self) -> Array:
        """Directions (x, y) of points on the image's rim at unit depth: top, bottom, left, right,
        `RIM_POINTS` of each, shape (2, n) [-]; NaN beyond what the lens is valid for.
        """
        u = np.linspace(-0.5, self.width - 0.5, RIM_POINTS)
        v = np.linspace(-0.5, self.height - 0.5, RIM_POINTS)
        left, top = np.full(RIM_POINTS, -0.5), np.full(RIM_POINTS, -0.5)
        rim = np.hstack([
            [u, top], [u, top + self.height], [left, v], [left + self.width, v],
        ])  # fmt: skip
        xy = self._normalized(rim)
        return xy if self.distortion is None else self.distortion.undistort(xy)

    def _normalized(self, uv: Array) -> Array:
        """Pixels at unit focal length, shape (2, n) [-]."""
        return np.vstack([(uv[0] - self.cx) / self.fx, (uv[1] - self.cy) / self.fy])

    def _placed(self, xy: Array) -> Array:
        """The pixels of points at unit focal length, shape (2, n) [px]."""
        return np.vstack([self.cx + self.fx * xy[0], self.cy + self.fy * xy[1]])

    def sees(self, uv: Array, border: float = 0.0) -> bool:
        """Whether all pixels uv, shape (2, n) [px], lie in the image, `border` [px] off its rim."""
        low = -0.5 + border
        inside = (
            (uv[0] > low)
            & (uv[0] < self.width - 0.5 - border)
            & (uv[1] > low)
            & (uv[1] < self.height - 0.5 - border)
        )
        return bool(np.all(inside))


FX, FY, CX, CY, WIDTH, HEIGHT = range(6)
"""Numbers of a camera [px]."""


@njit(cache=True)
def images_of(points: Array, X: Array, camera: Array, uv: Array) -> None:
    """Writes images of points, shape (3, k) [m], to uv, shape (2, k) [px]; NaN behind the camera.

    Source: servoing thesis (1.41).
    """
    for k in range(points.shape[1]):
        a, b, c = points[0, k], points[1, k], points[2, k]
        z = X[2] * a + X[5] * b + X[8] * c + X[11]
        if z > 0.0:
            uv[0, k] = camera[CX] + camera[FX] * (X[0] * a + X[3] * b + X[6] * c + X[9]) / z
            uv[1, k] = camera[CY] + camera[FY] * (X[1] * a + X[4] * b + X[7] * c + X[10]) / z
        else:
            uv[0, k] = uv[1, k] = np.nan


@njit(cache=True)
def is_faced(X: Array) -> bool:
    """Whether z of O points to the camera's side of its plane."""
    return X[6] * X[9] + X[7] * X[10] + X[8] * X[11] < 0.0


@njit(cache=True)
def is_pictured(points: Array, X: Array, camera: Array, border: float) -> bool:
    """Whether O turns its face to the camera, with all points, shape (3, k) [m], in the picture, a
    border [px] off its rim."""
    if not is_faced(X):
        return False
    uv = np.empty((2, points.shape[1]))
    images_of(points, X, camera, uv)
    low = -0.5 + border
    for k in range(points.shape[1]):
        u, v = uv[0, k], uv[1, k]
        if not (low < u < camera[WIDTH] - 0.5 - border):
            return False
        if not (low < v < camera[HEIGHT] - 0.5 - border):
            return False
    return True


@njit(cache=True)
def take_picture(
    points: Array, outline: Array, X: Array, camera: Array, border: float, uv: Array
) -> bool:
    """Writes `images_of` points where `is_pictured` holds of an outline; whether it does."""
    if not is_pictured(outline, X, camera, border):
        return False
    images_of(points, X, camera, uv)
    return True


@njit(cache=True)
def normalize_points(marks: Array, camera: Array, out: Array) -> None:
    """Points (u, v), one after the other, shape (2 n,) [px], to all x and then all y, shape (2 n,).

    Args:
        marks: The points.
        camera: Shape (4,).
        out: Overwritten [-].
    """
    n = marks.shape[0] // 2
    for k in range(n):
        out[k] = (marks[2 * k] - camera[2]) / camera[0]
        out[n + k] = (marks[2 * k + 1] - camera[3]) / camera[1]


@njit(cache=True)
def normalize_ellipses(marks: Array, camera: Array, out: Array) -> None:
    """Ellipses (u, v, n20, n11, n02), one after the other, shape (5 n,) [px, px^2], the same.

    Args:
        marks: The ellipses.
        camera: Shape (4,).
        out: Overwritten, shape (5 n,) [-].
    """
    fx, fy = camera[0], camera[1]
    for k in range(marks.shape[0] // ELLIPSE_SIZE):
        at = ELLIPSE_SIZE * k
        out[at] = (marks[at] - camera[2]) / fx
        out[at + 1] = (marks[at + 1] - camera[3]) / fy
        out[at + 2] = marks[at + 2] / (fx * fx)
        out[at + 3] = marks[at + 3] / (fx * fy)
        out[at + 4] = marks[at + 4] / (fy * fy)


@njit(cache=True)
def crossing_diagonals(marks: Array, camera: Array, out: Array) -> None:
    """Where the diagonals of four corners meet.

    Args:
        marks: Corners (u, v) around a square, shape (8,) [px].
        camera: Shape (4,).
        out: Overwritten, shape (2,) [-].
    """
    a, b, c, d = marks[0], marks[2], marks[4], marks[6]
    e, f, g, h = marks[1], marks[3], marks[5], marks[7]
    # (a, e) + share (c - a, g - e) lies on the line through (b, f) and (d, h).
    along_u, along_v, across_u, across_v = c - a, g - e, d - b, h - f
    share = ((b - a) * across_v - (f - e) * across_u) / (along_u * across_v - along_v * across_u)
    out[0] = (a + share * along_u - camera[2]) / camera[0]
    out[1] = (e + share * along_v - camera[3]) / camera[1]


@njit(cache=True)
def crossings_of_diagonals(marks: Array, camera: Array, out: Array) -> None:
    """`crossing_diagonals` of many images, marks shape (n, 8) [px], out shape (n, 2) [-]."""
    for k in range(marks.shape[0]):
        crossing_diagonals(marks[k], camera, out[k])
