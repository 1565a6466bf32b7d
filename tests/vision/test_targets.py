"""Tags in drawn images, poses of planes against OpenCV's solvers, and windows of images."""

import pickle

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import pose_error, pose_from_angles, rotation_from_vector
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.cameras.targets import TARGETS, TargetSettings
from cdpr_drake.vision.apriltags import (
    BORDERED_CELLS,
    TAG_CELLS,
    TAG_COUNT,
    TagFinder,
    TagTarget,
    tag_corners,
    tag_png,
)
from cdpr_drake.vision.blob_detection import gray_image
from cdpr_drake.vision.image_window import (
    EDGE_SHARE,
    GRID,
    MARGIN,
    ImageWindow,
    expected_window,
    target_box,
    union,
    whole_image,
    with_principal_point,
)
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import pose_from_points
from tests.vision.vision_cases import FLIP, facing

MEAN_OFFSET = 0.05  # [px]; what is left of the detector's constant offset
CORNER_OFFSET = 0.5  # [px]; a single corner on a tag drawn with pixels averaged
ALIGNED_OFFSET = 1.0  # [px]; OpenCV's refinement locks to pixels where edges follow their rows
EXACT = 1e-9  # of a pose from exact images [m, rad]: rounding of pixels over a square of 60 px
POSE = 1e-6  # [m, rad]; head on, the image says of a small tilt only its square
NOISY_ANGLE = np.radians(1.0)  # 0.1 px on 260 px is 0.4 mrad; tilt is seen ten times less
AT_REST = 1e-10
"""Of a step of Gauss and Newton from the pose where the sum of squares is least [m, rad]. Rounding
of pixels gives 1e-12; where the sum of squares falls no more by its digits it is 1e-8."""
NO_HIGHER = 1e-9  # share of a sum of squares which OpenCV's steps leave just as uncertain

SIZE, TAG = 0.06, 7  # edge of the black square [m]
CAMERA = Pinhole(640, 480, 388.0, 421.0, 319.5, 239.5)
SQUARE = tag_corners(SIZE)
SUPERSAMPLING = 8


