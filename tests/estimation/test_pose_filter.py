"""The fusing filter of poses: its Jacobians, its consistency, and that it finds a wrong start."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdpr_drake.estimation.pose_filter import (
    POSE,
    image_covariance,
    predict,
    start_belief,
    update_image,
    update_known_object,
    update_lengths,
)
from cdpr_drake.estimation.pose_from_images import object_from_pose, pose_from_object
from cdpr_drake.geometry.poses import exponential, logarithm, pose_error, pose_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.vision.apriltags import tag_corners
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import pose_from_points
from tests.estimation.estimation_cases import normalized_error

ROUND_OFF = 1e-9  # poses after some corrections, each with a 26 x 26 solve
SMALL = 1e-6  # size of errors
FIRST_ORDER = 1e-5  # share of a small twist that higher orders and differences may leave
SHIFTED_POINTS = 1e-1  # the same where points are off by millimetres: 1e-3 / 0.1 m, times some

ROBOT = load_robot("acrobot_small")
A, B = ROBOT.exit_points(), ROBOT.anchor_points()
X_PC = pose_from_angles(np.array([-0.0631, 0.0, 0.01]), np.array([0.0, np.pi, 0.0]))
X_WO = pose_from_angles(np.array([0.2209, -0.197, 0.0]), np.zeros(3))
START = pose_from_angles(np.array([0.112, -0.032, 0.301]), np.radians([-12.0, -10.0, 0.0]))
GOAL = pose_from_angles(np.array([0.284, -0.197, 0.08]), np.zeros(3))
CAMERA = Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5)
TAG = tag_corners(0.06)

PIXELS, LENGTH = 0.1, 2e-4
NOISE = np.repeat([1e-3**2, 5e-4**2], 3)
NO_DRIFT, NONE = np.zeros(8), np.zeros(6)
PERIOD, COUNT, SEEDS = 0.04, 60, 12
WAY = PoseTrajectory((START, GOAL), (COUNT * PERIOD,))


def deviations(degrees, metres):
    return np.diag(np.repeat([np.radians(degrees) ** 2, metres**2], 3))


def lengths(X_WP, points=(A, B)):
    return cable_lengths(X_WP, *points), length_jacobian(X_WP, *points)


def seen(X_WP, target=X_WO):
    return (X_WP @ X_PC).inverse() @ target


def image(X_WP, random):
    """What OpenCV finds from noisy corners of a tag."""
    X_CO = seen(X_WP)
    uv = CAMERA.project(X_CO.rotation().matrix() @ TAG + X_CO.translation()[:, np.newaxis])
    return pose_from_points(TAG, uv + PIXELS * random.standard_normal((2, 4)), CAMERA)


def start_of(X_WP, covariance=None, offsets=NO_DRIFT, camera=0.0, points=0.0):
    covariance = deviations(5.0, 0.04) if covariance is None else covariance
    known = points**2, points**2
    return start_belief(X_WP, X_PC, covariance, camera**2 * np.eye(6), offsets, known)


def middle():
    """A belief on the way, the errors of all that it believes, and the truth they lead to."""
    random = np.random.default_rng(3)
    belief = update_image(start_of(START, offsets=np.full(8, 1e-4)), seen(START), 1e-8 * np.eye(6))
    belief = replace(belief, X_WP=GOAL, parameters=1e-3 * random.standard_normal(56))
    x, y, x0, c = SMALL * random.standard_normal((4, 6))
    parameters = SMALL * random.standard_normal(56)
    truth = {
        "X": exponential(x) @ GOAL, "Y": exponential(y) @ belief.X_WO,
        "X0": exponential(x0) @ START, "C": X_PC @ exponential(c),
        "parameters": belief.parameters + parameters,
    }  # fmt: skip
    return belief, np.concatenate([x, y, x0, c, parameters]), truth


@pytest.fixture
def linear(monkeypatch):
    """Calls an update and gives its H and innovation, which the correction gets."""

    def run(update, *arguments):
        with monkeypatch.context() as patch:
            caught = []
            patch.setattr(
                "cdpr_drake.estimation.pose_filter._correct",
                lambda belief, H, innovation, R: caught.append((H, innovation)) or belief,
            )
            update(*arguments)
        return caught[0]

    return run


@pytest.mark.parametrize("name", ["image", "known object"])
def test_images_are_linear_in_the_errors_as_the_docstring_says(linear, name):
    belief, x, truth = middle()
    to_camera = (truth["X"] @ truth["C"]).inverse()
    if name == "image":
        H, innovation = linear(update_image, belief, to_camera @ truth["Y"], np.eye(6))
    else:
        X_WK = pose_from_angles(np.array([0.3, 0.1, 0.0]), np.array([0.0, 0.2, 0.4]))
        H, innovation = linear(update_known_object, belief, X_WK, to_camera @ X_WK, np.eye(6))
    np.testing.assert_allclose(innovation, H @ x, atol=FIRST_ORDER * SMALL)


def test_lengths_are_linear_in_the_errors_as_the_docstring_says(linear):
    belief, x, truth = middle()

    def change(parameters, X=GOAL, X0=START):
        """The model's change of lengths with these errors of points."""
        exits, anchors = (part.reshape(8, 3).T for part in np.split(parameters[8:], 2))
        points = A + exits, B + anchors
        return cable_lengths(X, *points) - cable_lengths(X0, *points)

    counted = change(truth["parameters"], truth["X"], truth["X0"]) + truth["parameters"][:8]
    H, innovation = linear(
        update_lengths, belief, counted, lengths(GOAL), lengths(START), np.ones(8)
    )
    # What the filter leaves out is of second order in millimetres of points; take it off.
    second, first = (
        change(belief.parameters) - change(np.zeros(56)),
        H[:, 32:] @ belief.parameters[8:],
    )
    np.testing.assert_allclose(innovation, H @ x + second - first, atol=SHIFTED_POINTS * SMALL)
    np.testing.assert_allclose(second, first, atol=1e-5)  # (1 mm)^2 / 1 m, times some


