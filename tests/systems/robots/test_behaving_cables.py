"""Cables that stiffen, are warm, creep and rub, in both engines: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from scipy.integrate import simpson
from scipy.linalg import expm

from cdpr_drake.cables.cable_behaviour import (
    CableBehaviour,
    behaving_cables,
    behaviour_of,
    strain_energy,
    tension_of_strain,
)
from cdpr_drake.cables.models import CABLE_MODELS, cable_derivatives, cable_law, cable_state
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium_kernel import energy_at
from cdpr_drake.systems.robots.cable_forces import CREPT
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.settings import CableSettings
from tests.motion.small_robots import small_robot
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    BY_ENGINE,
    CLOSED_FORM,
    behaving,
    read,
    settings_of,
    started,
)


@BY_ENGINE
def test_a_weight_on_a_cable_that_creeps_follows_the_linear_equation(kind):
    """A force is put on: platform, cable and creep are a linear system of three states."""
    c, tau, F, duration = 0.6, 0.3, 4.0, 0.2
    robot = behaving(small_robot("pendulum"), creep_stiffness=c, creep_time=tau)
    block, simulator, context = started(kind, robot, step=1e-4, wrench=[0, 0, 0, 0, 0, -F])
    l0, length, crept = read(block, context, "unstrained_lengths", "lengths", CREPT)
    ES, T, m = robot.stiffness()[0], robot.cable.retardation_time, robot.platform.mass
    assert crept == pytest.approx(length / l0 - 1.0, rel=1e-9)
    # (length - where it was, its rate, z - where it was)' = A x + b
    k = ES / l0 / m
    A = np.array(
        [[0.0, 1.0, 0.0], [-k * (1.0 + c), -k * T, k * c * l0], [1.0 / l0 / tau, 0.0, -1.0 / tau]]
    )
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[1, 3] = A, F / m
    simulator.AdvanceTo(duration)
    x = expm(whole * duration)[:3, 3]
    found = read(block, context, "lengths", CREPT) - [length, crept]
    np.testing.assert_allclose(found, x[[0, 2]], rtol=CLOSED_FORM)
    tension = ES * (length / l0 - 1.0) + ES * ((1.0 + c) * x[0] / l0 - c * x[2] + T * x[1] / l0)
    assert read(block, context, "tensions")[0] == pytest.approx(tension, rel=CLOSED_FORM)
    # After long it has the strain of the elastic law, which creep only delays.
    last = -np.linalg.solve(A, [0.0, F / m, 0.0])
    assert last[0] == pytest.approx(F * l0 / ES, rel=1e-9)


@BY_ENGINE
def test_a_swing_loses_what_the_dashpot_takes(kind):
    """Motion, weight and both springs together lose c E S (e - z)^2 / tau a metre of cable."""
    c, tau, step = 0.6, 0.05, 2e-4
    robot = behaving(small_robot("pendulum"), creep_stiffness=c, creep_time=tau)
    block, simulator, context = started(
        kind, robot, settings_of(model="elastic"), step, wrench=[0, 0, 0, 0, 0, -8.0]
    )
    l0, ES, m = read(block, context, "unstrained_lengths")[0], robot.stiffness()[0], 2.0
    rows = []
    for k in range(801):
        simulator.AdvanceTo(k * step)
        length, z = read(block, context, "lengths", CREPT)
        rows.append([length, z, read(block, context, "platform_state")[12]])
    length, z, v = np.array(rows).T
    e, weight = length / l0 - 1.0, m * robot.gravity + 8.0
    springs = 0.5 * l0 * ES * (e**2 + c * (e - z) ** 2)
    energy = 0.5 * m * v**2 - weight * length + springs
    lost = simpson(l0 * c * ES * (e - z) ** 2 / tau, dx=step)
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=CLOSED_FORM)
    assert lost > 0.05 * np.ptp(springs)


@BY_ENGINE
def test_drums_of_a_robot_in_motion_lift_more_than_they_lower(kind):
    friction, how = 0.05, settings_of(pulleys=True)
    robot = behaving(load_robot("acrobot_large"), sheave_friction=friction)
    cables = robot.cable_set()
    wraps = cable_paths(robot.home.transform(), cables).arcs / cables.pulley_radius
    block, _, context = started(kind, robot, how)
    for speed in (-0.02, 0.02, 0.0, 5e-4):
        block.GetInputPort("cable_velocities").FixValue(context, np.full(8, speed))
        ratio = read(block, context, "drum_tensions") / read(block, context, "tensions")
        by_law = np.exp(-friction * wraps * np.tanh(speed / 1e-3))
        np.testing.assert_allclose(ratio, by_law, rtol=CLOSED_FORM, err_msg=f"at {speed} m/s")


def test_the_semi_implicit_method_comes_to_the_same():
    robot = behaving(load_robot("acrobot_small"), **ALL_BEHAVIOUR)
    how, ends = settings_of("velocity", pulleys=True), []
    for method, step in (("runge_kutta3", 2e-4), ("semi_implicit", 2e-4), ("semi_implicit", 1e-4)):
        block, simulator, context = started(
            CompiledCableRobot, robot, how, step, command=-0.02, method=method
        )
        simulator.AdvanceTo(0.1)
        ends.append(read(block, context, "platform_state"))
    errors = [np.max(np.abs(end - ends[0])[:7]) for end in ends[1:]]
    assert errors[1] < 2e-6
    assert errors[1] < 0.5 * errors[0]


BEHAVIOUR = CableBehaviour(stiffening=2e-3, expansion=1.2e-5, warmer=15.0)


def hanging():
    robot = load_robot("acrobot_large")
    cables = behaving_cables(robot.cable_set(), BEHAVIOUR)
    X_WP = robot.home.transform()
    return robot, cables, X_WP, cable_paths(X_WP, cables).lengths / (1.0 + 2e-3)


def test_tensions_and_energy_are_those_of_the_law():
    robot, cables, X_WP, l0 = hanging()
    natural = l0 * BEHAVIOUR.longer()
    strains = cable_paths(X_WP, cables).lengths / natural - 1.0
    by_law = tension_of_strain(strains, cables.stiffness, BEHAVIOUR.stiffening)
    state = cable_state(cables, "elastic", X_WP, l0)
    np.testing.assert_allclose(state.tensions, by_law, rtol=1e-10)
    assert np.all(by_law > 0.0)
    law, motion = cable_law("elastic", cables), robot.motion_type().packed()
    place = (*X_WP.rotation().matrix().ravel(), *X_WP.translation())

    def energy(of):
        return energy_at(
            law, place, of.packed(), l0, 1.0, np.zeros(6), motion, np.zeros((8, 2)), np.empty(6),
            np.empty((6, 6)),
        )[0]  # fmt: skip

    stored = natural * strain_energy(strains, cables.stiffness, BEHAVIOUR.stiffening)
    assert energy(cables) == pytest.approx(float(np.sum(stored)), rel=1e-9)
    weak = replace(cables, stiffness=1e-6 * cables.stiffness)  # the series of small strains
    series = 0.5e-6 * cables.stiffness * strains**2 * natural
    assert energy(weak) == pytest.approx(float(np.sum(series)))


def test_derivatives_are_those_of_differences():
    _, cables, X_WP, l0 = hanging()
    slopes, h = cable_derivatives(cables, "elastic", X_WP, l0), 1e-7

    def state(shift, longer):
        there = RigidTransform(X_WP.rotation(), X_WP.translation() + shift)
        return cable_state(cables, "elastic", there, l0 + longer)

    ahead, back = state(np.zeros(3), h), state(np.zeros(3), -h)
    by_length = (ahead.tensions - back.tensions) / (2.0 * h)
    np.testing.assert_allclose(slopes.tensions_by_length, by_length, rtol=CLOSED_FORM)
    largest = np.max(np.abs(slopes.wrench_by_pose))
    for axis, step in enumerate(h * np.eye(3)):
        by_pose = (state(step, 0.0).wrench - state(-step, 0.0).wrench) / (2.0 * h)
        found = slopes.wrench_by_pose[:, 3 + axis]
        np.testing.assert_allclose(found, by_pose, atol=CLOSED_FORM * largest)


def test_a_robot_hangs_where_its_own_law_holds_it():
    robot = behaving(load_robot("acrobot_large"), stiffening=2e-3, expansion=1.2e-5, warmer=15.0)
    block, simulator, context = started(CompiledCableRobot, robot)
    before = read(block, context, "platform_state")
    simulator.AdvanceTo(0.05)
    np.testing.assert_allclose(read(block, context, "platform_state"), before, atol=1e-9)


def test_nothing_of_it_leaves_the_law_and_the_cables_as_they_were():
    robot = behaving(load_robot("acrobot_large"), sliding_speed=0.1, creep_time=7.0)
    cables = CableSettings(pulleys=True).cable_set(robot)
    assert cables.beyond.size == 0
    assert cable_law("elastic", cables) == CABLE_MODELS["elastic"].law
    assert behaviour_of(cables) == CableBehaviour()
    with_all = behaving_cables(cables, behaving(robot, **ALL_BEHAVIOUR).cable_behaviour())
    assert behaviour_of(with_all).longer() == pytest.approx(1.0 + 1.2e-5 * 15.0, rel=1e-12)
    assert with_all.packed().shape == (8, 23)
    np.testing.assert_array_equal(with_all.packed()[:, :17], cables.packed())
    assert with_all.chosen(np.arange(3)).packed().shape == (3, 23)
