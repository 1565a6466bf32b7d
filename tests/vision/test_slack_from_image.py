"""Slack read from images: the catenary against its length, its inverse, and pictures of cables."""

import numpy as np
import pytest

from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.slack_correction import tension_correction
from cdpr_drake.vision.cable_images import (
    cable_images,
    catenary_drop,
    slack_from_image,
    slack_rates,
    surplus_of_drops,
)

ROBOT = load_robot("acrobot_large")
CABLES = ROBOT.cable_set().without_pulleys()
X_WE = ROBOT.camera_mount("overview").pose.transform()
PINHOLE = load_camera("astra").pinhole(640, 480)
X_WP = pose_from_angles(np.array([0.202, 0.118, 0.268]), np.radians([-18.0, 10.0, 4.0]))
COUNT = 15
CHAIN = 1e-7
"""Of a length that is added up of 20000 pieces of a curve [m]."""
CURVE = 2e-4
"""Of points that are interpolated on 41 of a drawn curve, as they are in images here [m]."""


@pytest.mark.parametrize(
    ("span", "rise", "surplus"),
    [(1.0, 0.4, 0.02), (0.5, -1.0, 0.08), (1.2, 0.0, 1e-4), (0.3, 0.1, 2.0)],
)
def test_a_catenary_is_as_long_as_it_is_told(span, rise, surplus):
    x = np.linspace(0.0, span, 20_001)
    z = rise * x / span - catenary_drop(x, span, rise, surplus)
    assert z[0] == pytest.approx(0.0, abs=1e-9)
    assert z[-1] == pytest.approx(rise, abs=1e-9)
    length = np.sum(np.hypot(np.diff(x), np.diff(z)))
    assert length - np.hypot(span, rise) == pytest.approx(surplus, rel=1e-5, abs=CHAIN)
    some = np.linspace(0.1, 0.9, 9) * span
    found, _ = surplus_of_drops(some, catenary_drop(some, span, rise, surplus), span, rise)
    assert found == pytest.approx(surplus, rel=1e-6)


def test_what_a_surplus_changes_by_each_point_is_a_derivative():
    x = np.linspace(0.1, 0.9, 7)
    drops = catenary_drop(x, 1.0, 0.4, 0.03) + 1e-3 * np.sin(7.0 * x)
    _, by_drop = surplus_of_drops(x, drops, 1.0, 0.4)
    differences = [
        (surplus_of_drops(x, drops + d, 1.0, 0.4)[0] - surplus_of_drops(x, drops - d, 1.0, 0.4)[0])
        / 2e-6
        for d in 1e-6 * np.eye(7)
    ]
    # The curvature of the catenary by its length is left out, as by Gauss and Newton.
    np.testing.assert_allclose(by_drop, differences, rtol=0.02)


def image(surplus, noise, seed=0):
    """Image of cables, of which the first two hang through."""
    lengths = cable_paths(X_WP, CABLES).lengths
    lengths = lengths + np.where(np.arange(8) < 2, surplus, -1e-3)
    curves = cable_curves(CABLES, "kelvin_voigt", X_WP, lengths, 41)
    return cable_images(curves, X_WE, PINHOLE, COUNT, noise, np.random.default_rng(seed))


@pytest.mark.parametrize("surplus", [0.02, 0.04, 0.08])
def test_slack_is_seen_as_it_is(surplus):
    exact = slack_from_image(image(surplus, 0.0), CABLES, X_WP, X_WE, PINHOLE, 0.5)
    there = np.isfinite(exact.surplus[:2])
    assert np.any(there)
    np.testing.assert_allclose(exact.surplus[:2][there], surplus, atol=CURVE)
    taut = exact.surplus[2:][np.isfinite(exact.surplus[2:])]
    np.testing.assert_allclose(taut, 0.0, atol=CURVE)
    noisy = np.array([
        slack_from_image(
            image(surplus, 0.5, seed), CABLES, X_WP, X_WE, PINHOLE, 0.5
        ).surplus[:2][there]
        for seed in range(40)
    ])  # fmt: skip
    # Predicted deviation, within a half of that of 40 pictures.
    np.testing.assert_allclose(np.std(noisy, axis=0), exact.deviation[:2][there], rtol=0.5)
    assert np.max(np.abs(np.mean(noisy, axis=0) - surplus)) < 1e-3


def test_an_error_of_the_pose_is_no_larger_one_of_the_slack():
    wrong = X_WP @ exponential(np.array([0.0, 0.0, 0.0, 3e-3, -3e-3, 3e-3]))
    found = slack_from_image(image(0.04, 0.0), CABLES, wrong, X_WE, PINHOLE, 0.5).surplus[:2]
    assert np.nanmax(np.abs(found - 0.04)) < 0.02


def test_what_is_not_in_the_image_is_not_seen():
    away = exponential(np.array([0.0, np.pi, 0.0, 0.0, 0.0, 0.0]))
    curves = cable_curves(
        CABLES, "kelvin_voigt", X_WP, cable_paths(X_WP, CABLES).lengths + 0.04, 41
    )
    pixels = cable_images(curves, X_WE @ away, PINHOLE, COUNT, 0.0, np.random.default_rng(0))
    assert np.all(np.isnan(pixels))
    found = slack_from_image(pixels, CABLES, X_WP, X_WE @ away, PINHOLE, 0.5)
    assert np.all(np.isnan(found.surplus))


def test_rates_grow_with_what_is_seen_and_end_with_tension():
    tensions = np.array([0.0, 0.0, 0.0, 5.0, 0.2])
    threshold, gain = np.ones(5), np.full(5, 0.04)
    alone = tension_correction(tensions, threshold, gain)
    found = slack_rates(
        alone, tensions, threshold, np.array([0.08, 0.02, np.nan, 0.08, 0.001]),
        allowance=0.002, time=0.25, fastest=0.3,
    )  # fmt: skip
    np.testing.assert_allclose(found, [-0.3, -0.072, -0.04, 0.0, -0.032], atol=1e-12)
