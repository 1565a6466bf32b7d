"""Curves of cables for pictures: they end where cables end, and are as long and as deep."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.cables.curves import GROOVE_POINTS, cable_curves
from cdpr_drake.cables.states import cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot

ROUNDING = 1e-9  # of the catenary's Newton steps, whose last is 1e-8 of the tension [m]
POINTS = 2001
CHORDS = 1e-5  # what chords of POINTS points are shorter than a curve, and stretch [m]
SLACK = np.array([0.02, 0.0, 0.1, -1e-3, -1e-4, 0.3, 0.0, 0.05])
"""What unstrained lengths are longer than the way over the pulleys [m]."""

X_WP = load_robot("caroca").home.transform()
OVER_PULLEYS = load_robot("caroca").cable_set()
STRAIGHT = OVER_PULLEYS.without_pulleys()


def lengths(cables):
    return cable_paths(X_WP, cables).lengths + SLACK


def curves(cables, model, *points):
    return cable_curves(cables, model, X_WP, lengths(cables), *points)


def length_of(curve):
    return np.sum(np.linalg.norm(np.diff(curve, axis=1), axis=0))


@pytest.mark.parametrize("cables", [OVER_PULLEYS, STRAIGHT], ids=["pulleys", "straight"])
@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
def test_curves_end_at_exit_and_anchor_points(model, cables):
    ends = [(curve[:, 0], curve[:, -1]) for curve in curves(cables, model)]
    first, last = np.transpose(ends, (1, 2, 0))
    np.testing.assert_allclose(first, cables.p_WA, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(last, X_WP.multiply(cables.p_PB), rtol=0, atol=ROUNDING)


def test_a_catenary_is_as_long_and_as_deep_as_the_model_says():
    state = cable_state(STRAIGHT, "catenary", X_WP, lengths(STRAIGHT))
    for i, curve in enumerate(curves(STRAIGHT, "catenary", POINTS)):
        assert length_of(curve) == pytest.approx(state.lengths[i], abs=CHORDS)
        chord = curve[:, -1] - curve[:, 0]
        across = np.cross((curve - curve[:, :1]).T, chord / np.linalg.norm(chord))
        assert np.max(np.linalg.norm(across, axis=1)) == pytest.approx(state.sags[i], abs=CHORDS)


def test_free_part_of_a_catenary_leaves_its_groove_along_the_tangent():
    radii = OVER_PULLEYS.pulley_radius
    for A, r, curve in zip(
        OVER_PULLEYS.p_WA.T, radii, curves(OVER_PULLEYS, "catenary", POINTS), strict=True
    ):
        T, after = curve[:, GROOVE_POINTS - 1], curve[:, GROOVE_POINTS]
        out = (T - A) * [1.0, 1.0, 0.0]
        spoke = (T - A) / r - out / np.linalg.norm(out)
        assert np.linalg.norm(spoke) == pytest.approx(1.0, abs=1e-6)
        # The first of many chords turns from the tangent by half of its share of the curve.
        assert abs(spoke @ (after - T) / np.linalg.norm(after - T)) < 2.0 / POINTS


@pytest.mark.parametrize("weight", [None, 0.0])
def test_slack_cables_without_weight_show_their_surplus(weight):
    cables = STRAIGHT
    if weight is not None:
        cables = replace(cables, linear_weight=np.full(8, weight))
    l0 = lengths(cables)
    for i, curve in enumerate(curves(cables, "kelvin_voigt", POINTS)):
        if SLACK[i] <= 0.0:
            assert curve.shape == (3, 2)
        else:
            assert length_of(curve) == pytest.approx(l0[i], abs=5 * CHORDS)
            chord = np.linspace(curve[2, 0], curve[2, -1], POINTS)
            assert np.all(curve[2, 1:-1] < chord[1:-1])  # hangs below


@pytest.mark.parametrize("i", [3, 4])
def test_taut_cables_over_pulleys_follow_groove_and_tangent(i):
    paths, curve = cable_paths(X_WP, OVER_PULLEYS), curves(OVER_PULLEYS, "elastic")[i]
    assert curve.shape == (3, GROOVE_POINTS + 1)
    np.testing.assert_allclose(curve[:, -2], paths.p_WT[:, i], rtol=0, atol=ROUNDING)
    # Four chords of at most half a turn: 1 - sin(pi / 8) / (pi / 8) is 2.6 per cent.
    assert 0.97 * paths.arcs[i] < length_of(curve[:, :-1]) < paths.arcs[i]
