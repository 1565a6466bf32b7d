"""Dots, rings and bundles of tags in drawn images, and their poses."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.vision.apriltags import TagBundle, TagTarget, tag_corners
from cdpr_drake.vision.blob_detection import find_dark_blobs
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.rings import CircleTarget, to_pixels

CAMERA = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))
SIZE = 0.1
FINER = 4
"""Images are drawn this much larger and then averaged, so that edges are smooth."""

CENTER_OFFSET = 0.15
"""Centre of a drawn dot or ring [px], from grey values."""

SIZE_OFFSET = 0.004
"""Share by which a moment of a drawn ring is off: a tenth of a pixel of a radius of 50 px."""

SOLVER = 1e-6
"""Poses from exact marks [m, rad]."""

BUNDLE = TagBundle(
    [3, 8],
    [0.05, 0.04],
    [pose_from_angles(np.array([-0.04, 0.0, 0.0]), np.zeros(3)), RigidTransform([0.04, 0.01, 0.0])],
)
TARGETS = {
    "tag": TagTarget(3, SIZE),
    "dots": DotTarget(SIZE),
    "ring": CircleTarget(SIZE),
    "bundle": BUNDLE,
}

poses = st.builds(
    lambda tilt_x, tilt_y, turn, x, y, z: pose_from_angles(
        z * np.array([x, y, 1.0]), np.array([np.pi + tilt_x, tilt_y, turn])
    ),
    st.floats(-0.7, 0.7),
    st.floats(-0.7, 0.7),
    st.floats(-3.0, 3.0),
    st.floats(-0.12, 0.12),
    st.floats(-0.12, 0.12),
    st.floats(0.4, 0.8),
)


def drawn(target, X_CO):
    """What the camera sees of a target's plates on a grey ground."""
    size = (FINER * CAMERA.width, FINER * CAMERA.height)
    big = np.full(size[::-1], 150, np.uint8)
    for plate in target.plates():
        picture = cv2.imdecode(np.frombuffer(plate.png, np.uint8), cv2.IMREAD_GRAYSCALE)
        n = picture.shape[0]
        source = np.array([[0, 0], [n, 0], [n, n], [0, n]], np.float32) - 0.5
        rim = CAMERA.project(X_CO @ plate.X_OT @ tag_corners(plate.width)).T
        finer = (FINER * rim + (FINER - 1) / 2.0).astype(np.float32)
        warp = cv2.getPerspectiveTransform(source, finer)
        where = cv2.warpPerspective(np.full_like(picture, 255), warp, size)
        cv2.copyTo(cv2.warpPerspective(picture, warp, size, flags=cv2.INTER_LINEAR), where, big)
    gray = cv2.resize(big, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    return np.repeat(gray[:, :, np.newaxis], 3, axis=2)


def ideal(target, X_CO):
    return target.project(X_CO, CAMERA, 0.0, np.random.default_rng(0))


VIEWS = [
    pose_from_angles(np.array([0.0, 0.0, 0.3]), np.array([np.pi, 0.0, np.pi])),
    pose_from_angles(np.array([0.03, -0.02, 0.38]), np.array([np.pi + 0.3, -0.2, 0.4])),
    pose_from_angles(np.array([-0.05, 0.05, 0.45]), np.array([np.pi - 0.2, 0.35, -2.0])),
]


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_dots_are_found_in_order(view):
    """Within the offset that a dot's tilt and radius cause, beside that of the drawing."""
    found = TARGETS["dots"].find(drawn(TARGETS["dots"], VIEWS[view]))
    offset = found - ideal(TARGETS["dots"], VIEWS[view])
    assert np.max(np.abs(offset)) < (CENTER_OFFSET if view == 0 else 0.6)


def near_views(count):
    """Poses at which the whole plate is in the image, as near and tilted as that allows."""
    random = np.random.default_rng(4)
    while count:
        tilt, place = (
            random.uniform(-0.9, 0.9, 2),
            random.uniform([-0.5, -0.4, 0.15], [0.5, 0.4, 0.5]),
        )
        X_CO = pose_from_angles(
            place[2] * np.array([*place[:2], 1.0]),
            np.array([np.pi + tilt[0], tilt[1], random.uniform(-np.pi, np.pi)]),
        )
        if ideal(TARGETS["dots"], X_CO) is not None:
            count -= 1
            yield X_CO


def test_dots_are_found_wherever_the_plate_is_seen():
    """Also where perspective makes the larger dot smaller in the image than one that is nearer.

    The order is told by marks that are nearer to the right ones than a tenth of the square's edge.
    """
    dots = TARGETS["dots"]
    for X_CO in near_views(60):
        found, exact = dots.find(drawn(dots, X_CO)), ideal(dots, X_CO)
        assert found is not None, X_CO
        apart = np.linalg.norm(np.diff(exact.reshape(4, 2), axis=0), axis=1).min()
        assert np.max(np.abs(found - exact)) < 0.1 * apart, X_CO


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_rings_are_found_with_their_moments(view):
    found = TARGETS["ring"].find(drawn(TARGETS["ring"], VIEWS[view])).reshape(2, 5)
    exact = ideal(TARGETS["ring"], VIEWS[view]).reshape(2, 5)
    np.testing.assert_allclose(found[:, :2], exact[:, :2], atol=CENTER_OFFSET)
    for ours, theirs in zip(found[:, 2:], exact[:, 2:], strict=True):
        np.testing.assert_allclose(ours, theirs, atol=SIZE_OFFSET * (theirs[0] + theirs[2]))


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_bundles_are_found_tag_by_tag(view):
    found = BUNDLE.find(drawn(BUNDLE, VIEWS[view]))
    assert np.max(np.abs(found - ideal(BUNDLE, VIEWS[view]))) < 0.6
    assert pose_error(BUNDLE.solve(found, CAMERA), VIEWS[view])[0] < 2e-3


@pytest.mark.parametrize("name", TARGETS)
def test_no_other_target_is_taken_for_it(name):
    for other, target in TARGETS.items():
        if other != name and {name, other} != {"tag", "bundle"}:
            assert TARGETS[name].find(drawn(target, VIEWS[1])) is None


def test_blank_and_cut_pictures_hold_nothing():
    for gray in (0, 128, 255):
        assert find_dark_blobs(np.full((480, 640, 3), gray, np.uint8)) == []
    at_the_rim = pose_from_angles(np.array([0.155, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
    for name in ("dots", "ring"):
        assert TARGETS[name].find(drawn(TARGETS[name], at_the_rim)) is None
        assert ideal(TARGETS[name], at_the_rim) is None


@pytest.mark.parametrize("name", ["tag", "dots", "bundle"])
@settings(max_examples=25)
@given(X_CO=poses)
def test_the_pose_comes_back_from_exact_points(name, X_CO):
    target = TARGETS[name]
    found = target.solve(ideal(target, X_CO), CAMERA)
    assert max(pose_error(X_CO, found)) < SOLVER


@settings(max_examples=60)
@given(X_CO=poses)
def test_the_pose_comes_back_from_exact_circles_but_for_their_rotation(X_CO):
    ring = TARGETS["ring"]
    found = ring.solve(ideal(ring, X_CO), CAMERA)
    assert np.linalg.norm(found.translation() - X_CO.translation()) < SOLVER
    normals = [X.rotation().matrix()[:, 2] for X in (found, X_CO)]
    assert np.linalg.norm(normals[0] - normals[1]) < SOLVER


def test_one_tag_of_a_bundle_is_enough_and_the_other_is_filled_in():
    X_CO = VIEWS[1]
    marks = ideal(BUNDLE, X_CO)
    marks[8:] = np.nan
    found = BUNDLE.solve(marks, CAMERA)
    assert max(pose_error(X_CO, found)) < SOLVER
    np.testing.assert_allclose(
        BUNDLE.complete(marks, found, CAMERA), ideal(BUNDLE, X_CO), atol=1e-3
    )


def test_a_projected_bundle_shows_the_tags_in_view_only():
    X_CO = pose_from_angles(np.array([0.155, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
    marks = ideal(BUNDLE, X_CO)
    assert np.all(np.isfinite(marks[:8]))
    assert np.all(np.isnan(marks[8:]))
    assert BUNDLE.in_view(X_CO, CAMERA)
    assert not BUNDLE.in_view(RigidTransform([0.0, 0.0, 0.3]), CAMERA)  # face down


def test_tags_of_a_bundle_need_not_lie_in_one_plane():
    corner = TagBundle(
        [0, 1],
        [0.05, 0.05],
        [
            RigidTransform(),
            pose_from_angles(np.array([0.05, 0.0, 0.02]), np.array([0.0, 0.6, 0.0])),
        ],
    )
    found = corner.solve(ideal(corner, VIEWS[0]), CAMERA)
    assert max(pose_error(VIEWS[0], found)) < 1e-5


@pytest.mark.parametrize("name", TARGETS)
def test_noise_moves_the_marks_by_as_much(name):
    target, X_CO = TARGETS[name], VIEWS[1]
    random = np.random.default_rng(0)
    marks = np.array([target.project(X_CO, CAMERA, 0.2, random) for _ in range(300)])
    spread = np.std(marks - ideal(target, X_CO), axis=0)
    if name == "ring":  # centres of ellipses from 48 points each
        expected = 0.2 * np.sqrt(2.0 / 48.0)
        assert np.all(np.abs(spread.reshape(2, 5)[:, :2] / expected - 1.0) < 0.4)
    else:
        assert np.all(np.abs(spread / 0.2 - 1.0) < 0.2)


def test_normalized_marks_are_the_ideal_ones():
    for target in TARGETS.values():
        found = target.normalized(ideal(target, VIEWS[1]), CAMERA)
        np.testing.assert_allclose(found, target.ideal_marks(VIEWS[1]), atol=1e-12)
    ring = TARGETS["ring"]
    pixels = to_pixels(ring.ideal_marks(VIEWS[1]), CAMERA)
    np.testing.assert_allclose(pixels.ravel(), ideal(ring, VIEWS[1]), atol=1e-12)


def test_the_centre_of_a_ring_s_image_is_not_the_image_of_its_centre():
    """What (x_o, y_o) needs is the latter."""
    ring, X_CO = TARGETS["ring"], VIEWS[1]
    p = X_CO.translation()
    center = ring.center(ideal(ring, X_CO), X_CO, CAMERA)
    np.testing.assert_allclose(center, p[:2] / p[2], atol=1e-12)
    assert np.linalg.norm(ring.ideal_marks(X_CO)[0, :2] - center) > 1e-3


@given(poses, st.floats(-3.0, 3.0))
def test_a_free_rotation_does_not_count_as_an_error(X_CO, angle):
    turned = RigidTransform(pose_from_angles(np.zeros(3), np.array([0.0, 0.0, angle])) @ X_CO)
    moved = RigidTransform(turned.rotation(), X_CO.translation())
    distance, free = seen_pose_error(moved, X_CO, free_rotation=True)
    assert distance < 1e-12
    assert free < 1e-7
    assert seen_pose_error(moved, X_CO)[1] == pytest.approx(abs(angle), abs=1e-7)
