"""Images of cables, and the surplus lengths that are read from them.

`cable_images` gives points of the cables' curves as a camera E in the world sees them.
`slack_from_image` reads surplus lengths from such an image, and `slack_rates` says how fast to wind
them in. Below both is the inextensible catenary by its length, and its length by how far it hangs
down.

Source: servoing thesis, perspectives; Irvine, Cable Structures, 1981, 1.1 and 2.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.vision.pinhole import Pinhole

LEAST_POINTS = 5
"""Points of a cable that must be seen."""

LEAST_ANGLE = 0.1
"""Sine of the least angle between a line of sight and the plane in which the cable hangs."""

LEAST_SPAN = 0.02
"""Horizontal distance of the ends from which a cable hangs down sideways [m]."""

ITERATIONS = 12
"""Of Newton's method for the catenary, and of Gauss and Newton's for its length; both converge from
their parabolas within a few."""

FLAT = 1e-7
"""Surplus over the distance of the ends up to which a catenary is a parabola: by so much less than
its drop do they differ, and round-off of the catenary is larger."""

SMALLEST_ROOT = 1e-5
"""Root of the surplus below which there is none: a tenth of a nanometre [m^0.5]."""

DIFFERENCE = 1e-6
"""Step of the derivative by the root of the surplus [m^0.5]."""


def cable_images(
    curves: Sequence[Array],
    X_WE: RigidTransform,
    pinhole: Pinhole,
    count: int,
    noise: float,
    random: np.random.Generator,
) -> Array:
    """Pixels of points of cables, shape (m, 2, count) [px]; NaN where they are not in the image.

    What hides a cable, as the platform may, is not modelled.

    Args:
        curves: Curves of the cables in W, shape (3, n) each [m].
        X_WE: The camera E in W [m].
        pinhole: Its intrinsic parameters.
        count: Points of each cable.
        noise: Standard deviation of each coordinate [px].
        random: Where the noise comes from.
    """
    found = np.full((len(curves), 2, count), np.nan)
    X_EW = X_WE.inverse()
    for k, curve in enumerate(curves):
        found[k] = pinhole.project(X_EW @ even_points(curve, count))
    found += noise * random.standard_normal(found.shape)
    size = np.array([[pinhole.width], [pinhole.height]]) - 1.0
    outside = np.any(~((found >= 0.0) & (found <= size)), axis=1)
    found[np.broadcast_to(outside[:, np.newaxis], found.shape)] = np.nan
    return found


def even_points(curve: Array, count: int) -> Array:
    """Points evenly along a curve without its ends, shape (3, count) [m].

    Args:
        curve: Points, shape (3, n) [m].
        count: How many.
    """
    steps = np.linalg.norm(np.diff(curve, axis=1), axis=0)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = along[-1] * (np.arange(count) + 0.5) / count
    return np.array([np.interp(wanted, along, row) for row in curve])


@dataclass(frozen=True)
class ImageSlack:
    """Surplus lengths as they are seen.

    Attributes:
        surplus: Of each cable, shape (m,) [m]; NaN where it is not seen well enough.
        deviation: Its standard deviation by the noise of the image, shape (m,) [m].
    """

    surplus: Array
    deviation: Array


def slack_from_image(
    pixels: Array,
    cables: CableSet,
    X_WP: RigidTransform,
    X_WE: RigidTransform,
    pinhole: Pinhole,
    noise: float,
) -> ImageSlack:
    """Surplus lengths of cables from an image.

    A line of sight meets the vertical plane through the ends of its cable in a point; the catenary
    that hangs closest to a cable's points has its length. The ends are where the believed pose and
    cables put them, so an error of the pose is one of the surplus, as long and no longer.

    Args:
        pixels: Points of each cable in the image, in any order, shape (m, 2, n) [px]; NaN: unseen.
        cables: The cables as believed.
        X_WP: The platform's pose as believed [m].
        X_WE: The camera E in W as believed [m].
        pinhole: Its intrinsic parameters.
        noise: Standard deviation of a coordinate [px].

    Raises:
        CableGeometryError: An anchor point lies in the groove of its pulley.
    """
    paths = cable_paths(X_WP, cables)
    ends = paths.p_WT + paths.free * paths.u_W
    m = len(pixels)
    surplus, deviation = np.full(m, np.nan), np.full(m, np.nan)
    K_inverse, R = np.linalg.inv(pinhole.matrix()), X_WE.rotation().matrix()
    focal = float(np.sqrt(pinhole.fx * pinhole.fy))
    for k in range(m):
        seen = pixels[k][:, np.all(np.isfinite(pixels[k]), axis=0)]
        if not pinhole.is_ideal:
            seen = pinhole.read(seen)
            seen = seen[:, np.all(np.isfinite(seen), axis=0)]
        start, rise = paths.p_WT[:, k], ends[:, k] - paths.p_WT[:, k]
        span = float(np.hypot(rise[0], rise[1]))
        if span < LEAST_SPAN or seen.shape[1] < LEAST_POINTS:
            continue
        out = np.array([rise[0], rise[1], 0.0]) / span
        normal = np.array([-out[1], out[0], 0.0])
        rays = R @ K_inverse @ np.vstack([seen, np.ones(seen.shape[1])])
        sines = normal @ rays / np.linalg.norm(rays, axis=0)
        good = np.abs(sines) > LEAST_ANGLE
        depths = normal @ (start - X_WE.translation()) / (normal @ rays[:, good])
        points = X_WE.translation()[:, np.newaxis] + depths * rays[:, good] - start[:, np.newaxis]
        x = out @ points
        inside = (depths > 0.0) & (x > 0.0) & (x < span)
        if np.count_nonzero(inside) < LEAST_POINTS:
            continue
        x, z = x[inside], points[2, inside]
        surplus[k], by_drop = surplus_of_drops(x, rise[2] * x / span - z, span, float(rise[2]))
        across = noise / focal * depths[inside] / np.abs(sines[good][inside])
        deviation[k] = float(np.linalg.norm(by_drop * across))
    return ImageSlack(surplus, deviation)


def slack_rates(
    correction: Array,
    tensions: Array,
    thresholds: Array,
    seen: Array,
    *,
    allowance: float,
    time: float,
    fastest: float,
) -> Array:
    """Cable velocities that wind in what is seen to be slack, the faster the more it is.

    Args:
        correction: What tensions alone ask for, as `tension_correction`, shape (m,) [m/s].
        tensions: Measured tensions, shape (m,) [N].
        thresholds: Below which a cable counts as slack, shape (m,) [N].
        seen: Seen surplus lengths, NaN: not seen, shape (m,) [m].
        allowance: Surplus of which the image tells nothing, not negative [m].
        time: In which the rest is to be wound in, positive [s].
        fastest: Largest velocity, positive [m/s].

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s]; never positive. A cable that is
        taut by its tension is left alone whatever is seen.

    Source: servoing thesis, perspectives: "by detecting the amount of slack on a cable the TCA
    correction rate can be adjusted to decrease a large slack more rapidly"; the law is chosen.
    """
    beyond = np.maximum(np.nan_to_num(seen) - allowance, 0.0)
    rates = np.where(tensions < thresholds, beyond / time, 0.0)
    return -np.minimum(np.maximum(rates, -correction), fastest)


def catenary_drop(x: Array, span: float, rise: float, surplus: float) -> Array:
    """How far a hanging cable is below the line between its ends, shape (n,) [m].

    Args:
        x: Horizontal distances from the first end, shape (n,) [m].
        span: Horizontal distance of the ends, positive [m].
        rise: How much higher the second end is [m].
        surplus: Length less the distance of the ends, not negative [m].

    Source: Irvine, Cable Structures, 1981, 1.1: z = a cosh((x - x0) / a) + c, with
    L^2 = rise^2 + (2 a sinh(span / 2a))^2.
    """
    chord = float(np.hypot(span, rise))
    if surplus < FLAT * chord:
        middle = np.sqrt(max(surplus, 0.0)) * _per_root(span, chord)
        return np.asarray(4.0 * middle * x * (span - x) / span**2)
    line, length = rise * x / span, chord + surplus
    # More than 1, and 1 + xi^2 / 6 + xi^4 / 120 + ... of xi = span / 2a.
    ratio = np.sqrt(length**2 - rise**2) / span
    xi = np.sqrt(6.0 * (ratio - 1.0)) if ratio < 3.0 else np.log(2.0 * ratio) + 1.0
    for _ in range(ITERATIONS):
        xi -= (np.sinh(xi) - ratio * xi) / (np.cosh(xi) - ratio)
    a = span / (2.0 * xi)
    x0 = span / 2.0 - a * np.arcsinh(rise / (2.0 * a * np.sinh(xi)))
    return np.asarray(line - a * (np.cosh((x - x0) / a) - np.cosh(x0 / a)))


def surplus_of_drops(x: Array, drops: Array, span: float, rise: float) -> tuple[float, Array]:
    """Surplus of the catenary that hangs closest to some points, by least squares.

    Args:
        x: Horizontal distances of points from the first end, shape (n,) [m].
        drops: How far they are below the line between the ends, shape (n,) [m].
        span: Horizontal distance of the ends, positive [m].
        rise: How much higher the second end is [m].

    Returns:
        Surplus [m], 0 where they lie above the line, and what it changes by each drop, shape (n,).
    """
    chord = float(np.hypot(span, rise))
    bow = 4.0 * x * (span - x) / span**2
    middle = float(bow @ drops / (bow @ bow))
    # Of a parabola; the drop grows with the root of the surplus, which so is what is looked for.
    root = middle / _per_root(span, chord)
    if root <= SMALLEST_ROOT:
        return 0.0, np.zeros_like(x)
    for _ in range(ITERATIONS):
        slope = _slope(x, span, rise, root)
        change = slope @ (drops - catenary_drop(x, span, rise, root**2)) / (slope @ slope)
        root = max(root + float(change), 0.1 * root)
        if abs(change) < 1e-9:
            break
    slope = _slope(x, span, rise, root)
    return root**2, 2.0 * root * slope / (slope @ slope)


def sag_of_surplus(surplus: float, span: float, rise: float) -> float:
    """How far the middle of a hanging cable is below the line between its ends [m]; arguments as
    for `catenary_drop`."""
    return float(catenary_drop(np.array([0.5 * span]), span, rise, surplus)[0])


def drop_per_root(span: float, rise: float) -> float:
    """How far the middle of a flat cable hangs by the root of its surplus, about [m^0.5]."""
    return _per_root(span, float(np.hypot(span, rise)))


def _per_root(span: float, chord: float) -> float:
    """Drop of a flat parabola's middle by the root of its surplus, for ends so far apart [m^0.5].

    Source: Irvine, Cable Structures, 1981, 2.1: surplus = 8 middle^2 span^2 / (3 chord^3).
    """
    return float(chord**1.5 / (np.sqrt(8.0 / 3.0) * span))


def _slope(x: Array, span: float, rise: float, root: float) -> Array:
    """Derivative of the drops by the root of the surplus, shape (n,) [m^0.5]."""
    step = min(DIFFERENCE, 0.5 * root)
    after, before = (catenary_drop(x, span, rise, (root + s) ** 2) for s in (step, -step))
    return np.asarray((after - before) / (2.0 * step))
