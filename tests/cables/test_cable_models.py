"""All cable models: limits, wrench, derivatives against differences, errors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.cables.models import (
    CABLE_MODELS,
    cable_derivatives,
    cable_state,
    check_breaking,
    slack_tensions,
)
from cdpr_drake.cables.straight_kernel import floating_cables, floating_force
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import exponential, rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot

LIMIT = 1e-12
"""What a limit may differ from the simple model, relative to lengths and to E S."""

STEP = 1e-6
DIFFERENCE = 1e-6
"""Differences of fourth order, relative to E S or 1: 1e-16 / STEP is rounding, and where a cable
comes taut its stiffness grows by a power of ten within tenths of a millimetre."""

FEW = settings(max_examples=25, deadline=None)
"""Each example looks at eight cables."""

ELASTIC_MODELS = tuple(name for name in CABLE_MODELS if name != "inextensible")

# Eight cables of CAROCA's kind, some of them over pulleys, one pulley upside down.
P_WA = np.array([(x, y, z) for x in (-1.6, 1.7) for y in (-2.9, 3.0) for z in (0.1, 3.2)]).T
P_PB = np.array([(x, y, z) for x in (0.2, -0.21) for y in (-0.1, 0.12) for z in (0.23, 0.0)]).T
UP = np.tile([[0.0], [0.0], [1.0]], 8)
UP[2, 0] = -1.0
CABLES = CableSet.make(
    P_WA,
    P_PB,
    2.9e6,
    retardation=3e-4,
    pulley_radius=np.array([0.075, 0.075, 0.0, 0.0, 0.1, 0.02, 0.075, 0.075]),
    linear_weight=2.18,
    swivel_axis=UP,
    breaking_load=2e4,
)

position = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.5, 1.5), st.floats(0.5, 2.0)).map(np.array)
angles = st.tuples(*[st.floats(-0.5, 0.5)] * 3).map(np.array)
poses = st.builds(lambda a, p: RigidTransform(rotation_from_angles(a), p), angles, position)
spatial = st.tuples(*[st.floats(-1.0, 1.0)] * 6).map(np.array)
# Strains from stretched to breaking to slack by a fifth; away from the kink of the straight law.
strains = st.tuples(*[st.one_of(st.floats(-0.2, -1e-4), st.floats(1e-4, 3e-3))] * 8).map(np.array)


def moved(X_WP, displacement):
    """X_WP after a small displacement (rotation vector, translation) in W."""
    turn = exponential(np.concatenate([displacement[:3], np.zeros(3)])).rotation()
    return RigidTransform(turn @ X_WP.rotation(), X_WP.translation() + displacement[3:])


def slopes(function):
    """Derivatives at 0 of the attributes of what a function of one number returns, by name."""
    near = [function(k * STEP) for k in (-2, -1, 1, 2)]

    def slope(name):
        a, b, c, d = (getattr(state, name) for state in near)
        return (a - 8 * b + 8 * c - d) / (12 * STEP)

    return slope


def lengths_for(cables, X_WP, strain):
    return cable_paths(X_WP, cables).lengths / (1.0 + strain)


@FEW
@given(poses, strains, spatial)
def test_straight_without_pulleys_it_is_the_kernel_of_the_simulation(X_WP, strain, V):
    cables = CABLES.without_pulleys()
    l0, l0_dot = lengths_for(cables, X_WP, strain), 0.1 * strain
    state = cable_state(cables, "kelvin_voigt", X_WP, l0, V, l0_dot)
    q = X_WP.rotation().ToQuaternion().wxyz()
    x = np.concatenate([q, X_WP.translation(), V])
    force, table = np.empty(6), np.empty((3, 8))
    floating_force(x, l0, l0_dot, cables.packed(), 0, force)
    floating_cables(x, l0, l0_dot, cables.packed(), table)
    scale = CABLES.stiffness[0] * LIMIT
    np.testing.assert_allclose(state.tensions, table[0], atol=scale)
    np.testing.assert_allclose(state.lengths, table[1], rtol=LIMIT)
    np.testing.assert_allclose(state.wrench, force, atol=10 * scale)
    np.testing.assert_array_equal(state.slack, strain < 0.0)


@FEW
@given(poses, strains)
def test_a_weightless_catenary_is_the_straight_elastic_cable(X_WP, strain):
    """With pulleys. A weight that is nearly nothing is enough; nothing at all is exact."""
    l0 = lengths_for(CABLES, X_WP, strain)
    straight = cable_state(CABLES, "elastic", X_WP, l0)
    nothing = replace(CABLES, linear_weight=np.zeros(8))
    np.testing.assert_array_equal(
        cable_state(nothing, "catenary", X_WP, l0).wrench, straight.wrench
    )
    # What the weight bends, w l / t of the length, stays below LIMIT where a cable is taut.
    light = replace(CABLES, linear_weight=np.full(8, 1e-12))
    light_state = cable_state(light, "catenary", X_WP, l0)
    taut = strain > 0.0
    np.testing.assert_allclose(
        light_state.tensions[taut], straight.tensions[taut], rtol=0, atol=LIMIT * 2.9e6
    )
    np.testing.assert_allclose(
        light_state.forces[:, taut], straight.forces[:, taut], rtol=0, atol=3 * LIMIT * 2.9e6
    )
    np.testing.assert_allclose(light_state.lengths[taut], straight.lengths[taut], rtol=LIMIT)
    assert np.all(light_state.tensions[~taut] < 1e-9)


@FEW
@given(poses, strains, st.sampled_from(ELASTIC_MODELS))
def test_a_pulley_of_no_size_is_an_exit_point(X_WP, strain, model):
    none = CABLES.without_pulleys()
    tiny = replace(CABLES, pulley_radius=np.full(8, 1e-14))
    l0 = lengths_for(none, X_WP, strain)
    a, b = (cable_state(cables, model, X_WP, l0) for cables in (none, tiny))
    np.testing.assert_allclose(a.tensions, b.tensions, rtol=0, atol=LIMIT * 2.9e6)
    np.testing.assert_allclose(a.lengths, b.lengths, rtol=LIMIT)
    np.testing.assert_allclose(a.sags, b.sags, rtol=0, atol=LIMIT)


@FEW
@given(poses, strains)
def test_wrench_is_what_the_forces_do(X_WP, strain):
    for model in ELASTIC_MODELS:
        state = cable_state(CABLES, model, X_WP, lengths_for(CABLES, X_WP, strain))
        arms = X_WP.rotation().matrix() @ P_PB
        moment = np.sum(np.cross(arms.T, state.forces.T), axis=0)
        expected = np.concatenate([moment, np.sum(state.forces, axis=1)])
        np.testing.assert_allclose(state.wrench, expected, rtol=LIMIT, atol=1e-9)
        norms = np.linalg.norm(state.forces, axis=0)
        np.testing.assert_allclose(norms, state.tensions, rtol=LIMIT, atol=1e-9)


@pytest.mark.parametrize("model", ELASTIC_MODELS)
@FEW
@given(poses, strains, spatial)
def test_derivatives_by_pose_are_those_of_differences(model, X_WP, strain, direction):
    l0 = lengths_for(CABLES, X_WP, strain)
    D = cable_derivatives(CABLES, model, X_WP, l0)
    slope = slopes(lambda t: cable_state(CABLES, model, moved(X_WP, t * direction), l0))
    for name in ("tensions", "drum_tensions", "lengths", "surplus_lengths", "sags"):
        exact = getattr(D, f"{name}_by_pose") @ direction
        scale = np.maximum(np.abs(exact), 2.9e6 if "tensions" in name else 1.0)
        assert np.all(np.abs(slope(name) - exact) < DIFFERENCE * scale), name
    error = D.wrench_by_pose @ direction - slope("wrench")
    assert np.max(np.abs(error)) < DIFFERENCE * 2.9e6


@pytest.mark.parametrize("model", ELASTIC_MODELS)
@FEW
@given(poses, strains)
def test_derivatives_by_unstrained_length_are_those_of_differences(model, X_WP, strain):
    l0 = lengths_for(CABLES, X_WP, strain)
    D = cable_derivatives(CABLES, model, X_WP, l0)
    slope = slopes(lambda t: cable_state(CABLES, model, X_WP, l0 + t))
    for name in ("tensions", "drum_tensions", "lengths", "surplus_lengths", "sags"):
        exact = getattr(D, f"{name}_by_length")
        scale = np.maximum(np.abs(exact), 2.9e6 if "tensions" in name else 1.0)
        assert np.all(np.abs(slope(name) - exact) < DIFFERENCE * scale), name
    error = np.sum(D.wrench_by_length, axis=1) - slope("wrench")
    assert np.max(np.abs(error)) < DIFFERENCE * 2.9e6


@FEW
@given(poses, strains)
def test_forces_come_from_an_energy(X_WP, strain):
    """Maxwell: pull by length is drum tension by place, (1 + strain at the drum) included.

    The winch does the work -(t + t^2 / 2 ES) per unstrained length that it takes in, less the
    weight that it lifts to the height of A, which is the same for all lengths.
    """
    for model in ("elastic", "catenary"):
        l0 = lengths_for(CABLES, X_WP, strain)
        D = cable_derivatives(CABLES, model, X_WP, l0)
        state = cable_state(CABLES, model, X_WP, l0)
        stretch = 1.0 + state.drum_tensions / CABLES.stiffness
        np.testing.assert_allclose(
            -D.wrench_by_length.T,
            -(stretch[:, np.newaxis] * D.drum_tensions_by_pose),
            rtol=0,
            atol=DIFFERENCE * 1e3,
        )


@FEW
@given(poses, strains, spatial)
def test_length_rates_are_those_of_differences(X_WP, strain, V):
    l0, l0_dot = lengths_for(CABLES, X_WP, strain), 0.1 * strain
    rates = cable_state(CABLES, "catenary", X_WP, l0, V, l0_dot).length_rates
    slope = slopes(lambda t: cable_state(CABLES, "catenary", moved(X_WP, t * V), l0 + t * l0_dot))
    np.testing.assert_allclose(rates, slope("lengths"), atol=DIFFERENCE)


@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
@FEW
@given(X_WP=poses, strain=strains, V=spatial)
def test_damping_takes_energy(model, X_WP, strain, V):
    l0 = lengths_for(CABLES, X_WP, strain)
    still = cable_state(CABLES, model, X_WP, l0).wrench
    moving = cable_state(CABLES, model, X_WP, l0, V).wrench
    assert (moving - still) @ V <= 1e-9 * np.linalg.norm(still)


def test_a_cable_that_pulls_is_not_slack_however_long_it_is():
    """Sixty metres of steel rope across a span, drawn by 300 N: it sags by a metre and a half, so
    it is longer than its chord, and it is taut. Paid out, it hangs and is slack."""
    A, B = np.array([[0.0], [0.0], [0.0]]), np.array([[60.0], [0.0], [0.0]])
    cable = CableSet.make(A, B, 2.9e6, linear_weight=1.0)
    states = [
        cable_state(cable, "catenary", RigidTransform(), np.array([l0])) for l0 in (60.1, 75.0)
    ]
    taut, loose = states
    assert 250.0 < taut.tensions[0] < 350.0
    assert taut.surplus_lengths[0] == pytest.approx(0.1)
    assert not taut.slack[0]
    assert 0.0 < loose.tensions[0] < slack_tensions(cable, "catenary", np.array([75.0]))[0] == 75.0
    assert loose.slack[0]


def test_a_loop_below_the_platform_is_slack_whatever_its_length():
    """It pulls with the weight of what hangs below the platform, never with more than its own."""
    A, B = np.array([[0.0], [0.0], [2.0]]), np.array([[0.05], [0.0], [0.0]])
    cable = CableSet.make(A, B, 2.9e6, linear_weight=2.0)
    for l0 in (2.2, 4.0, 40.0):
        state = cable_state(cable, "catenary", RigidTransform(), np.array([l0]))
        assert 0.0 < state.tensions[0] < 2.0 * l0
        assert state.slack[0]


@FEW
@given(poses, strains)
def test_slack_is_a_matter_of_tension_and_surplus_one_of_length(X_WP, strain):
    l0 = lengths_for(CABLES, X_WP, strain)
    for model in ELASTIC_MODELS:
        state = cable_state(CABLES, model, X_WP, l0)
        np.testing.assert_array_equal(
            state.slack, state.tensions <= slack_tensions(CABLES, model, l0)
        )
        np.testing.assert_array_equal(state.surplus_lengths > 0.0, strain < 0.0)


def test_an_inextensible_cable_has_a_length_and_no_tension_of_its_own():
    X_WP = RigidTransform([0.1, 0.2, 1.0])
    ways = cable_paths(X_WP, CABLES)
    l0 = ways.lengths + np.array([0.0, 0.1, 0, 0, 0, 0, 0, 0])
    V = np.array([0.1, 0.2, -0.1, 0.3, 0.2, 0.1])
    state = cable_state(CABLES, "inextensible", X_WP, l0, V)
    assert state.slack.tolist() == [False, True] + 6 * [False]
    np.testing.assert_allclose(state.surplus_lengths[1], 0.1, rtol=LIMIT)
    assert state.tensions[1] == 0.0
    assert np.all(np.isnan(np.delete(state.tensions, 1)))
    np.testing.assert_allclose(state.length_rates, ways.J @ V)
    with pytest.raises(CableGeometryError, match=r"cable 3: .* 0\.01 m too short"):
        cable_state(CABLES, "inextensible", X_WP, l0 - 0.01 * (np.arange(8) == 2))
    with pytest.raises(CableModelError, match="accepted: an elastic one"):
        cable_derivatives(CABLES, "inextensible", X_WP, l0)


def test_what_makes_no_sense_is_refused():
    X_WP = RigidTransform([0.0, 0.0, 1.0])
    l0 = cable_paths(X_WP, CABLES).lengths
    with pytest.raises(CableModelError, match="found 'rope'; accepted: inextensible"):
        cable_state(CABLES, "rope", X_WP, l0)
    with pytest.raises(CableModelError, match="unstrained lengths: found"):
        cable_state(CABLES, "elastic", X_WP, -l0)
    with pytest.raises(CableModelError, match="unstrained lengths: found"):
        cable_state(CABLES, "elastic", X_WP, l0[:5])
    level = UP.copy()
    level[:, 4] = [1.0, 0.0, 0.0]
    with pytest.raises(CableModelError, match="swivel_axis of cable 5"):
        cable_state(replace(CABLES, swivel_axis=level), "catenary", X_WP, l0)
    inside = replace(CABLES, pulley_radius=np.where(np.arange(8) == 6, 4.0, 0.0))
    with pytest.raises(CableGeometryError, match="cable 7: its anchor point"):
        cable_state(inside, "catenary", X_WP, l0)


def test_a_cable_beyond_its_breaking_load_is_refused():
    X_WP = RigidTransform([0.0, 0.0, 1.0])
    l0 = lengths_for(CABLES, X_WP, np.where(np.arange(8) == 5, 1e-2, 1e-3))
    state = cable_state(CABLES, "elastic", X_WP, l0)
    with pytest.raises(CableGeometryError, match=r"cable 6: .* 2\.9e\+04 N; .* 2e\+04 N"):
        check_breaking(CABLES, state.tensions, l0)
    check_breaking(load_robot("caroca").cable_set(), state.tensions, l0)  # not published there
