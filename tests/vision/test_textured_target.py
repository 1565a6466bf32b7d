"""Textured squares in drawn images: where they are, how well that is known, and what is refused."""

import cv2
import numpy as np
import pytest

from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.blob_detection import gray_image
from cdpr_drake.vision.image_alignment import CORNERS, align, homography, is_square_seen, mapped
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.texture_detection import detect
from cdpr_drake.vision.texture_pictures import TEXTURES, drawn_image, texture_picture
from cdpr_drake.vision.textured_target import QUALITY, TexturedTarget

CAMERA = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))
SIZE = 0.06
TARGETS = {name: TexturedTarget(name, SIZE) for name in TEXTURES}
STONES = TARGETS["stones"]

NOISE = 3.0  # standard deviation of a pixel's gray, of 255, as a cheap camera has it
CORNER_OFFSET = 0.05  # of a corner of 90 to 130 px with such noise [px]; measured up to 0.025
FAR_OFFSET = 0.3  # of a corner of 60 px in an image of points, not of means [px]; measured 0.2
SAME = 0.01  # corners found by features and by following [px]: steps end at changes of 0.002
CHI_SQUARE = (3.0, 15.0)
"""Mean over 9 draws of a chi-square with 8 degrees of freedom: 8, standard deviation 1.3, and what
the drawing and whole gray levels add."""


def pose(position, *turn):
    return pose_from_angles(np.array(position), np.array(turn))


VIEWS = [
    pose([0.0, 0.0, 0.25], np.pi, 0.0, np.pi),
    pose([0.03, -0.02, 0.3], np.pi + 0.3, -0.2, 0.4),
    pose([-0.03, 0.03, 0.28], np.pi - 0.2, 0.35, -2.0),
]


def corners(X_CO):
    return CAMERA.project(X_CO @ STONES.points).T.ravel()


def image_of(target, k):
    """A noisy image of a target in a view."""
    image = drawn_image(target, VIEWS[k], CAMERA)
    noise = NOISE * np.random.default_rng(k).standard_normal(image.shape[:2])
    return np.clip(np.round(image + noise[:, :, None]), 0, 255).astype(np.uint8)


def offset(finding, expected):
    return np.max(np.abs(finding.marks - expected))


@pytest.fixture(scope="module")
def images():
    """Images of all textures in all views, by name and number."""
    return {(name, k): image_of(TARGETS[name], k) for name in TARGETS for k in range(len(VIEWS))}


@pytest.fixture(scope="module")
def found(images):
    """What is found in them by features."""
    return {key: TARGETS[key[0]].look(image) for key, image in images.items()}


def test_corners_are_found_to_hundredths_of_a_pixel_and_as_well_as_their_covariance_says(found):
    """Against the homography by which the image was drawn."""
    chi_squares = []
    for (name, k), finding in found.items():
        assert finding is not None, (name, k)
        assert not finding.followed
        assert offset(finding, corners(VIEWS[k])) < CORNER_OFFSET, (name, k)
        error = finding.marks - corners(VIEWS[k])
        chi_squares.append(error @ np.linalg.solve(finding.alignment.covariance, error))
    assert CHI_SQUARE[0] < np.mean(chi_squares) < CHI_SQUARE[1]


def test_poses_are_as_good_as_those_of_a_tag(found):
    """Of the same size, in the same noise, summed over the views: of one view a tag's offsets may
    cancel out."""
    tag, texture = TagTarget(0, SIZE), TARGETS["map"]
    by_tag, by_texture = np.zeros(2), np.zeros(2)
    for k, X_CO in enumerate(VIEWS):
        by_tag += pose_error(tag.solve(tag.find(image_of(tag, k)), CAMERA), X_CO)
        by_texture += pose_error(texture.solve(found["map", k].marks, CAMERA), X_CO)
    assert np.all(by_texture < by_tag)


@pytest.mark.parametrize("name", TEXTURES)
def test_it_is_followed_from_where_it_was_and_no_other_is_taken_for_it(found, images, name):
    target, image = TARGETS[name], images[name, 1]
    before = corners(VIEWS[1]) + np.array([5.0, -4.0, 6.0, -3.0, 5.0, -5.0, 4.0, -4.0])
    finding = target.look(image, before)
    assert finding.followed
    assert offset(finding, found[name, 1].marks) < SAME
    quality = dict(zip(QUALITY, target.follow(image, before)[8:], strict=True))
    assert quality["followed"] == 1.0
    assert quality["correlation"] > 0.9
    # Neither anywhere, nor where it was.
    other = next(other for other in TARGETS if other != name)
    blank = np.full((CAMERA.height, CAMERA.width, 3), 128, np.uint8)
    for wrong in (images[other, 0], blank):
        assert target.look(wrong, corners(VIEWS[0])) is None


