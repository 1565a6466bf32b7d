"""What a sensor makes of a true value: bias, noise, resolution and range, repeatable by a seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector

BLOCK = 64
"""Samples whose noise is drawn at once: a generator takes longer to make than to use."""


def sensor_random(seed: int, stream: int, block: int = 0) -> np.random.Generator:
    """Random numbers of one sensor; they depend on nothing else.

    Args:
        seed: Seed of the run.
        stream: Which sensor.
        block: 0 for what is drawn once; others as `sample_noise` needs them.
    """
    return np.random.default_rng([seed, stream, block])


def sample_noise(seed: int, stream: int, number: int, size: int) -> Array:
    """Independent standard normal numbers of one sample of one sensor, shape (size,).

    They depend on the arguments only, so a run can be repeated, or continued from a copy of its
    context.

    Args:
        seed: Seed of the run.
        stream: Which sensor.
        number: Which sample.
        size: How many numbers.
    """
    block, row = divmod(number, BLOCK)
    return _noise_block(seed, stream, block, size)[row]


@lru_cache(maxsize=64)
def _noise_block(seed: int, stream: int, block: int, size: int) -> Array:
    noise = sensor_random(seed, stream, block + 1).standard_normal((BLOCK, size))
    noise.flags.writeable = False
    return np.asarray(noise)


def quantized(values: Array, resolution: float) -> Array:
    """Values rounded to whole multiples of the resolution; 0 leaves them as they are."""
    if resolution == 0.0:
        return np.asarray(values, float)
    return np.asarray(resolution * np.round(np.asarray(values, float) / resolution))


def tension_readings(
    tensions: Array, offset: Array, noise: Array, resolution: float, limits: tuple[float, float]
) -> Array:
    """Readings of tension sensors, shape (m,) [N].

    Args:
        tensions: True tensions, shape (m,) [N].
        offset: What each sensor reads beyond the tension, always the same, shape (m,) [N].
        noise: What it reads beyond that this time, shape (m,) [N].
        resolution: Step between readings [N]; 0: none.
        limits: Smallest and largest reading [N].
    """
    return np.clip(quantized(tensions + offset + noise, resolution), *limits)


def encoder_readings(angles: Array, counts_per_turn: int) -> Array:
    """Angles that an incremental encoder reports, whole counts, shape (m,) [rad]."""
    return quantized(angles, 2.0 * np.pi / counts_per_turn)


@dataclass(frozen=True)
class PoseBias:
    """The systematic error of a pose sensor that was registered at one pose K of the platform.

    With phi the rotation vector from K to P, in K, the error of position in W is

        d = offset + G (p_WP - p_WK) + H phi.

    G stems from a wrong scale and direction of the sensor's frame, H from a wrong position of what
    is tracked on the platform. Rotations are wrong by one rotation vector in P.

    Attributes:
        X_WK: Pose of the platform where the sensor was registered [m].
        offset: Error of position there, shape (3,) [m].
        per_distance: G, shape (3, 3) [m/m].
        per_angle: H, shape (3, 3) [m/rad].
        turn: Error of rotation, shape (3,) [rad].
    """

    X_WK: RigidTransform
    offset: Array
    per_distance: Array
    per_angle: Array
    turn: Array

    def shift(self, X_WP: RigidTransform) -> Array:
        """Error of position in W at a pose of the platform, shape (3,) [m]."""
        phi = rotation_vector(self.X_WK.rotation().inverse() @ X_WP.rotation())
        away = X_WP.translation() - self.X_WK.translation()
        return np.asarray(self.offset + self.per_distance @ away + self.per_angle @ phi)


def moved_pose(X_WP: RigidTransform, shift: Array, turn: Array) -> RigidTransform:
    """The pose with its origin shifted in W [m] and turned by a rotation vector in P [rad]."""
    R = X_WP.rotation() @ rotation_from_vector(turn)
    return RigidTransform(R, X_WP.translation() + shift)


def random_direction(random: np.random.Generator) -> Array:
    """A unit vector, all directions alike, shape (3,)."""
    vector = random.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))


def random_rotation(random: np.random.Generator) -> Array:
    """A rotation matrix, all rotations alike, shape (3, 3)."""
    Q, R = np.linalg.qr(random.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q if np.linalg.det(Q) > 0.0 else Q[:, [1, 0, 2]])
