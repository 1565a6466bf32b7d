"""The pinhole camera: intrinsic parameters, projection, field of view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class Pinhole:
    """Intrinsic parameters of a camera without distortion.

    Pixel coordinates (u, v) count from the middle of the upper left pixel, u to the right and v
    down, as in OpenCV. In the camera frame C, x points right, y down, z forward.

    Attributes:
        width: Image width [px].
        height: Image height [px].
        fx: Focal length along u [px].
        fy: Focal length along v [px].
        cx: Principal point along u [px].
        cy: Principal point along v [px].
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

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

        Points at or behind the focal plane (z <= 0) give NaN. Source: servoing thesis (1.41).
        """
        z = np.where(p_CK[2] > 0.0, p_CK[2], np.nan)
        return np.vstack([self.cx + self.fx * p_CK[0] / z, self.cy + self.fy * p_CK[1] / z])

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
