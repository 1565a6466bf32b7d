"""The compiled robot moves as the plant does, the oracle of all robots and options; by events."""

from dataclasses import dataclass, field
from pathlib import Path

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

from cdpr_drake.dynamics.robot_arrays import DAMPING
from cdpr_drake.errors import DivergedError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.platform_schema import PlatformDamping
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.loops.robot_motion import RobotMotion
from cdpr_drake.systems.robots.cable_forces import CREPT
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import Failure
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.settings import CableRobotSettings
from tests.models.robots import robot_of
from tests.models.test_platform_pulleys import robot_content
from tests.motion.small_robots import small_robot
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    SAME_STEPS,
    behaving,
    bundled,
    even_step,
    place,
    port_names,
    pose,
    read,
    rubbing,
    settings_of,
    started,
)

LOOKS = 4
"""Times at which states are compared, without the start; failures begin at the first."""

FORCES = ("tensions", "applied_torques", "friction_torques")
"""Their differences are relative to the largest."""

STATE = ["platform_state", "unstrained_lengths", "unstrained_length_rates", "lengths", "tensions"]
MOTORS = ["motor_angles", "applied_torques", "friction_torques"]
WRENCH = np.array([0.3, -0.2, 0.5, 4.0, -3.0, 2.0])
TURNING = np.array([0.2, -0.1, 0.3, 0.0, 0.0, 0.0])


@dataclass
class Case:
    """A robot that moves for a while by a command whose parts differ."""

    robot: object
    mode: str = "ideal"
    model: str | None = None
    pulleys: bool = False
    damping: float | None = 2.0
    command: object = None
    wrench: object = None
    events: list | None = None
    duration: float = 0.1
    step: float | None = None
    more: list = field(default_factory=list)
    tolerance: float = SAME_STEPS

    def made(self):
        robot = self.robot() if callable(self.robot) else load_robot(self.robot)
        how = settings_of(self.mode, self.model, self.pulleys, self.damping, self.events)
        command = self.command
        if command is None:
            sizes = {"torque": -0.5, "position": -0.01}
            command = sizes.get(self.mode, -0.02) * np.linspace(0.5, 1.0, len(robot.cables))
        return robot, how, command


def creeping(name, **behaviour):
    return lambda: behaving(load_robot(name), **behaviour)


def creeping_and_rubbing():
    robot = behaving(load_robot("acrobot_small"), creep_stiffness=0.4, creep_time=0.05)
    return rubbing(robot, 0.3, 0.5, 0.02)


BREAKS = [Failure(kind="cable_breaks", time=0.02, cable=1)]
FAILING = [
    Failure(kind="winch_jams", time=0.02, winch=1),
    Failure(kind="power_lost", time=0.02, winch=3),
]
EVENTS = {"duration": 0.08, "step": 1e-4, "damping": None}
BUNDLES = {"robot": bundled, "damping": 20.0, "duration": 0.02, "step": 1e-4, "tolerance": 1e-8}
"""Rounding, times what motors with two cables make of it."""

SPEEDS = [0.05, -0.02, 0.03]

CASES = {
    "straight": Case("acrobot_small", model="kelvin_voigt"),
    "pulleys, velocity": Case("acrobot_small", "velocity", "elastic", True),
    "catenary, position": Case("acrobot_small", "position", "catenary", True, wrench=WRENCH),
    "pulleys at the platform": Case(
        lambda: robot_of(robot_content()), pulleys=True, damping=None, duration=0.02, step=1e-4
    ),
    "pulleys, torque": Case("acrobot_large", "torque", "kelvin_voigt", True, step=5e-4),
    "pushed": Case("acrobot_large", damping=None, wrench=WRENCH, step=1e-4),
    "catenary": Case("caroca", model="catenary"),
    "planar": Case("planar"),
    "planar, velocity": Case("planar", "velocity", "elastic"),
    "planar, pushed": Case("planar", damping=None, wrench=WRENCH, step=1e-4),
    "stiffening": Case(
        creeping("acrobot_small", stiffening=2e-3, expansion=1.2e-5, warmer=15.0), pulleys=True
    ),
    "all behaviour": Case(
        creeping("acrobot_small", **ALL_BEHAVIOUR), "velocity", pulleys=True, more=[CREPT]
    ),
    "creeping": Case(
        creeping("acrobot_large", creep_stiffness=0.4, creep_time=0.05), pulleys=True, more=[CREPT]
    ),
    "planar, creeping": Case(
        creeping("planar", stiffening=2e-3, creep_stiffness=0.4), "velocity", more=[CREPT]
    ),
    "rubbing": Case(
        lambda: rubbing(small_robot("hanging_four"), 0.3, 0.5, 0.02), damping=None,
        wrench=TURNING, more=[BENT],
    ),
    "rubbing in a plane": Case(
        lambda: rubbing(small_robot("oblique_body"), 0.3, 0.5, 0.02), damping=None,
        wrench=TURNING, more=[BENT],
    ),
    "rubbing, creeping": Case(creeping_and_rubbing, "velocity", wrench=TURNING, more=[BENT, CREPT]),
    "bundles": Case(**BUNDLES, command=SPEEDS),
    "bundles, velocity": Case(**BUNDLES, mode="velocity", command=SPEEDS),
    "bundles, torque": Case(**BUNDLES, mode="torque", command=[-0.15, -0.17, -0.16]),
    "bundles, position": Case(**BUNDLES, mode="position", command=[0.002, -0.001, 0.0]),
    "a cable breaks": Case("acrobot_small", events=BREAKS, **EVENTS),
    "breaks, velocity": Case(
        "acrobot_small", "velocity", "elastic", True, events=BREAKS, **EVENTS
    ),
    "breaks, catenary": Case("caroca", model="catenary", events=BREAKS, **EVENTS),
    "breaks, planar": Case("planar", events=BREAKS, **EVENTS),
    "fails, torque": Case("acrobot_small", "torque", command=-0.05, events=FAILING, **EVENTS),
    "fails, velocity": Case("acrobot_small", "velocity", command=-0.02, events=FAILING, **EVENTS),
}  # fmt: skip


