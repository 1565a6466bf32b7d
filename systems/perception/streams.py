"""Random numbers of sensors of which a robot can have several: a stream for each name."""

from __future__ import annotations

import zlib

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.estimation import sensor_random

RANGES, INERTIAL, DEPTH, ODOMETRY, PAN_TILT, DEPTH_POINTS = 211, 223, 227, 229, 233, 239
"""Tell the random numbers of sensors of one kind from those of others."""


def named_stream(kind: int, name: str) -> int:
    """The stream of a sensor by its kind and its name, whatever other sensors there are."""
    return (kind << 32) + zlib.crc32(name.encode())


def large_noise(seed: int, stream: int, number: int, size: int) -> Array:
    """As `estimation.sample_noise`, for samples of so many numbers that none are kept."""
    return np.asarray(sensor_random(seed, stream, number).standard_normal(size))