def test_who_is_lost_is_found_again(found, images):
    """From a wrong place, from a place without any sense, and from outside the image."""
    exact = found["stones", 0].marks
    for wrong in (exact + 150.0, exact[::-1], np.full(8, np.nan), exact + 3000.0):
        finding = STONES.look(images["stones", 0], wrong)
        assert not finding.followed
        assert offset(finding, exact) < SAME


def test_what_covers_a_part_is_left_out(images):
    """A hand over a third; nothing left to go by where most is covered."""
    image, exact = images["stones", 0].copy(), corners(VIEWS[0])
    left, width = exact[::2].min(), np.ptp(exact[::2])
    image[:, int(left) : int(left + 0.33 * width)] = 60
    for before in (None, exact + 2.0):
        finding = STONES.look(image, before)
        assert finding.alignment.share < 0.9
        assert offset(finding, exact) < 3 * CORNER_OFFSET
    image[:, int(left) : int(left + 0.85 * width)] = 60
    assert STONES.look(image, exact) is None


def test_a_part_in_the_image_says_where_the_rest_is():
    target = TARGETS["print"]
    part, away = (pose([x, 0.0, 0.25], np.pi, 0.0, np.pi) for x in (0.14, 0.2))
    assert np.max(corners(part)[::2]) > CAMERA.width
    assert offset(target.look(drawn_image(target, part, CAMERA)), corners(part)) < 0.5
    assert target.look(drawn_image(target, away, CAMERA)) is None


@pytest.mark.parametrize("name", TEXTURES)
def test_far_ones_are_found_in_images_that_do_not_average(name):
    """A renderer takes a point of the picture for each pixel, and leaves out what lies between."""
    fine = Pinhole.from_view_angles(4 * 240, 4 * 180, np.radians(47.0), np.radians(36.0))
    X_CO = pose([0.01, -0.015, 0.29], np.pi + 0.1, -0.2, 0.1)
    sampled = np.ascontiguousarray(drawn_image(TARGETS[name], X_CO, fine)[2::4, 2::4])
    exact = (fine.project(X_CO @ TARGETS[name].points).T.ravel() - 2.0) / 4.0
    assert np.ptp(exact[::2]) < 70.0  # more than three pixels of the picture in one of the image
    assert offset(TARGETS[name].look(sampled), exact) < FAR_OFFSET


def test_brightness_and_contrast_are_free(found, images):
    dull = np.round(0.4 * images["map", 2] + 30.0).astype(np.uint8)
    finding = TARGETS["map"].look(dull, corners(VIEWS[2]) + 1.0)
    assert offset(finding, found["map", 2].marks) < CORNER_OFFSET


def test_a_large_image_of_it_is_read_at_half_the_resolution():
    X_CO = pose([0.0, 0.0, 0.085], np.pi, 0.05, 0.1)
    gray = gray_image(drawn_image(STONES, X_CO, CAMERA))
    guess = homography(CORNERS, corners(X_CO).reshape(4, 2).T + 2.0)
    aligned = align(STONES.picture, gray, guess)
    np.testing.assert_allclose(aligned.corners.T.ravel(), corners(X_CO), atol=2 * CORNER_OFFSET)
    np.testing.assert_allclose(mapped(aligned.H, CORNERS), aligned.corners, atol=1e-6)


def test_squares_from_behind_and_folded_ones_are_none():
    square = np.array([[0.0, 50.0, 50.0, 0.0], [0.0, 0.0, 50.0, 50.0]])
    assert is_square_seen(square, 30.0)
    assert not is_square_seen(square, 80.0)
    for wrong in (square[:, ::-1], square[:, [0, 2, 1, 3]], np.full((2, 4), np.inf)):
        assert not is_square_seen(wrong, 30.0)


@pytest.mark.parametrize("name", TEXTURES)
def test_pictures_are_the_same_every_time_and_cannot_be_written_to(name):
    picture = texture_picture(name)
    assert picture.shape == (256, 256)
    assert picture.std() > 30.0
    np.testing.assert_array_equal(picture, texture_picture.__wrapped__(name))
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0] = 0


def test_noise_has_no_features_that_fit():
    noise = np.random.default_rng(0).integers(0, 255, (240, 320)).astype(np.uint8)
    assert detect(texture_picture("stones"), cv2.GaussianBlur(noise, (0, 0), 1.5)) is None