def history(kind, robot, how, names, duration, step, **start):
    """Rows of the ports at the start and at every look, by port."""
    block, simulator, context = started(kind, robot, how, step, **start)
    rows = {name: [read(block, context, name)] for name in names}
    for k in range(1, LOOKS + 1):
        simulator.AdvanceTo(duration * k / LOOKS)
        for name in names:
            rows[name].append(read(block, context, name))
    return {name: np.array(values) for name, values in rows.items()}


@pytest.mark.parametrize("name", CASES)
def test_it_moves_as_the_plant(name):
    case = CASES[name]
    robot, how, command = case.made()
    longest = case.step or automatic_step(robot, robot.home.transform(), "runge_kutta3", how)
    step = even_step(case.duration, min(longest, 2e-3), LOOKS)
    names = STATE + (MOTORS if case.mode != "ideal" else []) + case.more
    found, expected = (
        history(kind, robot, how, names, case.duration, step, command=command, wrench=case.wrench)
        for kind in (CompiledCableRobot, CableRobot)
    )
    moves = expected["platform_state"]
    assert np.max(np.abs(moves[-1] - moves[0])) > 1e-5
    for port in names:
        scale = np.max(np.abs(expected[port])) if port in FORCES else 1.0
        np.testing.assert_allclose(
            found[port], expected[port], rtol=0.0, atol=case.tolerance * max(scale, 1.0),
            err_msg=port,
        )  # fmt: skip
    for port in case.more:
        assert np.max(np.abs(expected[port][-1] - expected[port][0])) > 1e-6, port
    if robot.winch_groups().are_shared():
        rates = found["unstrained_length_rates"]
        np.testing.assert_allclose(rates[:, ::2], rates[:, 1::2], atol=1e-12)


@pytest.mark.parametrize("mode", ["ideal", "torque", "velocity", "position"])
def test_ports_are_those_of_the_plant_and_a_few_more(mode):
    robot, how = load_robot("acrobot_small"), settings_of(mode)
    robot.winch.brake_torque = 0.5
    inputs, outputs = port_names(CableRobot(robot, how))
    more_inputs, more_outputs = port_names(CompiledCableRobot(robot, how))
    command = {"torque": "motor_torques", "position": "commanded_lengths"}
    brakes = set() if mode == "ideal" else {"brakes"}
    assert set(inputs) == {command.get(mode, "cable_velocities"), "applied_wrench"} | brakes
    rates = {"commanded_length_rates"} if mode == "position" else set()
    assert set(more_inputs) == set(inputs) | rates
    assert set(more_outputs) == set(outputs) | {"step_errors", "steps"}
    motors = {"motor_angles", "motor_speeds", "applied_torques", "friction_torques"}
    assert set(outputs) == (motors if mode != "ideal" else set()) | {
        "X_WP", "body_accelerations", "body_poses", "body_velocities", "drum_tensions", "lengths",
        "platform_state", "query_object", "sags", "slack", "surplus_lengths", "tensions",
        "unstrained_length_rates", "unstrained_lengths",
    }  # fmt: skip


def test_every_engine_takes_damping_and_model_of_the_file():
    robot = load_robot("acrobot_small")
    robot.damping = PlatformDamping(translation=30.0, rotation=0.4)
    robot.cable_model = "catenary"
    plant, compiled = CableRobot(robot), CompiledCableRobot(robot)
    gain = plant.GetSubsystemByName("damping").D()
    np.testing.assert_array_equal(np.diag(-gain[:, -6:]), [0.4] * 3 + [30.0] * 3)
    assert plant.forces.model() == "catenary"
    motion = RobotMotion(robot, CableRobotSettings(), StepRule())
    batch = BatchRobots(robot, 1)
    for arrays in (compiled.motion.arrays(), motion._arrays, batch._members[0].arrays):
        np.testing.assert_array_equal(arrays.body[DAMPING : DAMPING + 2], [30.0, 0.4])
    assert motion._model == batch._members[0].model == "catenary"


def test_kernels_know_nothing_of_drake():
    folder = Path(__file__).parents[3] / "cdpr_drake" / "dynamics"
    assert not [path.name for path in folder.glob("*.py") if "pydrake" in path.read_text()]


# Events: commands from event to event or continuous, outputs, accuracy.

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
