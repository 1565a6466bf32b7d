"""The pose of a plane from one image, against OpenCV's solvers and against what is known."""

import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import exponential, pose_error
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.cameras.targets import TARGETS, TargetSettings
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import pose_from_points

CAMERA = Pinhole(640, 480, 600.0, 610.0, 319.5, 239.5)
SQUARE = 0.03 * np.array([[-1.0, 1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [0.0, 0.0, 0.0, 0.0]])

EXACT = 1e-9
"""Of a pose from exact images [m, rad]: rounding of pixels over a square of 60 px."""

AT_REST = 1e-10
"""Of a step of Gauss and Newton from the pose where the sum of squares is least [m, rad]. Rounding
of pixels gives 1e-12; where the sum of squares falls no more by its digits it is 1e-8."""

NO_HIGHER = 1e-9
"""Share by which a sum of squares may pass OpenCV's, which its steps leave just as uncertain."""


def facing(turn, position):
    """A pose that faces the camera but for a turn by a rotation vector [rad]."""
    tilt = exponential(np.r_[turn, 0.0, 0.0, 0.0]).rotation()
    return RigidTransform(RotationMatrix.MakeXRotation(np.pi) @ tilt, position)


def squares(X_CO, points, uv):
    return float(np.sum(np.square(CAMERA.project(X_CO @ points) - uv)))


def by_opencv(points, uv):
    """The least sum of squares that OpenCV's planar solvers come to."""
    P, image, K = np.ascontiguousarray(points.T), np.ascontiguousarray(uv.T), CAMERA.matrix()
    sums = []
    for method in (cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_ITERATIVE):
        count, turns, places, _ = cv2.solvePnPGeneric(P, image, K, None, flags=method)
        for r, p in zip(turns[:count], places[:count], strict=True):
            r, p = cv2.solvePnPRefineLM(P, image, K, None, r, p)
            if p[2, 0] > 0.0:
                R = RotationMatrix.ProjectToRotationMatrix(cv2.Rodrigues(r)[0])
                sums.append(squares(RigidTransform(R, p.ravel()), points, uv))
    return min(sums)


@pytest.mark.parametrize(
    "X_CO",
    [
        RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, 0.2]),  # seen head on
        RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.04, -0.03, 0.3]),
        facing([0.0, 0.0, np.pi], [0.01, 0.0, 0.2]),
        facing([0.7, -0.4, 2.0], [0.03, 0.02, 0.25]),
        facing([1.1, 0.0, 0.0], [0.0, -0.02, 0.4]),
    ],
)
@pytest.mark.parametrize("shift", [0.0, 0.02])
def test_an_exact_image_gives_the_pose(X_CO, shift):
    points = SQUARE + np.array([[shift], [2.0 * shift], [0.0]])
    found = pose_from_points(points, CAMERA.project(X_CO @ points), CAMERA)
    distance, angle = pose_error(found, X_CO)
    # Head on, the image says of a small tilt only its square.
    head_on = np.abs(X_CO.rotation().matrix()[2, 2]) == 1.0
    assert distance < EXACT
    assert angle < (1e-6 if head_on else EXACT)


def test_no_pose_of_opencv_fits_noisy_images_better():
    random = np.random.default_rng(0)
    for number in range(150):
        points = SQUARE
        if number % 3 == 0:
            count = random.integers(5, 12)
            points = np.vstack([random.uniform(-0.05, 0.08, (2, count)), np.zeros(count)])
        tilt = [0.0, 1e-6, 0.1, 0.4, 0.7][number % 5] * random.normal(size=3)
        place = [*random.uniform(-0.05, 0.05, 2), random.uniform(0.1, 0.6)]
        X_CO = facing(tilt, place) @ RigidTransform(
            RotationMatrix.MakeZRotation(random.uniform(-4.0, 4.0)), np.zeros(3)
        )
        uv = CAMERA.project(X_CO @ points)
        if not np.all(np.isfinite(uv)):
            continue
        uv += 0.3 * random.standard_normal(uv.shape)
        found = pose_from_points(points, uv, CAMERA)
        assert squares(found, points, uv) <= by_opencv(points, uv) * (1.0 + NO_HIGHER)


def last_step(X_CO, points, uv):
    """The step of Gauss and Newton from a pose, as a rotation vector [rad] and a displacement [m];
    derivatives by complex steps."""
    r, tiny = X_CO.rotation().matrix() @ points, 1e-30
    f, c = np.array([[CAMERA.fx], [CAMERA.fy]]), np.array([[CAMERA.cx], [CAMERA.cy]])

    def errors(x):
        q = r + np.cross(x[:3], r, axis=0) + (X_CO.translation() + x[3:])[:, np.newaxis]
        return (f * q[:2] / q[2] + c - uv).ravel()

    J = np.array([errors(1j * tiny * axis).imag / tiny for axis in np.eye(6)]).T
    return np.linalg.lstsq(J, -errors(np.zeros(6)), rcond=None)[0]


def test_the_pose_is_the_minimum_to_more_than_the_sum_of_squares_tells():
    random = np.random.default_rng(3)
    for number in range(60):
        tilt = [0.0, 0.02, 0.1, 0.4, 0.7][number % 5] * random.normal(size=3)
        X_CO = facing(tilt, [*random.uniform(-0.05, 0.05, 2), random.uniform(0.1, 0.4)])
        uv = CAMERA.project(X_CO @ SQUARE) + 0.3 * random.standard_normal((2, 4))
        found = pose_from_points(SQUARE, uv, CAMERA)
        assert np.linalg.norm(last_step(found, SQUARE, uv)) < AT_REST


def test_what_has_no_pose_gives_none():
    line = np.array([[0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0], np.zeros(4)]) * 0.01
    X_CO = facing([0.3, 0.0, 0.0], [0.0, 0.0, 0.2])
    assert pose_from_points(line, CAMERA.project(X_CO @ line), CAMERA) is None
    assert pose_from_points(SQUARE[:, :3], np.zeros((2, 3)), CAMERA) is None
    nothing = np.full((2, 4), 300.0)
    assert pose_from_points(SQUARE, nothing, CAMERA) is None


def test_points_in_space_have_their_own_solver():
    points = np.hstack([SQUARE, SQUARE[:, :2] + np.array([[0.0], [0.0], [0.02]])])
    X_CO = facing([0.4, 0.2, 0.0], [0.01, 0.0, 0.25])
    found = pose_from_points(points, CAMERA.project(X_CO @ points), CAMERA)
    assert pose_error(found, X_CO)[0] < 1e-6


@pytest.mark.parametrize("kind", sorted(set(TARGETS) - {"tag_bundle"}))
def test_marks_at_unit_focal_length_are_those_of_the_pose(kind):
    target = TargetSettings(kind=kind, size=0.05, pose=Pose(position=np.zeros(3))).target()
    X_CO = facing([0.3, -0.2, 0.5], [0.02, -0.01, 0.3])
    marks = target.project(X_CO, CAMERA, 0.0, np.random.default_rng(0))
    expected, written = target.ideal_marks(X_CO), np.empty(target.size)
    target.write_normalized(marks, CAMERA, written)
    np.testing.assert_allclose(written, expected.ravel(), atol=1e-12)
    np.testing.assert_array_equal(target.normalized(marks, CAMERA).ravel(), written)
    assert target.normalized(marks, CAMERA).shape == expected.shape
