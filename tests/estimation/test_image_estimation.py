"""Poses from images: exact data give the exact pose, and errors between the ends cancel."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.estimation.pose_from_images import (
    object_from_pose,
    pose_from_images,
    pose_from_object,
)
from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles

ROUND_OFF = 1e-12  # products of some poses with entries of order one

coordinate = st.floats(-2.0, 2.0)
pose = st.tuples(*[coordinate] * 6).map(
    lambda x: pose_from_angles(np.array(x[:3]), np.array(x[3:]))
)


@given(pose, pose, pose)
def test_an_object_seen_by_the_platform_gives_its_pose_back(X_WP, X_PC, X_WO):
    X_CO = (X_WP @ X_PC).inverse() @ X_WO
    assert max(pose_error(object_from_pose(X_WP, X_PC, X_CO), X_WO)) < ROUND_OFF
    assert max(pose_error(pose_from_object(X_WO, X_PC, X_CO), X_WP)) < ROUND_OFF


@given(pose, pose, pose, pose)
def test_two_exact_images_give_the_exact_motion(X_WP0, X_WP, X_PC, X_WO):
    before, now = ((X @ X_PC).inverse() @ X_WO for X in (X_WP0, X_WP))
    assert max(pose_error(pose_from_images(X_WP0, X_PC, before, now), X_WP)) < ROUND_OFF


def test_image_after_image_is_the_first_and_the_last_image():
    """(2.4) repeated is (2.5) whatever the noise: what is added by one image the next removes."""
    random = np.random.default_rng(1)
    X_PC = pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.1, 3.0, 0.0]))
    X_WP0 = pose_from_angles(np.array([0.1, 0.0, 0.3]), np.array([0.2, 0.1, 0.0]))
    X_WO = pose_from_angles(np.array([0.2, -0.2, 0.0]), np.zeros(3))
    exact = (X_WP0 @ X_PC).inverse() @ X_WO
    images = [exact @ exponential(0.01 * random.standard_normal(6)) for _ in range(200)]
    X_WP = X_WP0
    for before, now in pairwise(images):
        X_WP = pose_from_images(X_WP, X_PC, before, now)
    at_once = pose_from_object(object_from_pose(X_WP0, X_PC, images[0]), X_PC, images[-1])
    assert max(pose_error(X_WP, at_once)) < ROUND_OFF
    assert pose_error(X_WP, X_WP0)[0] > 1e-3  # the noise of the two images is in it
