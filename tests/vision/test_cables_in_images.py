"""Slack and cables read from pictures that are drawn here, beside their closed forms."""

from functools import cache

import cv2
import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.slack_correction import tension_correction
from cdpr_drake.vision.cable_detection import SLACK, TAUT, UNSEEN, SightSettings, find_sags
from cdpr_drake.vision.cable_images import (
    cable_images,
    catenary_drop,
    sag_of_surplus,
    slack_from_image,
    slack_rates,
    surplus_of_drops,
)
from cdpr_drake.vision.cable_pictures import CABLE_COLOR, draw_cables
from cdpr_drake.vision.pinhole import Pinhole

CHAIN = 1e-7  # of a length that is added up of 20000 pieces of a curve [m]
CURVE = 2e-4  # of points that are interpolated on 41 of a drawn curve, as they are here [m]
KNOWN = 4.0  # sigmas of the fit: few errors of sags in 15000 normal numbers are beyond
GREY = 157

# The catenary.


@pytest.mark.parametrize(
    ("span", "rise", "surplus"),
    [(1.0, 0.4, 0.02), (0.5, -1.0, 0.08), (1.2, 0.0, 1e-4), (0.3, 0.1, 2.0)],
)
def test_a_catenary_is_as_long_as_it_is_told(span, rise, surplus):
    x = np.linspace(0.0, span, 20_001)
    z = rise * x / span - catenary_drop(x, span, rise, surplus)
    assert z[[0, -1]] == pytest.approx([0.0, rise], abs=1e-9)
    length = np.sum(np.hypot(np.diff(x), np.diff(z)))
    assert length - np.hypot(span, rise) == pytest.approx(surplus, rel=1e-5, abs=CHAIN)
    x = np.linspace(0.1, 0.9, 9) * span
    inverse, _ = surplus_of_drops(x, catenary_drop(x, span, rise, surplus), span, rise)
    assert inverse == pytest.approx(surplus, rel=1e-6)


def test_what_a_surplus_changes_by_each_point_is_a_derivative():
    x = np.linspace(0.1, 0.9, 7)
    drops = catenary_drop(x, 1.0, 0.4, 0.03) + 1e-3 * np.sin(7.0 * x)

    def surplus(d):
        return surplus_of_drops(x, drops + d, 1.0, 0.4)[0]

    differences = [(surplus(d) - surplus(-d)) / 2e-6 for d in 1e-6 * np.eye(7)]
    # The curvature of the catenary by its length is left out, as by Gauss and Newton.
    by_drop = surplus_of_drops(x, drops, 1.0, 0.4)[1]
    np.testing.assert_allclose(by_drop, differences, rtol=0.02)


# Points of cables.

LARGE = load_robot("acrobot_large")
CABLES = LARGE.cable_set().without_pulleys()
X_WE = LARGE.camera_mount("overview").pose.transform()
PINHOLE = load_camera("astra").pinhole(640, 480)
X_WP = pose_from_angles(np.array([0.202, 0.118, 0.268]), np.radians([-18.0, 10.0, 4.0]))
AWAY = X_WE @ exponential(np.array([0.0, np.pi, 0.0, 0.0, 0.0, 0.0]))


def seen(surplus, noise=0.0, seed=0, camera=X_WE, believed=X_WP):
    """Slack read from an image of cables, of which the first two hang through."""
    added = np.where(np.arange(8) < 2, surplus, -1e-3)
    curves = cable_curves(
        CABLES, "kelvin_voigt", X_WP, cable_paths(X_WP, CABLES).lengths + added, 41
    )
    pixels = cable_images(curves, camera, PINHOLE, 15, noise, np.random.default_rng(seed))
    return pixels, slack_from_image(pixels, CABLES, believed, camera, PINHOLE, 0.5)


