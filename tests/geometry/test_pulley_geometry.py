"""Paths of all cables at a pose: straight ones without pulleys, errors at the border."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.geometry.straight_cables import cable_lengths, length_jacobian
from cdpr_drake.models.robot_loader import load_robot
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

ROUNDING = 1e-12
STEP = 1e-6
DIFFERENCE = 1e-8  # STEP^2 over the square of lengths above 0.5 m, and 1e-16 / STEP


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_without_pulleys_they_are_straight(name):
    robot = load_robot(name)
    X_WP, cables = robot.home.transform(), robot.cable_set().without_pulleys()
    paths = cable_paths(X_WP, cables)
    np.testing.assert_allclose(
        paths.lengths, cable_lengths(X_WP, cables.p_WA, cables.p_PB), rtol=0, atol=ROUNDING
    )
    J = length_jacobian(X_WP, cables.p_WA, cables.p_PB)
    np.testing.assert_allclose(paths.J, J, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(paths.p_WT, cables.p_WA)
    np.testing.assert_array_equal(paths.arcs, 0.0)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_jacobian_is_the_derivative_of_the_lengths(name):
    robot = load_robot(name)
    cables = robot.cable_set()
    X_WP = robot.home.transform() @ RigidTransform(
        exponential(np.array([0.1, 0.05, -0.1, 0, 0, 0])).rotation(), [0.0] * 3
    )
    J = cable_paths(X_WP, cables).J
    for j in range(6):
        V = np.zeros(6)
        V[j] = 1.0

        def lengths(t, V=V):
            turn = exponential(np.concatenate([V[:3] * t, np.zeros(3)])).rotation()
            X = RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + V[3:] * t)
            return cable_paths(X, cables).lengths

        slope = (lengths(STEP) - lengths(-STEP)) / (2 * STEP)
        np.testing.assert_allclose(J[:, j], slope, atol=DIFFERENCE)


def test_the_parts_add_up_and_end_at_the_anchor_points():
    robot = load_robot("caroca")
    X_WP, cables = robot.home.transform(), robot.cable_set()
    paths = cable_paths(X_WP, cables)
    np.testing.assert_array_equal(paths.lengths, paths.free + paths.arcs)
    np.testing.assert_allclose(
        paths.p_WT + paths.free * paths.u_W, X_WP.multiply(cables.p_PB), atol=ROUNDING
    )
    # A cable that falls steeply from a pulley of 75 mm covers more than a quarter of it.
    assert np.all(paths.arcs > 0.075 * np.pi / 2)
    assert np.all(paths.arcs < 0.075 * np.pi)


def test_an_anchor_point_in_the_groove_is_refused():
    cables = load_robot("acrobot_small").cable_set()
    cables = replace(cables, pulley_radius=np.where(np.arange(8) == 3, 1.5, 0.0045))
    with pytest.raises(CableGeometryError, match=r"cable 4: its anchor point .* of radius 1\.5 m"):
        cable_paths(RigidTransform([0.0, 0.0, 0.6]), cables)


def test_an_anchor_point_on_its_exit_point_is_refused():
    cables = load_robot("acrobot_small").cable_set().without_pulleys()
    X_WP = RigidTransform(cables.p_WA[:, 6] - cables.p_PB[:, 6])
    with pytest.raises(CableGeometryError, match=r"cable 7: .* lies on its exit point"):
        cable_paths(X_WP, cables)
