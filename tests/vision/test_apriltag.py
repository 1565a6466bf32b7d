"""Detection on drawn tags of known placement, pose from corners, and noise."""

import pickle

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.poses import pose_error, rotation_from_vector
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
from cdpr_drake.vision.pinhole import Pinhole

MEAN_OFFSET = 0.05  # [px]; what is left of the detector's constant offset
CORNER_OFFSET = 0.5  # [px]; a single corner on a tag drawn with pixels averaged
ALIGNED_OFFSET = 1.0  # [px]; OpenCV's refinement locks to pixels where edges follow their rows
POSE_TOLERANCE = 1e-6  # [m, rad]; OpenCV's iterations stop at about 1e-8 of a pixel
CENTER_TOLERANCE = 1e-9  # [px]; two lines cut
NOISE = 0.1  # [px]; of a corner of a good detection
NOISY_ANGLE = np.radians(
    1.0
)  # such noise on a tag of 260 px is 0.4 mrad; tilt is seen ten times less

SIZE = 0.06  # edge of the black square [m]
CAMERA = Pinhole(640, 480, 388.0, 421.0, 319.5, 239.5)
TAG = 7
SUPERSAMPLING = 8
FLIP = RotationMatrix(np.diag([1.0, -1.0, -1.0]))  # a tag that faces the camera, upright


def facing(tilt, p_CO):
    return RigidTransform(FLIP @ rotation_from_vector(np.array(tilt)), np.array(p_CO))


def corners_of(X_CO):
    return CAMERA.project(X_CO @ tag_corners(SIZE))


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


def placed(pixels, tilt, shift):
    """Corners of a tag about `pixels` wide, tilted, `shift` of the picture's centre [m at 1 m]."""
    z = SIZE * CAMERA.fx / pixels
    return corners_of(facing(tilt, (shift[0] * z, shift[1] * z, z)))


