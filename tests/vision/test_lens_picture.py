"""Pictures through a lens show what lies in the direction of each pixel; what spoils images."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from cdpr_drake.errors import LensDistortionError
from cdpr_drake.vision.image_flaws import ImageFlaws
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.lens_picture import lens_map, lens_picture, without_lens
from cdpr_drake.vision.pinhole import Pinhole

GRAY = 1.5
"""Of 255: rounding to whole grays, twice, and what lies between four pixels of a smooth picture."""

NOISE_SHARE = 0.02  # of a standard deviation, from 3e5 numbers: more than six times its own
CAMERA = Pinhole(160, 120, 110.0, 112.0, 78.0, 61.0)
LENSES = {
    "barrel": LensDistortion("brown_conrady", (-0.25, 0.08, 1e-3, -1e-3)),
    "pincushion": LensDistortion("brown_conrady", (0.2,)),
    "fisheye": LensDistortion("fisheye", (-0.02, 0.003)),
}


def gray_of(x, y):
    """A smooth scene by the direction at unit focal length."""
    return 128.0 + 60.0 * np.sin(6.0 * x) + 50.0 * np.cos(5.0 * y)


def scene(camera):
    """What a pinhole sees of it, 8 bits."""
    v, u = np.mgrid[: camera.height, : camera.width]
    gray = gray_of((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy)
    return np.rint(gray).astype(np.uint8)


@pytest.mark.parametrize("name", LENSES)
def test_a_picture_through_a_lens_shows_what_opencv_says(name):
    """Directions of pixels by OpenCV's own iterations."""
    lens = LENSES[name]
    camera = replace(CAMERA, distortion=lens)
    image = lens_picture(scene(without_lens(camera)), camera)
    assert image.shape == (120, 160)
    v, u = np.mgrid[:120, :160].astype(float)
    at = np.stack([u.ravel(), v.ravel()], axis=1).reshape(-1, 1, 2)
    k = np.array(lens.coefficients + (0.0,) * (4 - len(lens.coefficients)))[:4]
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12)
    if lens.kind == "fisheye":
        xy = cv2.fisheye.undistortPoints(at, CAMERA.matrix(), k, criteria=criteria)
    else:
        xy = cv2.undistortPoints(at, CAMERA.matrix(), k, criteria=criteria)
    x, y = xy.reshape(-1, 2).T
    expected = gray_of(x, y).reshape(120, 160)
    assert np.max(np.abs(image - expected)) < GRAY


def test_maps_are_made_once_and_say_what_they_lose():
    barrel = lens_map(replace(CAMERA, distortion=LENSES["barrel"]))
    assert lens_map(replace(CAMERA, distortion=LENSES["barrel"])) is barrel
    assert barrel.scale[0] == pytest.approx(1.0, abs=0.01)  # on the axis the lens's own
    assert barrel.scale[1] > 1.2
    assert barrel.wide.width > CAMERA.width
    pincushion = lens_map(replace(CAMERA, distortion=LENSES["pincushion"]))
    assert pincushion.scale[0] < 0.9


def test_a_field_that_is_too_wide_is_drawn_smaller_or_refused():
    wide = replace(CAMERA, fx=74.0, fy=75.0, distortion=LensDistortion("fisheye", ()))
    drawn = lens_map(wide)
    assert drawn.wide.width * drawn.wide.height < 6.2 * 160 * 120
    assert drawn.scale[0] < 0.9
    widest = replace(
        CAMERA, fx=65.5, fy=65.5, cx=79.5, cy=59.5, distortion=LensDistortion("fisheye", ())
    )
    with pytest.raises(LensDistortionError, match=r"at least 0\.25, or a"):
        lens_map(widest)
    with pytest.raises(LensDistortionError, match="beyond what it is valid for"):
        lens_map(replace(CAMERA, distortion=LensDistortion("brown_conrady", (-0.9,))))


def test_rows_of_a_rolling_shutter_are_exposed_one_after_the_other():
    flaws = ImageFlaws(readout=0.02, renders=4)
    np.testing.assert_allclose(flaws.instants, [-0.0175, -0.0125, -0.0075, -0.0025], atol=1e-15)
    pictures = np.stack([np.full((8, 3, 4), 10 * k, np.uint8) for k in range(4)])
    image = flaws.expose(pictures)
    np.testing.assert_array_equal(image[:, 0, 0], [0, 0, 10, 10, 20, 20, 30, 30])


def test_exposure_shows_the_mean_of_its_time():
    flaws = ImageFlaws(exposure=0.01, renders=5)
    pictures = np.stack([np.full((4, 2, 4), 50 * k, np.uint8) for k in range(5)])
    np.testing.assert_array_equal(flaws.expose(pictures), np.full((4, 2, 4), 100))
    assert np.all(flaws.instants < 0.0)


def test_every_row_is_exposed_once_and_in_its_time():
    flaws = ImageFlaws(exposure=0.004, readout=0.016, renders=20)
    shares = flaws.shares(33)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)
    middles = shares.T @ flaws.instants
    ends = -0.016 * (1.0 - np.arange(33) / 32.0)
    assert np.max(np.abs(middles - (ends - 0.002))) <= 0.5 * flaws.step + 1e-12


def test_noise_has_its_size_and_its_seed():
    flaws, gray = ImageFlaws(noise=4.0), np.full((300, 400, 4), 120, np.uint8)
    image = flaws.spoil(gray, np.random.default_rng(5))
    again = flaws.spoil(gray, np.random.default_rng(5))
    np.testing.assert_array_equal(image, again)
    off = image[..., :3].astype(float) - 120.0
    # Rounding adds a twelfth to the variance.
    assert np.std(off) == pytest.approx(np.sqrt(16.0 + 1.0 / 12.0), rel=NOISE_SHARE)
    np.testing.assert_array_equal(image[..., 3], 120)
    np.testing.assert_array_equal(gray, 120)


def test_defocus_spreads_an_edge_by_its_size():
    edge = np.zeros((40, 80, 4), np.uint8)
    edge[:, 40:] = 255
    image = ImageFlaws(defocus=3.0).spoil(edge, np.random.default_rng(0))
    rise = np.diff(image[20, :, 0].astype(float))
    at = np.arange(79)
    middle = np.sum(at * rise) / np.sum(rise)
    spread = np.sqrt(np.sum((at - middle) ** 2 * rise) / np.sum(rise))
    assert spread == pytest.approx(3.0, rel=0.05)


def test_no_flaws_are_no_change():
    picture = np.random.default_rng(1).integers(0, 255, (5, 6, 4)).astype(np.uint8)
    nothing = ImageFlaws()
    assert not nothing.moves
    np.testing.assert_array_equal(nothing.instants, [0.0])
    np.testing.assert_array_equal(nothing.expose(picture[None]), picture)
    assert nothing.spoil(picture, np.random.default_rng(0)) is picture
