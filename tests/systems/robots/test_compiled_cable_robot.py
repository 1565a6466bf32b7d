"""The robot in compiled steps: the plant is the oracle, ports and events are those of a block."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Sine

from cdpr_drake.errors import CableGeometryError, CdprError, DivergedError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    WinchSettings,
)
from tests.systems.robots.engines import made

SAME_STEPS = 1e-9
"""Difference of states, relative to 1 m, rad, m/s or rad/s, where both engines take the same steps
by the same method: rounding, times what the motion makes of it."""

MANY = 50


def settings_of(model="kelvin_voigt", pulleys=False, winches=None, damping=0.0):
    return CableRobotSettings(
        cables=CableSettings(model=model, pulleys=pulleys),
        winches=winches or WinchSettings(),
        damping=DampingSettings(translation=damping, rotation=damping),
    )


def simulated(kind, robot, how, command, *, duration, step, X_WP=None, slack=None):
    """The block, its context at the end, and states in between, the same steps by either engine."""
    block = made(kind, robot, how)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform() if X_WP is None else X_WP, slack)
    lengths = block.GetOutputPort("unstrained_lengths").Eval(context)
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() == "brakes":
            port.FixValue(context, np.zeros(port.size()))
        elif port.get_name() == "commanded_lengths":
            port.FixValue(context, lengths + command)
        elif port.get_name() not in ("commanded_length_rates", "applied_wrench"):
            port.FixValue(context, command)
    steps = int(np.ceil(duration / step / MANY)) * MANY
    step = duration / steps
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(max_step=step))
    states = []
    for k in range(1, MANY + 1):
        simulator.AdvanceTo(duration * k / MANY)
        states.append(outputs(block, context))
    return np.array(states)


def outputs(block, context):
    names = ["platform_state", "unstrained_lengths", "unstrained_length_rates", "lengths"]
    return np.concatenate([block.GetOutputPort(name).Eval(context) for name in names])


def port_names(system, inputs):
    count = system.num_input_ports() if inputs else system.num_output_ports()
    port = system.get_input_port if inputs else system.get_output_port
    return {port(i).get_name() for i in range(count)}


@pytest.mark.parametrize("mode", ["ideal", "torque", "velocity", "position"])
def test_ports_are_those_of_the_plant_and_a_few_more(mode):
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    robot, how = load_robot("acrobot_small"), settings_of(winches=winches)
    plant, compiled = CableRobot(robot, how), CompiledCableRobot(robot, how)
    more = {"commanded_length_rates"} if mode == "position" else set()
    assert port_names(compiled, True) == port_names(plant, True) | more
    assert port_names(compiled, False) == port_names(plant, False) | {"step_errors", "steps"}


@pytest.mark.parametrize(
    ("name", "model", "pulleys", "mode"),
    [
        ("acrobot_small", "kelvin_voigt", False, "ideal"),
        ("acrobot_small", "elastic", True, "velocity"),
        ("acrobot_small", "catenary", True, "position"),
        ("acrobot_large", "kelvin_voigt", True, "torque"),
        ("caroca", "catenary", False, "ideal"),
        ("planar", "kelvin_voigt", False, "ideal"),
        ("planar", "elastic", False, "velocity"),
    ],
)
def test_moves_as_the_plant_does(name, model, pulleys, mode):
    robot = load_robot(name)
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    how = settings_of(model, pulleys, winches, damping=2.0)
    m = len(robot.cables)
    command = {"torque": -0.5, "position": -0.01}.get(mode, -0.02) * np.linspace(0.5, 1.0, m)
    step = automatic_step(robot, robot.home.transform(), "runge_kutta3", how)
    found, expected = (
        simulated(kind, robot, how, command, duration=0.2, step=step)
        for kind in (CompiledCableRobot, CableRobot)
    )
    moved = np.max(np.abs(expected[-1] - expected[0]))
    assert moved > 1e-5
    np.testing.assert_allclose(found, expected, atol=SAME_STEPS)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=8)
def test_robots_and_motions_that_are_drawn_agree(seed):
    random = np.random.default_rng(seed)
    robot = load_robot(str(random.choice(["acrobot_small", "acrobot_large", "planar"])))
    planar = robot.is_planar()
    robot.cable.youngs_modulus *= 10.0 ** random.uniform(-3.0, 0.0)
    robot.cable.retardation_time = random.uniform(0.0, 1e-3)
    robot.platform.mass *= random.uniform(0.5, 3.0)
    for cable in robot.cables:
        shift = random.uniform(-0.03, 0.03, 3) * [1.0, 1.0, 0.0 if planar else 1.0]
        cable.exit_point = cable.exit_point + shift
    how = settings_of(pulleys=bool(random.integers(2)) and not planar)
    home = robot.home.transform()
    shift = random.uniform(-0.05, 0.05, 3) * [1.0, 1.0, 0.0 if planar else 1.0]
    X_WP = RigidTransform(home.rotation(), home.translation() + shift)
    command = random.uniform(-0.02, 0.02, len(robot.cables))
    step = automatic_step(robot, X_WP, "runge_kutta3", how)
    found, expected = (
        simulated(kind, robot, how, command, duration=0.1, step=step, X_WP=X_WP)
        for kind in (CompiledCableRobot, CableRobot)
    )
    scale = 1.0 + np.max(np.abs(expected))
    np.testing.assert_allclose(found, expected, atol=SAME_STEPS * scale)


def hung(**rule):
    robot = load_robot("acrobot_small")
    block = CompiledCableRobot(robot, rule=StepRule(**rule), command_period=HELD)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    port = block.GetInputPort("cable_velocities")
    port.FixValue(context, np.zeros(8))
    return block, simulator, context, port


def test_outputs_between_events_belong_to_their_time_and_asking_changes_nothing():
    block, simulator, context, port = hung(max_step=1e-3)
    port.FixValue(context, np.full(8, -1e-2))
    start = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    simulator.AdvanceTo(0.1)
    for _ in range(3):
        now = block.GetOutputPort("unstrained_lengths").Eval(context)
        np.testing.assert_allclose(now, start - 1e-3, atol=1e-12)


def test_a_command_that_is_changed_between_two_advances_acts_from_then_on():
    """What a command does begins with it, also where nobody looked at the state before."""
    block, simulator, context, port = hung(max_step=1e-3)
    start = block.GetOutputPort("unstrained_lengths").Eval(context).copy()
    for command, total in ((-1e-2, -1e-3), (3e-2, 2e-3), (0.0, 2e-3)):
        port.FixValue(context, np.full(8, command))
        simulator.AdvanceTo(context.get_time() + 0.1)
        port.FixValue(context, np.full(8, 0.123))  # at once changed again
        now = block.GetOutputPort("unstrained_lengths").Eval(context)
        np.testing.assert_allclose(now, start + total, atol=1e-12)


def test_contexts_do_not_know_each_other():
    block, simulator, context, port = hung(max_step=1e-3)
    other = Simulator(block, context.Clone())
    port.FixValue(other.get_mutable_context(), np.full(8, -1e-2))
    other.AdvanceTo(0.1)
    simulator.AdvanceTo(0.1)
    lengths = [
        block.GetOutputPort("unstrained_lengths").Eval(one.get_context())
        for one in (simulator, other)
    ]
    np.testing.assert_allclose(lengths[0] - lengths[1], 1e-3, atol=1e-12)


def test_commands_that_change_continuously_are_sampled():
    """By `command_period`; the error is that of a command that is linear between samples."""
    robot, errors = load_robot("acrobot_small"), []
    for period in (2e-3, 1e-3):
        builder = DiagramBuilder()
        block = builder.AddSystem(
            CompiledCableRobot(robot, rule=StepRule(max_step=1e-3), command_period=period)
        )
        wave = builder.AddSystem(Sine(amplitudes=np.full(8, 1e-3), frequencies=np.full(8, 10.0),
                                      phases=np.zeros(8), is_time_based=True))  # fmt: skip
        builder.Connect(wave.get_output_port(0), block.GetInputPort("cable_velocities"))
        simulator = Simulator(builder.Build())
        own = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        block.set_at_equilibrium(own, robot.home.transform())
        start = block.GetOutputPort("unstrained_lengths").Eval(own).copy()
        simulator.AdvanceTo(0.1)
        exact = start + 1e-4 * (1.0 - np.cos(1.0))
        errors.append(np.max(np.abs(block.GetOutputPort("unstrained_lengths").Eval(own) - exact)))
    assert errors[1] < 0.3 * errors[0] < 1e-8


def test_time_that_is_set_back_is_refused():
    block, simulator, context, _ = hung(max_step=1e-3)
    simulator.AdvanceTo(0.1)
    simulator.AdvanceTo(0.2)
    context.SetTime(0.0)
    with pytest.raises(RuntimeError, match=r"state is that of 0\.1 s.* context stands at 0 s"):
        block.GetOutputPort("X_WP").Eval(context)
    block.set_at_equilibrium(context, block.robot.home.transform())
    simulator.Initialize()
    simulator.AdvanceTo(0.1)


def test_a_motion_without_end_is_an_error_in_one_line():
    _, simulator, _, _ = hung(max_step=0.02)
    with pytest.raises(DivergedError, match=r"before .* s: the motion is not finite .* 0\.02 s"):
        simulator.AdvanceTo(5.0)


def test_accuracy_is_kept_and_told():
    block, simulator, context, port = hung(max_step=1e-3, accuracy=1e-9)
    port.FixValue(context, np.full(8, -1e-2))
    simulator.AdvanceTo(0.2)
    errors = block.GetOutputPort("step_errors").Eval(context)
    taken, back = block.GetOutputPort("steps").Eval(context)
    assert np.all(errors > 0.0)
    assert np.all(errors <= 1e-9)
    assert taken > 200
    assert back > 0


def test_a_platform_on_the_axis_of_a_pulley_cannot_go_on():
    robot = load_robot("acrobot_small")
    block = CompiledCableRobot(robot, settings_of(pulleys=True))
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    cables = block.forces.cable_set()
    X_WP = RigidTransform(cables.p_WA[:, 0] - cables.p_PB[:, 0])
    block.motion.hold(block.motion.GetMyMutableContextFromRoot(context), X_WP, np.ones(8), None)
    with pytest.raises(CableGeometryError, match="cable 1"):
        Simulator(block, context).AdvanceTo(0.1)


def test_what_else_moves_needs_the_plant():
    def add_ball(builder, in_plant, scene_graph):
        ball = SpatialInertia.SolidSphereWithMass(0.5, 0.05)
        in_plant.plant.AddRigidBody("ball", in_plant.plant.AddModelInstance("toys"), ball)

    with pytest.raises(CdprError, match=r"found 3 bodies .* need the engine plant"):
        CompiledCableRobot(load_robot("acrobot_small"), add_to_scene=add_ball)


def test_the_scene_moves_with_the_platform():
    block, simulator, context, port = hung(max_step=1e-3)
    port.FixValue(context, np.full(8, -1e-2))
    simulator.AdvanceTo(0.5)
    query = block.GetOutputPort("query_object").Eval(context)
    frame = block.plant.GetBodyFrameIdOrThrow(block.in_plant.body_index)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    assert np.max(pose_error(query.GetPoseInWorld(frame), X_WP)) < 1e-12
    bodies = block.GetOutputPort("body_poses").Eval(context)
    assert np.max(pose_error(bodies[1], X_WP)) < 1e-12
    assert X_WP.translation()[2] > block.robot.home.transform().translation()[2] + 1e-3


def test_commanded_tensions_hold_a_platform_that_they_balance():
    robot = load_robot("acrobot_small")
    cables = robot.cable_set().without_pulleys()
    reference = CompiledCableRobot(robot)
    tensions = reference.set_at_equilibrium(
        reference.CreateDefaultContext(), robot.home.transform()
    )
    builder = DiagramBuilder()
    motion = builder.AddSystem(motion_by_tensions(robot, cables, rule=StepRule(max_step=1e-3)))
    source = builder.AddSystem(ConstantVectorSource(tensions))
    builder.Connect(source.get_output_port(), motion.GetInputPort("tensions"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.2)
    own = motion.GetMyContextFromRoot(simulator.get_context())
    X_WP = motion.GetOutputPort("X_WP").Eval(own)
    assert np.max(pose_error(X_WP, robot.home.transform())) < 1e-9
    assert not motion.GetOutputPort("slack").Eval(own).any()


def test_kernels_know_nothing_of_drake():
    folder = Path(__file__).parents[3] / "cdpr_drake" / "dynamics"
    assert not [path.name for path in folder.glob("*.py") if "pydrake" in path.read_text()]
