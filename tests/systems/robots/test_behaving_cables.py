"""Cables that stiffen, are warm, creep and rub, in both engines: against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.primitives import Linearize
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
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium_kernel import energy_at
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.cable_forces import CREPT, simulated_cables
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings
from tests.motion.small_robots import small_robot
from tests.systems.robots.engines import made

ENGINES = [CompiledCableRobot, CableRobot]

SAME_STEPS = 1e-9
"""Difference of states where both engines take the same steps, as in their other tests."""

CLOSED_FORM = 1e-6
"""Relative, of what an engine integrates, or of differences, against a closed form."""

ALL = {
    "stiffening": 2e-3, "expansion": 1.2e-5, "warmer": 15.0, "sheave_friction": 0.05,
    "creep_stiffness": 0.4, "creep_time": 0.05,
}  # fmt: skip


def behaving(robot, **behaviour):
    return replace(robot, cable=replace(robot.cable, behaviour=BehaviourSettings(**behaviour)))


def started(kind, robot, how, step, *, commands=0.0, X_WP=None, method="runge_kutta3"):
    """A simulator of the block at rest, by fixed steps, its commands constant."""
    block = made(kind, robot, how)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform() if X_WP is None else X_WP)
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() not in ("applied_wrench", "commanded_length_rates"):
            port.FixValue(context, np.full(port.size(), 1.0) * commands)
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(method=method, max_step=step))
    return block, simulator


def told(block, context, *names):
    return np.concatenate([block.GetOutputPort(name).Eval(context) for name in names])


@pytest.mark.parametrize(
    ("name", "behaviour", "mode"),
    [
        ("acrobot_small", {"stiffening": 2e-3, "expansion": 1.2e-5, "warmer": 15.0}, "ideal"),
        ("acrobot_small", ALL, "velocity"),
        ("acrobot_large", {"creep_stiffness": 0.4, "creep_time": 0.05}, "ideal"),
        ("planar", {"stiffening": 2e-3, "creep_stiffness": 0.4}, "velocity"),
    ],
)
def test_both_engines_move_alike(name, behaviour, mode):
    robot = behaving(load_robot(name), **behaviour)
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    how = CableRobotSettings(cables=CableSettings(pulleys=name != "planar"), winches=winches)
    step, ends = automatic_step(robot, robot.home.transform(), "runge_kutta3", how), []
    names = ["platform_state", "unstrained_lengths"]
    if "creep_stiffness" in behaviour:
        names.append(CREPT)
    step = 0.1 / np.ceil(0.1 / step)
    for kind in ENGINES:
        uneven = -0.02 * np.linspace(0.5, 1.0, len(robot.cables))
        block, simulator = started(kind, robot, how, step, commands=uneven)
        context = simulator.get_context()
        begin = told(block, context, *names)
        simulator.AdvanceTo(0.1)
        ends.append(told(block, context, *names))
        assert np.max(np.abs(ends[-1] - begin)) > 1e-4
    np.testing.assert_allclose(*ends, atol=SAME_STEPS)


@pytest.mark.parametrize("kind", ENGINES)
def test_a_weight_on_a_cable_that_creeps_follows_the_linear_equation(kind):
    """A force is put on: platform, cable and creep are a linear system of three states."""
    c, tau, F, duration = 0.6, 0.3, 4.0, 0.5
    robot = behaving(small_robot("pendulum"), creep_stiffness=c, creep_time=tau)
    block, simulator = started(kind, robot, CableRobotSettings(), 1e-4)
    context = simulator.get_mutable_context()
    block.GetInputPort("applied_wrench").FixValue(context, [0, 0, 0, 0, 0, -F])
    l0, length, crept = (
        told(block, context, name)[0] for name in ("unstrained_lengths", "lengths", CREPT)
    )
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
    found = told(block, context, "lengths", CREPT) - [length, crept]
    np.testing.assert_allclose(found, x[[0, 2]], rtol=CLOSED_FORM)
    tension = ES * (length / l0 - 1.0) + ES * ((1.0 + c) * x[0] / l0 - c * x[2] + T * x[1] / l0)
    assert told(block, context, "tensions")[0] == pytest.approx(tension, rel=CLOSED_FORM)
    # After long it has the strain of the elastic law, which creep only delays.
    last = -np.linalg.solve(A, [0.0, F / m, 0.0])
    assert last[0] == pytest.approx(F * l0 / ES, rel=1e-9)


@pytest.mark.parametrize("kind", ENGINES)
def test_a_swing_loses_what_the_dashpot_takes(kind):
    """Motion, weight and both springs together lose c E S (e - z)^2 / tau a metre of cable."""
    c, tau, step = 0.6, 0.05, 2e-4
    robot = behaving(small_robot("pendulum"), creep_stiffness=c, creep_time=tau)
    how = CableRobotSettings(cables=CableSettings(model="elastic"))
    block, simulator = started(kind, robot, how, step)
    context = simulator.get_mutable_context()
    block.GetInputPort("applied_wrench").FixValue(context, [0, 0, 0, 0, 0, -8.0])
    l0, ES, m = told(block, context, "unstrained_lengths")[0], robot.stiffness()[0], 2.0
    rows = []
    for k in range(2001):
        simulator.AdvanceTo(k * step)
        length, z = told(block, context, "lengths", CREPT)
        rows.append([length, z, told(block, context, "platform_state")[12]])
    length, z, v = np.array(rows).T
    e, weight = length / l0 - 1.0, m * robot.gravity + 8.0
    springs = 0.5 * l0 * ES * (e**2 + c * (e - z) ** 2)
    energy = 0.5 * m * v**2 - weight * length + springs
    lost = simpson(l0 * c * ES * (e - z) ** 2 / tau, dx=step)
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=CLOSED_FORM)
    assert lost > 0.05 * np.ptp(springs)


@pytest.mark.parametrize("kind", ENGINES)
def test_drums_of_a_robot_in_motion_lift_more_than_they_lower(kind):
    friction = 0.05
    robot = behaving(load_robot("acrobot_large"), sheave_friction=friction)
    how = CableRobotSettings(cables=CableSettings(pulleys=True))
    X_WP, cables = robot.home.transform(), robot.cable_set()
    wraps = cable_paths(X_WP, cables).arcs / cables.pulley_radius
    for speed in (-0.02, 0.02, 0.0, 5e-4):
        block, simulator = started(kind, robot, how, 1e-3, commands=speed)
        context = simulator.get_context()
        ratio = told(block, context, "drum_tensions") / told(block, context, "tensions")
        by_law = np.exp(-friction * wraps * np.tanh(speed / 1e-3))
        np.testing.assert_allclose(ratio, by_law, rtol=CLOSED_FORM)


def test_the_semi_implicit_method_comes_to_the_same():
    robot = behaving(load_robot("acrobot_small"), **ALL)
    how = CableRobotSettings(
        cables=CableSettings(pulleys=True), winches=WinchSettings(kind="motor", mode="velocity")
    )
    ends = []
    for method, step in (("runge_kutta3", 2e-4), ("semi_implicit", 2e-4), ("semi_implicit", 1e-4)):
        block, simulator = started(
            CompiledCableRobot, robot, how, step, commands=-0.02, method=method
        )
        simulator.AdvanceTo(0.1)
        ends.append(told(block, simulator.get_context(), "platform_state", CREPT))
    errors = [np.max(np.abs(end - ends[0])[:7]) for end in ends[1:]]
    assert errors[1] < 2e-6
    assert errors[1] < 0.5 * errors[0]


def test_a_loop_without_a_diagram_moves_as_the_block_does():
    robot = behaving(load_robot("acrobot_small"), **ALL)
    how = CableRobotSettings(cables=CableSettings(pulleys=True))
    block, simulator = started(CompiledCableRobot, robot, how, 5e-4, commands=-0.02)
    motion = RobotMotion(robot, how, StepRule(max_step=5e-4))
    motion.begin(motion.resting(robot.home.transform()))
    motion.command(np.full(8, -0.02))
    simulator.AdvanceTo(0.05)
    motion.advance(0.05)
    context = simulator.get_context()
    np.testing.assert_array_equal(motion.platform_state(), told(block, context, "platform_state"))
    np.testing.assert_array_equal(motion.cables()[0], told(block, context, "tensions"))


BEHAVIOUR = CableBehaviour(stiffening=2e-3, expansion=1.2e-5, warmer=15.0)


def hanging():
    robot = load_robot("acrobot_large")
    cables = behaving_cables(robot.cable_set(), BEHAVIOUR)
    X_WP = robot.home.transform()
    return robot, cables, X_WP, cable_paths(X_WP, cables).lengths / (1.0 + 2e-3)


def test_tensions_and_energy_are_those_of_the_law():
    robot, cables, X_WP, l0 = hanging()
    state = cable_state(cables, "elastic", X_WP, l0)
    natural = l0 * BEHAVIOUR.longer()
    strains = cable_paths(X_WP, cables).lengths / natural - 1.0
    by_law = tension_of_strain(strains, cables.stiffness, BEHAVIOUR.stiffening)
    np.testing.assert_allclose(state.tensions, by_law, rtol=1e-10)
    assert np.all(by_law > 0.0)
    stored = natural * strain_energy(strains, cables.stiffness, BEHAVIOUR.stiffening)
    law, packed, solved = cable_law("elastic", cables), cables.packed(), np.zeros((8, 2))
    motion = (*X_WP.rotation().matrix().ravel(), *X_WP.translation())
    energy, _, _ = energy_at(
        law, motion, packed, l0, 1.0, np.zeros(6), robot.motion_type().packed(), solved,
        np.empty(6), np.empty((6, 6)),
    )  # fmt: skip
    assert energy == pytest.approx(float(np.sum(stored)), rel=1e-9)
    weak = replace(cables, stiffness=1e-6 * cables.stiffness)  # the series of small strains
    energy, _, _ = energy_at(
        law, motion, weak.packed(), l0, 1.0, np.zeros(6), robot.motion_type().packed(), solved,
        np.empty(6), np.empty((6, 6)),
    )  # fmt: skip
    assert energy == pytest.approx(float(np.sum(0.5e-6 * cables.stiffness * strains**2 * natural)))


def test_derivatives_are_those_of_differences():
    _, cables, X_WP, l0 = hanging()
    slopes, h = cable_derivatives(cables, "elastic", X_WP, l0), 1e-7

    def state(shift, longer):
        moved = RigidTransform(X_WP.rotation(), X_WP.translation() + shift)
        return cable_state(cables, "elastic", moved, l0 + longer)

    ahead, back = state(np.zeros(3), h), state(np.zeros(3), -h)
    by_length = (ahead.tensions - back.tensions) / (2.0 * h)
    np.testing.assert_allclose(slopes.tensions_by_length, by_length, rtol=CLOSED_FORM)
    for axis in range(3):
        step = h * np.eye(3)[axis]
        by_pose = (state(step, 0.0).wrench - state(-step, 0.0).wrench) / (2.0 * h)
        largest = np.max(np.abs(slopes.wrench_by_pose))
        np.testing.assert_allclose(
            slopes.wrench_by_pose[:, 3 + axis], by_pose, atol=CLOSED_FORM * largest
        )


def test_the_plant_on_autodiff_has_the_derivatives_of_differences():
    robot = behaving(load_robot("acrobot_small"), **ALL)
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(pulleys=True)))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, RigidTransform([0.05, -0.08, 0.3]))
    port = block.GetInputPort("cable_velocities")
    port.FixValue(context, np.zeros(8))
    linear = Linearize(block, context, port.get_index(), block.GetOutputPort(CREPT).get_index())
    x0 = context.get_continuous_state_vector().CopyToVector()
    columns, h = [], 1e-8
    for k in range(len(x0)):
        ends = []
        for side in (h, -h):
            context.SetContinuousState(x0 + side * np.eye(len(x0))[k])
            ends.append(block.EvalTimeDerivatives(context).CopyToVector())
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    A = np.array(columns).T
    np.testing.assert_allclose(linear.A(), A, atol=CLOSED_FORM * np.max(np.abs(A)))


def test_a_robot_hangs_where_its_own_law_holds_it():
    robot = behaving(load_robot("acrobot_large"), stiffening=2e-3, expansion=1.2e-5, warmer=15.0)
    block, simulator = started(CompiledCableRobot, robot, CableRobotSettings(), 1e-3)
    context = simulator.get_context()
    before = told(block, context, "platform_state")
    simulator.AdvanceTo(0.05)
    np.testing.assert_allclose(told(block, context, "platform_state"), before, atol=1e-9)


def test_nothing_of_it_leaves_the_law_and_the_cables_as_they_were():
    robot = behaving(load_robot("acrobot_large"), sliding_speed=0.1, creep_time=7.0)
    cables = CableSettings(pulleys=True).cable_set(robot)
    assert cables.beyond.size == 0
    assert cable_law("elastic", cables) == CABLE_MODELS["elastic"].law
    assert behaviour_of(cables) == CableBehaviour()
    with_all = behaving_cables(cables, behaving(robot, **ALL).cable_behaviour())
    assert behaviour_of(with_all).longer() == pytest.approx(1.0 + 1.2e-5 * 15.0, rel=1e-12)
    assert with_all.packed().shape == (8, 23)
    np.testing.assert_array_equal(with_all.packed()[:, :17], cables.packed())
    assert with_all.chosen(np.arange(3)).packed().shape == (3, 23)


def test_what_no_law_combines_is_refused_by_name():
    robot = behaving(load_robot("acrobot_large"), **ALL)
    cables = CableSettings(pulleys=True).cable_set(robot)
    with pytest.raises(CableModelError, match=r"found catenary .* cable.behaviour; accepted: el"):
        simulated_cables(cables, "catenary")
    with pytest.raises(CableModelError, match=r"found inextensible .* cable.behaviour"):
        simulated_cables(cables, "inextensible")
    over = cables.over_platform_pulleys(0.02, np.tile([[0.0], [0.0], [1.0]], 8))
    with pytest.raises(CableModelError, match=r"sheave_friction: found 0.05 with pulleys"):
        simulated_cables(over, "elastic")
    with pytest.raises(CableModelError, match="creep_time: found 0; accepted: > 0"):
        behaving_cables(cables, CableBehaviour(creep_stiffness=0.1, creep_time=0.0))
    with pytest.raises(CableModelError, match="stiffening: found -1; accepted: >= 0"):
        behaving_cables(cables, CableBehaviour(stiffening=-1.0))
