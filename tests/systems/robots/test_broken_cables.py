"""A cable breaks, in both engines: what is left moves as the robot without it, to the bit."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import Failure, FailureSettings
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    WinchSettings,
)
from tests.systems.robots.engines import made

STEP, BREAK, END = 1e-4, 0.02, 0.06

SAME_STEPS = 1e-9
"""Difference of states of both engines by the same steps, see test_compiled_cable_robot."""

GUESSES = 3
"""Where in `simulation_kernel.make_room` solutions of catenaries begin."""

STORED = 1e-9
"""Relative difference of energies: rounding of a sum that has the weight's energy in it."""


def settings(mode="ideal", model="kelvin_voigt", pulleys=False, events=None):
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    failures = None if events is None else FailureSettings(events=events)
    return CableRobotSettings(
        cables=CableSettings(model=model, pulleys=pulleys), winches=winches, failures=failures
    )


def breaking(cable, time=BREAK):
    return [Failure(kind="cable_breaks", time=time, cable=cable)]


def started(kind, robot, how, command, *, method="runge_kutta3", step=STEP):
    """The block and its simulator, at rest at home, with commands that hold."""
    block = made(kind, robot, how)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, method, step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(method=method, max_step=step))
    fix_commands(block, context, command)
    return block, simulator, context


def fix_commands(block, context, command):
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() in ("cable_velocities", "motor_torques", "commanded_lengths"):
            port.FixValue(context, command)


def states(block, context, keep=None):
    """State of the platform, and lengths and rates of the cables to keep."""
    parts = [block.GetOutputPort("platform_state").Eval(context)]
    for name in ("unstrained_lengths", "unstrained_length_rates", "tensions"):
        values = block.GetOutputPort(name).Eval(context)
        parts.append(values if keep is None else values[keep])
    return np.concatenate(parts)


def without(robot, cable):
    left = [c for k, c in enumerate(robot.cables) if k != cable]
    return replace(robot, cables=left)


CASES = [
    ("acrobot_small", "ideal", "kelvin_voigt", False, "runge_kutta3"),
    ("acrobot_small", "ideal", "kelvin_voigt", True, "runge_kutta3"),
    ("acrobot_small", "velocity", "elastic", True, "runge_kutta3"),
    ("acrobot_large", "torque", "kelvin_voigt", False, "runge_kutta2"),
    ("acrobot_small", "velocity", "kelvin_voigt", False, "semi_implicit"),
    ("planar", "ideal", "kelvin_voigt", False, "semi_implicit"),
    ("caroca", "ideal", "catenary", False, "runge_kutta3"),
]


@pytest.mark.parametrize(("name", "mode", "model", "pulleys", "method"), CASES)
@pytest.mark.parametrize("cable", [0, 2])
def test_what_is_left_moves_as_the_robot_without_it(name, mode, model, pulleys, method, cable):
    """By the compiled engine, from the state in which it breaks, to the last bit."""
    robot = load_robot(name)
    m = len(robot.cables)
    command = {"torque": -0.4}.get(mode, -0.03) * np.linspace(0.5, 1.0, m)
    keep = np.arange(m) != cable
    block, simulator, context = started(
        CompiledCableRobot, robot, settings(mode, model, pulleys, breaking(cable)), command,
        method=method,
    )  # fmt: skip
    block.set_at_equilibrium(context, robot.home.transform())
    simulator.AdvanceTo(BREAK)
    n = block.GetOutputPort("platform_state").size()
    own = block.motion.GetMyContextFromRoot(context)
    at_break = block.motion.state(own).copy()
    other, other_simulator, other_context = started(
        CompiledCableRobot, without(robot, cable), settings(mode, model, pulleys), command[keep],
        method=method,
    )  # fmt: skip
    other_context.SetTime(BREAK)
    winches = at_break[n:].reshape(-1, m)[:, keep].ravel()
    other.motion.set_state(
        other.motion.GetMyMutableContextFromRoot(other_context),
        np.concatenate([at_break[:n], winches]),
    )
    # Catenaries begin with the last solution, which is left in the robot's room to work in.
    guesses = block.motion.arrays().room[GUESSES : GUESSES + 2 * m].reshape(m, 2)
    other.motion.arrays().room[GUESSES : GUESSES + 2 * (m - 1)] = guesses[keep].ravel()
    for simulator_ in (simulator, other_simulator):
        simulator_.AdvanceTo(END)
    found, expected = states(block, context, keep), states(other, other_context)
    if model == "catenary":  # whose tensions, asked for at the end alone, begin with no solution
        np.testing.assert_allclose(found[1 - m :], expected[1 - m :], rtol=SAME_STEPS)
        found, expected = found[: 1 - m], expected[: 1 - m]
    assert np.array_equal(found, expected)
    assert not np.allclose(found[:n], at_break[:n], atol=1e-6)


def test_the_plant_moves_as_that_of_the_robot_without_it():
    robot, cable = load_robot("acrobot_small"), 3
    m = len(robot.cables)
    command, keep = -0.03 * np.linspace(0.5, 1.0, m), np.arange(m) != cable
    block, simulator, context = started(
        CableRobot, robot, settings(events=breaking(cable)), command
    )
    block.set_at_equilibrium(context, robot.home.transform())
    simulator.AdvanceTo(BREAK)
    other, other_simulator, other_context = started(
        CableRobot, without(robot, cable), settings(), command[keep]
    )
    other_context.SetTime(BREAK)
    plant = other.plant.GetMyMutableContextFromRoot(other_context)
    other.plant.SetPositionsAndVelocities(
        plant, block.GetOutputPort("platform_state").Eval(context)
    )
    lengths = block.GetOutputPort("unstrained_lengths").Eval(context)[keep]
    other.winches.hold(
        other.winches.GetMyMutableContextFromRoot(other_context), lengths, np.zeros(m - 1)
    )
    for simulator_ in (simulator, other_simulator):
        simulator_.AdvanceTo(END)
    assert np.array_equal(states(block, context, keep), states(other, other_context))