@pytest.mark.parametrize("surplus", [0.02, 0.04, 0.08])
def test_slack_is_seen_as_it_is(surplus):
    exact = seen(surplus)[1]
    visible = np.isfinite(exact.surplus)
    assert np.any(visible[:2])
    expected = np.where(np.arange(8) < 2, surplus, 0.0)
    np.testing.assert_allclose(exact.surplus[visible], expected[visible], atol=CURVE)
    slack = np.flatnonzero(visible[:2])
    noisy = np.array([seen(surplus, 0.5, seed)[1].surplus[slack] for seed in range(40)])
    # Predicted deviation, within a half of that of 40 pictures.
    np.testing.assert_allclose(np.std(noisy, axis=0), exact.deviation[slack], rtol=0.5)
    assert np.max(np.abs(np.mean(noisy, axis=0) - surplus)) < 1e-3


def test_an_error_of_the_pose_is_no_larger_one_of_the_slack():
    wrong = X_WP @ exponential(np.array([0.0, 0.0, 0.0, 3e-3, -3e-3, 3e-3]))
    assert np.nanmax(np.abs(seen(0.04, believed=wrong)[1].surplus[:2] - 0.04)) < 0.02


def test_what_is_not_in_the_image_is_not_seen():
    pixels, slack = seen(0.04, camera=AWAY)
    assert np.all(np.isnan(pixels))
    assert np.all(np.isnan(slack.surplus))


def test_rates_grow_with_what_is_seen_and_end_with_tension():
    tensions = np.array([0.0, 0.0, 0.0, 5.0, 0.2])
    alone = tension_correction(tensions, np.ones(5), np.full(5, 0.04))
    rates = slack_rates(
        alone, tensions, np.ones(5), np.array([0.08, 0.02, np.nan, 0.08, 0.001]),
        allowance=0.002, time=0.25, fastest=0.3,
    )  # fmt: skip
    np.testing.assert_allclose(rates, [-0.3, -0.072, -0.04, 0.0, -0.032], atol=1e-12)


# Cables in pictures.

SURPLUS = np.array([0.0, 0.03, 0.0, 0.004, 0.0, 0.01, 0.0, 0.0])  # sags of 9, 3, 6 cm about
VERDICT = [SLACK if surplus > 0.0 else TAUT for surplus in SURPLUS]
SMALL = load_robot("acrobot_small")
MOUNT, SET = SMALL.camera_mount("overview"), SMALL.cable_set()
CAMERA = load_camera(MOUNT.model).pinhole(
    load_camera(MOUNT.model).width, load_camera(MOUNT.model).height
)
X_WC = MOUNT.pose.transform()
POSE = pose_from_angles(np.array([0.1, 0.02, 0.3]), np.radians([5.0, 5.0, -4.0]))
RISE = (cable_paths(POSE, SET).free * cable_paths(POSE, SET).u_W).T
SAGS = [
    sag_of_surplus(surplus, np.hypot(*rise[:2]), rise[2])
    for surplus, rise in zip(SURPLUS, RISE, strict=True)
]


@cache
def picture(skip=(), covered=0, grain=2.0):
    """Cables before a wall, but some, and none where something is in front on the right."""
    lengths = cable_paths(POSE, SET).lengths * (1.0 - 1e-4 * (SURPLUS == 0.0)) + SURPLUS
    curves = cable_curves(SET, "elastic", POSE, lengths, 65)
    depth = np.full((CAMERA.height, CAMERA.width), np.inf)
    depth[:, CAMERA.width - covered :] = 0.1
    plain = np.full((*depth.shape, 3), GREY, np.uint8)
    drawn = [k for k in range(SET.count) if k not in skip]
    radii = 0.5 * SMALL.diameters()[drawn]
    image = draw_cables(plain, depth, [curves[k] for k in drawn], radii, X_WC, CAMERA)
    noise = grain * np.random.default_rng(0).standard_normal(image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)


def sags(image, pose=POSE, *settings, **more):
    return find_sags(image, SET, pose, X_WC, CAMERA, *settings, **more)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (1e-3, -5e-4, 5e-4)])
