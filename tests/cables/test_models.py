"""All cable models: limits, wrenches, energies, kernels, derivatives and refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import RigidTransform

from cdpr_drake.cables.dispatch_kernel import cable_energy, cable_response
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.cables.models import CABLE_MODELS, STRAIGHT
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.cables.simulation_autodiff import (
    model_force_and_drums_array,
    model_force_array,
    model_outputs_array,
    solve_catenary_any,
)
from cdpr_drake.cables.simulation_kernel import (
    OUTPUTS,
    make_room,
    model_force,
    model_force_and_drums,
    model_outputs,
    outputs_kernel,
)
from cdpr_drake.cables.states import cable_derivatives, cable_state, check_breaking, slack_tensions
from cdpr_drake.cables.straight_kernel import cable_pull, floating_force
from cdpr_drake.errors import CableGeometryError, CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import cable_line, floating_motion
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.pulley_kernel import (
    CABLE_SET_COLUMNS,
    LINEAR_WEIGHT,
    PULLEY_RADIUS,
    SWIVEL_AXIS,
)
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.kernel_calls import any_scalar
from tests.geometry.geometry_cases import moved

ES = 2.9e6
LIMIT = 1e-12  # what a limit may differ from the simple model, relative to lengths and to E S
DIFFERENCE = 1e-6
"""Differences of fourth order over 1e-6, relative to E S or 1: rounding, and where a cable comes
taut its stiffness grows by a power of ten within tenths of a millimetre."""

FEW = settings(max_examples=15, deadline=None)  # of eight cables each
ELASTIC_MODELS = tuple(name for name in CABLE_MODELS if name != "inextensible")
elastic_models = pytest.mark.parametrize("model", ELASTIC_MODELS)

# Eight cables of CAROCA's kind, some of them over pulleys, one pulley upside down.
P_WA = np.array([(x, y, z) for x in (-1.6, 1.7) for y in (-2.9, 3.0) for z in (0.1, 3.2)]).T
P_PB = np.array([(x, y, z) for x in (0.2, -0.21) for y in (-0.1, 0.12) for z in (0.23, 0.0)]).T
UP = np.array([[0.0] * 8, [0.0] * 8, [-1.0] + [1.0] * 7])
CABLES = CableSet.make(
    P_WA, P_PB, ES, retardation=3e-4, linear_weight=2.18, swivel_axis=UP, breaking_load=2e4,
    pulley_radius=np.array([0.075, 0.075, 0.0, 0.0, 0.1, 0.02, 0.075, 0.075]),
)  # fmt: skip
HOME = RigidTransform([0.0, 0.0, 1.0])

share = st.floats(-1.0, 1.0)
position = st.tuples(share, st.floats(-1.5, 1.5), st.floats(0.5, 2.0))
poses = st.builds(pose_from_angles, position, st.tuples(*[st.floats(-0.5, 0.5)] * 3).map(np.array))
spatial = st.tuples(*[share] * 6).map(np.array)
# From stretched to breaking to slack by a fifth; away from the kink of the straight law.
strains = st.tuples(*[st.one_of(st.floats(-0.2, -1e-4), st.floats(1e-4, 3e-3))] * 8).map(np.array)


def slope(function, step=1e-6):
    """Derivative at 0, of fourth order."""
    a, b, c, d = (function(k * step) for k in (-2, -1, 1, 2))
    return (a - 8 * b + 8 * c - d) / (12 * step)


NAMES = ("tensions", "drum_tensions", "lengths", "surplus_lengths", "sags")


def vector(state):
    """Numbers of a state by which derivatives are compared, as shares of E S where forces."""
    return np.concatenate([
        *(getattr(state, name) / (ES if "tensions" in name else 1.0) for name in NAMES),
        state.wrench / ES,
    ])  # fmt: skip


def check_slopes(function, by_name, wrench):
    rows = [by_name(name) / (ES if "tensions" in name else 1.0) for name in NAMES]
    exact = np.concatenate([*rows, wrench / ES])
    error = np.abs(slope(lambda t: vector(function(t))) - exact)
    scale = np.maximum(np.abs(exact), 1.0)
    scale[-6:] = 1.0
    assert np.all(error < DIFFERENCE * scale)


def lengths_for(cables, X_WP, strain):
    return cable_paths(X_WP, cables).lengths / (1.0 + strain)


@FEW
@given(poses, strains, spatial)
def test_straight_without_pulleys_it_is_the_kernel_of_the_simulation(X_WP, strain, V):
    cables = CABLES.without_pulleys()
    l0, l0_dot = lengths_for(cables, X_WP, strain), 0.1 * strain
    state = cable_state(cables, "kelvin_voigt", X_WP, l0, V, l0_dot)
    x = np.concatenate([X_WP.rotation().ToQuaternion().wxyz(), X_WP.translation(), V])
    force, motion = np.empty(6), floating_motion(x)
    floating_force(x, l0, l0_dot, cables.packed(), 0, force)
    of_each = zip(cables.packed(), l0, l0_dot, strict=True)
    tensions, lengths = np.array([cable_pull(motion, *one)[:2] for one in of_each]).T
    np.testing.assert_allclose(state.tensions, tensions, atol=ES * LIMIT)
    np.testing.assert_allclose(state.lengths, lengths, rtol=LIMIT)
    np.testing.assert_allclose(state.wrench, force, atol=10 * ES * LIMIT)
    np.testing.assert_array_equal(state.slack, strain < 0.0)


@FEW
@given(poses, strains)
def test_a_weightless_catenary_is_the_straight_elastic_cable(X_WP, strain):
    """With pulleys. A weight that is nearly nothing is enough; nothing at all is exact."""
    l0 = lengths_for(CABLES, X_WP, strain)
    straight, none, light = (
        cable_state(replace(CABLES, linear_weight=np.full(8, w)), model, X_WP, l0)
        for w, model in ((2.18, "elastic"), (0.0, "catenary"), (1e-12, "catenary"))
    )
    np.testing.assert_array_equal(none.wrench, straight.wrench)
    # What the weight bends, w l / t of the length, stays below LIMIT where a cable is taut.
    taut, atol = strain > 0.0, LIMIT * ES
    np.testing.assert_allclose(light.tensions[taut], straight.tensions[taut], rtol=0, atol=atol)
    forces = light.forces[:, taut], straight.forces[:, taut]
    np.testing.assert_allclose(*forces, rtol=0, atol=3 * atol)
    np.testing.assert_allclose(light.lengths[taut], straight.lengths[taut], rtol=LIMIT)
    assert np.all(light.tensions[~taut] < 1e-9)


@elastic_models
@FEW
@given(X_WP=poses, strain=strains, direction=spatial)
def test_wrench_slack_derivatives_and_tiny_pulleys(model, X_WP, strain, direction):
    l0 = lengths_for(CABLES, X_WP, strain)
    state = cable_state(CABLES, model, X_WP, l0)
    arms = X_WP.rotation().matrix() @ P_PB
    moment = np.sum(np.cross(arms.T, state.forces.T), axis=0)
    wrench = np.concatenate([moment, np.sum(state.forces, axis=1)])
    np.testing.assert_allclose(state.wrench, wrench, rtol=LIMIT, atol=1e-9)
    norms = np.linalg.norm(state.forces, axis=0)
    np.testing.assert_allclose(norms, state.tensions, rtol=LIMIT, atol=1e-9)
    # Slack is a matter of tension, and surplus one of length.
    slack = state.tensions <= slack_tensions(CABLES, model, l0)
    np.testing.assert_array_equal(state.slack, slack)
    np.testing.assert_array_equal(state.surplus_lengths > 0.0, strain < 0.0)
    D = cable_derivatives(CABLES, model, X_WP, l0)
    check_slopes(
        lambda t: cable_state(CABLES, model, moved(X_WP, direction, t), l0),
        lambda name: getattr(D, f"{name}_by_pose") @ direction, D.wrench_by_pose @ direction,
    )  # fmt: skip
    check_slopes(
        lambda t: cable_state(CABLES, model, X_WP, l0 + t),
        lambda name: getattr(D, f"{name}_by_length"), np.sum(D.wrench_by_length, axis=1),
    )  # fmt: skip
    # Maxwell: pull by length is drum tension by place, (1 + strain at the drum) included. The
    # winch does the work -(t + t^2 / 2 ES) per unstrained length that it takes in.
    if model in ("elastic", "catenary"):
        stretch = (1.0 + state.drum_tensions / ES)[:, np.newaxis]
        expected = stretch * D.drum_tensions_by_pose
        np.testing.assert_allclose(D.wrench_by_length.T, expected, rtol=0, atol=DIFFERENCE * 1e3)
    # A pulley of no size is an exit point.
    none = CABLES.without_pulleys()
    tiny, l0 = replace(CABLES, pulley_radius=np.full(8, 1e-14)), lengths_for(none, X_WP, strain)
    a, b = (cable_state(cables, model, X_WP, l0) for cables in (none, tiny))
    np.testing.assert_allclose(a.tensions, b.tensions, rtol=0, atol=LIMIT * ES)
    np.testing.assert_allclose(a.lengths, b.lengths, rtol=LIMIT)
    np.testing.assert_allclose(a.sags, b.sags, rtol=0, atol=LIMIT)


@pytest.mark.parametrize("model", ["kelvin_voigt", "catenary"])
@FEW
@given(X_WP=poses, strain=strains, V=spatial)
def test_rates_are_those_of_differences_and_damping_takes_energy(model, X_WP, strain, V):
    l0, l0_dot = lengths_for(CABLES, X_WP, strain), 0.1 * strain
    rates = cable_state(CABLES, model, X_WP, l0, V, l0_dot).length_rates
    expected = slope(
        lambda t: cable_state(CABLES, model, moved(X_WP, V, t), l0 + t * l0_dot).lengths
    )
    np.testing.assert_allclose(rates, expected, atol=DIFFERENCE)
    still = cable_state(CABLES, model, X_WP, l0).wrench
    moving = cable_state(CABLES, model, X_WP, l0, V).wrench
    assert (moving - still) @ V <= 1e-9 * np.linalg.norm(still)


def one_cable(A, B, l0, weight):
    cable = CableSet.make(np.array([A]).T, np.array([B]).T, ES, linear_weight=weight)
    return cable, cable_state(cable, "catenary", RigidTransform(), np.array([l0]))


def test_a_cable_that_pulls_is_not_slack_however_long_it_is():
    """Sixty metres of steel rope across a span, drawn by 300 N: it sags by a metre and a half, so
    it is longer than its chord, and it is taut. Paid out, it hangs and is slack."""
    _, taut = one_cable([0.0, 0.0, 0.0], [60.0, 0.0, 0.0], 60.1, 1.0)
    assert 250.0 < taut.tensions[0] < 350.0
    assert taut.surplus_lengths[0] == pytest.approx(0.1)
    assert not taut.slack[0]
    cable, loose = one_cable([0.0, 0.0, 0.0], [60.0, 0.0, 0.0], 75.0, 1.0)
    assert 0.0 < loose.tensions[0] < slack_tensions(cable, "catenary", np.array([75.0]))[0] == 75.0
    assert loose.slack[0]


@pytest.mark.parametrize("l0", [2.2, 4.0, 40.0])
def test_a_loop_below_the_platform_is_slack_whatever_its_length(l0):
    """It pulls with the weight of what hangs below the platform, never with more than its own."""
    _, state = one_cable([0.0, 0.0, 2.0], [0.05, 0.0, 0.0], l0, 2.0)
    assert 0.0 < state.tensions[0] < 2.0 * l0
    assert state.slack[0]


def test_an_inextensible_cable_has_a_length_and_no_tension_of_its_own():
    X_WP, V = RigidTransform([0.1, 0.2, 1.0]), np.array([0.1, 0.2, -0.1, 0.3, 0.2, 0.1])
    ways = cable_paths(X_WP, CABLES)
    state = cable_state(CABLES, "inextensible", X_WP, ways.lengths + 0.1 * np.eye(8)[1], V)
    assert state.slack.tolist() == [False, True] + 6 * [False]
    np.testing.assert_allclose(state.surplus_lengths[1], 0.1, rtol=LIMIT)
    assert state.tensions[1] == 0.0
    assert np.all(np.isnan(np.delete(state.tensions, 1)))
    np.testing.assert_allclose(state.length_rates, ways.J @ V)


L0 = cable_paths(HOME, CABLES).lengths
TILTED = UP.copy()
TILTED[:, 4] = [1.0, 0.0, 0.0]
INSIDE = np.where(np.arange(8) == 6, 4.0, 0.0)


@pytest.mark.parametrize(
    ("error", "words", "model", "l0", "change"),
    [
        (CableModelError, "found 'rope'; accepted: inextensible", "rope", L0, {}),
        (CableModelError, "unstrained lengths: found", "elastic", -L0, {}),
        (CableModelError, "unstrained lengths: found", "elastic", L0[:5], {}),
        (CableModelError, "swivel_axis of cable 5", "catenary", L0, {"swivel_axis": TILTED}),
        (CableGeometryError, "cable 7: its anchor", "catenary", L0, {"pulley_radius": INSIDE}),
        (
            CableGeometryError, r"cable 3: .* 0\.01 m too short", "inextensible",
            L0 - 0.01 * np.eye(8)[2], {},
        ),
    ],
)  # fmt: skip
def test_refusal(error, words, model, l0, change):
    with pytest.raises(error, match=words):
        cable_state(replace(CABLES, **change), model, HOME, l0)


def test_refusal_of_derivatives_and_of_a_cable_beyond_its_breaking_load():
    with pytest.raises(CableModelError, match="accepted: an elastic one"):
        cable_derivatives(CABLES, "inextensible", HOME, L0)
    l0 = lengths_for(CABLES, HOME, np.where(np.arange(8) == 5, 1e-2, 1e-3))
    tensions = cable_state(CABLES, "elastic", HOME, l0).tensions
    with pytest.raises(CableGeometryError, match=r"cable 6: .* 2\.9e\+04 N; .* 2e\+04 N"):
        check_breaking(CABLES, tensions, l0)
    check_breaking(load_robot("caroca").cable_set(), tensions, l0)  # not published there


# Kernels of simulations.

ROUNDING = 1e-7  # [N], of tensions near 300 N and a stiffness of 1 MN/m
ROBOTS = {name: load_robot(name) for name in ("caroca", "planar")}
situations = pytest.mark.parametrize(
    ("name", "sags", "pulleys"),
    [(name, sags, over) for name in ROBOTS for sags in (False, True) for over in (False, True)],
)


def situation(name, pulleys, seed):
    """State of the platform, unstrained lengths, their rates, cables, height of the plane."""
    robot, random = ROBOTS[name], np.random.default_rng(seed).uniform(-1.0, 1.0, 22)
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    if robot.is_planar():
        state = np.concatenate([[0.1, 0.05, 0.2] * random[:3], random[3:6]])
    else:
        p = robot.home.transform().translation() + 0.2 * random[3:6]
        state = np.concatenate([[1.0], 0.1 * random[:3], p, random[6:12]])
    m = cables.count
    strain = 1e-3 * random[12 : 12 + m]
    strain = np.where(np.abs(strain) < 1e-5, 1e-5, strain)  # away from the kink at zero
    l0 = cable_paths(pose_from_state(robot, state), cables).lengths / (1.0 + strain)
    return robot, state, l0, 0.1 * random[:m], cables, float(robot.plane_height or 0.0)


def force_and_outputs(state, l0, l0_dot, rows, sags, height):
    m, nv = len(l0), 3 if len(state) == 6 else 6
    force, table = np.empty(nv), np.empty((OUTPUTS, m))
    inputs = state, l0, l0_dot, rows, make_room(m, sags, height)
    assert model_force(*inputs, force) == model_outputs(*inputs, table) == -1
    if not sags:
        own = np.empty_like(table)
        assert outputs_kernel(STRAIGHT)(*inputs, own) == -1
        np.testing.assert_array_equal(own, table)
    return force, table


@situations
def test_kernels_are_the_pure_function(name, sags, pulleys):
    for seed in range(15):
        robot, state, l0, l0_dot, cables, height = situation(name, pulleys, seed)
        rows, planar = cables.packed(), robot.is_planar()
        force, table = force_and_outputs(state, l0, l0_dot, rows, sags, height)
        V = np.array([0.0, 0.0, state[5], state[3], state[4], 0.0]) if planar else state[7:]
        model, X_WP = "catenary" if sags else "kelvin_voigt", pose_from_state(robot, state)
        expected = cable_state(cables, model, X_WP, l0, V, l0_dot)
        wrench = expected.wrench[[3, 4, 2]] if planar else expected.wrench
        np.testing.assert_allclose(force, wrench, atol=ROUNDING)
        columns = [getattr(expected, column) for column in NAMES]
        np.testing.assert_allclose(table[[0, 1, 2, 4, 5]], columns, atol=ROUNDING)
        # Force and drum tensions together; the platform's velocities may lie behind others.
        m, nv, first = len(l0), len(force), 2
        both, inputs = np.empty(nv + 2 + m), (state, l0, l0_dot, rows)
        room = make_room(m, sags, height, first)
        assert model_force_and_drums(*inputs, room, nv + 2, both) == -1
        np.testing.assert_allclose(both, [0.0, 0.0, *force, *table[1]], atol=ROUNDING)
        assert np.all(both[:first] == 0.0)
        arrays, bad = model_force_and_drums_array(*inputs, sags, height, start=first, nv=nv + 2)
        assert bad == -1
        np.testing.assert_allclose(arrays.astype(float), both, rtol=1e-9, atol=ROUNDING)


@situations
def test_autodiff_has_the_values_and_the_derivatives_of_differences(name, sags, pulleys):
    """By state, lengths and rates at once, in motion: the derivative of the damping is in it."""
    for seed in (1, 2, 3):
        _, state, l0, l0_dot, cables, height = situation(name, pulleys, seed)
        rows, n, m = cables.packed(), len(state), len(l0)
        start = np.concatenate([state, l0, l0_dot])

        def evaluate(z, n=n, m=m, rows=rows, height=height):
            values = force_and_outputs(z[:n], z[n : n + m], z[n + m :], rows, sags, height)
            return np.concatenate([value.ravel() for value in values])

        z = InitializeAutoDiff(start).ravel()
        inputs = z[:n], z[n : n + m], z[n + m :], rows, sags, height
        force, bad = model_force_array(*inputs, start=0, nv=3 if n == 6 else 6)
        table, worse = model_outputs_array(*inputs)
        assert bad == worse == -1
        values = np.array([x + 0.0 * z[0] for x in [*force, *table.ravel()]])
        np.testing.assert_allclose(ExtractValue(values).ravel(), evaluate(start), atol=ROUNDING)
        for exact, e in zip(ExtractGradient(values).T, np.eye(len(start)), strict=True):
            expected = slope(lambda t, e=e, x=start: evaluate(x + t * e), 1e-7)
            largest = max(1e6, np.max(np.abs(expected)))  # what is left of differences
            assert np.max(np.abs(exact - expected)) < 1e-7 * largest


def test_an_implicit_function_keeps_its_value():
    arguments = np.array([3.0, -2.0, 0.075, 1.0, 3.8, 2.9e6, 2.18, 0.0, 0.0])
    H, V_A, _ = solve_catenary(*arguments)
    again_H, again_V, good = solve_catenary_any(*InitializeAutoDiff(arguments).ravel())
    assert good
    np.testing.assert_allclose((again_H.value(), again_V.value()), (H, V_A), rtol=1e-9)
    for k in (0, 1, 2, 4, 5, 6):  # all parameters: also radius, stiffness and weight
        step = 1e-6 * max(abs(arguments[k]), 0.1) * np.eye(9)[k]
        ahead, behind = (np.array(solve_catenary(*(arguments + s * step))[:2]) for s in (1, -1))
        exact = again_H.derivatives()[k], again_V.derivatives()[k]
        np.testing.assert_allclose(exact, (ahead - behind) / (2 * step[k]), rtol=1e-4, atol=1e-9)


def test_the_source_of_a_kernel_runs_on_any_scalar():
    X = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, AutoDiffXd(3.0, [1.0]), 0.0, 4.0)
    length = any_scalar(cable_line)(X, np.zeros(8))[0]
    assert length.value() == 5.0
    assert length.derivatives() == pytest.approx([0.6])


# The energy of one cable.


def packed_row(radius, weight, axis=1.0):
    """A row as `CableSet.packed` has it, without a pulley at the platform."""
    row = np.zeros(CABLE_SET_COLUMNS)
    row[:3], row[6] = (0.3, -0.2, 3.0), 1e4
    row[PULLEY_RADIUS], row[LINEAR_WEIGHT], row[SWIVEL_AXIS + 2] = radius, weight, axis
    return row


def energy_and_pull(sags, row, p, l0):
    X = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *p)
    solved, D = np.zeros(2), np.zeros((DERIVATIVES, 4))
    response = cable_response(sags, X, row, l0, solved, np.empty((6, 3)), D)
    assert response[-1]
    return cable_energy(sags, X, row, l0, solved), np.array(response[:3])


@pytest.mark.parametrize(("radius", "axis"), [(0.0, 1.0), (0.075, 1.0), (0.1, -1.0)])
@pytest.mark.parametrize("sags", [False, True])
def test_slope_of_the_energy_is_the_pull(sags, radius, axis):
    row, random = packed_row(radius, 2.0 if sags else 0.0, axis), np.random.default_rng(9)
    for extra in [*random.uniform(-0.02, -1e-3, 6), *random.uniform(1e-3, 0.3, 6)]:
        p = row[:3] + random.uniform([0.5, -3.0, -2.0], [2.5, 3.0, 2.0])
        l0 = (1.0 + extra) * np.linalg.norm(p - row[:3]) + np.pi * radius * (extra > 0.0)
        _, pull = energy_and_pull(sags, row, p, l0)
        slopes = [
            slope(lambda t, e=e, p=p, l0=l0: energy_and_pull(sags, row, p + t * e, l0)[0], 1e-5)
            for e in np.eye(3)
        ]
        np.testing.assert_allclose(slopes, pull, atol=1e-6 * max(1.0, np.linalg.norm(pull)))


def test_energy_of_a_slack_straight_and_of_a_vertical_cable_in_closed_form():
    """Stretch of its own weight, hung free but for its end's height."""
    assert energy_and_pull(False, packed_row(0.0, 2.0), [0.3, -0.2, 2.0], 1.5)[0] == 0.0
    l0, w, stiffness, depth = 2.0, 2.0, 1e4, 2.01
    s = (np.arange(20000) + 0.5) / 20000 * l0
    T_A = stiffness * (depth / l0 - 1.0) + 0.5 * w * l0
    tension, height = T_A - w * s, -(s + (T_A * s - 0.5 * w * s**2) / stiffness)
    expected = np.mean(tension**2 / (2.0 * stiffness) + w * height) * l0
    energy, pull = energy_and_pull(True, packed_row(0.0, w), [0.3, -0.2, 3.0 - depth], l0)
    assert energy == pytest.approx(expected, rel=1e-6)
    assert pull[2] == pytest.approx(-(T_A - w * l0), rel=1e-6)