def test_the_start_pose_and_the_pose_are_one_until_something_moves():
    P = start_of(START, offsets=np.full(8, 1e-6)).covariance
    np.testing.assert_array_equal(P[:6, :6], P[12:18, :6])
    np.testing.assert_array_equal(P[:6, :6], P[12:18, 12:18])
    # exp(x) X = X exp(z) with z the error as a twist in P
    z = SMALL * np.arange(1.0, 7.0)
    x = logarithm(START @ exponential(z) @ START.inverse())
    expected = normalized_error(z, deviations(5.0, 0.04))
    np.testing.assert_allclose(normalized_error(x, P[:6, :6]), expected, rtol=1e-6)


def test_no_image_of_an_unknown_object_tells_the_absolute_pose():
    """What images cannot see stays as uncertain as it was, whatever they correct."""
    belief, random, X = start_of(START), np.random.default_rng(5), START
    before = belief.covariance[:6, :6].copy()
    for _ in range(50):
        noise = exponential(1e-3 * random.standard_normal(6))
        belief = update_image(belief, seen(X) @ noise, 1e-6 * np.eye(6))
        X = X @ exponential(0.02 * random.standard_normal(6))
        belief = predict(belief, NONE, PERIOD, NOISE, NO_DRIFT)
    assert np.all(np.linalg.eigvalsh(belief.covariance[:6, :6] - before) > -1e-9)


def run(seed, covariance, points, camera):
    """A noisy way from START to GOAL, with start pose, points and camera believed wrongly.

    Returns:
        NEES, shape (COUNT,), and the last position errors [m] of: filter, control alone, images
        alone, and the start.
    """
    random = np.random.default_rng(seed)
    wrong = START @ exponential(-random.multivariate_normal(NONE, covariance))
    near = [each + points * random.standard_normal((3, 8)) for each in (A, B)]
    X_PCb = X_PC @ exponential(camera * random.standard_normal(6))
    belief = replace(start_of(wrong, covariance, camera=camera, points=points), X_PC=X_PCb)
    X, control, object_at_first, nees = START, wrong, None, []
    for k in range(COUNT):
        X_CO = image(X, random)
        belief = update_image(belief, X_CO, image_covariance(X_CO, TAG, PIXELS, CAMERA.fx))
        object_at_first = object_at_first or object_from_pose(wrong, X_PCb, X_CO)
        counted = lengths(X)[0] - lengths(START)[0] + LENGTH * random.standard_normal(8)
        model = lengths(belief.X_WP, near), lengths(belief.X_WP0, near)
        belief = update_lengths(belief, counted, *model, np.full(8, LENGTH**2))
        x = logarithm(X @ belief.X_WP.inverse())
        nees.append(normalized_error(x, belief.covariance[POSE, POSE]))
        V = logarithm(WAY.pose(k * PERIOD).inverse() @ WAY.pose((k + 1) * PERIOD)) / PERIOD
        shaken = exponential(np.sqrt(NOISE * PERIOD) * random.standard_normal(6))
        X, control = X @ exponential(V * PERIOD) @ shaken, control @ exponential(V * PERIOD)
        belief = predict(belief, V, PERIOD, NOISE, NO_DRIFT)
    from_images = pose_from_object(object_at_first, X_PCb, seen(X))
    errors = [pose_error(X, other)[0] for other in (belief.X_WP, control, from_images)]
    return nees, [*errors, pose_error(START, wrong)[0]]