def test_slack_and_taut_cables_are_told_apart_and_measured(shift):
    """Also where they are believed to end a millimetre off."""
    wrong = RigidTransform(POSE.rotation(), POSE.translation() + np.array(shift))
    result = sags(picture(), wrong)
    assert list(result.verdict) == VERDICT
    np.testing.assert_array_less(np.abs(result.sag - SAGS), KNOWN * result.sigma)
    if not any(shift):
        np.testing.assert_array_less(result.sigma, 2e-3)
        np.testing.assert_array_less(np.abs(result.surplus - SURPLUS), KNOWN * result.surplus_sigma)
        grey = cv2.cvtColor(picture(), cv2.COLOR_RGB2GRAY)
        np.testing.assert_array_equal(sags(grey).sag, result.sag)


def test_nothing_is_said_of_cables_that_are_not_there():
    result = sags(picture(skip=(1, 4)))
    assert list(np.flatnonzero(result.verdict == UNSEEN)) == [1, 4]
    assert np.all(np.isnan(result.sag[[1, 4]]))
    assert result.points[1].shape == (2, 0)
    assert np.all(sags(picture(skip=tuple(range(8)))).verdict == UNSEEN)


def test_what_is_in_front_hides_cables():
    assert np.all(picture(covered=CAMERA.width, grain=0.0) == GREY)
    half = CAMERA.width // 2
    image = picture(covered=CAMERA.width - half, grain=0.0)
    assert np.all(image[:, half + 2 :] == GREY)
    assert np.any(image[:, :half] < GREY - 20)


@pytest.mark.parametrize("width", [0.4, 1.0, 2.5])
def test_a_cable_darkens_by_the_area_that_it_covers(width):
    """Whatever its width, of parts of a pixel or several: the area is length times width."""
    camera, shape = Pinhole(200, 160, 100.0, 100.0, 99.5, 79.5), (160, 200)
    ends = np.array([[-0.7, 0.6], [-0.31, 0.23], [1.0, 1.0]])
    image = draw_cables(
        np.full((*shape, 3), 255, np.uint8), np.full(shape, np.inf), [ends],
        np.array([0.5 * width / 100.0]), RigidTransform(), camera,
    )  # fmt: skip
    share = (255.0 - image[:, :, 0]) / (255.0 - CABLE_COLOR[0])
    length = 100.0 * np.linalg.norm(ends[:2, 1] - ends[:2, 0])
    # Thickness is of whole parts of a quarter pixel, and drawn ends are round.
    assert np.sum(share) == pytest.approx(length * width, rel=0.15)
    rows, columns = np.nonzero(share > 0.0)
    slope = np.polyfit(columns, rows, 1, w=np.sqrt(share[rows, columns]))
    line = camera.project(ends)
    np.testing.assert_allclose(np.polyval(slope, line[0]), line[1], atol=0.12)


def test_an_error_of_the_pose_is_in_the_deviations_of_sags():
    """What is told of the pose counts, and only that: deviations grow with it, and sags of a pose
    that is off stay within them, which they would not as if it were exact."""
    told = np.diag(np.repeat([np.radians(0.1), 8e-4], 3) ** 2)
    wrong = POSE @ exponential(np.array([*np.radians([0.1, -0.1, 0.1]), 1e-3, -5e-4, 5e-4]))
    off, more, blind, exact = (
        sags(picture(), pose, SightSettings(ends=5e-5), pose_covariance=share * told)
        for pose, share in ((wrong, 1.0), (wrong, 4.0), (wrong, 0.0), (POSE, 0.0))
    )
    assert list(off.verdict) == VERDICT
    np.testing.assert_array_less(np.abs(off.sag - SAGS), KNOWN * off.sigma)
    np.testing.assert_array_less(np.abs(exact.sag - SAGS), KNOWN * exact.sigma)
    assert np.mean(exact.sigma) < 0.8 * np.mean(off.sigma)
    assert np.mean(off.sigma) < np.mean(more.sigma)
    assert not np.all(np.abs(blind.sag - SAGS) < KNOWN * blind.sigma)
