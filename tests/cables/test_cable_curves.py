"""Curves of cables for pictures: they end where cables end, and are as long and as deep."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.cables.curves import GROOVE_POINTS, cable_curves
from cdpr_drake.cables.models import cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot

ROUNDING = 1e-9
"""Of the catenary's Newton steps, whose last is 1e-8 of the tension and squares [m]."""

POINTS = 2001

CHORDS = 1e-5
"""What chords of `POINTS` points are shorter than a curve of some metres, and stretch [m]."""

SLACK = np.array([0.02, 0.0, 0.1, -1e-3, -1e-4, 0.3, 0.0, 0.05])
"""What unstrained lengths are longer than the straight way [m]."""


@pytest.fixture(scope="module")
def robot():
    return load_robot("caroca")


def at_home(robot, cables):
    """The pose, and unstrained lengths that differ by `SLACK` from the way over the pulleys."""
    X_WP = robot.home.transform()
    return X_WP, cable_paths(X_WP, cables).lengths + SLACK


def length_of(curve):
    return np.sum(np.linalg.norm(np.diff(curve, axis=1), axis=0))


@pytest.mark.parametrize("pulleys", [True, False])
@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
def test_curves_end_at_exit_and_anchor_points(robot, model, pulleys):
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    X_WP, l0 = at_home(robot, cables)
    for i, curve in enumerate(cable_curves(cables, model, X_WP, l0)):
        np.testing.assert_allclose(curve[:, 0], cables.p_WA[:, i], rtol=0, atol=ROUNDING)
        B = X_WP.multiply(cables.p_PB[:, i])
        np.testing.assert_allclose(curve[:, -1], B, rtol=0, atol=ROUNDING)


def test_a_catenary_is_as_long_and_as_deep_as_the_model_says(robot):
    cables = robot.cable_set().without_pulleys()
    X_WP, l0 = at_home(robot, cables)
    state = cable_state(cables, "catenary", X_WP, l0)
    for i, curve in enumerate(cable_curves(cables, "catenary", X_WP, l0, POINTS)):
        assert length_of(curve) == pytest.approx(state.lengths[i], abs=CHORDS)
        chord = curve[:, -1] - curve[:, 0]
        across = np.cross((curve - curve[:, :1]).T, chord / np.linalg.norm(chord))
        assert np.max(np.linalg.norm(across, axis=1)) == pytest.approx(state.sags[i], abs=CHORDS)


def test_free_part_of_a_catenary_leaves_its_groove_along_the_tangent(robot):
    cables = robot.cable_set()
    X_WP, l0 = at_home(robot, cables)
    for i, curve in enumerate(cable_curves(cables, "catenary", X_WP, l0, POINTS)):
        T, after = curve[:, GROOVE_POINTS - 1], curve[:, GROOVE_POINTS]
        out = T - cables.p_WA[:, i]
        out[2] = 0.0
        centre = cables.p_WA[:, i] + cables.pulley_radius[i] * out / np.linalg.norm(out)
        spoke = (T - centre) / cables.pulley_radius[i]
        assert np.linalg.norm(spoke) == pytest.approx(1.0, abs=1e-6)
        # The first of many chords turns from the tangent by half of its share of the curve.
        assert abs(spoke @ (after - T) / np.linalg.norm(after - T)) < 2.0 / POINTS


@pytest.mark.parametrize("weight", [None, 0.0])
def test_slack_cables_without_weight_show_their_surplus(robot, weight):
    cables = robot.cable_set().without_pulleys()
    if weight is not None:
        cables = replace(cables, linear_weight=np.full(8, weight))
    X_WP, l0 = at_home(robot, cables)
    for i, curve in enumerate(cable_curves(cables, "kelvin_voigt", X_WP, l0, POINTS)):
        if SLACK[i] <= 0.0:
            assert curve.shape == (3, 2)
            continue
        assert length_of(curve) == pytest.approx(l0[i], abs=5 * CHORDS)
        share = np.linspace(0.0, 1.0, POINTS)
        chord = curve[2, 0] + (curve[2, -1] - curve[2, 0]) * share
        assert np.all(curve[2, 1:-1] < chord[1:-1])  # hangs below


def test_taut_cables_over_pulleys_follow_groove_and_tangent(robot):
    cables = robot.cable_set()
    X_WP, l0 = at_home(robot, cables)
    paths = cable_paths(X_WP, cables)
    for i in (3, 4):
        curve = cable_curves(cables, "elastic", X_WP, l0)[i]
        assert curve.shape == (3, GROOVE_POINTS + 1)
        np.testing.assert_allclose(curve[:, -2], paths.p_WT[:, i], rtol=0, atol=ROUNDING)
        groove = length_of(curve[:, :-1])
        # Four chords of at most half a turn: 1 - sin(pi / 8) / (pi / 8) is 2.6 per cent.
        assert 0.97 * paths.arcs[i] < groove < paths.arcs[i]
