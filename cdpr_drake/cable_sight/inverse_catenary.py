"""Surplus lengths from an image of the cables, and how fast to wind them in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cable_sight.catenary import surplus_of_drops
from cdpr_drake.geometry import CableSet, cable_paths
from cdpr_drake.vision import Pinhole

LEAST_POINTS = 5
"""Points of a cable that must be seen."""

LEAST_ANGLE = 0.1
"""Sine of the least angle between a line of sight and the plane in which the cable hangs."""

LEAST_SPAN = 0.02
"""Horizontal distance of the ends from which a cable hangs down sideways [m]."""


@dataclass(frozen=True)
class SeenSlack:
    """Surplus lengths as they are seen.

    Attributes:
        surplus: Of each cable, shape (m,) [m]; NaN where it is not seen well enough.
        deviation: Its standard deviation by the noise of the image, shape (m,) [m].
    """

    surplus: Array
    deviation: Array


def seen_slack(
    pixels: Array,
    cables: CableSet,
    X_WP: RigidTransform,
    X_WE: RigidTransform,
    pinhole: Pinhole,
    noise: float,
) -> SeenSlack:
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
    return SeenSlack(surplus, deviation)


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
