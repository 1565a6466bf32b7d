"""Cables found in pictures that are drawn here, beside their closed forms."""

from functools import cache

import cv2
import numpy as np
import pytest

from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.vision.cable_detection import SLACK, TAUT, UNSEEN, SightSettings, find_sags
from cdpr_drake.vision.cable_images import sag_of_surplus
from cdpr_drake.vision.cable_pictures import CABLE_COLOR, draw_cables

GREY = 157
SURPLUS = np.array([0.0, 0.03, 0.0, 0.004, 0.0, 0.01, 0.0, 0.0])
"""Of lengths over ways [m]; sags are 0, 9, 0, 3, 0, 6, 0, 0 cm about."""

KNOWN = 4.0
"""Errors of sags in standard deviations of the fit: few in 15000 normal numbers are beyond."""


@cache
def scene():
    robot = load_robot("acrobot_small")
    mount = robot.camera_mount("overview")
    camera = load_camera(mount.model)
    return (
        robot.cable_set(), 0.5 * robot.diameters(), mount.pose.transform(),
        camera.pinhole(camera.width, camera.height),
    )  # fmt: skip


ANGLES = np.radians([5.0, 5.0, -4.0])

POSE = pose_from_angles(np.array([0.1, 0.02, 0.3]), ANGLES)


def picture(surplus=SURPLUS, depth=None, grain=2.0, skip=()):
    cables, radii, X_WE, pinhole = scene()
    lengths = cable_paths(POSE, cables).lengths * (1.0 - 1e-4 * (surplus == 0.0)) + surplus
    curves = cable_curves(cables, "elastic", POSE, lengths, 65)
    shape = (pinhole.height, pinhole.width)
    plain = np.full((*shape, 3), GREY, np.uint8)
    depth = np.full(shape, np.inf) if depth is None else depth
    kept = [k for k in range(cables.count) if k not in skip]
    image = draw_cables(plain, depth, [curves[k] for k in kept], radii[kept], X_WE, pinhole)
    noise = grain * np.random.default_rng(0).standard_normal(image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)


def truth():
    paths = cable_paths(POSE, scene()[0])
    rise = (paths.free * paths.u_W).T
    return np.array([
        sag_of_surplus(s, np.hypot(*r[:2]), r[2]) for s, r in zip(SURPLUS, rise, strict=True)
    ])  # fmt: skip


def found(image, pose=POSE):
    cables, _, X_WE, pinhole = scene()
    return find_sags(image, cables, pose, X_WE, pinhole)


def test_slack_and_taut_cables_are_told_apart_and_measured():
    seen = found(picture())
    assert list(seen.verdict) == [SLACK if s > 0.0 else TAUT for s in SURPLUS]
    np.testing.assert_array_less(np.abs(seen.sag - truth()), KNOWN * seen.sigma)
    np.testing.assert_array_less(seen.sigma, 2e-3)
    np.testing.assert_array_less(np.abs(seen.surplus - SURPLUS), KNOWN * seen.surplus_sigma)


def test_where_they_are_believed_to_end_is_off():
    """By a millimetre: errors of sags stay within what the fit says."""
    wrong = pose_from_angles(POSE.translation() + np.array([1e-3, -5e-4, 5e-4]), ANGLES)
    seen = found(picture(), wrong)
    assert list(seen.verdict) == [SLACK if s > 0.0 else TAUT for s in SURPLUS]
    np.testing.assert_array_less(np.abs(seen.sag - truth()), KNOWN * seen.sigma)


def test_nothing_is_said_of_cables_that_are_not_there():
    seen = found(picture(skip=(1, 4)))
    assert list(np.flatnonzero(seen.verdict == UNSEEN)) == [1, 4]
    assert np.all(np.isnan(seen.sag[[1, 4]]))
    assert seen.points[1].shape == (2, 0)
    empty = found(picture(skip=tuple(range(8))))
    assert np.all(empty.verdict == UNSEEN)