@pytest.mark.parametrize(
    ("name", "mode", "model", "pulleys"),
    [
        ("acrobot_small", "ideal", "kelvin_voigt", False),
        ("acrobot_small", "velocity", "elastic", True),
        ("caroca", "ideal", "catenary", False),
        ("planar", "ideal", "kelvin_voigt", False),
    ],
)
def test_both_engines_break_alike(name, mode, model, pulleys):
    robot, found = load_robot(name), []
    for kind in (CableRobot, CompiledCableRobot):
        block, simulator, context = started(
            kind, robot, settings(mode, model, pulleys, breaking(1)), np.zeros(len(robot.cables))
        )
        block.set_at_equilibrium(context, robot.home.transform())
        simulator.AdvanceTo(END)
        found.append(states(block, context))
        assert block.GetOutputPort("tensions").Eval(context)[1] == 0.0
        assert block.GetOutputPort("slack").Eval(context)[1] == 1.0
        broken = block.GetOutputPort("broken").Eval(context)
        assert np.array_equal(broken, np.arange(len(robot.cables)) == 1)
    np.testing.assert_allclose(*found, atol=SAME_STEPS * np.max(np.abs(found[0])))


@pytest.mark.parametrize("pulleys", [False, True])
def test_what_it_had_stored_is_released(pulleys):
    """The energy that is gone is the stretch of the cable; what is left keeps its own."""
    robot, cable = load_robot("acrobot_small"), 4
    block, simulator, context = started(
        CompiledCableRobot, robot, settings("ideal", "elastic", pulleys, breaking(cable)),
        np.zeros(len(robot.cables)), step=2e-5,
    )  # fmt: skip
    block.set_at_equilibrium(context, robot.home.transform())
    simulator.AdvanceTo(BREAK - STEP)
    own = block.motion.GetMyContextFromRoot(context)
    before = block.motion.energy(own)
    simulator.AdvanceTo(BREAK)
    l = block.GetOutputPort("lengths").Eval(context)[cable]  # noqa: E741
    simulator.AdvanceTo(BREAK + 1e-9)  # the flags have changed, the pose has not
    after = block.motion.energy(own)
    l0 = block.GetOutputPort("unstrained_lengths").Eval(context)[cable]
    if pulleys:
        l = whole_length(block, context, cable)  # noqa: E741
    stored = 0.5 * block.motion.cable_set().stiffness[cable] * (l - l0) ** 2 / l0
    assert stored > 0.0
    assert before - after == pytest.approx(stored, rel=STORED)
    simulator.AdvanceTo(END)
    assert block.motion.energy(own) == pytest.approx(after, rel=1e-7)  # error of the steps


def whole_length(block, context, cable):
    """Along the groove and then straight, of a cable whose pulley is gone with it."""
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    return cable_paths(X_WP, block.motion.cable_set()).lengths[cable]


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
@pytest.mark.parametrize("mode", ["ideal", "velocity"])
def test_where_nothing_fails_bits_are_the_same(kind, mode):
    robot, found = load_robot("acrobot_small"), []
    command = -0.03 * np.linspace(0.5, 1.0, len(robot.cables))
    for events in (None, [], breaking(1, 10.0)):
        block, simulator, context = started(kind, robot, settings(mode, events=events), command)
        block.set_at_equilibrium(context, robot.home.transform())
        simulator.AdvanceTo(END)
        found.append(states(block, context))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


@pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])
def test_an_input_breaks_it_too(kind):
    robot, found = load_robot("planar"), []
    for by_input in (True, False):
        how = settings(events=[] if by_input else breaking(2, 0.0))
        block, simulator, context = started(kind, robot, how, np.zeros(len(robot.cables)))
        block.set_at_equilibrium(context, robot.home.transform())
        if by_input:
            flags = np.zeros(len(robot.cables))
            flags[2] = 1.0
            block.GetInputPort("broken").FixValue(context, flags)
        simulator.AdvanceTo(END)
        found.append(states(block, context))
    assert np.array_equal(*found)
    assert found[0][-2] == 0.0


def test_forces_with_derivatives_break_too():
    """`CableForces` for AutoDiffXd gives the numbers of that for float."""
    robot = load_robot("planar")
    in_plant = CableRobot(robot).in_plant
    block = CableForces(in_plant, breakable=True)
    flags = np.arange(len(robot.cables)) == 1
    found = []
    for system in (block, block.ToAutoDiffXd()):
        context = system.CreateDefaultContext()
        m = len(robot.cables)
        for name, values in (
            ("platform_state", [0.01, 0.02, 0.03, 0.1, -0.2, 0.3]),
            ("unstrained_lengths", np.full(m, 0.5)),
            ("unstrained_length_rates", np.zeros(m)),
            ("broken", flags.astype(float)),
        ):
            port = system.GetInputPort(name)
            port.FixValue(context, np.array(values)[: port.size()])
        force = system.GetOutputPort("generalized_force").Eval(context)
        tensions = system.GetOutputPort("tensions").Eval(context)
        numbers = [getattr(x, "value", lambda x=x: x)() for x in (*force, *tensions)]
        found.append(np.array(numbers, float))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert found[0][-m + 1] == 0.0
    assert np.all(np.delete(found[0][-m:], 1) > 0.0)
