"""Projection, view angles and the rim of the image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.vision.pinhole import Pinhole

PIXEL_TOLERANCE = 1e-9  # [px]; products of numbers up to 1e4 px
CAMERA = Pinhole(640, 480, 388.0, 421.0, 310.0, 245.0)

sizes = st.integers(1, 4000)
view_angles = st.floats(0.05, 3.0)


@given(sizes, sizes, view_angles, view_angles)
def test_view_angles_come_back(width, height, horizontal, vertical):
    camera = Pinhole.from_view_angles(width, height, horizontal, vertical)
    assert 2.0 * np.arctan(width / 2.0 / camera.fx) == pytest.approx(horizontal)
    assert 2.0 * np.arctan(height / 2.0 / camera.fy) == pytest.approx(vertical)
    assert (camera.width, camera.height) == (width, height)
    assert (camera.cx, camera.cy) == ((width - 1) / 2.0, (height - 1) / 2.0)


@given(sizes, sizes, view_angles, view_angles, st.floats(0.1, 10.0))
def test_rays_at_the_half_view_angles_meet_the_rim(width, height, horizontal, vertical, z):
    """Pixel 0 reaches from -0.5 to 0.5, so the rim is at -0.5 and at width - 0.5."""
    camera = Pinhole.from_view_angles(width, height, horizontal, vertical)
    x, y = z * np.tan(horizontal / 2.0), z * np.tan(vertical / 2.0)
    uv = camera.project(np.array([[-x, x], [-y, y], [z, z]]))
    rim = [[-0.5, width - 0.5], [-0.5, height - 0.5]]
    np.testing.assert_allclose(uv, rim, rtol=0.0, atol=PIXEL_TOLERANCE)


def test_the_optical_axis_meets_the_principal_point():
    uv = CAMERA.project(np.array([[0.0], [0.0], [2.0]]))
    np.testing.assert_array_equal(uv, [[310.0], [245.0]])


def test_right_is_right_and_down_is_down():
    u, v = CAMERA.project(np.array([[0.1], [0.2], [1.0]]))[:, 0]
    assert u == pytest.approx(310.0 + 38.8)
    assert v == pytest.approx(245.0 + 84.2)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.1, 5.0), st.floats(0.1, 10.0))
def test_projection_is_the_matrix_up_to_scale(x, y, z, scale):
    p = np.array([[x], [y], [z]])
    u, v, w = (CAMERA.matrix() @ p)[:, 0]
    expected = [[u / w], [v / w]]
    np.testing.assert_allclose(CAMERA.project(p), expected, rtol=0.0, atol=PIXEL_TOLERANCE)
    np.testing.assert_allclose(CAMERA.project(scale * p), expected, rtol=0.0, atol=PIXEL_TOLERANCE)


def test_points_at_or_behind_the_focal_plane_are_nowhere():
    points = np.array([[0.1, 0.1, 0.1], [0.0, 0.0, 0.0], [1.0, 0.0, -1.0]])
    uv = CAMERA.project(points)
    assert np.all(np.isfinite(uv[:, 0]))
    assert np.all(np.isnan(uv[:, 1:]))


@pytest.mark.parametrize(
    ("u", "v", "inside"),
    [
        (0.0, 0.0, True),
        (-0.49, -0.49, True),
        (639.49, 479.49, True),
        (-0.5, 100.0, False),
        (639.5, 100.0, False),
        (100.0, -0.5, False),
        (100.0, 479.5, False),
        (np.nan, 100.0, False),
    ],
)
def test_sees_up_to_the_rim(u, v, inside):
    assert CAMERA.sees(np.array([[u], [v]])) is inside


@pytest.mark.parametrize(
    ("u", "v", "inside"),
    [
        (9.6, 9.6, True),
        (629.4, 469.4, True),
        (9.5, 100.0, False),
        (629.5, 100.0, False),
        (100.0, 9.5, False),
        (100.0, 469.5, False),
    ],
)
def test_a_border_narrows_the_view(u, v, inside):
    assert CAMERA.sees(np.array([[u], [v]]), border=10.0) is inside


def test_one_point_outside_is_not_seeing_all():
    assert CAMERA.sees(np.array([[10.0, 20.0], [10.0, 20.0]]))
    assert not CAMERA.sees(np.array([[10.0, 20.0, 700.0], [10.0, 20.0, 30.0]]))


def test_points_behind_are_not_seen():
    assert not CAMERA.sees(CAMERA.project(np.array([[0.0], [0.0], [-1.0]])))
