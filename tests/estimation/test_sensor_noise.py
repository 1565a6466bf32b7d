"""What sensors make of true values, by statistics and closed forms; poses from exact images."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.estimation.pose_from_images import (
    object_from_pose,
    pose_from_images,
    pose_from_object,
)
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
from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles, rotation_vector

EXACT = 1e-12  # rotation matrices and vectors of order one, products of some poses

coordinate = st.floats(-2.0, 2.0)
pose = st.tuples(*[coordinate] * 6).map(
    lambda x: pose_from_angles(np.array(x[:3]), np.array(x[3:]))
)


@given(value=st.floats(-1e3, 1e3), resolution=st.floats(1e-3, 10.0))
def test_rounding_is_within_half_a_step(value, resolution):
    rounded = quantized(np.array([value]), resolution)[0]
    assert abs(rounded - value) <= 0.5 * resolution * (1.0 + 1e-9)
    assert rounded / resolution == pytest.approx(round(rounded / resolution), abs=1e-6)


QUARTER_TURNS = 0.5 * np.pi * np.array([0.0, 1.0, -1.0, 4.0])
TENSIONS = np.array([-50.0, 10.0, 200.0]), np.full(3, 0.5), np.zeros(3), 0.2, (-25.0, 75.0)


@pytest.mark.parametrize(
    ("readings", "expected"),
    [
        (quantized(np.array([0.1234]), 0.0), [0.1234]),
        (encoder_readings(np.array([0.7, 0.9, -2.3, 7.0]), 4), QUARTER_TURNS),
        (tension_readings(*TENSIONS), [-25.0, 10.4, 75.0]),
    ],
    ids=["no resolution", "four counts", "range"],
)
def test_readings_by_hand(readings, expected):
    np.testing.assert_allclose(readings, expected, rtol=1e-7)


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
    Q = np.array([random_rotation(random) for _ in range(2000)])
    np.testing.assert_allclose(
        Q @ Q.swapaxes(1, 2), np.broadcast_to(np.eye(3), Q.shape), atol=EXACT
    )
    np.testing.assert_allclose(np.linalg.det(Q), 1.0, atol=EXACT)
    # Each entry has variance 1/3: four standard deviations of the mean are 0.052.
    assert np.max(np.abs(Q.mean(axis=0))) < 0.052


def test_the_bias_grows_from_the_registration():
    X_WK, none = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0.2, 0.5]), np.zeros(3)
    bias = PoseBias(
        X_WK=X_WK, offset=none, per_distance=0.02 * np.eye(3), per_angle=0.05 * np.eye(3), turn=none
    )
    away = RigidTransform(np.array([0.5, 0.0, 0.0])) @ X_WK
    turned = X_WK @ RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), none)
    for X, shift in ((X_WK, none), (away, [0.01, 0.0, 0.0]), (turned, [0.0, 0.0, 0.02])):
        np.testing.assert_allclose(bias.shift(X), shift, atol=EXACT)


def test_moved_poses_shift_in_the_world_and_turn_in_the_platform():
    X_WP = RigidTransform(RollPitchYaw(0.4, -0.2, 1.0), [1.0, 2.0, 3.0])
    X = moved_pose(X_WP, np.array([0.01, 0.0, 0.0]), np.array([0.0, 0.02, 0.0]))
    np.testing.assert_allclose(X.translation(), [1.01, 2.0, 3.0], atol=EXACT)
    turn = rotation_vector(X_WP.rotation().inverse() @ X.rotation())
    np.testing.assert_allclose(turn, [0.0, 0.02, 0.0], atol=EXACT)


# Poses from images.


@given(pose, pose, pose, pose)
def test_exact_images_give_pose_object_and_motion(X_WP0, X_WP, X_PC, X_WO):
    before, now = ((X @ X_PC).inverse() @ X_WO for X in (X_WP0, X_WP))
    assert max(pose_error(object_from_pose(X_WP, X_PC, now), X_WO)) < EXACT
    assert max(pose_error(pose_from_object(X_WO, X_PC, now), X_WP)) < EXACT
    assert max(pose_error(pose_from_images(X_WP0, X_PC, before, now), X_WP)) < EXACT


def test_image_after_image_is_the_first_and_the_last_image():
    """(2.4) repeated is (2.5) whatever the noise: what is added by one image the next removes."""
    random = np.random.default_rng(1)
    X_PC = pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.1, 3.0, 0.0]))
    X_WP0 = pose_from_angles(np.array([0.1, 0.0, 0.3]), np.array([0.2, 0.1, 0.0]))
    exact = (X_WP0 @ X_PC).inverse() @ pose_from_angles(np.array([0.2, -0.2, 0.0]), np.zeros(3))
    images = [exact @ exponential(0.01 * random.standard_normal(6)) for _ in range(200)]
    X_WP = X_WP0
    for before, now in pairwise(images):
        X_WP = pose_from_images(X_WP, X_PC, before, now)
    at_once = pose_from_object(object_from_pose(X_WP0, X_PC, images[0]), X_PC, images[-1])
    assert max(pose_error(X_WP, at_once)) < EXACT
    assert pose_error(X_WP, X_WP0)[0] > 1e-3  # the noise of the two images is in it