def test_the_picture_is_a_black_square_with_a_white_rim_and_the_identity_inside():
    picture = cv2.imdecode(np.frombuffer(tag_png(TAG), np.uint8), cv2.IMREAD_GRAYSCALE)
    cells = picture.shape[0] // BORDERED_CELLS
    small = picture[cells // 2 :: cells, cells // 2 :: cells]
    assert small.shape == (BORDERED_CELLS, BORDERED_CELLS)
    assert np.all(small[[0, -1]] == 255)
    assert np.all(small[:, [0, -1]] == 255)
    assert np.all(small[[1, -2], 1:-1] == 0)
    assert np.all(small[1:-1, [1, -2]] == 0)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    bits = (small[2:-2, 2:-2] > 127).astype(np.uint8)
    assert family.getDistanceToId(bits, TAG, False) == 0


def test_the_family_has_its_count_of_tags():
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    assert len(family.bytesList) == TAG_COUNT


def test_corners_run_from_upper_left_clockwise_seen_from_the_front():
    corners = tag_corners(2.0)
    np.testing.assert_array_equal(corners, [[-1, 1, 1, -1], [1, 1, -1, -1], [0, 0, 0, 0]])


@pytest.mark.parametrize("pixels", [60, 150, 260])
def test_corners_are_found_where_they_were_drawn(pixels):
    placements = [
        ((0.0, 0.0, 0.5), (0.003, -0.002)),
        ((0.3, -0.2, 0.2), (0.05, -0.03)),
        ((-0.2, 0.35, 1.0), (-0.04, 0.02)),
        ((0.1, 0.1, -2.5), (0.0, 0.0)),
    ]
    offsets = []
    for tilt, shift in placements:
        corners = placed(pixels, tilt, shift)
        found = TagFinder([TAG]).find(draw(corners))[TAG]
        offsets.append(found - corners)
        assert np.max(np.linalg.norm(offsets[-1], axis=0)) < CORNER_OFFSET
    assert np.max(np.abs(np.mean(offsets, axis=(0, 2)))) < MEAN_OFFSET


@pytest.mark.parametrize("pixels", [60, 150, 260])
@pytest.mark.parametrize("quarter_turns", [0, 1, 2, 3])
def test_corners_of_a_tag_along_the_pixels_are_found_less_well(pixels, quarter_turns):
    corners = placed(pixels, (0.0, 0.0, quarter_turns * np.pi / 2.0), (0.003, -0.002))
    found = TagFinder([TAG]).find(draw(corners))[TAG]
    assert np.max(np.linalg.norm(found - corners, axis=0)) < ALIGNED_OFFSET


def test_an_image_with_a_fourth_channel_gives_the_same_corners():
    rgb = draw(placed(150, (0.1, 0.2, 0.3), (0.0, 0.0)))
    rgba = np.dstack([rgb, np.full(rgb.shape[:2], 255, np.uint8)])
    finder = TagFinder([TAG])
    np.testing.assert_array_equal(finder.find(rgba)[TAG], finder.find(rgb)[TAG])


def test_a_finder_gets_into_another_process():
    rgb = draw(placed(150, (0.1, 0.2, 0.3), (0.0, 0.0)))
    finder = TagFinder([TAG, 3])
    other = pickle.loads(pickle.dumps(finder))
    np.testing.assert_array_equal(other.find(rgb)[TAG], finder.find(rgb)[TAG])
    assert other.find(rgb).keys() == {TAG}


def test_another_tag_is_not_taken_for_the_one_looked_for():
    rgb = draw(placed(150, (0.1, 0.2, 0.3), (0.0, 0.0)), tag_id=8)
    assert not TagFinder([TAG]).find(rgb)
    assert list(TagFinder([TAG, 8]).find(rgb)) == [8]


@pytest.mark.parametrize("gray", [0, 128, 255])
def test_nothing_is_found_in_an_empty_image(gray):
    assert not TagFinder([TAG]).find(np.full((480, 640, 3), gray, np.uint8))


def test_a_tag_cut_by_the_rim_is_not_found():
    corners = placed(150, (0.0, 0.0, 0.0), (0.0, 0.0))
    corners[0] -= np.mean(corners[0])
    assert not TagFinder([TAG]).find(draw(corners))


def pose_of(corners, size=SIZE):
    """The pose of a tag from its corners, shape (2, 4)."""
    return TagTarget(TAG, size).solve(corners.T.ravel(), CAMERA)


def tilted(direction, tilt, turn, x, y, z):
    axis = np.array([np.cos(direction), np.sin(direction), 0.0])
    R = FLIP @ rotation_from_vector(tilt * axis) @ RotationMatrix.MakeZRotation(turn)
    return RigidTransform(R, [x * z, y * z, z])


# Tilted any way up to 57 degrees, turned any way, in the field of view and a bit beyond.
poses = st.builds(
    tilted,
    st.floats(-3.1, 3.1),
    st.floats(0.0, 1.0),
    st.floats(-3.1, 3.1),
    st.floats(-0.4, 0.4),
    st.floats(-0.3, 0.3),
    st.floats(0.08, 0.6),
)


@given(poses)
def test_the_pose_comes_back_from_projected_corners(X_CO):
    found = pose_of(corners_of(X_CO))
    assert found is not None
    assert max(pose_error(X_CO, found)) < POSE_TOLERANCE


@pytest.mark.parametrize(
    "X_CO",
    [
        facing((0.0, 0.0, 0.0), (0.0, 0.0, 0.09)),  # a half turn, which IPPE divides by
        facing((0.0, 0.0, 0.0), (0.0, 0.03125, 0.25)),
        facing((1e-8, 0.0, 0.0), (0.0, 0.0, 0.09)),
        tilted(0.5, 0.75, 0.5, 0.0, 0.0, 0.5),  # tilted about its edge, where IPPE gives NaN
    ],
)
def test_poses_where_ippe_alone_fails_come_back(X_CO):
    found = pose_of(corners_of(X_CO))
    assert found is not None
    assert max(pose_error(X_CO, found)) < POSE_TOLERANCE


def test_noise_tilts_a_frontal_tag_little():
    """IPPE alone would tilt it by sqrt(2 * 0.1 px / 260 px), 1.6 degrees."""
    X_CO = facing((0.0, 0.0, 0.0), (0.0, 0.0, 0.09))
    rng = np.random.default_rng(0)
    corners = corners_of(X_CO)
    for _ in range(200):
        found = pose_of(corners + NOISE * rng.standard_normal((2, 4)))
        assert pose_error(X_CO, found)[1] < NOISY_ANGLE


@settings(max_examples=30)
@given(poses)
def test_a_tag_twice_as_large_is_twice_as_far(X_CO):
    corners = corners_of(X_CO)
    near = pose_of(corners)
    far = pose_of(corners, 2.0 * SIZE)
    doubled = RigidTransform(near.rotation(), 2.0 * near.translation())
    assert max(pose_error(doubled, far)) < POSE_TOLERANCE


def test_a_fourth_channel_changes_nothing():
    rgba = np.random.default_rng(0).integers(0, 256, (97, 131, 4), dtype=np.uint8)
    cut = cv2.cvtColor(np.ascontiguousarray(rgba[:, :, :3]), cv2.COLOR_RGB2GRAY)
    np.testing.assert_array_equal(gray_image(rgba), cut)
    np.testing.assert_array_equal(gray_image(rgba[:, :, :3]), cut)
