"""The robot in compiled steps: outputs, commands from event to event or continuous, accuracy."""

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    Integrator,
    LogVectorOutput,
    Sine,
    TrajectorySource,
    ZeroOrderHold,
)
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.errors import DivergedError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from tests.systems.robots.engines import place, pose, read, settings_of, started

SAME_MOTION = 1e-5
"""Distance of platforms [m] by the two engines, each with its default accuracy."""

SAME_SAMPLES = 1e-9
"""Distance of platforms [m] with other events: errors of second order of a millisecond."""

OTHER_STEPS = 1e-6
"""Distance of platforms [m] where the integration takes other steps."""

END = 0.12
ROBOT = load_robot("acrobot_small")
HOME = ROBOT.home.transform()
RULE = StepRule(max_step=1e-3)


def hung(command=0.0, step=1e-3):
    """With the port of its commands."""
    block, simulator, context = started(CompiledCableRobot, ROBOT, step=step, command=command)
    return block, simulator, context, block.GetInputPort("cable_velocities")


def test_a_command_that_is_changed_between_two_advances_acts_from_then_on():
    """Also where nobody looked at the state before; to look, also often, changes nothing."""
    block, simulator, context, port = hung()
    start = read(block, context, "unstrained_lengths")
    for command, total in ((-1e-2, -1e-3), (3e-2, 2e-3), (0.0, 2e-3)):
        port.FixValue(context, np.full(8, command))
        simulator.AdvanceTo(context.get_time() + 0.1)
        port.FixValue(context, np.full(8, 0.123))  # at once changed again
        for _ in range(3):
            now = read(block, context, "unstrained_lengths")
            np.testing.assert_allclose(now, start + total, atol=1e-12)


def test_contexts_do_not_know_each_other():
    block, simulator, context, port = hung()
    other = Simulator(block, context.Clone())
    port.FixValue(other.get_mutable_context(), np.full(8, -1e-2))
    other.AdvanceTo(0.1)
    simulator.AdvanceTo(0.1)
    still, drawn = (
        read(block, one.get_context(), "unstrained_lengths") for one in (simulator, other)
    )
    np.testing.assert_allclose(still - drawn, 1e-3, atol=1e-12)


def test_a_motion_without_end_is_an_error_in_one_line():
    _, simulator, _, _ = hung(step=0.02)
    with pytest.raises(DivergedError, match=r"before .* s: the motion is not finite .* 0\.02 s"):
        simulator.AdvanceTo(5.0)


def test_accuracy_is_kept_and_told():
    block, simulator, context, _ = hung(-1e-2)
    block.integrate_by(StepRule(max_step=1e-3, accuracy=1e-9))
    simulator.AdvanceTo(0.2)
    errors = read(block, context, "step_errors")
    taken, back = read(block, context, "steps")
    assert np.all(errors > 0.0)
    assert np.all(errors <= 1e-9)
    assert taken > 200
    assert back > 0


def test_the_scene_moves_with_the_platform():
    block, simulator, context, _ = hung(-1e-2)
    simulator.AdvanceTo(0.2)
    query = block.GetOutputPort("query_object").Eval(context)
    frame = block.plant.GetBodyFrameIdOrThrow(block.in_plant.body_index)
    X_WP = pose(block, context)
    assert np.max(pose_error(query.GetPoseInWorld(frame), X_WP)) < 1e-12
    bodies = block.GetOutputPort("body_poses").Eval(context)
    assert np.max(pose_error(bodies[1], X_WP)) < 1e-12
    assert X_WP.translation()[2] > HOME.translation()[2] + 1e-3


def wave(size, scale, base=0.0):
    """A bump: zero, and at rest, at both ends, so that who looks there sees nothing."""
    times = np.linspace(0.0, END, 31)
    values = base + scale * np.sin(np.pi * times / END) ** 2 * np.ones((size, 1))
    return TrajectorySource(PiecewisePolynomial.CubicShapePreserving(times, values, True))


def ramp(size, scale, base=0.0):
    times = np.array([0.0, END / 3.0, END])
    values = base + scale * np.array([0.0, 1.0, 0.3]) * np.ones((size, 1))
    return TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, values))


def integral(size, scale, base=0.0):
    builder = DiagramBuilder()
    rate = builder.AddSystem(ConstantVectorSource(np.full(size, scale / END)))
    sums = builder.AddSystem(Integrator(np.broadcast_to(np.ravel(base), size)))
    builder.Connect(rate.get_output_port(), sums.get_input_port())
    builder.ExportOutput(sums.get_output_port())
    return builder.Build()


def held(size):
    builder = DiagramBuilder()
    source, hold = builder.AddSystem(wave(size, 0.02)), ZeroOrderHold(0.01, size)
    builder.AddSystem(hold)
    builder.Connect(source.get_output_port(), hold.get_input_port())
    builder.ExportOutput(hold.get_output_port())
    return builder.Build()


def connect(builder, source, port):
    builder.AddSystem(source)
    parts = builder.AddSystem(Demultiplexer([port.size()]))  # as a user cuts a longer vector
    builder.Connect(source.get_output_port(), parts.get_input_port())
    builder.Connect(parts.get_output_port(0), port)


