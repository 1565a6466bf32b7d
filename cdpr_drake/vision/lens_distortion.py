"""What a lens does to the image of a pinhole: Brown and Conrady's distortion, or a fisheye's.

`LensDistortion` maps points at unit focal length to distorted ones and back; the equations stand in
`lens_kernel`. It knows how far it is valid: a polynomial that was fitted to the middle of an image
may turn back at its rim, and images there would fold over.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.errors import LensDistortionError, accepted_names
from cdpr_drake.vision.lens_kernel import (
    BROWN_CONRADY,
    FIRST,
    FISHEYE,
    KIND,
    LENS_SIZE,
    RADIUS,
    distort_point,
    distort_points,
    undistort_points,
)

NO_LENS = "none"

KINDS = {"brown_conrady": BROWN_CONRADY, "fisheye": FISHEYE}
"""Numbers of the kinds in kernels."""

COEFFICIENTS = {
    "brown_conrady": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}
"""Names of the coefficients, in OpenCV's order."""

FARTHEST = 50.0
"""Largest radius at unit focal length that counts as seen [-], 88.9 deg from the axis: a pinhole
with any lens sees less than a half space."""

_STEPS = 20_000


@dataclass(frozen=True)
class LensDistortion:
    """The distortion of a lens.

    Attributes:
        kind: "brown_conrady" or "fisheye".
        coefficients: Those that `COEFFICIENTS` names, in that order; missing ones at the end are 0.
    """

    kind: str
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuses what is no lens.

        Raises:
            LensDistortionError: The kind is unknown, or there are too many coefficients.
        """
        if self.kind not in KINDS:
            raise LensDistortionError(
                f"kind of lens: found {self.kind!r}; {accepted_names(self.kind, KINDS)}"
            )
        names = COEFFICIENTS[self.kind]
        if len(self.coefficients) > len(names) or not np.all(np.isfinite(self.coefficients)):
            raise LensDistortionError(
                f"coefficients of a {self.kind} lens: found {list(self.coefficients)}; accepted: "
                f"up to {len(names)} finite numbers, {', '.join(names)}"
            )

    @cached_property
    def numbers(self) -> Array:
        """What kernels take, shape (10,); the last is the valid radius [-]."""
        numbers = np.zeros(LENS_SIZE)
        numbers[KIND] = KINDS[self.kind]
        numbers[FIRST : FIRST + len(self.coefficients)] = self.coefficients
        numbers[RADIUS] = self.valid_radius
        return numbers

    @cached_property
    def valid_radius(self) -> float:
        """Radius of the ideal image at unit focal length up to which no two points have one image,
        at most `FARTHEST` [-].

        It is the first at which the determinant of the Jacobian vanishes in some direction.
        """
        radii = np.linspace(0.0, 1.0, _STEPS + 1)[1:] * np.arctan(FARTHEST)
        worst = self._least_determinant(np.tan(radii))
        folded = np.flatnonzero(~(worst > 0.0))
        if not len(folded):
            return FARTHEST
        first = int(folded[0])
        low, high = (0.0 if first == 0 else radii[first - 1]), radii[first]
        for _ in range(60):
            middle = 0.5 * (low + high)
            if self._least_determinant(np.array([np.tan(middle)]))[0] > 0.0:
                low = middle
            else:
                high = middle
        return float(np.tan(low))

    def _least_determinant(self, r: Array) -> Array:
        """Least determinant of the Jacobian over all directions at radii, shape (n,) [-].

        With q = (p2, p1) of size p, at an angle phi to the point, the Jacobian is
        [[g' + 6 p r c, 2 p r s], [2 p r s, f + 2 p r c]] along and across it, c and s the cosine
        and the sine of phi; g = r f. NaN beyond a pole.
        """
        k = np.zeros(8)
        k[: len(self.coefficients)] = self.coefficients
        if self.kind == "fisheye":
            t = np.arctan(r)
            rise = np.polyval([9.0 * k[3], 7.0 * k[2], 5.0 * k[1], 3.0 * k[0], 1.0], t * t)
            return np.asarray(rise, float)
        s = r * r
        above = np.polyval([k[4], k[1], k[0], 1.0], s)
        below = np.polyval([k[7], k[6], k[5], 1.0], s)
        rises = [np.polyval([3.0 * c, 2.0 * b, a], s) for a, b, c in
                 ((k[0], k[1], k[4]), (k[5], k[6], k[7]))]  # fmt: skip
        below = np.where(below > 0.0, below, np.nan)
        f = above / below
        slope = f + 2.0 * s * (rises[0] - f * rises[1]) / below
        tilt = float(np.hypot(k[2], k[3])) * r
        square, linear, rest = 16.0 * tilt**2, 2.0 * tilt * (slope + 3.0 * f), slope * f
        c = np.clip(-linear / np.where(square > 0.0, 2.0 * square, np.inf), -1.0, 1.0)
        least = square * c * c + linear * c + rest - 4.0 * tilt**2
        return np.asarray(np.where((slope > 0.0) & (f > 0.0), least, -1.0), float)

    def distort(self, points: npt.ArrayLike) -> Array:
        """Distorted points, shape (2, n) [-], of points at unit focal length.

        NaN where they are beyond the valid radius.
        """
        given = np.ascontiguousarray(points, float)
        out = np.empty(given.shape)
        distort_points(given, self.numbers, out)
        return out

    def undistort(self, points: npt.ArrayLike) -> Array:
        """Points at unit focal length, shape (2, n) [-], of distorted ones.

        NaN where the image of the valid field does not have them.
        """
        given = np.ascontiguousarray(points, float)
        out = np.empty(given.shape)
        undistort_points(given, self.numbers, out)
        return out

    def jacobian(self, point: npt.ArrayLike) -> Array:
        """Derivative of a distorted point by the point, shape (2, 2) [-]; that of the way back is
        its inverse."""
        x, y = np.asarray(point, float)
        _, _, a, b, d = distort_point(float(x), float(y), self.numbers)
        return np.array([[a, b], [b, d]])
