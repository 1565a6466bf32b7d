"""Forces of the cables: kernel against the pure functions, AutoDiffXd against differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff

from cdpr_drake.cables.dispatch_kernel import STRAIGHT
from cdpr_drake.cables.hanging_kernel import solve_catenary
from cdpr_drake.cables.models import cable_state
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
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.motion_kernel import cable_line
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.kernel_calls import any_scalar

ROUNDING = 1e-9  # [N], of tensions near 300 N and a stiffness of 1 MN/m
STEP = 1e-7
DIFFERENCE = 1e-7  # differences of fourth order, relative to the largest derivative, 1e6 N/m

ROBOTS = {name: load_robot(name) for name in ("caroca", "planar")}
numbers = st.tuples(*[st.floats(-1.0, 1.0)] * 22).map(np.array)
MODELS = [(sags, pulleys) for sags in (False, True) for pulleys in (False, True)]


def situation(name, pulleys, random):
    """State of the platform, unstrained lengths, their rates, cables, height of the plane."""
    robot = ROBOTS[name]
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    home = robot.home.transform()
    if robot.is_planar():
        state = np.concatenate([[0.1, 0.05, 0.2] * random[:3], random[3:6]])
    else:
        q = np.concatenate([[1.0], 0.1 * random[:3]])
        state = np.concatenate([q, home.translation() + 0.2 * random[3:6], random[6:12]])
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
    return np.concatenate([force, table.ravel()])


@pytest.mark.parametrize(("sags", "pulleys"), MODELS)
@pytest.mark.parametrize("name", list(ROBOTS))
@settings(max_examples=20, deadline=None)
@given(random=numbers)
def test_kernel_is_the_pure_function(name, sags, pulleys, random):
    robot, state, l0, l0_dot, cables, height = situation(name, pulleys, random)
    found = force_and_outputs(state, l0, l0_dot, cables.packed(), sags, height)
    planar = robot.is_planar()
    V = np.array([0.0, 0.0, state[5], state[3], state[4], 0.0]) if planar else state[7:]
    model = "catenary" if sags else "kelvin_voigt"
    expected = cable_state(cables, model, pose_from_state(robot, state), l0, V, l0_dot)
    wrench = expected.wrench[[3, 4, 2]] if planar else expected.wrench
    np.testing.assert_allclose(found[: len(wrench)], wrench, atol=ROUNDING * 1e2)
    table = found[len(wrench) :].reshape(OUTPUTS, -1)
    for row, name_of in enumerate(
        ("tensions", "drum_tensions", "lengths", None, "surplus_lengths", "sags")
    ):
        if name_of is not None:
            np.testing.assert_allclose(table[row], getattr(expected, name_of), atol=ROUNDING * 1e2)


@pytest.mark.parametrize(("sags", "pulleys"), MODELS)
@pytest.mark.parametrize("name", list(ROBOTS))
@settings(max_examples=3, deadline=None)
@given(random=numbers)
def test_autodiff_has_the_values_and_the_derivatives_of_differences(name, sags, pulleys, random):
    """By state, lengths and rates at once, in motion: the derivative of the damping is in it."""
    _, state, l0, l0_dot, cables, height = situation(name, pulleys, random)
    rows, n, m = cables.packed(), len(state), len(l0)
    start = np.concatenate([state, l0, l0_dot])

    def evaluate(z):
        return force_and_outputs(z[:n], z[n : n + m], z[n + m :], rows, sags, height)

    z = InitializeAutoDiff(start).ravel()
    inputs = z[:n], z[n : n + m], z[n + m :], rows, sags, height
    nv = 3 if n == 6 else 6
    force, bad = model_force_array(*inputs, start=0, nv=nv)
    table, worse = model_outputs_array(*inputs)
    assert bad == worse == -1
    values = np.array([x + 0.0 * z[0] for x in [*force, *table.ravel()]])
    base = evaluate(start)
    np.testing.assert_allclose(ExtractValue(values).ravel(), base, atol=ROUNDING * 1e2)
    gradient = ExtractGradient(values)
    for j in range(len(start)):
        e = np.zeros(len(start))
        e[j] = STEP
        a, b, c, d = (evaluate(start + k * e) for k in (-2, -1, 1, 2))
        slope = (a - 8 * b + 8 * c - d) / (12 * STEP)
        largest = max(1e6, np.max(np.abs(slope)))  # what is left of differences goes with it
        assert np.max(np.abs(gradient[:, j] - slope)) < DIFFERENCE * largest


def test_an_implicit_function_keeps_its_value():
    arguments = (3.0, -2.0, 0.075, 1.0, 3.8, 2.9e6, 2.18, 0.0, 0.0)
    H, V_A, _ = solve_catenary(*arguments)
    lifted = [AutoDiffXd(a, np.eye(9)[k]) for k, a in enumerate(arguments)]
    again_H, again_V, good = solve_catenary_any(*lifted)
    assert good
    np.testing.assert_allclose((again_H.value(), again_V.value()), (H, V_A), rtol=1e-9)
    # All parameters: also radius, stiffness and weight.
    for k in (0, 1, 2, 4, 5, 6):
        step = 1e-6 * max(abs(arguments[k]), 0.1)
        ahead, behind = (
            np.array(
                solve_catenary(*[a + s * step * (i == k) for i, a in enumerate(arguments)])[:2]
            )
            for s in (1, -1)
        )
        slope = (ahead - behind) / (2 * step)
        exact = again_H.derivatives()[k], again_V.derivatives()[k]
        np.testing.assert_allclose(exact, slope, rtol=1e-4, atol=1e-9)


def test_the_source_of_a_kernel_runs_on_any_scalar():
    X = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, AutoDiffXd(3.0, [1.0]), 0.0, 4.0)
    length = any_scalar(cable_line)(X, np.zeros(8))[0]
    assert length.value() == 5.0
    assert length.derivatives() == pytest.approx([0.6])


@pytest.mark.parametrize(("sags", "pulleys"), MODELS)
@pytest.mark.parametrize("name", list(ROBOTS))
@settings(max_examples=10, deadline=None)
@given(random=numbers)
def test_force_and_drums_are_both(name, sags, pulleys, random):
    _, state, l0, l0_dot, cables, height = situation(name, pulleys, random)
    rows, m, nv = cables.packed(), len(l0), 3 if len(state) == 6 else 6
    # The platform's velocities may lie behind those of other bodies.
    first, force, table = 2, np.empty(nv + 2), np.empty((OUTPUTS, m))
    room, both = make_room(m, sags, height, first), np.empty(nv + 2 + m)
    inputs = state, l0, l0_dot, rows
    assert model_force(*inputs, room, force) == model_outputs(*inputs, room, table) == -1
    assert model_force_and_drums(*inputs, room, nv + 2, both) == -1
    np.testing.assert_allclose(both, np.concatenate([force, table[1]]), atol=ROUNDING * 1e2)
    assert np.all(both[:first] == 0.0)
    arrays, bad = model_force_and_drums_array(*inputs, sags, height, start=first, nv=nv + 2)
    assert bad == -1
    np.testing.assert_allclose(arrays.astype(float), both, rtol=1e-9, atol=ROUNDING * 1e2)
