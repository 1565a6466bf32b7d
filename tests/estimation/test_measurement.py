"""What sensors make of true values: rounding, range, statistics, repeatability, bias."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.estimation.sensor_noise import (
    PoseBias,
    encoder_readings,
    moved_pose,
    quantized,
    random_direction,
    random_rotation,
    sample_noise,
    tension_readings,
)
from cdpr_drake.geometry.poses import rotation_vector

EXACT = 1e-12
"""Rotation matrices and vectors of order one."""


@given(value=st.floats(-1e3, 1e3), resolution=st.floats(1e-3, 10.0))
def test_rounding_is_within_half_a_step(value, resolution):
    rounded = quantized(np.array([value]), resolution)[0]
    assert abs(rounded - value) <= 0.5 * resolution * (1.0 + 1e-9)
    assert rounded / resolution == pytest.approx(round(rounded / resolution), abs=1e-6)


def test_no_resolution_leaves_values_alone():
    np.testing.assert_array_equal(quantized(np.array([0.1234]), 0.0), [0.1234])


def test_an_encoder_of_four_counts_sees_quarter_turns():
    angles = np.array([0.7, 0.9, -2.3, 7.0])
    np.testing.assert_allclose(
        encoder_readings(angles, 4), np.array([0.0, 1.0, -1.0, 4.0]) * np.pi / 2.0
    )


def test_readings_end_at_the_range():
    t = np.array([-50.0, 10.0, 200.0])
    readings = tension_readings(t, np.full(3, 0.5), np.zeros(3), 0.2, (-25.0, 75.0))
    np.testing.assert_allclose(readings, [-25.0, 10.4, 75.0])


def test_samples_depend_on_seed_sensor_and_number_only():
    keys = [(0, 1, 1), (0, 1, 2), (0, 2, 1), (1, 1, 1), (0, 1, 64), (0, 1, 1000)]
    draws = {key: tuple(sample_noise(*key, 2)) for key in keys}
    assert len({x for draw in draws.values() for x in draw}) == 2 * len(keys)
    for key in reversed(keys):
        assert tuple(sample_noise(*key, 2)) == draws[key]


def test_noise_is_standard_normal():
    noise = np.array([sample_noise(3, 7, number, 4) for number in range(2000)])
    # Four standard deviations of a mean and of a standard deviation of 8000 normal numbers.
    assert abs(noise.mean()) < 4.0 / np.sqrt(8000.0)
    assert abs(noise.std() - 1.0) < 4.0 / np.sqrt(16000.0)
    assert abs(np.mean(noise[1:] * noise[:-1])) < 4.0 / np.sqrt(8000.0)


def test_random_directions_and_rotations_have_no_preference():
    random = np.random.default_rng(5)
    directions = np.array([random_direction(random) for _ in range(4000)])
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=EXACT)
    # Standard deviation of each mean is 1 / sqrt(3 n) = 0.009; four of them.
    assert np.max(np.abs(directions.mean(axis=0))) < 0.037
    rotations = np.array([random_rotation(random) for _ in range(2000)])
    for Q in rotations[:50]:
        np.testing.assert_allclose(Q @ Q.T, np.eye(3), atol=EXACT)
        assert np.linalg.det(Q) == pytest.approx(1.0, abs=EXACT)
    # Each entry has variance 1/3: four standard deviations of the mean are 0.052.
    assert np.max(np.abs(rotations.mean(axis=0))) < 0.052


def bias_at(X_WK, **changes):
    parts = {
        "offset": np.zeros(3),
        "per_distance": np.zeros((3, 3)),
        "per_angle": np.zeros((3, 3)),
        "turn": np.zeros(3),
    }
    return PoseBias(X_WK=X_WK, **(parts | changes))


def test_the_bias_grows_from_the_registration():
    X_WK = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0.2, 0.5])
    bias = bias_at(X_WK, per_distance=0.02 * np.eye(3), per_angle=0.05 * np.eye(3))
    np.testing.assert_allclose(bias.shift(X_WK), np.zeros(3), atol=EXACT)
    away = RigidTransform(X_WK.rotation(), X_WK.translation() + np.array([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(bias.shift(away), [0.01, 0.0, 0.0], atol=EXACT)
    turned = X_WK @ RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), np.zeros(3))
    np.testing.assert_allclose(bias.shift(turned), [0.0, 0.0, 0.02], atol=EXACT)


def test_moved_poses_shift_in_the_world_and_turn_in_the_platform():
    X_WP = RigidTransform(RollPitchYaw(0.4, -0.2, 1.0), [1.0, 2.0, 3.0])
    X = moved_pose(X_WP, np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.02, 0.0]))
    np.testing.assert_allclose(X.translation(), [1.01, 2.0, 3.0], atol=EXACT)
    turn = rotation_vector(X_WP.rotation().inverse() @ X.rotation())
    np.testing.assert_allclose(turn, [0.0, 0.02, 0.0], atol=EXACT)
