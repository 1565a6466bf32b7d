"""Numba kernels for the distortion of lenses, of points at unit focal length.

A lens is `numbers`, shape (10,): its kind, eight coefficients in the order of OpenCV, and the
radius up to which it is valid, that of the ideal image at unit focal length [-]. Beyond it images
fold over: two directions would share one pixel. Points out of the valid field give NaN.

Of `BROWN_CONRADY` the coefficients are k1, k2, p1, p2, k3, k4, k5, k6; with s = x^2 + y^2

    f = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3),
    x_d = f x + 2 p1 x y + p2 (s + 2 x^2),    y_d = f y + p1 (s + 2 y^2) + 2 p2 x y.

Its Jacobian is symmetric, so the map is the gradient of a potential, which is strictly convex as
long as the determinant stays positive on the way from the middle: no two points of the valid disc
have one image. Of `FISHEYE` they are k1 to k4; with r = tan theta

    theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8),    x_d = theta_d x / r.

Source: Brown, Photogrammetric Engineering 37(8), 1971; Kannala and Brandt, IEEE TPAMI 28(8), 2006;
OpenCV, modules calib3d and fisheye, for order and signs of the coefficients.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

BROWN_CONRADY, FISHEYE = 1.0, 2.0
"""Kinds, the first number of a lens."""

KIND, FIRST, RADIUS = 0, 1, 9
"""Where kind, coefficients and valid radius stand in the numbers of a lens."""

LENS_SIZE = 10

ROUNDS = 60
"""Steps of a search; bisection alone settles a double within that."""

SETTLED = 1e-15
"""A step of the search that is a smaller share of 1 + r is the last."""

FOUND = 1e-12
"""Residual, per 1 + r, from which on a point counts as found [-]."""

AXIS = 1e-9
"""Radius below which a fisheye's point is on the axis: tan and its argument are one there."""


@njit(cache=True, error_model="numpy")
def _radial(r: float, lens: Array) -> tuple[float, float]:
    """Distorted radius of a radius without tangential parts, and its slope."""
    c = lens[FIRST:]
    if lens[KIND] == FISHEYE:
        t = np.arctan(r)
        s = t * t
        image = t * (1.0 + s * (c[0] + s * (c[1] + s * (c[2] + s * c[3]))))
        rise = 1.0 + s * (3.0 * c[0] + s * (5.0 * c[1] + s * (7.0 * c[2] + s * 9.0 * c[3])))
        return image, rise / (1.0 + r * r)
    s = r * r
    above = 1.0 + s * (c[0] + s * (c[1] + s * c[4]))
    below = 1.0 + s * (c[5] + s * (c[6] + s * c[7]))
    above_s = c[0] + s * (2.0 * c[1] + s * 3.0 * c[4])
    below_s = c[5] + s * (2.0 * c[6] + s * 3.0 * c[7])
    f = above / below
    return r * f, f + 2.0 * s * (above_s - f * below_s) / below


@njit(cache=True, error_model="numpy")
def distort_point(x: float, y: float, lens: Array) -> tuple[float, float, float, float, float]:
    """The distorted point and its symmetric Jacobian: x_d, y_d, dx_d/dx, dx_d/dy, dy_d/dy [-]."""
    r = np.sqrt(x * x + y * y)
    if not r <= lens[RADIUS]:
        return np.nan, np.nan, np.nan, np.nan, np.nan
    image, slope = _radial(r, lens)
    # On the axis both are 1: image / r would be 0 / 0.
    f = image / r if r > AXIS else slope
    bend = (slope - f) / (r * r) if r > AXIS else 0.0
    a, b, d = f + bend * x * x, bend * x * y, f + bend * y * y
    u, v = f * x, f * y
    if lens[KIND] == BROWN_CONRADY:
        p1, p2 = lens[FIRST + 2], lens[FIRST + 3]
        s = r * r
        u += 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x)
        v += p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y
        a += 2.0 * p1 * y + 6.0 * p2 * x
        b += 2.0 * p1 * x + 2.0 * p2 * y
        d += 6.0 * p1 * y + 2.0 * p2 * x
    return u, v, a, b, d


@njit(cache=True, error_model="numpy")
def _radius_of(image: float, lens: Array) -> float:
    """The radius of which one is the distorted one, by Newton's method in a bracket; the valid
    radius where it is beyond."""
    low, high = 0.0, lens[RADIUS]
    if _radial(high, lens)[0] <= image:
        return high
    r = min(image, 0.5 * high)
    for _ in range(ROUNDS):
        value, slope = _radial(r, lens)
        if value > image:
            high = r
        else:
            low = r
        after = r - (value - image) / slope
        if not low < after < high:
            after = 0.5 * (low + high)
        if abs(after - r) <= SETTLED * (1.0 + r):
            return after
        r = after
    return r


@njit(cache=True, error_model="numpy")
def undistort_point(u: float, v: float, lens: Array) -> tuple[float, float]:
    """The point of the valid field of which (u, v) is the distorted one; NaN: there is none [-]."""
    image = np.sqrt(u * u + v * v)
    if not image < np.inf:
        return np.nan, np.nan
    if image == 0.0 and lens[KIND] == FISHEYE:
        return 0.0, 0.0
    r = _radius_of(image, lens)
    scale = r / image if image > 0.0 else 0.0
    x, y = scale * u, scale * v
    if lens[KIND] == FISHEYE:
        off = abs(_radial(r, lens)[0] - image)
        return (x, y) if off <= FOUND * (1.0 + image) else (np.nan, np.nan)
    # Tangential parts: from the radial point, steps that stay in the disc and come nearer.
    x_d, y_d, a, b, d = distort_point(x, y, lens)
    if not np.isfinite(x_d):  # a radius that rounds to just beyond the rim
        x, y = (1.0 - 1e-12) * x, (1.0 - 1e-12) * y
        x_d, y_d, a, b, d = distort_point(x, y, lens)
    off = np.hypot(x_d - u, y_d - v)
    for _ in range(ROUNDS):
        det = a * d - b * b
        if off == 0.0 or not det > 0.0:
            break
        step_x = (d * (u - x_d) - b * (v - y_d)) / det
        step_y = (a * (v - y_d) - b * (u - x_d)) / det
        share, nearer = 1.0, False
        for _ in range(ROUNDS):
            new_x, new_y = x + share * step_x, y + share * step_y
            e, g, h, i, j = distort_point(new_x, new_y, lens)
            new_off = np.hypot(e - u, g - v)
            if new_off < off:  # not where it is NaN, out of the disc
                nearer = True
                break
            share *= 0.5
            if share * (abs(step_x) + abs(step_y)) < SETTLED:
                break
        if not nearer:
            break
        x, y, x_d, y_d, a, b, d, off = new_x, new_y, e, g, h, i, j, new_off
    return (x, y) if off <= FOUND * (1.0 + image) else (np.nan, np.nan)


@njit(cache=True)
def distort_points(points: Array, lens: Array, out: Array) -> None:
    """Distorted points, shape (2, n) [-], of such; NaN where they are out of the valid field."""
    for k in range(points.shape[1]):
        out[0, k], out[1, k], _, _, _ = distort_point(points[0, k], points[1, k], lens)


@njit(cache=True)
def undistort_points(points: Array, lens: Array, out: Array) -> None:
    """Ideal points, shape (2, n) [-], of distorted ones; NaN where no point of the valid field has
    that image."""
    for k in range(points.shape[1]):
        out[0, k], out[1, k] = undistort_point(points[0, k], points[1, k], lens)