def draw(corners, tag_id=TAG):
    """RGB picture with the tag's black square at corners (u, v), shape (2, 4) [px], on gray.

    Each pixel is the mean of 8 x 8 samples. Pixel u spans u - 0.5 to u + 0.5, so that u lies at
    (u + 0.5) * 8 - 0.5 among the samples.
    """
    picture = cv2.imdecode(np.frombuffer(tag_png(tag_id), np.uint8), cv2.IMREAD_GRAYSCALE)
    cell = picture.shape[0] / BORDERED_CELLS
    first, last = cell - 0.5, cell * (1 + TAG_CELLS) - 0.5
    square = np.array([[first, first], [last, first], [last, last], [first, last]])
    target = (corners.T + 0.5) * SUPERSAMPLING - 0.5
    H = cv2.getPerspectiveTransform(square.astype(np.float32), target.astype(np.float32))
    size = (CAMERA.width * SUPERSAMPLING, CAMERA.height * SUPERSAMPLING)
    samples = cv2.warpPerspective(picture, H, size, borderValue=128)
    gray = cv2.resize(samples, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(gray, cv2.COLOR_GRAY2RGB)


def corners_of(X_CO):
    return CAMERA.project(X_CO @ SQUARE)


def placed(pixels, tilt, shift=(0.0, 0.0)):
    """Corners of a tag about `pixels` wide, tilted, `shift` of the picture's centre [m at 1 m]."""
    z = SIZE * CAMERA.fx / pixels
    return corners_of(facing(tilt, (shift[0] * z, shift[1] * z, z)))


# Tags.


def test_the_picture_is_a_black_square_with_a_white_rim_and_the_identity_inside():
    picture = cv2.imdecode(np.frombuffer(tag_png(TAG), np.uint8), cv2.IMREAD_GRAYSCALE)
    cells = picture.shape[0] // BORDERED_CELLS
    small = picture[cells // 2 :: cells, cells // 2 :: cells]
    ring = np.pad(np.pad(np.ones((6, 6)), 1), 1, constant_values=255)
    assert small.shape == (BORDERED_CELLS, BORDERED_CELLS)
    np.testing.assert_array_equal(small[ring != 1], ring[ring != 1])
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    assert family.getDistanceToId((small[2:-2, 2:-2] > 127).astype(np.uint8), TAG, False) == 0
    assert len(family.bytesList) == TAG_COUNT
    # Corners run from upper left clockwise, seen from the front.
    np.testing.assert_array_equal(tag_corners(2.0), [[-1, 1, 1, -1], [1, 1, -1, -1], [0] * 4])


@pytest.mark.parametrize("pixels", [60, 150, 260])
def test_corners_are_found_where_they_were_drawn(pixels):
    """Less well where edges follow rows of pixels."""
    offsets = []
    for tilt, shift in (
        ((0.0, 0.0, 0.5), (0.003, -0.002)), ((0.3, -0.2, 0.2), (0.05, -0.03)),
        ((-0.2, 0.35, 1.0), (-0.04, 0.02)), ((0.1, 0.1, -2.5), (0.0, 0.0)),
    ):  # fmt: skip
        corners = placed(pixels, tilt, shift)
        offsets.append(TagFinder([TAG]).find(draw(corners))[TAG] - corners)
    assert np.max(np.linalg.norm(offsets, axis=1)) < CORNER_OFFSET
    assert np.max(np.abs(np.mean(offsets, axis=(0, 2)))) < MEAN_OFFSET
    for quarter_turns in range(4):
        corners = placed(pixels, (0.0, 0.0, quarter_turns * np.pi / 2.0), (0.003, -0.002))
        offset = TagFinder([TAG]).find(draw(corners))[TAG] - corners
        assert np.max(np.linalg.norm(offset, axis=0)) < ALIGNED_OFFSET, quarter_turns


def test_a_fourth_channel_changes_nothing_and_a_finder_gets_into_another_process():
    rgb = draw(placed(150, (0.1, 0.2, 0.3)))
    rgba, finder = np.dstack([rgb, np.full(rgb.shape[:2], 255, np.uint8)]), TagFinder([TAG, 3])
    for each, image in ((finder, rgba), (pickle.loads(pickle.dumps(finder)), rgb)):
        tags = each.find(image)
        assert tags.keys() == {TAG}
        np.testing.assert_array_equal(tags[TAG], finder.find(rgb)[TAG])
    rgba = np.random.default_rng(0).integers(0, 256, (97, 131, 4), dtype=np.uint8)
    cut = cv2.cvtColor(np.ascontiguousarray(rgba[:, :, :3]), cv2.COLOR_RGB2GRAY)
    for image in (rgba, rgba[:, :, :3]):
        np.testing.assert_array_equal(gray_image(image), cut)


def test_no_other_tag_no_empty_image_and_no_tag_at_the_rim_is_taken_for_one():
    other = draw(placed(150, (0.1, 0.2, 0.3)), tag_id=8)
    assert list(TagFinder([TAG, 8]).find(other)) == [8]
    corners = placed(150, (0.0, 0.0, 0.0))
    corners[0] -= np.mean(corners[0])
    empty = (np.full((480, 640, 3), gray, np.uint8) for gray in (0, 128, 255))
    for number, image in enumerate((other, draw(corners), *empty)):
        assert not TagFinder([TAG]).find(image), number


# Poses of planes.


def pose_of(corners, size=SIZE):
    """The pose of a tag from its corners, shape (2, 4)."""
    return TagTarget(TAG, size).solve(corners.T.ravel(), CAMERA)


def tilted(direction, tilt, turn, x, y, z):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    R = FLIP @ rotation_from_vector(tilt * axis) @ RotationMatrix.MakeZRotation(turn)
    return RigidTransform(R, [x * z, y * z, z])


# Tilted any way up to 57 degrees, turned any way, in the field of view and a bit beyond.
poses = st.builds(
    tilted, st.floats(-3.1, 3.1), st.floats(0.0, 1.0), st.floats(-3.1, 3.1),
    st.floats(-0.4, 0.4), st.floats(-0.3, 0.3), st.floats(0.08, 0.6),
)  # fmt: skip


@given(poses)
def test_the_pose_comes_back_from_projected_corners_and_twice_the_size_is_twice_as_far(X_CO):
    assert max(pose_error(X_CO, pose_of(corners_of(X_CO)))) < POSE
    doubled = RigidTransform(X_CO.rotation(), 2.0 * X_CO.translation())
    assert max(pose_error(doubled, pose_of(corners_of(X_CO), 2.0 * SIZE))) < 2.0 * POSE


@pytest.mark.parametrize(
    ("X_CO", "angle"),
    [
        (facing([0.0, 0.0, 0.0], [0.0, 0.0, 0.2]), POSE),
        (facing([0.0, 0.0, 0.0], [0.04, -0.03, 0.3]), POSE),
        (facing([0.0, 0.0, np.pi], [0.01, 0.0, 0.2]), POSE),
        (facing([0.7, -0.4, 2.0], [0.03, 0.02, 0.25]), EXACT),
        (facing([1.1, 0.0, 0.0], [0.0, -0.02, 0.4]), EXACT),
        (facing([0.0, 0.0, 0.0], [0.0, 0.0, 0.09]), POSE),  # a half turn, which IPPE divides by
        (facing([0.0, 0.0, 0.0], [0.0, 0.03125, 0.25]), POSE),
        (facing([1e-8, 0.0, 0.0], [0.0, 0.0, 0.09]), POSE),
        (tilted(0.5, 0.75, 0.5, 0.0, 0.0, 0.5), POSE),  # tilted about its edge: NaN by IPPE
    ],
)
@pytest.mark.parametrize("shift", [0.0, 0.02])
def test_an_exact_image_gives_the_pose_also_where_ippe_alone_fails(X_CO, angle, shift):
    points = SQUARE + np.array([[shift], [2.0 * shift], [0.0]])
    errors = pose_error(pose_from_points(points, CAMERA.project(X_CO @ points), CAMERA), X_CO)
    assert errors[0] < EXACT
    assert errors[1] < angle


def test_noise_tilts_a_frontal_tag_little():
    """IPPE alone would tilt it by sqrt(2 * 0.1 px / 260 px), 1.6 degrees."""
    X_CO = facing([0.0, 0.0, 0.0], [0.0, 0.0, 0.09])
    corners = corners_of(X_CO)
    for noise in 0.1 * np.random.default_rng(0).standard_normal((200, 2, 4)):
        assert pose_error(X_CO, pose_of(corners + noise))[1] < NOISY_ANGLE


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


def test_no_pose_of_opencv_fits_noisy_images_better_and_it_is_the_minimum():
    """To more than the sum of squares tells."""
    random = np.random.default_rng(0)
    for number in range(100):
        points = SQUARE
        if number % 3 == 0:
            count = random.integers(5, 12)
            points = np.vstack([random.uniform(-0.05, 0.08, (2, count)), np.zeros(count)])
        tilt = [0.0, 1e-6, 0.1, 0.4, 0.7][number % 5] * random.normal(size=3)
        place = [*random.uniform(-0.05, 0.05, 2), random.uniform(0.1, 0.6)]
        turn = RotationMatrix.MakeZRotation(random.uniform(-4.0, 4.0))
        uv = CAMERA.project(facing(tilt, place) @ RigidTransform(turn, np.zeros(3)) @ points)
        if not np.all(np.isfinite(uv)):
            continue
        uv += 0.3 * random.standard_normal(uv.shape)
        X_CO = pose_from_points(points, uv, CAMERA)
        assert squares(X_CO, points, uv) <= by_opencv(points, uv) * (1.0 + NO_HIGHER), number
        assert np.linalg.norm(last_step(X_CO, points, uv)) < AT_REST, number


def test_what_has_no_pose_gives_none_and_points_in_space_have_their_own_solver():
    line = np.array([[0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0], np.zeros(4)]) * 0.01
    X_CO = facing([0.3, 0.0, 0.0], [0.0, 0.0, 0.2])
    assert pose_from_points(line, CAMERA.project(X_CO @ line), CAMERA) is None
    assert pose_from_points(SQUARE[:, :3], np.zeros((2, 3)), CAMERA) is None
    sharp = Pinhole(640, 480, 600.0, 610.0, 319.5, 239.5)
    assert pose_from_points(SQUARE, np.full((2, 4), 300.0), sharp) is None
    space = np.hstack([SQUARE, SQUARE[:, :2] + np.array([[0.0], [0.0], [0.02]])])
    X_CO = facing([0.4, 0.2, 0.0], [0.01, 0.0, 0.25])
    solved = pose_from_points(space, CAMERA.project(X_CO @ space), CAMERA)
    assert pose_error(solved, X_CO)[0] < 1e-6


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


# Windows.

PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))
NOWHERE = np.full(4, np.nan)
BOX = np.array([170.0, 90.0, 436.0, 360.0])


