"""Estimators from images: exact images give exact poses; what is unseen leaves them be."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import exponential, pose_error, pose_from_angles
from cdpr_drake.systems.estimators.image_estimators import (
    ConsecutiveImages,
    FirstImage,
    KnownObject,
)
from cdpr_drake.systems.estimators.pose_estimator import KnownTag
from tests.systems.estimators.estimator_bench import PERIOD, RATE, EstimatorBench

ROUND_OFF = 1e-11  # some hundred products of poses with entries of order one

X_PC = pose_from_angles(np.array([-0.06, 0.0, 0.01]), np.array([0.1, 3.0, 0.0]))
X_WO = pose_from_angles(np.array([0.2, -0.2, 0.0]), np.array([0.0, 0.1, 0.3]))
X_WK = pose_from_angles(np.array([-0.1, 0.2, 0.05]), np.array([0.2, 0.0, 1.0]))
START = pose_from_angles(np.array([0.1, 0.0, 0.3]), np.array([0.2, 0.1, 0.0]))
NO_IMAGE = {"X_CO": RigidTransform(), "found": [0.0]}
BOTH = pytest.mark.parametrize("kind", [ConsecutiveImages, FirstImage])


def path(count, seed=2):
    random = np.random.default_rng(seed)
    poses = [START]
    for _ in range(count - 1):
        poses.append(poses[-1] @ exponential(0.02 * random.standard_normal(6)))
    return poses


def image(X_WP, noise=None):
    X_CO = (X_WP @ X_PC).inverse() @ X_WO
    return {"X_CO": X_CO if noise is None else X_CO @ exponential(noise), "found": [1.0]}


def known(X_WP):
    return {"X_CK": (X_WP @ X_PC).inverse() @ X_WK, "known_tag_found": [1.0]}


@BOTH
def test_ports_are_these(kind):
    estimator = kind(START, X_PC, RATE)
    names = [estimator.get_input_port(i).get_name() for i in range(estimator.num_input_ports())]
    assert names == ["X_CO", "found"]
    assert estimator.num_output_ports() == 1
    assert isinstance(estimator.GetOutputPort("X_WP").Allocate().get_value(), RigidTransform)


@BOTH
def test_exact_images_give_the_exact_pose_at_once(kind):
    """At the instant of the image, not one step later."""
    bench = EstimatorBench(kind(START, X_PC, RATE))
    for X_WP in path(30):
        assert max(pose_error(bench.step(**image(X_WP)), X_WP)) < ROUND_OFF


@BOTH
def test_a_wrong_start_stays_wrong_in_the_world(kind):
    """Images tell the motion only: the error is one fixed motion of the world."""
    wrong = START @ exponential(np.array([0.05, 0.0, 0.1, 0.02, 0.0, -0.03]))
    bench = EstimatorBench(kind(wrong, X_PC, RATE))
    for X_WP in path(20):
        found = bench.step(**image(X_WP))
        expected = wrong @ START.inverse() @ X_WP
        assert max(pose_error(found, expected)) < ROUND_OFF


@BOTH
def test_while_nothing_is_seen_it_stays_and_catches_up_with_the_next_image(kind):
    poses = path(12)
    bench = EstimatorBench(kind(START, X_PC, RATE))
    for k, X_WP in enumerate(poses):
        seen = k < 4 or k > 8
        found = bench.step(**(image(X_WP) if seen else NO_IMAGE))
        assert max(pose_error(found, X_WP if seen else poses[3])) < ROUND_OFF


@BOTH
def test_before_the_first_image_it_is_where_it_was_believed(kind):
    bench = EstimatorBench(kind(START, X_PC, RATE))
    assert max(pose_error(bench.step(**NO_IMAGE), START)) < ROUND_OFF


def test_noise_does_not_add_up_from_image_to_image():
    """Neither drifts, and they agree: comparing consecutive images cancels what lies between."""
    random = np.random.default_rng(4)
    noise = 0.003 * random.standard_normal((400, 6))
    benches = [EstimatorBench(kind(START, X_PC, RATE)) for kind in (ConsecutiveImages, FirstImage)]
    errors = []
    for X_WP, each in zip(path(400), noise, strict=True):
        one, other = (bench.step(**image(X_WP, each)) for bench in benches)
        assert max(pose_error(one, other)) < ROUND_OFF
        errors.append(pose_error(one, X_WP)[1])
    assert np.max(errors[200:]) < 1.5 * np.max(errors[:200])


@BOTH
def test_a_known_tag_begins_it_anew_after_each_period(kind):
    wrong = START @ exponential(np.array([0.05, 0.0, 0.1, 0.02, 0.0, -0.03]))
    period = 5.0 * PERIOD
    bench = EstimatorBench(kind(wrong, X_PC, RATE, KnownTag(X_WK, X_PC, period)))
    for k, X_WP in enumerate(path(20)):
        found = bench.step(**image(X_WP), **known(X_WP))
        expected = X_WP if k >= 5 else wrong @ START.inverse() @ X_WP
        assert max(pose_error(found, expected)) < ROUND_OFF


@BOTH
def test_a_known_tag_that_shows_up_late_is_used_then(kind):
    wrong = START @ exponential(np.array([0.05, 0.0, 0.1, 0.02, 0.0, -0.03]))
    bench = EstimatorBench(kind(wrong, X_PC, RATE, KnownTag(X_WK, X_PC, 2.0 * PERIOD)))
    unseen = {"X_CK": RigidTransform(), "known_tag_found": [0.0]}
    for k, X_WP in enumerate(path(12)):
        found = bench.step(
            **(NO_IMAGE if k == 7 else image(X_WP)), **(known(X_WP) if k == 7 else unseen)
        )
        if k < 7:
            assert pose_error(found, X_WP)[0] > 1e-2
        else:
            # At 7 the target itself is not seen: what follows is told from 8 on.
            assert k != 7 or max(pose_error(found, X_WP)) < ROUND_OFF


def test_the_known_object_tells_the_pose_whatever_was_believed():
    bench = EstimatorBench(KnownObject(RigidTransform(), X_PC, X_WK, RATE))
    unseen = {"X_CK": RigidTransform(), "known_tag_found": [0.0]}
    assert bench.step(**unseen).IsExactlyIdentity()
    poses = path(6)
    for X_WP in poses:
        assert max(pose_error(bench.step(**known(X_WP)), X_WP)) < ROUND_OFF
    assert max(pose_error(bench.step(**unseen), poses[-1])) < ROUND_OFF
