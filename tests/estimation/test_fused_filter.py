"""The fusing filter: every matrix against differences of the nonlinear models, and consistency."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.estimation.pose_filter import image_covariance
from cdpr_drake.estimation.sensor_filter import (
    EXTERNAL,
    POSE,
    Increments,
    Prior,
    correct,
    move_inertially,
    pose_at,
    start_fusion,
)
from cdpr_drake.estimation.sensor_models import (
    Look,
    depth_innovation,
    gate,
    image_innovation,
    length_innovation,
    normalized_innovation,
    object_of_image,
    sight_external,
    sight_on_board,
    velocity_innovation,
)
from cdpr_drake.estimation.source_gates import (
    ACCEPTED,
    REJECTED,
    USED,
    Gates,
    take_depths,
    take_image,
    take_lengths,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.vision.target import pose_from_points
from tests.estimation.estimation_cases import (
    BEFORE,
    CABLES,
    GRAVITY,
    POINTS,
    X_PC,
    X_PQ,
    X_WE,
    X_WO,
    X_WP,
    M,
    belief,
    differences,
    normalized_error,
    pose_innovation,
    spread,
    wrong_by,
)

DIFFERENCE = 2e-5  # of derivatives: central differences lose the square of the step and round-off
MIXTURE = 5e-3
"""Of the error of a pose between two others, which is a mixture of theirs in first order of the way
from one to the other, here 0.04 rad, of which an eighth is left halfway."""

PINHOLE = load_camera("astra").pinhole(640, 480)
GATES = Gates(1e-3, 0.5, spread(0.05, 0.05))
NONE = np.zeros(6)


def external(made, steps=0.0):
    return sight_external(made, X_PQ, steps)


SIGHTS = {"on board": sight_on_board, "external": external}


@pytest.mark.parametrize("sight_of", SIGHTS.values(), ids=SIGHTS)
@pytest.mark.parametrize(
    ("steps", "tolerance"), [(0.0, DIFFERENCE), (1.0, DIFFERENCE), (0.4, MIXTURE)]
)
def test_matrices_of_cameras(sight_of, steps, tolerance):
    made = belief()
    sight = sight_of(made, steps)
    expected = differences(made, lambda true: pose_innovation(sight, sight_of(true, steps).Z))
    np.testing.assert_allclose(sight.H, expected, atol=tolerance)


def lengths(true):
    return cable_paths(true.X_WP, CABLES).lengths + true.offsets


def innovation_of_lengths(made, reading):
    paths = cable_paths(made.X_WP, CABLES)
    return length_innovation(made, reading, paths.lengths, paths.J)


READINGS = {  # what is read of the truth, and matrix and innovation of a reading
    **{
        f"depths {name}": (
            lambda true, of=sight_of: (of(true, 0.0).Z @ POINTS)[2],
            lambda made, reading, of=sight_of: depth_innovation(of(made, 0.0), POINTS, reading),
        )
        for name, sight_of in SIGHTS.items()
    },
    "lengths": (lengths, innovation_of_lengths),
    "velocity": (
        lambda true: true.X_WP.rotation().matrix().T @ true.velocity, velocity_innovation
    ),
}  # fmt: skip


@pytest.mark.parametrize(("read", "innovation_of"), READINGS.values(), ids=READINGS)
def test_matrices_of_readings(read, innovation_of):
    made = belief()
    H, innovation = innovation_of(made, read(made) + 0.01)
    np.testing.assert_allclose(innovation, 0.01, atol=1e-12)
    np.testing.assert_allclose(H, differences(made, read), atol=DIFFERENCE)


def test_what_an_imu_felt_carries_errors_on():
    """P grows as the errors do that the nonlinear motion makes of other starts and biases."""
    made = belief(past=0)
    turn = exponential(np.array([0.01, -0.02, 0.015, 0.0, 0.0, 0.0])).rotation()
    felt = Increments(turn, np.array([0.3, 0.1, 0.42]), np.array([4e-3, 1e-3, 9e-3]), 0.04)
    after = move_inertially(made, felt, GRAVITY, NONE, NONE)

    def errors(true):
        """Errors against the belief after it, ordered as in P."""
        moved = move_inertially(true, felt, GRAVITY, NONE, NONE)
        turned = moved.X_WP @ after.X_WP.inverse()
        rest = moved.velocity - turned.rotation() @ after.velocity
        return np.concatenate([logarithm(turned), rest])

    F = np.eye(len(made.covariance))
    F[:9] = differences(made, errors)
    np.testing.assert_allclose(after.covariance, F @ made.covariance @ F.T, atol=2e-7)


@pytest.mark.parametrize(("lift", "falls"), [(1.0, 0.0), (0.0, 1.0)])
def test_an_imu_at_rest_stays_and_one_in_free_fall_falls(lift, falls):
    made = replace(belief(past=0), velocity=np.zeros(3))
    up = -lift * (X_WP.rotation().matrix().T @ GRAVITY)
    felt = Increments(RotationMatrix(), up * 0.5, up * 0.125, 0.5)
    after = move_inertially(made, felt, GRAVITY, NONE, NONE)
    expected = RigidTransform(X_WP.rotation(), X_WP.translation() + falls * 0.125 * GRAVITY)
    assert max(pose_error(after.X_WP, expected)) < 1e-12
    np.testing.assert_allclose(after.velocity, falls * 0.5 * GRAVITY, atol=1e-12)


def test_a_late_image_is_of_the_pose_at_its_time():
    """Or of the oldest that is remembered."""
    half = X_WP @ exponential(0.5 * logarithm(X_WP.inverse() @ BEFORE))
    for steps, pose, tolerance in (
        (1.0, BEFORE, 1e-12), (0.0, X_WP, 1e-12), (0.5, half, 1e-9), (3.4, BEFORE, 1e-12)
    ):  # fmt: skip
        assert max(pose_error(pose_at(belief(), steps)[0], pose)) < tolerance, steps


def test_the_first_image_tells_where_the_object_is():
    made = replace(belief(), X_WO=None)
    Z = (BEFORE @ X_PC).inverse() @ X_WO
    after = object_of_image(made, Z, np.diag(spread(1e-3, 1e-3) ** 2), 1.0)
    assert max(pose_error(after.X_WO, X_WO)) < 1e-9
    # The same image again is what is expected, and tells nothing of the pose.
    sight = sight_on_board(after, 1.0)
    S = sight.H @ after.covariance @ sight.H.T
    assert np.max(np.abs(pose_innovation(sight, Z))) < 1e-9
    np.testing.assert_allclose(S, np.diag(spread(1e-3, 1e-3) ** 2), atol=1e-8)


# Gates.


@pytest.mark.parametrize(("size", "published"), [(1, 10.828), (3, 16.266), (6, 22.458)])
def test_gates_are_chi_square(size, published):
    """Tables of the chi-square distribution at 0.999."""
    assert gate(size, 1e-3) == pytest.approx(published, abs=1e-3)


def test_a_wrong_image_is_left_out_then_its_camera_is_calibrated_anew():
    """An external camera that is 2 cm and 1 deg off where 1 mm and 0.1 deg are expected."""
    made = belief(past=0)
    P = made.covariance.copy()
    P[EXTERNAL, EXTERNAL] = np.diag(spread(np.radians(0.1), 1e-3) ** 2)
    P[POSE, POSE] *= 1e-2
    made = replace(made, covariance=P)
    error = np.array([0.0, np.radians(1.0), 0.0, 0.02, 0.0, 0.0])
    seen = (X_WE @ exponential(error)).inverse() @ X_WP @ X_PQ
    R, since = np.diag(spread(2e-3, 1e-3) ** 2), ACCEPTED

    def read(_, sight):
        return pose_innovation(sight, seen), R

    for step in range(20):
        taken = take_image(made, external, read, EXTERNAL, GATES, (since, 0.04 * step))
        made, since = taken.belief, taken.refused_since
        if step * 0.04 < GATES.patience:
            assert taken.status == REJECTED
            assert max(pose_error(made.X_WP, X_WP)) < 1e-12
    assert taken.status == USED
    assert max(pose_error(made.X_WP, X_WP)) < 2e-3
    left = logarithm(X_WE.inverse() @ made.X_WE) - error
    assert np.linalg.norm(left) < 0.2 * np.linalg.norm(error)


def test_one_wrong_depth_and_one_wrong_length_are_left_out():
    made = belief(past=0)
    depths = (external(made).Z @ POINTS)[2]
    depths[1] += 0.5
    taken = take_depths(made, external, POINTS, depths, np.full(4, 1e-3), GATES)
    assert taken.status == 0.75
    assert max(pose_error(taken.belief.X_WP, X_WP)) < 1e-9
    wrong = np.arange(M) == 2
    reading = cable_paths(X_WP, CABLES).lengths + 0.5 * wrong
    measured = (*innovation_of_lengths(made, reading), 1e-3)
    taken, refused = take_lengths(made, measured, np.full(M, True), GATES, np.zeros(M), 0.04)
    assert taken.status == (M - 1) / M
    np.testing.assert_allclose(refused, 0.04 * wrong)
    assert max(pose_error(taken.belief.X_WP, X_WP)) < 1e-9


# Consistency.


def assert_chi_square(nees):
    """Their mean is that of the distribution, within five deviations of a mean of that many."""
    assert abs(np.mean(nees) - 6.0) < 5.0 * np.sqrt(12.0 / len(nees))


def error_of_pose(true, made):
    x = logarithm(true.X_WP @ made.X_WP.inverse())
    return normalized_error(x, made.covariance[POSE, POSE])


def test_consistent_over_seeds():
    """Errors of start, cameras and object as believed."""
    nees = []
    looks = (
        (sight_on_board, 1.0, spread(2e-3, 1e-3)),
        (external, 0.0, spread(2e-2, 5e-3)),
    )
    start = belief(past=1)
    shares = np.linalg.cholesky(start.covariance + 1e-12 * np.eye(len(start.covariance)))
    for seed in range(40):
        random, made = np.random.default_rng([7, seed]), start
        true = wrong_by(made, shares @ random.standard_normal(len(shares)))
        for sight_of, steps, deviations in looks:
            noise = deviations * random.standard_normal(6)
            seen, sight = sight_of(true, steps).Z @ exponential(noise), sight_of(made, steps)
            innovation = pose_innovation(sight, seen)
            made = correct(made, sight.H, innovation, np.diag(deviations**2))
        nees.append(error_of_pose(true, made))
    assert_chi_square(nees)


def seen_from_afar(seed, images):
    """A tag of 12 cm that the camera in the world sees from its place, in so many images: the
    belief before, the truth, and the poses that fit best."""
    random, points = np.random.default_rng([23, seed]), 2.0 * POINTS
    prior = Prior(
        pose=spread(np.radians(1.0), 0.005), on_board=NONE, external=NONE,
        offsets=np.zeros(M), biases=NONE,
    )  # fmt: skip
    made = start_fusion(X_WP, X_PC, X_WE, prior, cable_paths(X_WP, CABLES).J, 0)
    made, d = replace(made, X_WO=X_WO), np.zeros(len(made.covariance))
    d[POSE] = np.linalg.cholesky(made.covariance[POSE, POSE]) @ random.standard_normal(6)
    true = wrong_by(made, d)
    uv = PINHOLE.project(external(true).Z @ points)
    noise = 0.3 * random.standard_normal((images, *uv.shape))
    return made, true, [pose_from_points(points, uv + n, PINHOLE) for n in noise], points


def test_a_far_tag_is_taken_in_by_its_points():
    """The poses that fit best are biased, and some are those of the tag tilted the other way; the
    points are neither. So the filter is as wrong as it says, and leaves no image out."""
    nees, largest = {"points": [], "poses": []}, {"points": 0.0, "poses": 0.0}
    for seed in range(20):
        start, true, poses, points = seen_from_afar(seed, images=25)
        for name in nees:
            made = start
            for seen in poses:
                sight = external(made)
                if name == "points":
                    look = Look(seen, points, 0.3 / PINHOLE.fx)
                    innovation, R = image_innovation(made, sight, look)
                else:
                    innovation = pose_innovation(sight, seen)
                    R = image_covariance(seen, points, 0.3, PINHOLE.fx)
                nis = normalized_innovation(made, sight.H, innovation, R)
                largest[name] = max(largest[name], nis)
                if nis < gate(6, 1e-6):
                    made = correct(made, sight.H, innovation, R)
            nees[name].append(error_of_pose(true, made))
    assert_chi_square(nees["points"])
    assert np.mean(nees["poses"]) > 12.0
    assert largest["points"] < gate(6, 1e-6) < largest["poses"]


@pytest.mark.parametrize("size", [0.0, 1e-4])
def test_an_image_of_what_is_believed_brings_no_innovation_and_a_near_one_its_pose(size):
    made = belief(past=0)
    sight = external(made)
    moved = size * np.array([1.0, -2.0, 0.5, 1.0, 0.3, -1.0])
    look = Look(sight.Z @ exponential(moved), 2.0 * POINTS, 0.3 / PINHOLE.fx)
    innovation, R = image_innovation(made, sight, look)
    np.testing.assert_allclose(innovation, moved, atol=1e-7)
    expected = image_covariance(look.seen, look.points, 0.3, PINHOLE.fx)
    np.testing.assert_allclose(R, expected, rtol=1e-2, atol=1e-8)
