"""Commands that change continuously: the compiled robot moves as the plant, whoever has events."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    Integrator,
    LogVectorOutput,
    TrajectorySource,
    ZeroOrderHold,
)
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings

SAME_MOTION = 1e-5
"""Distance of platforms [m] by the two engines, each with its default accuracy."""

SAME_SAMPLES = 1e-9
"""Distance of platforms [m] with other events: errors of second order of a millisecond."""

OTHER_STEPS = 1e-6
"""Distance of platforms [m] where the integration takes other steps."""

END = 0.3
ROBOT = load_robot("acrobot_small")


def wave(size, scale, base=0.0):
    """A bump: zero, and at rest, at both ends, so that who looks there sees nothing."""
    times = np.linspace(0.0, END, 31)
    values = base + scale * np.sin(np.pi * times / END) ** 2 * np.ones((size, 1))
    return TrajectorySource(PiecewisePolynomial.CubicShapePreserving(times, values, True))


def ramp(size, scale, base=0.0):
    times = np.array([0.0, 0.1, END])
    values = base + scale * np.array([0.0, 1.0, 0.3]) * np.ones((size, 1))
    return TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, values))


def integral(size, scale, base=0.0):
    return "integrator", np.full(size, scale / END), np.broadcast_to(base, size)


def connect(builder, source, port):
    if isinstance(source, tuple):
        _, rate, start = source
        constant = builder.AddSystem(ConstantVectorSource(rate))
        source = builder.AddSystem(Integrator(start))
        builder.Connect(constant.get_output_port(), source.get_input_port())
        return builder.Connect(source.get_output_port(), port)
    builder.AddSystem(source)
    parts = builder.AddSystem(Demultiplexer([port.size()]))  # as a user cuts a longer vector
    builder.Connect(source.get_output_port(), parts.get_input_port())
    return builder.Connect(parts.get_output_port(0), port)


def end_of(kind, sources, *, winches=None, log=None, **how):
    """Position of the platform at the end [m]; sources by port, made by a function."""
    builder = DiagramBuilder()
    settings = CableRobotSettings(winches=winches or WinchSettings())
    block = builder.AddSystem(kind(ROBOT, settings, **how))
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        name, make = port.get_name(), sources.get(port.get_name())
        if make is not None:
            connect(builder, make(port.size()), port)
        elif name in ("brakes", "cable_velocities"):
            still = builder.AddSystem(ConstantVectorSource(np.zeros(port.size())))
            builder.Connect(still.get_output_port(), port)
    if log is not None:
        LogVectorOutput(block.GetOutputPort("lengths"), builder, log)
    simulator = Simulator(builder.Build())
    context = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    block.set_at_equilibrium(context, ROBOT.home.transform())
    if kind is CableRobot:
        integrator = ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
        integrator.set_target_accuracy(1e-7)
    simulator.AdvanceTo(END)
    return block.GetOutputPort("X_WP").Eval(context).translation()


def held_torques():
    block = CableRobot(ROBOT, CableRobotSettings(winches=MOTORS["torque"]))
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, ROBOT.home.transform())
    drums = block.GetOutputPort("drum_tensions").Eval(context)
    return -drums * ROBOT.winch_law().drum.length_per_angle(np.zeros(8))


def home_lengths():
    block = CompiledCableRobot(ROBOT)
    context = block.CreateDefaultContext()
    block.set_at_equilibrium(context, ROBOT.home.transform())
    return block.GetOutputPort("unstrained_lengths").Eval(context)


MOTORS = {
    mode: WinchSettings(kind="motor", mode=mode) for mode in ("torque", "velocity", "position")
}
CASES = {
    "ideal": (None, "cable_velocities", 0.02, lambda: 0.0),
    "velocity": (MOTORS["velocity"], "cable_velocities", 0.02, lambda: 0.0),
    "position": (MOTORS["position"], "commanded_lengths", 0.005, home_lengths),
    "torque": (MOTORS["torque"], "motor_torques", -0.4, held_torques),
    "wrench": (None, "applied_wrench", 0.5, lambda: 0.0),
}


@pytest.mark.parametrize("make", [wave, ramp, integral])
@pytest.mark.parametrize("case", CASES)
def test_a_continuous_command_moves_the_compiled_robot_as_the_plant(case, make):
    winches, port, scale, base = CASES[case]
    start = base()
    start = start[:, np.newaxis] if np.ndim(start) and make is not integral else start
    sources = {port: lambda size: make(size, scale, start)}
    expected = end_of(CableRobot, sources, winches=winches)
    found = end_of(CompiledCableRobot, sources, winches=winches)
    assert np.max(np.abs(expected - ROBOT.home.transform().translation())) > SAME_MOTION
    np.testing.assert_allclose(found, expected, atol=SAME_MOTION)


@pytest.mark.parametrize("log", [0.01, 0.007, 0.00031])
def test_motion_does_not_depend_on_who_logs(log):
    sources = {"cable_velocities": lambda size: wave(size, 0.02)}
    alone = end_of(CompiledCableRobot, sources)
    np.testing.assert_allclose(
        end_of(CompiledCableRobot, sources, log=log), alone, atol=SAME_SAMPLES
    )


def test_a_held_command_may_be_sampled_at_events_only():
    """The command of a sampled controller acts the same way, by its events or by more."""

    def held(size):
        builder = DiagramBuilder()
        source, hold = builder.AddSystem(wave(size, 0.02)), ZeroOrderHold(0.01, size)
        builder.AddSystem(hold)
        builder.Connect(source.get_output_port(), hold.get_input_port())
        builder.ExportOutput(hold.get_output_port())
        return builder.Build()

    rule = StepRule(max_step=1e-3)
    ends = [
        end_of(CompiledCableRobot, {"cable_velocities": held}, rule=rule, command_period=period)
        for period in (HELD, None, 0.00037)
    ]
    np.testing.assert_allclose(ends[1], ends[0], atol=SAME_SAMPLES)
    np.testing.assert_allclose(ends[2], ends[0], atol=OTHER_STEPS)


def test_a_continuous_command_that_nothing_samples_is_refused_by_name():
    for port in ("cable_velocities", "applied_wrench"):
        sources = {port: lambda size: ramp(size, 0.02)}
        with pytest.raises(CdprError, match=rf"{port} of acrobot_small: .* or a command_period"):
            end_of(CompiledCableRobot, sources, command_period=math.inf)
    with pytest.raises(CdprError, match=r"command_period: found 0 s; accepted: more than 0"):
        CompiledCableRobot(ROBOT, command_period=0.0)


def test_continuous_tensions_lift_the_platform_as_they_balance_it():
    """Against the motion by small steps of the same tensions."""
    ends = []
    block = CompiledCableRobot(ROBOT)
    held = block.set_at_equilibrium(block.CreateDefaultContext(), ROBOT.home.transform())
    for period in (None, 1e-4):
        builder = DiagramBuilder()
        cables = ROBOT.cable_set().without_pulleys()
        rule = StepRule(max_step=1e-3)
        motion = builder.AddSystem(
            motion_by_tensions(ROBOT, cables, rule=rule, command_period=period)
        )
        connect(builder, ramp(8, 0.05, held[:, np.newaxis]), motion.GetInputPort("tensions"))
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(END)
        own = motion.GetMyContextFromRoot(simulator.get_context())
        ends.append(motion.GetOutputPort("X_WP").Eval(own).translation())
    assert ends[0][2] > ROBOT.home.transform().translation()[2] + 1e-3
    np.testing.assert_allclose(ends[0], ends[1], atol=SAME_SAMPLES)
