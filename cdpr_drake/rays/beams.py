"""Beams of range sensors and of the pixels of cameras, and what a sensor makes of distances."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def fan_angles(first: float, last: float, count: int) -> Array:
    """Angles of the beams of a laser scanner, evenly from the first to the last, shape (k,) [rad].

    One beam looks between the two.
    """
    if count == 1:
        return np.array([0.5 * (first + last)])
    return np.linspace(first, last, count)


def fan_directions(angles: Array) -> Array:
    """Directions of beams in the plane z = 0 of the sensor's frame S, shape (k, 3).

    The angle is from x, the front, towards y, the left, as ROS's message LaserScan has it.
    """
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])


def reported_ranges(ranges: Array, noise: Array, limits: tuple[float, float], step: float) -> Array:
    """What a range sensor says of distances, shape (k,) [m].

    Beyond the largest range, and where there is nothing: inf; below the smallest: -inf, as ROS's
    REP 117 has it. Noise counts before the limits are looked at.

    Args:
        ranges: True distances, inf for nothing, shape (k,) [m].
        noise: What is read beyond them, shape (k,) [m].
        limits: Smallest and largest range [m].
        step: Step between readings [m]; 0: none.
    """
    read = ranges + noise
    if step > 0.0:
        read = step * np.round(read / step)
    low, high = limits
    return np.where(read > high, np.inf, np.where(read < low, -np.inf, read))