@cache
def runs(known, points=0.0, camera=0.0):
    rows = [run(seed, deviations(*known), points, camera) for seed in range(SEEDS)]
    nees, errors = zip(*rows, strict=True)
    return np.mean(nees, axis=0), np.mean(errors, axis=0)


FAR, NEAR = (5.0, 0.04), (0.2, 0.002)  # how well the start is known [deg, m]


@pytest.mark.parametrize(
    "case", [(FAR,), (NEAR, 0.003, 0.0), (NEAR, 0.0, 0.005), (NEAR, 0.003, 0.005)]
)
def test_it_knows_how_far_errors_of_start_points_and_camera_mislead_it(case):
    """The mean of 12 values of chi-square with 6 degrees of freedom lies within 3.1 and 9.9 with
    99.9 per cent; and it is better than what it is made from."""
    nees, (fused, control, images, _) = runs(*case)
    for column in (0, COUNT // 5, 2 * COUNT // 5, 3 * COUNT // 5, COUNT - 1):
        assert 3.1 < nees[column] < 9.9, column
    assert fused < min(control, images)


def test_it_removes_an_error_of_the_start_pose_that_its_inputs_keep():
    fused, control, images, start = runs(FAR)[1]
    assert control > 0.5 * start
    assert images > 0.5 * start
    assert fused < 0.1 * min(control, images)


def test_a_known_object_corrects_the_pose_at_once():
    belief = start_of(START @ exponential(np.array([0.02, -0.01, 0.03, 0.01, 0.02, -0.01])))
    for _ in range(3):  # the filter is of first order; each image halves the digits that are wrong
        belief = update_known_object(belief, X_WO, seen(START), 1e-10 * np.eye(6))
    assert max(pose_error(belief.X_WP, START)) < 1e-4
    assert max(pose_error(belief.X_WP0, START)) < 1e-4  # it was there then, too


def test_cables_that_are_left_out_say_nothing():
    belief = middle()[0]
    belief = replace(belief, parameters=np.where(np.arange(56) < 8, belief.parameters, 0.0))
    now, start = lengths(GOAL), lengths(START)
    assert update_lengths(belief, np.ones(8), now, start, np.full(8, np.inf)) is belief
    three = np.where(np.arange(8) < 3, 1e-8, np.inf)
    counted = now[0] - start[0] + belief.offsets + np.where(np.arange(8) < 3, 0.0, 1.0)
    after = update_lengths(belief, counted, now, start, three)
    assert max(pose_error(after.X_WP, belief.X_WP)) < ROUND_OFF


def test_the_covariance_of_an_image_is_that_of_the_solver():
    """The spread of poses that OpenCV finds from noisy corners, 400 times."""
    random = np.random.default_rng(7)
    X_WP = pose_from_angles(np.array([0.2, -0.1, 0.2]), np.radians([-8.0, -6.0, 5.0]))
    errors = [logarithm(image(X_WP, random).inverse() @ seen(X_WP)) for _ in range(400)]
    expected = image_covariance(seen(X_WP), TAG, PIXELS, CAMERA.fx)
    ratio = np.linalg.eigvals(np.linalg.solve(expected, np.cov(np.array(errors).T))).real
    # A sample covariance of 400 has eigenvalues within (1 -+ sqrt(6 / 400))^2; half again as spare.
    assert np.all((ratio > 0.6) & (ratio < 1.6))


def test_rounding_leaves_the_covariance_symmetric_and_positive():
    belief = start_of(START, offsets=np.full(8, 1e-6))
    for _ in range(100):
        belief = update_image(belief, seen(START), 1e-10 * np.eye(6))
        belief = predict(belief, NONE, PERIOD, NOISE, NO_DRIFT)
    P = belief.covariance
    np.testing.assert_allclose(P, P.T, atol=1e-15)
    assert np.min(np.linalg.eigvalsh(P)) > -1e-12
