"""Projection, lenses and pictures through them, against OpenCV; what spoils images."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drake.vision.image_flaws import ImageFlaws
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.lens_picture import lens_map, lens_picture, without_lens
from cdpr_drake.vision.pinhole import Pinhole
from tests.vision.vision_cases import LENSES, by_opencv, directions_by_opencv

PIXELS = 1e-9  # [px]; products of numbers up to 1e4 px, and the same formulas
RETURN = 1e-9  # [-]; well inside the field, where the slope is not small
SLOPE = 1e-8  # [-]; central differences over `STEP`
STEP = 1e-6
GRAY = 1.5  # of 255: rounding twice, and what lies between four pixels of a smooth picture
NOISE_SHARE = 0.02  # of a standard deviation, from 3e5 numbers: more than six times its own
K = np.array([[700.0, 0.0, 331.5], [0.0, 640.0, 225.0], [0.0, 0.0, 1.0]])
CAMERA = Pinhole(640, 480, 388.0, 421.0, 310.0, 245.0)
SMALL = Pinhole(160, 120, 110.0, 112.0, 78.0, 61.0)
PLAIN = Pinhole.from_view_angles(640, 480, 0.9, 0.7)
EDGE = np.linspace(-1.0, 1.0, 101)

every_lens = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


# Pinholes.


@given(
    st.integers(1, 4000), st.integers(1, 4000), st.floats(0.05, 3.0), st.floats(0.05, 3.0),
    st.floats(0.1, 10.0),
)  # fmt: skip
def test_rays_at_the_half_view_angles_meet_the_rim(width, height, horizontal, vertical, z):
    """Pixel 0 reaches from -0.5 to 0.5, so the rim is at -0.5 and at width - 0.5."""
    camera = Pinhole.from_view_angles(width, height, horizontal, vertical)
    x, y = z * np.tan(horizontal / 2.0), z * np.tan(vertical / 2.0)
    uv = camera.project(np.array([[-x, x], [-y, y], [z, z]]))
    rim = [[-0.5, width - 0.5], [-0.5, height - 0.5]]
    np.testing.assert_allclose(uv, rim, rtol=0.0, atol=PIXELS)
    assert (camera.width, camera.height) == (width, height)
    assert (camera.cx, camera.cy) == ((width - 1) / 2.0, (height - 1) / 2.0)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.1, 5.0), st.floats(0.1, 10.0))
def test_projection_is_the_matrix_up_to_scale(x, y, z, scale):
    p = np.array([[x], [y], [z]])
    u, v, w = (CAMERA.matrix() @ p)[:, 0]
    for points in (p, scale * p):
        np.testing.assert_allclose(CAMERA.project(points), [[u / w], [v / w]], atol=PIXELS)


def test_right_is_right_down_is_down_and_behind_is_nowhere():
    points = np.array([[0.0, 0.1, 0.1, 0.1], [0.0, 0.2, 0.0, 0.0], [2.0, 1.0, 0.0, -1.0]])
    uv = CAMERA.project(points)
    np.testing.assert_allclose(uv[:, :2], [[310.0, 310.0 + 38.8], [245.0, 245.0 + 84.2]])
    assert np.all(np.isnan(uv[:, 2:]))
    assert not CAMERA.sees(uv[:, 3:])


@pytest.mark.parametrize(
    ("uv", "border", "inside"),
    [
        ((0.0, 0.0), 0.0, True), ((-0.49, -0.49), 0.0, True), ((639.49, 479.49), 0.0, True),
        ((-0.5, 100.0), 0.0, False), ((639.5, 100.0), 0.0, False), ((100.0, -0.5), 0.0, False),
        ((100.0, 479.5), 0.0, False), ((np.nan, 100.0), 0.0, False), ((9.6, 9.6), 10.0, True),
        ((629.4, 469.4), 10.0, True), ((9.5, 100.0), 10.0, False), ((629.5, 100.0), 10.0, False),
        ((100.0, 9.5), 10.0, False), ((100.0, 469.5), 10.0, False),
    ],
)  # fmt: skip
def test_a_point_is_seen_up_to_the_rim_and_all_are_where_each_is(uv, border, inside):
    points = np.array([[20.0, uv[0]], [20.0, uv[1]]])
    assert CAMERA.sees(points[:, 1:], border) is inside
    assert CAMERA.sees(points, border) is inside


# Lenses.


def rays(lens, share=0.9, count=400):
    """Random points at unit focal length within a share of the field that an image may have."""
    random = np.random.default_rng(3)
    radius = min(share * lens.valid_radius, 2.0)
    r, angle = radius * np.sqrt(random.uniform(0.0, 1.0, count)), random.uniform(0, 6.3, count)
    return np.array([r * np.cos(angle), r * np.sin(angle)])


@every_lens
def test_pixels_are_those_of_opencv_and_points_come_back(lens):
    xy, middle = rays(lens), np.zeros((2, 1))
    image = lens.distort(xy)
    uv = K[:2, :2] @ image + K[:2, 2:]
    np.testing.assert_allclose(uv, by_opencv(lens, xy, K), rtol=0.0, atol=PIXELS)
    np.testing.assert_allclose(lens.undistort(image), xy, rtol=0.0, atol=RETURN)
    # The axis stays the axis, and nothing comes of nothing.
    np.testing.assert_array_equal(lens.distort(middle), middle)
    np.testing.assert_array_equal(lens.undistort(middle), middle)
    np.testing.assert_array_equal(lens.jacobian([0.0, 0.0]), np.eye(2))
    for nothing in (np.nan, np.inf):
        assert np.all(np.isnan(lens.undistort(np.full((2, 1), nothing))))


@every_lens
def test_the_jacobian_is_that_of_finite_differences(lens):
    for point in rays(lens, count=30).T:
        around = point[:, None] + STEP * np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
        u = lens.distort(around)
        differences = np.column_stack([u[:, 0] - u[:, 1], u[:, 2] - u[:, 3]]) / (2.0 * STEP)
        np.testing.assert_allclose(lens.jacobian(point), differences, rtol=0.0, atol=SLOPE)


@settings(deadline=None, max_examples=50)
@given(
    st.floats(-0.6, 0.6), st.floats(-0.3, 0.3), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01),
    st.floats(-0.1, 0.1), st.floats(0.0, 6.28), st.floats(0.0, 0.95),
)  # fmt: skip
def test_any_lens_gives_points_of_its_field_back(k1, k2, p1, p2, k3, angle, share):
    lens = LensDistortion("brown_conrady", (k1, k2, p1, p2, k3))
    r = share * min(lens.valid_radius, 3.0)
    point = r * np.array([[np.cos(angle)], [np.sin(angle)]])
    image = lens.distort(point)
    back = lens.undistort(image)
    # Near the rim the slope is small, so that the image is what can be compared.
    np.testing.assert_allclose(lens.distort(back), image, rtol=1e-10, atol=1e-10)
    smallest = np.linalg.eigvalsh(lens.jacobian(point[:, 0]))[0]
    np.testing.assert_allclose(back, point, rtol=0.0, atol=1e-9 / smallest)


def test_a_radial_field_ends_where_the_radius_turns_back():
    """Of r - c r^3 the radius turns at r = 1 / sqrt(3 c), whose image is two thirds of it."""
    c = 0.4
    lens, turn = LensDistortion("brown_conrady", (-c,)), 1.0 / np.sqrt(3.0 * c)
    assert lens.valid_radius == pytest.approx(turn, rel=1e-9)
    assert np.all(np.isnan(lens.distort(np.array([[1.001 * turn], [0.0]]))))
    for share, valid in ((1.0001, False), (0.9999, True)):
        back = lens.undistort(np.array([[share * 2.0 / 3.0 * turn], [0.0]]))
        assert np.all(np.isfinite(back)) == valid


def test_tangential_parts_end_the_field_where_a_determinant_vanishes():
    """In the field every determinant is positive; on its rim the least one is zero."""
    lens = LensDistortion("brown_conrady", (-0.2, 0.0, 0.03, 0.05))
    assert lens.valid_radius < LensDistortion("brown_conrady", (-0.2,)).valid_radius
    angles = np.linspace(0.0, 2.0 * np.pi, 2001)
    rim = (1.0 - 1e-9) * lens.valid_radius * np.array([np.cos(angles), np.sin(angles)])
    on_rim, inside = (
        min(np.linalg.det(lens.jacobian(share * point)) for point in rim.T) for share in (1.0, 0.99)
    )
    assert on_rim == pytest.approx(0.0, abs=1e-4)
    assert inside > 0.0


def test_an_equidistant_fisheye_sees_nearly_a_half_space():
    angle = np.radians(85.0)
    image = LENSES["equidistant"].distort(np.array([[0.0], [np.tan(angle)]]))
    np.testing.assert_allclose(image[:, 0], [0.0, angle], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["barrel", "pincushion", "fisheye", "equidistant"])
def test_the_view_of_a_plan_is_seen_by_opencv(name):
    """Where a plan keeps targets: no direction in it is out of OpenCV's image, and one side of each
    pair cannot be moved out by a hundredth. The camera says the same."""
    size, lens = np.array([660, 440]), LENSES[name]
    camera = Pinhole(*size, K[0, 0], K[1, 1], K[0, 2], K[1, 2], distortion=lens)
    slopes = np.array(camera.view_slopes())
    field = 0.9999 * slopes[:, None] * np.stack(np.meshgrid(EDGE, EDGE)).reshape(2, -1)
    uv = by_opencv(lens, field, K)
    assert np.all((uv > -0.5) & (uv < size[:, None] - 0.5))
    assert camera.sees(camera.project(np.vstack([field, np.ones(len(field.T))])))
    for k in (0, 1):
        sides = slopes[:, None] * np.vstack([np.tile(EDGE, 2), np.tile(EDGE, 2)])
        sides[k] = 1.01 * slopes[k] * np.repeat([1.0, -1.0], len(EDGE))
        at = by_opencv(lens, sides, K)[k]
        assert not np.all((at > -0.5) & (at < size[k] - 0.5))
        assert not camera.sees(camera.project(np.vstack([sides, np.ones(len(sides.T))])))


def test_without_a_lens_the_view_is_that_of_the_angles():
    assert PLAIN.view_slopes() == pytest.approx((np.tan(0.45), np.tan(0.35)))


# Pictures through a lens.


def gray_of(x, y):
    """A smooth scene by the direction at unit focal length."""
    return 128.0 + 60.0 * np.sin(6.0 * x) + 50.0 * np.cos(5.0 * y)


def through(*lens):
    return replace(SMALL, distortion=LensDistortion(*lens))


BARREL = through("brown_conrady", (-0.25, 0.08, 1e-3, -1e-3))
PINCUSHION = through("brown_conrady", (0.2,))


@pytest.mark.parametrize("camera", [BARREL, PINCUSHION, through("fisheye", (-0.02, 0.003))])
def test_a_picture_through_a_lens_shows_what_opencv_says(camera):
    wide = without_lens(camera)
    v, u = np.mgrid[: wide.height, : wide.width]
    scene = np.rint(gray_of((u - wide.cx) / wide.fx, (v - wide.cy) / wide.fy)).astype(np.uint8)
    image = lens_picture(scene, camera)
    v, u = np.mgrid[:120, :160].astype(float)
    uv = np.stack([u.ravel(), v.ravel()])
    x, y = directions_by_opencv(camera.distortion, uv, SMALL.matrix())
    assert np.max(np.abs(image - gray_of(x, y).reshape(120, 160))) < GRAY


def test_maps_are_made_once_and_say_what_they_lose():
    barrel = lens_map(BARREL)
    assert lens_map(replace(BARREL)) is barrel
    assert barrel.scale[0] == pytest.approx(1.0, abs=0.01)  # on the axis the lens's own
    assert barrel.scale[1] > 1.2
    assert barrel.wide.width > SMALL.width
    assert lens_map(PINCUSHION).scale[0] < 0.9


def test_a_field_that_is_too_wide_is_drawn_smaller():
    drawn = lens_map(replace(SMALL, fx=74.0, fy=75.0, distortion=LensDistortion("fisheye", ())))
    assert drawn.wide.width * drawn.wide.height < 6.2 * 160 * 120
    assert drawn.scale[0] < 0.9


# Flaws.


def steps(count, size, shape):
    """Pictures of which each is brighter by so much."""
    return np.stack([np.full((*shape, 4), size * k, np.uint8) for k in range(count)])


def test_rows_of_a_rolling_shutter_are_exposed_one_after_the_other():
    flaws = ImageFlaws(readout=0.02, renders=4)
    np.testing.assert_allclose(flaws.instants, [-0.0175, -0.0125, -0.0075, -0.0025], atol=1e-15)
    rows = flaws.expose(steps(4, 10, (8, 3)))[:, 0, 0]
    np.testing.assert_array_equal(rows, [0, 0, 10, 10, 20, 20, 30, 30])


def test_exposure_shows_the_mean_of_its_time_and_every_row_in_its_own():
    flaws = ImageFlaws(exposure=0.01, renders=5)
    assert np.all(flaws.expose(steps(5, 50, (4, 2))) == 100)
    assert np.all(flaws.instants < 0.0)
    flaws = ImageFlaws(exposure=0.004, readout=0.016, renders=20)
    shares = flaws.shares(33)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)
    ends = -0.016 * (1.0 - np.arange(33) / 32.0)
    late = shares.T @ flaws.instants - (ends - 0.002)
    assert np.max(np.abs(late)) <= 0.5 * flaws.step + 1e-12


def test_noise_has_its_size_and_its_seed():
    flaws, gray = ImageFlaws(noise=4.0), np.full((300, 400, 4), 120, np.uint8)
    image, again = (flaws.spoil(gray, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(image, again)
    # Rounding adds a twelfth to the variance.
    deviation = np.std(image[..., :3].astype(float) - 120.0)
    assert deviation == pytest.approx(np.sqrt(16.0 + 1.0 / 12.0), rel=NOISE_SHARE)
    np.testing.assert_array_equal(image[..., 3], 120)
    np.testing.assert_array_equal(gray, 120)


def test_defocus_spreads_an_edge_by_its_size():
    edge = np.zeros((40, 80, 4), np.uint8)
    edge[:, 40:] = 255
    image = ImageFlaws(defocus=3.0).spoil(edge, np.random.default_rng(0))
    rise, at = np.diff(image[20, :, 0].astype(float)), np.arange(79)
    middle = np.average(at, weights=rise)
    assert np.average((at - middle) ** 2, weights=rise) ** 0.5 == pytest.approx(3.0, rel=0.05)


def test_no_flaws_are_no_change():
    picture = np.random.default_rng(1).integers(0, 255, (5, 6, 4)).astype(np.uint8)
    nothing = ImageFlaws()
    assert not nothing.moves
    np.testing.assert_array_equal(nothing.instants, [0.0])
    np.testing.assert_array_equal(nothing.expose(picture[None]), picture)
    assert nothing.spoil(picture, np.random.default_rng(0)) is picture