def end_of(kind, mode, port_name, make, log=None, **how):
    """Position of the platform at the end [m]; a source for one port is made of its size."""
    builder = DiagramBuilder()
    block = builder.AddSystem(kind(ROBOT, settings_of(mode), **how))
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() == port_name:
            connect(builder, make(port.size()), port)
        elif port.get_name() in ("brakes", "cable_velocities"):
            still = builder.AddSystem(ConstantVectorSource(np.zeros(port.size())))
            builder.Connect(still.get_output_port(), port)
    if log is not None:
        LogVectorOutput(block.GetOutputPort("lengths"), builder, log)
    simulator = Simulator(builder.Build())
    context = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    block.set_at_equilibrium(context, HOME)
    if kind is CableRobot:
        integrator = ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
        integrator.set_target_accuracy(1e-7)
    simulator.AdvanceTo(END)
    return place(block, context)


def at_home(mode, name):
    block, _, context = started(CompiledCableRobot, ROBOT, settings_of(mode))
    return read(block, context, name)[:, np.newaxis]


COMMANDS = {
    "ideal": ("ideal", "cable_velocities", 0.04, lambda: 0.0),
    "velocity": ("velocity", "cable_velocities", 0.04, lambda: 0.0),
    "position": ("position", "commanded_lengths", 0.005,
                 lambda: at_home("ideal", "unstrained_lengths")),
    "torque": ("torque", "motor_torques", -0.4, lambda: at_home("torque", "applied_torques")),
    "wrench": ("ideal", "applied_wrench", 2.0, lambda: 0.0),
}  # fmt: skip
PAIRS = [
    ("ideal", wave), ("ideal", ramp), ("ideal", integral), ("velocity", wave),
    ("velocity", integral), ("position", ramp), ("position", integral), ("torque", wave),
    ("torque", ramp), ("wrench", ramp), ("wrench", integral),
]  # fmt: skip


@pytest.mark.parametrize(("command", "make"), PAIRS)
def test_a_continuous_command_moves_the_compiled_robot_as_the_plant(command, make):
    mode, port, scale, base = COMMANDS[command]
    start = base()
    expected, found = (
        end_of(kind, mode, port, lambda size: make(size, scale, start))
        for kind in (CableRobot, CompiledCableRobot)
    )
    assert np.max(np.abs(expected - HOME.translation())) > SAME_MOTION
    np.testing.assert_allclose(found, expected, atol=SAME_MOTION)


def end_with(make=lambda size: wave(size, 0.02), **how):
    return end_of(CompiledCableRobot, "ideal", "cable_velocities", make, **how)


def test_motion_does_not_depend_on_who_logs():
    alone = end_with()
    for log in (0.01, 0.007, 0.00031):
        np.testing.assert_allclose(end_with(log=log), alone, atol=SAME_SAMPLES, err_msg=f"{log} s")


def test_a_held_command_may_be_sampled_at_events_only():
    """The command of a sampled controller acts the same way, by its events or by more."""
    ends = [end_with(held, rule=RULE, command_period=period) for period in (HELD, None, 0.00037)]
    np.testing.assert_allclose(ends[1], ends[0], atol=SAME_SAMPLES)
    np.testing.assert_allclose(ends[2], ends[0], atol=OTHER_STEPS)


def test_commands_that_change_continuously_are_sampled():
    """By `command_period`; the error is that of a command that is linear between samples."""
    errors = []
    for period in (2e-3, 1e-3):
        builder = DiagramBuilder()
        block = builder.AddSystem(CompiledCableRobot(ROBOT, rule=RULE, command_period=period))
        wave = builder.AddSystem(Sine(amplitudes=np.full(8, 1e-3), frequencies=np.full(8, 10.0),
                                      phases=np.zeros(8), is_time_based=True))  # fmt: skip
        builder.Connect(wave.get_output_port(0), block.GetInputPort("cable_velocities"))
        simulator = Simulator(builder.Build())
        own = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        block.set_at_equilibrium(own, HOME)
        exact = read(block, own, "unstrained_lengths") + 1e-4 * (1.0 - np.cos(1.0))
        simulator.AdvanceTo(0.1)
        errors.append(np.max(np.abs(read(block, own, "unstrained_lengths") - exact)))
    assert errors[1] < 0.3 * errors[0] < 1e-8


def by_tensions(source, duration, period=None):
    """Pose and slackness of a platform that tensions of a source carry."""
    builder, cables = DiagramBuilder(), ROBOT.cable_set().without_pulleys()
    motion = builder.AddSystem(motion_by_tensions(ROBOT, cables, rule=RULE, command_period=period))
    connect(builder, source, motion.GetInputPort("tensions"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    own = motion.GetMyContextFromRoot(simulator.get_context())
    return pose(motion, own), read(motion, own, "slack")


def test_commanded_tensions_hold_a_platform_and_continuous_ones_lift_it():
    """Against the motion by small steps of the same tensions."""
    balance = at_home("ideal", "tensions")
    X_WP, slack = by_tensions(ConstantVectorSource(balance[:, 0]), 0.2)
    assert np.max(pose_error(X_WP, HOME)) < 1e-9
    assert not slack.any()
    coarse, fine = (
        by_tensions(ramp(8, 0.2, balance), END, period)[0].translation() for period in (None, 1e-4)
    )
    assert coarse[2] > HOME.translation()[2] + 1e-4
    np.testing.assert_allclose(coarse, fine, atol=SAME_SAMPLES)
