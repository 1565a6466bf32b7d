"""The distortion of lenses, against OpenCV's own projection, and where it folds over."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drake.errors import LensDistortionError
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.pinhole import Pinhole

PIXEL_TOLERANCE = 1e-9  # [px]; the formulas are the same, and images have a thousand pixels
RETURN_TOLERANCE = 1e-9  # [-]; well inside the field, where the slope is not small
SLOPE_TOLERANCE = 1e-8  # [-]; central differences over 1e-6
STEP = 1e-6
K = np.array([[700.0, 0.0, 331.5], [0.0, 640.0, 225.0], [0.0, 0.0, 1.0]])

LENSES = {
    "barrel": LensDistortion("brown_conrady", (-0.31, 0.11, 1e-3, -7e-4, -0.02)),
    "pincushion": LensDistortion("brown_conrady", (0.12, 0.02, -5e-4, 1e-3)),
    "rational": LensDistortion("brown_conrady", (1.2, 0.4, 2e-4, -3e-4, 0.02, 1.6, 0.6, 0.05)),
    "fisheye": LensDistortion("fisheye", (-0.02, 0.006, -0.002, 2e-4)),
    "equidistant": LensDistortion("fisheye", ()),
}


def rays(lens, share=0.9, count=400):
    """Random points at unit focal length within a share of the field that an image may have."""
    random = np.random.default_rng(3)
    radius = min(share * lens.valid_radius, 2.0)
    r, angle = radius * np.sqrt(random.uniform(0.0, 1.0, count)), random.uniform(0, 6.3, count)
    return np.array([r * np.cos(angle), r * np.sin(angle)])


def by_opencv(lens, xy):
    """Pixels of OpenCV of points at unit focal length, shape (2, n)."""
    points = np.vstack([xy, np.ones(xy.shape[1])]).T.reshape(-1, 1, 3)
    zero = np.zeros(3)
    if lens.kind == "fisheye":
        D = np.zeros(4)
        D[: len(lens.coefficients)] = lens.coefficients
        uv = cv2.fisheye.projectPoints(points, zero, zero, K, D)[0]
    else:
        D = np.zeros(8)
        D[: len(lens.coefficients)] = lens.coefficients
        uv = cv2.projectPoints(points, zero, zero, K, D)[0]
    return uv.reshape(-1, 2).T


@pytest.mark.parametrize("name", LENSES)
def test_pixels_are_those_of_opencv(name):
    lens = LENSES[name]
    xy = rays(lens)
    uv = K[:2, :2] @ lens.distort(xy) + K[:2, 2:]
    np.testing.assert_allclose(uv, by_opencv(lens, xy), rtol=0.0, atol=PIXEL_TOLERANCE)


@pytest.mark.parametrize("name", LENSES)
def test_points_come_back(name):
    lens = LENSES[name]
    xy = rays(lens)
    np.testing.assert_allclose(
        lens.undistort(lens.distort(xy)), xy, rtol=0.0, atol=RETURN_TOLERANCE
    )


@pytest.mark.parametrize("name", LENSES)
def test_the_axis_stays_the_axis(name):
    lens = LENSES[name]
    middle = np.zeros((2, 1))
    np.testing.assert_array_equal(lens.distort(middle), middle)
    np.testing.assert_array_equal(lens.undistort(middle), middle)
    np.testing.assert_array_equal(lens.jacobian([0.0, 0.0]), np.eye(2))


@pytest.mark.parametrize("name", LENSES)
def test_the_jacobian_is_that_of_finite_differences(name):
    lens = LENSES[name]
    for point in rays(lens, count=30).T:
        around = point[:, None] + STEP * np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
        u = lens.distort(around)
        differences = np.column_stack([u[:, 0] - u[:, 1], u[:, 2] - u[:, 3]]) / (2.0 * STEP)
        np.testing.assert_allclose(
            lens.jacobian(point), differences, rtol=0.0, atol=SLOPE_TOLERANCE
        )


@settings(deadline=None)
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
    lens = LensDistortion("brown_conrady", (-c,))
    turn = 1.0 / np.sqrt(3.0 * c)
    assert lens.valid_radius == pytest.approx(turn, rel=1e-9)
    beyond = np.array([[1.001 * turn], [0.0]])
    assert np.all(np.isnan(lens.distort(beyond)))
    rim = 2.0 / 3.0 * turn
    assert np.all(np.isnan(lens.undistort(np.array([[1.0001 * rim], [0.0]]))))
    assert np.all(np.isfinite(lens.undistort(np.array([[0.9999 * rim], [0.0]]))))


def test_tangential_parts_end_the_field_where_a_determinant_vanishes():
    """In the field every determinant is positive; on its rim the least one is zero."""
    lens = LensDistortion("brown_conrady", (-0.2, 0.0, 0.03, 0.05))
    plain = LensDistortion("brown_conrady", (-0.2,))
    assert lens.valid_radius < plain.valid_radius
    angles = np.linspace(0.0, 2.0 * np.pi, 2001)
    rim = (1.0 - 1e-9) * lens.valid_radius * np.array([np.cos(angles), np.sin(angles)])
    on_rim = [np.linalg.det(lens.jacobian(point)) for point in rim.T]
    inside = [np.linalg.det(lens.jacobian(0.99 * point)) for point in rim.T]
    assert min(on_rim) == pytest.approx(0.0, abs=1e-4)
    assert min(inside) > 0.0


def test_an_equidistant_fisheye_sees_nearly_a_half_space():
    lens = LENSES["equidistant"]
    angle = np.radians(85.0)
    image = lens.distort(np.array([[0.0], [np.tan(angle)]]))
    np.testing.assert_allclose(image[:, 0], [0.0, angle], rtol=0.0, atol=1e-12)


def test_nothing_comes_of_nothing():
    for lens in LENSES.values():
        assert np.all(np.isnan(lens.undistort(np.full((2, 1), np.nan))))
        assert np.all(np.isnan(lens.undistort(np.full((2, 1), np.inf))))


@pytest.mark.parametrize(
    ("kind", "coefficients", "words"),
    [
        ("barrel", (0.1,), "accepted: brown_conrady, fisheye"),
        ("fisheye", (0.1,) * 5, "up to 4 finite numbers"),
        ("brown_conrady", (np.nan,), "up to 8 finite numbers"),
    ],
)
def test_what_is_no_lens_is_refused(kind, coefficients, words):
    with pytest.raises(LensDistortionError, match=words):
        LensDistortion(kind, coefficients)


@pytest.mark.parametrize("coefficients", [(-0.25, 0.08, 0.001, -0.0005), (0.12, 0.0, 0.0, 0.0)])
def test_a_view_that_a_lens_sees_in_full(coefficients):
    """All of the rectangle is in the image, and of one that is wider a side reaches out."""
    lens = LensDistortion("brown_conrady", coefficients)
    camera = replace(Pinhole.from_view_angles(640, 480, 0.9, 0.7), cx=330.0, distortion=lens)
    x, y = camera.view_slopes()
    edge = np.linspace(-1.0, 1.0, 41)
    inside = 0.999 * np.array([[x * a, y * b] for a in edge for b in edge]).T
    assert camera.sees(camera.project(np.vstack([inside, np.ones(inside.shape[1])])))
    for sides in (
        [(sign * 1.01 * x, a * y) for sign in (1, -1) for a in edge],
        [(a * x, sign * 1.01 * y) for sign in (1, -1) for a in edge],
    ):
        assert not camera.sees(camera.project(np.vstack([np.array(sides).T, np.ones(82)])))


@pytest.mark.parametrize("name", ["barrel", "pincushion", "fisheye", "equidistant"])
def test_the_view_of_a_plan_is_seen_by_opencv(name):
    """Where a plan keeps targets: none of a million directions in it is out of OpenCV's image, and
    none of four sides can be moved out by a hundredth."""
    width, height = 660, 440
    camera = Pinhole(width, height, K[0, 0], K[1, 1], K[0, 2], K[1, 2], distortion=LENSES[name])
    x, y = camera.view_slopes()
    a, b = np.meshgrid(np.linspace(-1.0, 1.0, 1001), np.linspace(-1.0, 1.0, 1001))
    uv = by_opencv(LENSES[name], 0.9999 * np.vstack([x * a.ravel(), y * b.ravel()]))
    assert np.all((uv > -0.5) & (uv < np.array([[width], [height]]) - 0.5))
    edge = np.linspace(-1.0, 1.0, 1001)
    for k, size, slopes in ((0, width, (1.01 * x, y)), (1, height, (x, 1.01 * y))):
        sides = []
        for sign in (1.0, -1.0):
            side = np.array([slopes[0] * edge, slopes[1] * edge])
            side[k] = sign * slopes[k]
            at = by_opencv(LENSES[name], side)[k]
            sides.append(np.all((at > -0.5) & (at < size - 0.5)))
        assert not all(sides)


def test_without_a_lens_the_view_is_that_of_the_angles():
    camera = Pinhole.from_view_angles(640, 480, 0.9, 0.7)
    assert camera.view_slopes() == pytest.approx((np.tan(0.45), np.tan(0.35)))
