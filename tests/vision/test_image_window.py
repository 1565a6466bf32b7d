"""Windows of images: where a target is expected, and that a window's camera sees its pixels."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.vision.apriltags import TagTarget
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

PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))
NOWHERE = np.full(4, np.nan)

ROUNDING = 1e-9
"""Of projections [px]."""


def has(window, u, v):
    inside = window.u <= u < window.u + window.width and window.v <= v < window.v + window.height
    return inside


def test_a_window_s_camera_sees_the_same_pixels():
    window = ImageWindow(160, 64, 256, 208)
    p_CK = np.random.default_rng(1).uniform([-0.1, -0.1, 0.5], [0.1, 0.1, 1.0], (20, 3)).T
    whole = PINHOLE.project(p_CK)
    part = window.pinhole(PINHOLE).project(p_CK) + np.array([[window.u], [window.v]])
    np.testing.assert_allclose(part, whole, atol=ROUNDING)
    picture = np.random.default_rng(2).integers(0, 255, (480, 640, 4))
    drawn = ImageWindow(96, 48, 400, 300)
    cut = window.cut(picture[48:348, 96:496], drawn)
    assert np.array_equal(cut, picture[64:272, 160:416])
    assert cut.flags.c_contiguous


@pytest.mark.parametrize("move", [(0.0, 0.0), (23.0, -11.0), (-60.0, 35.0)])
def test_what_moves_evenly_and_grows_stays_in_the_window_that_is_expected(move):
    before = np.array([200.0, 150.0, 260.0, 220.0])
    now = before + np.tile(move, 2) + np.array([-2.0, -2.0, 2.0, 2.0])
    then = 2.0 * now - before
    window = expected_window(now, before, PINHOLE)
    for box in (now, then):
        assert has(window, *(box[:2] - MARGIN))
        assert has(window, *(box[2:] + MARGIN))
    assert window.width * window.height < 0.3 * PINHOLE.width * PINHOLE.height
    assert window.u % GRID == window.v % GRID == 0


@pytest.mark.parametrize("share", [-1.0, 0.0, 0.5, 1.5])
def test_what_speeds_up_or_stops_or_turns_back_stays_in_the_window(share):
    """By as much as half of its last motion beside what that promises; back to where it was."""
    before, move = np.array([200.0, 150.0, 260.0, 220.0]), np.tile([40.0, -30.0], 2)
    now = before + move
    then = now + share * move
    window = expected_window(now, before, PINHOLE)
    if share >= 0.0:
        assert has(window, *(then[:2] - MARGIN))
        assert has(window, *(then[2:] + MARGIN))
    else:  # looked for in the whole image
        assert not has(window, *then[:2])


def test_at_rest_a_window_is_a_margin_wide_and_rounded_to_the_grid():
    box = np.array([170.0, 90.0, 436.0, 360.0])
    window = expected_window(box, box, PINHOLE)
    assert 0 <= window.width - 266 - 2 * MARGIN <= 2 * GRID
    assert 0 <= window.height - 270 - 2 * MARGIN <= 2 * GRID


def test_without_an_image_before_the_last_a_window_has_room_for_what_is_not_known():
    box = np.array([170.0, 90.0, 436.0, 360.0])
    resting, unknown = (expected_window(box, before, PINHOLE) for before in (box, NOWHERE))
    assert union(resting, unknown) == unknown
    margin = MARGIN + EDGE_SHARE * 270.0
    assert has(unknown, *(box[:2] - margin))
    assert has(unknown, *(box[2:] + margin))


def test_windows_end_with_the_image_and_there_is_none_outside_of_it():
    corner = expected_window(np.array([600.0, 440.0, 700.0, 500.0]), NOWHERE, PINHOLE)
    assert corner.u + corner.width == PINHOLE.width
    assert corner.v + corner.height == PINHOLE.height
    assert expected_window(np.array([700.0, 10.0, 750.0, 60.0]), NOWHERE, PINHOLE) is None
    assert expected_window(NOWHERE, NOWHERE, PINHOLE) is None
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
