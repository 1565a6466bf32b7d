"""Cables of any model hold what they are asked to hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.cables.models import cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.static_tensions import find_static_tensions, lengths_for_tensions

BALANCE = 1e-6
"""Force [N] and moment [N m] left of 1.5 kN: lengths of 4 m are rounded to 4e-16 m, times a
stiffness of 1 MN/m for each of eight cables, and tensions are settled to 1e-12."""

CAROCA = load_robot("caroca")
BOUNDS = (0.0, 1e4)

position = st.tuples(st.floats(-0.6, 0.6), st.floats(-1.0, 1.0), st.floats(0.5, 1.8)).map(np.array)
angles = st.tuples(*[st.floats(-0.1, 0.1)] * 3).map(np.array)
poses = st.builds(lambda a, p: RigidTransform(rotation_from_angles(a), p), angles, position)


def weight(robot, X_WP):
    return gravity_wrench(X_WP, robot.platform.mass, robot.center_of_mass(), robot.gravity)


@pytest.mark.parametrize("model", ["elastic", "kelvin_voigt", "catenary"])
@pytest.mark.parametrize("pulleys", [False, True])
@settings(max_examples=10, deadline=None)
@given(X_WP=poses)
def test_the_platform_is_at_rest(model, pulleys, X_WP):
    cables = CAROCA.cable_set() if pulleys else CAROCA.cable_set().without_pulleys()
    w = weight(CAROCA, X_WP)
    found = find_static_tensions(cables, model, X_WP, w, BOUNDS)
    state = cable_state(cables, model, X_WP, found.unstrained_lengths)
    np.testing.assert_allclose(state.wrench, -w, atol=BALANCE)
    np.testing.assert_allclose(state.tensions, found.tensions, atol=BALANCE)
    np.testing.assert_allclose(state.drum_tensions, found.drum_tensions, atol=BALANCE)
    assert np.all((found.tensions >= -BALANCE) & (found.tensions <= BOUNDS[1]))


def test_heavy_cables_carry_themselves_too():
    """The tensions at A hold platform and cables, those at B the platform."""
    X_WP, cables = CAROCA.home.transform(), CAROCA.cable_set().without_pulleys()
    found = find_static_tensions(cables, "catenary", X_WP, weight(CAROCA, X_WP), BOUNDS)
    assert np.all(found.drum_tensions > found.tensions)
    rope = np.sum(cables.linear_weight * found.unstrained_lengths)
    light = find_static_tensions(cables, "elastic", X_WP, weight(CAROCA, X_WP), BOUNDS)
    gain = np.sum(found.drum_tensions - light.tensions)
    # Half of the cables' weight hangs on the platform, steeply enough to take more than that.
    assert gain > 0.5 * rope


def test_inextensible_cables_have_the_lengths_of_their_ways():
    X_WP, cables = CAROCA.home.transform(), CAROCA.cable_set()
    found = find_static_tensions(cables, "inextensible", X_WP, weight(CAROCA, X_WP), BOUNDS)
    np.testing.assert_array_equal(found.unstrained_lengths, cable_paths(X_WP, cables).lengths)


def test_none_where_nothing_holds():
    X_WP = RigidTransform([1.9, 3.4, 1.0])
    cables = CAROCA.cable_set().without_pulleys()
    for model in ("elastic", "catenary"):
        assert find_static_tensions(cables, model, X_WP, weight(CAROCA, X_WP), BOUNDS) is None


def test_lengths_belong_to_their_tensions():
    X_WP, cables = CAROCA.home.transform(), CAROCA.cable_set()
    tensions = np.array([20.0, 30.0, 100.0, 300.0, 1e3, 3e3, 9e3, 50.0])
    for model in ("elastic", "catenary"):
        l0 = lengths_for_tensions(cables, model, X_WP, tensions)
        found = cable_state(cables, model, X_WP, l0).tensions
        np.testing.assert_allclose(found, tensions, rtol=0, atol=1e-6)