def holds(window, box, margin=MARGIN):
    """Whether a window has a box (left, top, right, bottom) and a margin around it."""
    first = np.array([window.u, window.v])
    last = first + np.array([window.width, window.height])
    return bool(np.all(box[:2] - margin >= first) and np.all(box[2:] + margin < last))


def test_a_window_s_camera_sees_the_same_pixels():
    window = ImageWindow(160, 64, 256, 208)
    p_CK = np.random.default_rng(1).uniform([-0.1, -0.1, 0.5], [0.1, 0.1, 1.0], (20, 3)).T
    part = window.pinhole(PINHOLE).project(p_CK) + np.array([[window.u], [window.v]])
    np.testing.assert_allclose(part, PINHOLE.project(p_CK), atol=1e-9)
    picture = np.random.default_rng(2).integers(0, 255, (480, 640, 4))
    cut = window.cut(picture[48:348, 96:496], ImageWindow(96, 48, 400, 300))
    assert np.array_equal(cut, picture[64:272, 160:416])
    assert cut.flags.c_contiguous


@given(
    st.floats(0.0, 440.0), st.floats(0.0, 330.0), st.floats(20.0, 90.0), st.floats(-60.0, 60.0),
    st.floats(-40.0, 40.0), st.floats(-3.0, 3.0), st.floats(0.0, 1.5),
)  # fmt: skip
def test_what_moves_grows_stops_or_speeds_up_stays_in_the_window(u, v, size, du, dv, grow, share):
    """By as much as half of its last motion beside what that promises; as far as the image goes.
    What turns back is looked for in the whole image."""
    before = np.array([u, v, u + size, v + size])
    move = np.tile([du, dv], 2) + grow * np.array([-1.0, -1.0, 1.0, 1.0])
    window = expected_window(before + move, before, PINHOLE)
    end = np.array([639.0, 479.0]) - MARGIN
    for box in (before + move, before + (1.0 + share) * move):
        cut_off = np.concatenate([np.maximum(box[:2], MARGIN), np.minimum(box[2:], end)])
        assert holds(window, cut_off)
    assert window.u % GRID == window.v % GRID == 0


