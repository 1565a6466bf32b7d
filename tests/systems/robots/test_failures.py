"""Failures: as if parts had never been there."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.failures import Failure, Failures, FailureSettings
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor
from tests.systems.robots.engines import (
    BY_ENGINE,
    SAME_STEPS,
    pose,
    read,
    settings_of,
    started,
    without,
)

ROBOT = load_robot("acrobot_small")
M = len(ROBOT.cables)
STEP, FAIL, END = 1e-4, 0.02, 0.05

GUESSES = 3
"""Where in `simulation_kernel.make_room` solutions of catenaries begin."""

STORED = 1e-9
"""Relative difference of energies: rounding of a sum that has the weight's energy in it."""

STATES = ("platform_state", "unstrained_lengths", "unstrained_length_rates", "tensions")


def breaking(cable, time=FAIL):
    return [Failure(kind="cable_breaks", time=time, cable=cable)]


def states(block, context, keep=slice(None)):
    """State of the platform, and of the cables to keep."""
    platform, *cables = (read(block, context, name) for name in STATES)
    return np.concatenate([platform, *(values[keep] for values in cables)])


CASES = [
    ("acrobot_small", "ideal", "kelvin_voigt", False, "runge_kutta3", 0),
    ("acrobot_small", "ideal", "kelvin_voigt", True, "runge_kutta3", 2),
    ("acrobot_small", "velocity", "elastic", True, "runge_kutta3", 0),
    ("acrobot_large", "torque", "kelvin_voigt", False, "runge_kutta2", 2),
    ("acrobot_small", "velocity", "kelvin_voigt", False, "semi_implicit", 0),
    ("planar", "ideal", "kelvin_voigt", False, "semi_implicit", 2),
    ("caroca", "ideal", "catenary", False, "runge_kutta3", 0),
    ("caroca", "ideal", "catenary", False, "runge_kutta3", 2),
]


@pytest.mark.parametrize(("name", "mode", "model", "pulleys", "method", "cable"), CASES)
def test_what_is_left_moves_as_the_robot_without_it(name, mode, model, pulleys, method, cable):
    """By the compiled engine, from the state in which it breaks, to the last bit."""
    robot = load_robot(name)
    m = len(robot.cables)
    keep = np.arange(m) != cable
    command = {"torque": -0.4}.get(mode, -0.03) * np.linspace(0.5, 1.0, m)
    block, simulator, context = started(
        CompiledCableRobot, robot, settings_of(mode, model, pulleys, events=breaking(cable)), STEP,
        command=command, method=method,
    )  # fmt: skip
    simulator.AdvanceTo(FAIL)
    n = block.GetOutputPort("platform_state").size()
    at_break = block.motion.state(block.motion.GetMyContextFromRoot(context)).copy()
    other, other_simulator, other_context = started(
        CompiledCableRobot, without(robot, cable), settings_of(mode, model, pulleys), STEP,
        command=command[keep], method=method, held=False,
    )  # fmt: skip
    other_context.SetTime(FAIL)
    winches = at_break[n:].reshape(-1, m)[:, keep].ravel()
    other.motion.set_state(
        other.motion.GetMyMutableContextFromRoot(other_context),
        np.concatenate([at_break[:n], winches]),
    )
    # Catenaries begin with the last solution, which is left in the robot's room to work in.
    guesses = block.motion.arrays().room[GUESSES : GUESSES + 2 * m].reshape(m, 2)
    other.motion.arrays().room[GUESSES : GUESSES + 2 * (m - 1)] = guesses[keep].ravel()
    simulator.AdvanceTo(END)
    other_simulator.AdvanceTo(END)
    found, expected = states(block, context, keep), states(other, other_context)
    if model == "catenary":  # whose tensions, asked for at the end alone, begin with no solution
        np.testing.assert_allclose(found[1 - m :], expected[1 - m :], rtol=SAME_STEPS)
        found, expected = found[: 1 - m], expected[: 1 - m]
    assert np.array_equal(found, expected)
    assert not np.allclose(found[:n], at_break[:n], atol=1e-6)


