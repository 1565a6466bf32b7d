"""The fusing filter: every matrix against differences of the nonlinear models, and consistency."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.estimation.pose_filter import image_covariance
from cdpr_drake.estimation.sensor_filter import (
    EXTERNAL,
    POSE,
    FusedBelief,
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
from tests.estimation.fused_beliefs import (
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
    pose_innovation,
    spread,
    wrong_by,
)

DIFFERENCE = 2e-5
"""Of derivatives: central differences by `STEP` lose the square of it and round-off over it."""
MIXTURE = 5e-3
"""Of the error of a pose between two others, which is a mixture of theirs in first order of the way
from one to the other, here 0.04 rad, of which an eighth is left halfway."""

PINHOLE = load_camera("astra").pinhole(640, 480)

SIGHTS = {
    "on board": lambda made, steps: sight_on_board(made, steps),
    "external": lambda made, steps: sight_external(made, X_PQ, steps),
}


@pytest.mark.parametrize("name", SIGHTS)
@pytest.mark.parametrize(
    ("steps", "tolerance"), [(0.0, DIFFERENCE), (1.0, DIFFERENCE), (0.4, MIXTURE)]
)
def test_matrices_of_cameras(name, steps, tolerance):
    made = belief()
    sight = SIGHTS[name](made, steps)
    found = differences(made, lambda true: pose_innovation(sight, SIGHTS[name](true, steps).Z))
    np.testing.assert_allclose(sight.H, found, atol=tolerance)


@pytest.mark.parametrize("name", SIGHTS)
def test_matrices_of_depths(name):
    made = belief()
    sight = SIGHTS[name](made, 0.0)
    H, innovation = depth_innovation(sight, POINTS, (sight.Z @ POINTS)[2] + 0.01)
    np.testing.assert_allclose(innovation, 0.01, atol=1e-12)
    found = differences(made, lambda true: (SIGHTS[name](true, 0.0).Z @ POINTS)[2])
    np.testing.assert_allclose(H, found, atol=DIFFERENCE)


def test_matrix_of_lengths_and_of_velocity():
    made = belief()

    def lengths(true):
        return cable_paths(true.X_WP, CABLES).lengths + true.offsets

    paths = cable_paths(made.X_WP, CABLES)
    H, innovation = length_innovation(made, lengths(made), paths.lengths, paths.J)
    np.testing.assert_allclose(innovation, 0.0, atol=1e-12)
    np.testing.assert_allclose(H, differences(made, lengths), atol=DIFFERENCE)
    H, _ = velocity_innovation(made, np.zeros(3))
    found = differences(made, lambda true: true.X_WP.rotation().matrix().T @ true.velocity)
    np.testing.assert_allclose(H, found, atol=DIFFERENCE)


def test_what_an_imu_felt_carries_errors_on():
    """P grows as the errors do that the nonlinear motion makes of other starts and biases."""
    made = belief(past=0)
    turn = exponential(np.array([0.01, -0.02, 0.015, 0.0, 0.0, 0.0])).rotation()
    felt = Increments(turn, np.array([0.3, 0.1, 0.42]), np.array([4e-3, 1e-3, 9e-3]), 0.04)
    none = np.zeros(6)

    def after(true):
        moved = move_inertially(true, felt, GRAVITY, none, none)
        # Errors against the belief after it, ordered as in P.
        turned = moved.X_WP @ there.X_WP.inverse()
        return np.concatenate(
            [logarithm(turned), moved.velocity - turned.rotation() @ there.velocity]
        )

    there = move_inertially(made, felt, GRAVITY, none, none)
    F = np.eye(len(made.covariance))
    F[:9] = differences(made, after)
    P = F @ made.covariance @ F.T
    np.testing.assert_allclose(there.covariance, P, atol=2e-7)


def test_an_imu_at_rest_stays_and_one_in_free_fall_falls():
    made = belief(past=0)
    made = FusedBelief(**{**made.__dict__, "velocity": np.zeros(3)})
    up = -(X_WP.rotation().matrix().T @ GRAVITY)
    still = Increments(RigidTransform().rotation(), up * 0.5, up * 0.125, 0.5)
    rests = move_inertially(made, still, GRAVITY, np.zeros(6), np.zeros(6))
    assert max(pose_error(rests.X_WP, X_WP)) < 1e-12
    nothing = Increments(still.turn, np.zeros(3), np.zeros(3), 0.5)
    falls = move_inertially(made, nothing, GRAVITY, np.zeros(6), np.zeros(6))
    np.testing.assert_allclose(
        falls.X_WP.translation(), X_WP.translation() + 0.125 * GRAVITY, atol=1e-12
    )
    np.testing.assert_allclose(falls.velocity, 0.5 * GRAVITY, atol=1e-12)


def test_a_late_image_is_of_the_pose_at_its_time():
    made = belief()
    assert max(pose_error(pose_at(made, 1.0)[0], BEFORE)) < 1e-12
    assert max(pose_error(pose_at(made, 0.0)[0], X_WP)) < 1e-12
    half = X_WP @ exponential(0.5 * logarithm(X_WP.inverse() @ BEFORE))
    assert max(pose_error(pose_at(made, 0.5)[0], half)) < 1e-9


def test_the_first_image_tells_where_the_object_is():
    made = FusedBelief(**{**belief().__dict__, "X_WO": None})
    Z = (BEFORE @ X_PC).inverse() @ X_WO
    found = object_of_image(made, Z, np.diag(spread(1e-3, 1e-3) ** 2), 1.0)
    assert max(pose_error(found.X_WO, X_WO)) < 1e-9
    # The same image again is what is expected, and tells nothing of the pose.
    sight = sight_on_board(found, 1.0)
    S = sight.H @ found.covariance @ sight.H.T
    assert np.max(np.abs(pose_innovation(sight, Z))) < 1e-9
    np.testing.assert_allclose(S, np.diag(spread(1e-3, 1e-3) ** 2), atol=1e-8)


@pytest.mark.parametrize(("size", "published"), [(1, 10.828), (3, 16.266), (6, 22.458)])
def test_gates_are_chi_square(size, published):
    """Tables of the chi-square distribution at 0.999."""
    assert gate(size, 1e-3) == pytest.approx(published, abs=1e-3)


GATES = Gates(1e-3, 0.5, spread(0.05, 0.05))


def test_a_wrong_image_is_left_out_then_its_camera_is_calibrated_anew():
    """An external camera that is 2 cm and 1 deg off where 1 mm and 0.1 deg are expected."""
    made = belief(past=0)
    P = made.covariance.copy()
    P[EXTERNAL, EXTERNAL] = np.diag(spread(np.radians(0.1), 1e-3) ** 2)
    P[POSE, POSE] *= 1e-2
    made = FusedBelief(**{**made.__dict__, "covariance": P})
    error = np.array([0.0, np.radians(1.0), 0.0, 0.02, 0.0, 0.0])
    seen = (X_WE @ exponential(error)).inverse() @ X_WP @ X_PQ
    R = np.diag(spread(2e-3, 1e-3) ** 2)
    since = ACCEPTED

    def read(_, sight):
        return pose_innovation(sight, seen), R

    for step in range(20):
        taken = take_image(
            made, lambda b: sight_external(b, X_PQ, 0.0), read, EXTERNAL, GATES,
            (since, 0.04 * step),
        )  # fmt: skip
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
    depths = (sight_external(made, X_PQ, 0.0).Z @ POINTS)[2]
    depths[1] += 0.5
    taken = take_depths(
        made, lambda b: sight_external(b, X_PQ, 0.0), POINTS, depths, np.full(4, 1e-3), GATES
    )
    assert taken.status == 0.75
    assert max(pose_error(taken.belief.X_WP, X_WP)) < 1e-9
    paths = cable_paths(X_WP, CABLES)
    lengths = paths.lengths.copy()
    lengths[2] += 0.5
    measured = (*length_innovation(made, lengths, paths.lengths, paths.J), 1e-3)
    taken, refused = take_lengths(made, measured, np.full(M, True), GATES, np.zeros(M), 0.04)
    assert taken.status == (M - 1) / M
    np.testing.assert_allclose(refused, np.where(np.arange(M) == 2, 0.04, 0.0))
    assert max(pose_error(taken.belief.X_WP, X_WP)) < 1e-9


def test_consistent_over_seeds():
    """Errors of start, cameras and object as believed: the normalized error has the mean that the
    chi-square distribution has, within five deviations of a mean of that many."""
    seeds, found = 40, []
    R_on, R_ext = np.diag(spread(2e-3, 1e-3) ** 2), np.diag(spread(2e-2, 5e-3) ** 2)
    for seed in range(seeds):
        random = np.random.default_rng([7, seed])
        made = belief(past=1)
        error = np.linalg.cholesky(made.covariance + 1e-12 * np.eye(len(made.covariance)))
        true = wrong_by(made, error @ random.standard_normal(len(error)))
        looks = (
            (lambda b: sight_on_board(b, 1.0), R_on),
            (lambda b: sight_external(b, X_PQ, 0.0), R_ext),
        )
        for sight_of, R in looks:
            noise = np.linalg.cholesky(R) @ random.standard_normal(6)
            seen, sight = sight_of(true).Z @ exponential(noise), sight_of(made)
            made = correct(made, sight.H, pose_innovation(sight, seen), R)
        x = logarithm(true.X_WP @ made.X_WP.inverse())
        found.append(x @ np.linalg.solve(made.covariance[POSE, POSE], x))
    assert abs(np.mean(found) - 6.0) < 5.0 * np.sqrt(12.0 / seeds)


def seen_from_afar(seed, images):
    """A tag of 12 cm that the camera in the world sees from its place, in so many images: the
    poses that fit best, and the belief before, whose error is d."""
    random = np.random.default_rng([23, seed])
    points = 2.0 * POINTS
    prior = Prior(
        pose=spread(np.radians(1.0), 0.005), on_board=np.zeros(6), external=np.zeros(6),
        offsets=np.zeros(M), biases=np.zeros(6),
    )  # fmt: skip
    made = start_fusion(X_WP, X_PC, X_WE, prior, cable_paths(X_WP, CABLES).J, 0)
    made = FusedBelief(**{**made.__dict__, "X_WO": X_WO})
    d = np.zeros(len(made.covariance))
    d[POSE] = np.linalg.cholesky(made.covariance[POSE, POSE]) @ random.standard_normal(6)
    uv = PINHOLE.project(sight_external(wrong_by(made, d), X_PQ, 0.0).Z @ points)
    noise = [0.3 * random.standard_normal(uv.shape) for _ in range(images)]
    return made, d, [pose_from_points(points, uv + n, PINHOLE) for n in noise], points


def test_a_far_tag_is_taken_in_by_its_points():
    """The poses that fit best are biased, and some are those of the tag tilted the other way; the
    points are neither. So the filter is as wrong as it says, and leaves no image out."""
    seeds, images, nees, largest = (
        20,
        25,
        {"points": [], "poses": []},
        {"points": 0.0, "poses": 0.0},
    )
    for seed in range(seeds):
        start, d, poses, points = seen_from_afar(seed, images)
        for name in nees:
            made = start
            for seen in poses:
                sight = sight_external(made, X_PQ, 0.0)
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
            x = logarithm(exponential(d[POSE]) @ X_WP @ made.X_WP.inverse())
            nees[name].append(x @ np.linalg.solve(made.covariance[POSE, POSE], x))
    assert abs(np.mean(nees["points"]) - 6.0) < 5.0 * np.sqrt(12.0 / seeds)
    assert np.mean(nees["poses"]) > 12.0
    assert largest["points"] < gate(6, 1e-6) < largest["poses"]


def test_an_image_of_what_is_believed_brings_no_innovation_and_a_near_one_its_pose():
    made = belief(past=0)
    sight = sight_external(made, X_PQ, 0.0)
    twist = 1e-4 * np.array([1.0, -2.0, 0.5, 1.0, 0.3, -1.0])
    for moved in (np.zeros(6), twist):
        look = Look(sight.Z @ exponential(moved), 2.0 * POINTS, 0.3 / PINHOLE.fx)
        innovation, R = image_innovation(made, sight, look)
        np.testing.assert_allclose(innovation, moved, atol=1e-7)
        expected = image_covariance(look.seen, look.points, 0.3, PINHOLE.fx)
        np.testing.assert_allclose(R, expected, rtol=1e-2, atol=1e-8)