def test_a_window_is_no_larger_than_motion_asks_for():
    before, move = np.array([200.0, 150.0, 260.0, 220.0]), np.tile([40.0, -30.0], 2)
    moving = expected_window(before + move, before, PINHOLE)
    assert moving.width * moving.height < 0.3 * PINHOLE.width * PINHOLE.height
    assert not holds(moving, np.tile(before[:2], 2), 0.0)  # what turns back
    resting, unknown = (expected_window(BOX, before, PINHOLE) for before in (BOX, NOWHERE))
    assert 0 <= resting.width - 266 - 2 * MARGIN <= 2 * GRID
    assert 0 <= resting.height - 270 - 2 * MARGIN <= 2 * GRID
    assert union(resting, unknown) == unknown
    assert holds(unknown, BOX, MARGIN + EDGE_SHARE * 270.0)


def test_windows_end_with_the_image_and_there_is_none_outside_of_it():
    corner = expected_window(np.array([600.0, 440.0, 700.0, 500.0]), NOWHERE, PINHOLE)
    assert corner.u + corner.width == PINHOLE.width
    assert corner.v + corner.height == PINHOLE.height
    for box in (np.array([700.0, 10.0, 750.0, 60.0]), NOWHERE):
        assert expected_window(box, NOWHERE, PINHOLE) is None
    large = np.array([-50.0, -50.0, 700.0, 500.0])
    assert expected_window(large, NOWHERE, PINHOLE) == whole_image(PINHOLE)


@pytest.mark.parametrize(("u", "v"), [(0, 0), (512, 0), (0, 384), (560, 400), (304, 224)])
def test_what_drake_draws_has_the_principal_point_inside(u, v):
    window = ImageWindow(u, v, 64, 48)
    drawn = with_principal_point(window, PINHOLE)
    assert union(drawn, window) == drawn
    camera = drawn.pinhole(PINHOLE)
    assert 0.0 < camera.cx + 0.5 < camera.width
    assert 0.0 < camera.cy + 0.5 < camera.height
    assert union(drawn, whole_image(PINHOLE)) == whole_image(PINHOLE)


def test_a_box_has_the_outline_and_none_is_behind_the_camera():
    target = TagTarget(0, 0.1)
    X_CO = pose_from_angles(np.array([0.05, 0.0, 0.5]), np.array([np.pi + 0.3, -0.2, 0.4]))
    uv = PINHOLE.project(X_CO @ target.points)
    box = target_box(target, X_CO, PINHOLE)
    assert np.array_equal(box, [*np.min(uv, axis=1), *np.max(uv, axis=1)])
    assert np.all(np.isnan(target_box(target, RigidTransform([0.0, 0.0, -0.5]), PINHOLE)))