def test_what_is_in_front_hides_cables():
    pinhole = scene()[3]
    depth = np.full((pinhole.height, pinhole.width), 0.1)
    image = picture(depth=depth, grain=0.0)
    assert np.all(image == GREY)
    depth[:, : pinhole.width // 2] = np.inf
    image = picture(depth=depth, grain=0.0)
    assert np.all(image[:, pinhole.width // 2 + 2 :] == GREY)
    assert np.any(image[:, : pinhole.width // 2] < GREY - 20)


@pytest.mark.parametrize("width", [0.4, 1.0, 2.5])
def test_a_cable_darkens_by_the_area_that_it_covers(width):
    """Whatever its width, of parts of a pixel or several: the area is length times width."""
    from pydrake.math import RigidTransform

    from cdpr_drake.vision.pinhole import Pinhole

    camera = Pinhole(200, 160, 100.0, 100.0, 99.5, 79.5)
    ends = np.array([[-0.7, 0.6], [-0.31, 0.23], [1.0, 1.0]])
    plain = np.full((160, 200, 3), 255, np.uint8)
    image = draw_cables(
        plain, np.full((160, 200), np.inf), [ends], np.array([0.5 * width / 100.0]),
        RigidTransform(), camera,
    )  # fmt: skip
    share = (255.0 - image[:, :, 0]) / (255.0 - CABLE_COLOR[0])
    length = 100.0 * np.linalg.norm(ends[:2, 1] - ends[:2, 0])
    # Thickness is of whole parts of a quarter pixel, and drawn ends are round.
    assert np.sum(share) == pytest.approx(length * width, rel=0.15)
    rows, columns = np.nonzero(share > 0.0)
    weights = share[rows, columns]
    slope = np.polyfit(columns, rows, 1, w=np.sqrt(weights))
    line = camera.project(ends)
    np.testing.assert_allclose(np.polyval(slope, line[0]), line[1], atol=0.12)


def test_grey_images_are_taken_too():
    image = picture()
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    np.testing.assert_array_equal(found(grey).sag, found(image).sag)


def test_an_error_of_the_pose_is_in_the_deviations_of_sags():
    """What is told of the pose counts, and only that: deviations grow with it, and sags of a pose
    that is off stay within them, which they would not as if it were exact."""
    cables, _, X_WE, pinhole = scene()
    image, sure = picture(), SightSettings(ends=5e-5)
    twist = np.concatenate([np.radians([0.1, -0.1, 0.1]), [1e-3, -5e-4, 5e-4]])
    told = np.diag(np.repeat([np.radians(0.1), 8e-4], 3) ** 2)
    wrong = POSE @ exponential(twist)
    seen = find_sags(image, cables, wrong, X_WE, pinhole, sure, pose_covariance=told)
    assert list(seen.verdict) == [SLACK if s > 0.0 else TAUT for s in SURPLUS]
    np.testing.assert_array_less(np.abs(seen.sag - truth()), KNOWN * seen.sigma)
    exact = find_sags(image, cables, POSE, X_WE, pinhole, sure, pose_covariance=np.zeros((6, 6)))
    assert np.mean(exact.sigma) < 0.8 * np.mean(seen.sigma)
    np.testing.assert_array_less(np.abs(exact.sag - truth()), KNOWN * exact.sigma)
    more = find_sags(image, cables, wrong, X_WE, pinhole, sure, pose_covariance=4.0 * told)
    assert np.mean(seen.sigma) < np.mean(more.sigma)
    blind = find_sags(image, cables, wrong, X_WE, pinhole, sure, pose_covariance=np.zeros((6, 6)))
    assert not np.all(np.abs(blind.sag - truth()) < KNOWN * blind.sigma)
    with pytest.raises(CdprError, match="pose_covariance: found shape"):
        find_sags(image, cables, POSE, X_WE, pinhole, sure, pose_covariance=-np.eye(6))