@pytest.mark.parametrize("pulleys", [False, True])
def test_what_a_cable_had_stored_is_released(pulleys):
    """Along the groove and then straight: its pulley is gone with it."""
    how = settings_of("ideal", "elastic", pulleys, events=breaking(4))
    block, simulator, context = started(CompiledCableRobot, ROBOT, how, 2e-5)
    simulator.AdvanceTo(FAIL - STEP)
    own, cables = block.motion.GetMyContextFromRoot(context), block.motion.cable_set()
    before = block.motion.energy(own)
    simulator.AdvanceTo(FAIL + 1e-9)
    l0 = read(block, context, "unstrained_lengths")[4]
    stretch = cable_paths(pose(block, context), cables).lengths[4] - l0
    stored = 0.5 * cables.stiffness[4] * stretch**2 / l0
    assert stored > 0.0
    assert before - block.motion.energy(own) == pytest.approx(stored, rel=STORED)


@BY_ENGINE
@pytest.mark.parametrize("mode", ["ideal", "velocity"])
def test_where_nothing_fails_bits_are_the_same(kind, mode):
    found, command = [], -0.03 * np.linspace(0.5, 1.0, M)
    for events in (None, [], breaking(1, 10.0)):
        block, simulator, context = started(
            kind, ROBOT, settings_of(mode, events=events), STEP, command=command
        )
        simulator.AdvanceTo(FAIL)
        found.append(states(block, context))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


@BY_ENGINE
def test_an_input_breaks_a_cable_as_an_event_does(kind):
    robot, found = load_robot("planar"), []
    flags = (np.arange(4) == 2).astype(float)
    for events in ([], breaking(2, 0.0)):
        block, simulator, context = started(kind, robot, settings_of(events=events), STEP)
        if not events:
            block.GetInputPort("broken").FixValue(context, flags)
        simulator.AdvanceTo(FAIL)
        found.append(states(block, context))
        np.testing.assert_array_equal(read(block, context, "broken"), flags)
        assert read(block, context, "tensions")[2] == 0.0
        assert read(block, context, "slack")[2] == 1.0
    assert np.array_equal(*found)


def failing(kind, mode, what, *, command=-0.02, robot=ROBOT):
    """A robot at the moment at which something happens to its winch 3."""
    how = settings_of(mode, events=[Failure(kind=what, time=FAIL, winch=3)])
    block, simulator, context = started(kind, robot, how, STEP, command=command)
    simulator.AdvanceTo(FAIL)
    return block, simulator, context


@BY_ENGINE
def test_an_ideal_winch_that_jams_stands_still_at_once(kind):
    block, simulator, context = failing(kind, "ideal", "winch_jams")
    before = read(block, context, "unstrained_lengths")
    simulator.AdvanceTo(END)
    changed = read(block, context, "unstrained_lengths") - before
    assert changed[3] == 0.0
    assert np.delete(changed, 3) == pytest.approx(-0.02 * (END - FAIL))
    assert read(block, context, "unstrained_length_rates")[3] == 0.0
    assert np.array_equal(read(block, context, "jammed"), np.arange(M) == 3)


@BY_ENGINE
def test_a_drum_that_jams_settles_as_friction_does(kind):
    """Its speed fades with the settling time T, in which it goes on by T times its speed."""
    block, simulator, context = failing(kind, "velocity", "winch_jams")
    before = read(block, context, "unstrained_lengths")[3]
    rate = read(block, context, "unstrained_length_rates")[3]
    simulator.AdvanceTo(0.08)
    settled = ROBOT.winch_law().friction.settling_time * rate
    assert rate < -0.001
    after = read(block, context, "unstrained_lengths")[3]
    assert after - before == pytest.approx(settled, rel=1e-3)  # of the steps
    assert abs(read(block, context, "unstrained_length_rates")[3]) < 1e-9


@BY_ENGINE
@pytest.mark.parametrize("friction", [True, False])
def test_a_motor_without_power_is_turned_by_its_cable(kind, friction):
    """Where its friction does not hold the cable, which on ACROBOT it does up to some newtons."""
    robot = copy.deepcopy(ROBOT)
    if not friction:
        robot.winch.friction.coulomb = robot.winch.friction.static = 0.0
    block, simulator, context = failing(kind, "velocity", "power_lost", command=0.0, robot=robot)
    before = read(block, context, "unstrained_lengths")
    simulator.AdvanceTo(0.08)
    torques = read(block, context, "applied_torques")
    assert torques[3] == 0.0
    assert np.all(np.delete(torques, 3) != 0.0)
    paid_out = read(block, context, "unstrained_lengths") - before
    if friction:
        assert abs(paid_out[3]) < 1e-9
    else:
        assert paid_out[3] > 2.0 * np.max(np.abs(np.delete(paid_out, 3)))
        assert read(block, context, "tensions")[3] == 0.0


def test_each_begins_when_it_says_and_lasts():
    events = [
        Failure(kind="cable_breaks", time=0.1, cable=3),
        Failure(kind="brake_closes", time=0.1, delay=0.055, winch=0),
        Failure(kind="power_lost", time=0.0, winch=2),
    ]
    builder = DiagramBuilder()
    block = builder.AddSystem(Failures(FailureSettings(events=events), 4, 3))
    logs = [
        LogVectorOutput(block.GetOutputPort(name), builder, 0.01)
        for name in ("broken", "jammed", "powerless")
    ]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.3)
    found = [log.FindLog(simulator.get_context()) for log in logs]
    times, (broken, jammed, powerless) = found[0].sample_times(), [log.data().T for log in found]
    # A row at an instant holds what stood there before.
    assert np.array_equal(broken[:, 3], times > 0.1 + 1e-9)
    assert np.array_equal(jammed[:, 0], times > 0.155)
    assert np.all(powerless[:, 2] == 1.0)
    assert np.all(broken[:, :3] == 0.0)
    assert np.all(jammed[:, 1:] == 0.0)


def test_a_scenario_of_it_needs_a_diagram():
    assert "failures" in diagram_reason(load_scenario("acrobot_broken_cable"))


def test_a_sensor_that_freezes_gives_what_it_read_last():
    scenario = load_scenario("acrobot_broken_cable", [
        "sensors={tension: vlu850, encoder: servo_encoder, log: [tension, encoder]}",
        "integration.engine=compiled",
        "failures.events=[{kind: sensor_freezes, time: 0.1, sensor: tension, cable: 2}, "
        "{kind: sensor_freezes, time: 0.2, sensor: encoder}]",
    ])  # fmt: skip
    servo = build_visual_servo(scenario)
    context = servo.make_context()
    simulator, tensions, lengths = Simulator(servo.diagram, context), [], []
    for time in (0.15, 0.3, 0.4):
        simulator.AdvanceTo(time)
        for name, rows in (("measured_tensions", tensions), ("measured_lengths", lengths)):
            port = servo.readings.port(name)
            rows.append(port.Eval(port.get_system().GetMyContextFromRoot(context)).copy())
    same = tensions[0] == tensions[1]
    assert same[2]
    assert np.sum(same) < M / 2
    assert np.all(lengths[0] != lengths[1])
    assert np.array_equal(lengths[1], lengths[2])


@pytest.mark.parametrize("periods", [1, 3.4])
def test_late_messages_come_late_and_the_last_one_stands_until_then(periods):
    """Readings are numbered by their time: a ramp, without noise, of two cables of three."""
    rate, begins = 100.0, 0.2
    builder, model = DiagramBuilder(), load_tension_sensor("vlu850")
    exact = replace(model, accuracy=0.0, repeatability=0.0)
    sensor = builder.AddSystem(TensionSensor(exact, 3, rate=rate))
    ramp = PiecewisePolynomial.FirstOrderHold([0.0, 9.0], np.array([[0.0, 9.0]] * 3))
    source = builder.AddSystem(TrajectorySource(ramp))
    builder.Connect(source.get_output_port(), sensor.GetInputPort("tensions"))
    sensor.delay(begins, np.array([True, False, True]), periods / rate)
    simulator = Simulator(builder.Build())
    context, late = simulator.get_context(), int(np.ceil(periods))
    for k in range(40):
        simulator.AdvanceTo((k + 0.5) / rate)
        found = read(sensor, sensor.GetMyContextFromRoot(context), "measured_tensions")
        first = round(begins * rate)
        seen = k if k < first else max(k - late, min(first - 1, k))
        assert found == pytest.approx([seen / rate, k / rate, seen / rate], abs=1e-12)


def test_a_run_with_late_messages_says_so():
    late = "failures.events=[{kind: message_late, time: 0.1, sensor: tension, delay: 0.05}]"
    scenario = load_scenario("acrobot_broken_redistributed", [
        late, "emergency=null", "duration=0.2", "log_rate=500", "integration.engine=compiled",
    ])  # fmt: skip
    result = ServoRun(scenario).simulate()
    readings, times = result.log["measured_tensions"], result.log["time"]
    held = (times > 0.11) & (times < 0.145)
    assert np.ptp(readings[held], axis=0) == pytest.approx(np.zeros(M))
    assert np.all(np.ptp(readings[times > 0.17], axis=0) > 0.0)
    events = result.as_dict()["failures"]["events"]
    assert events[0]["what"] == "tension: messages are late"
