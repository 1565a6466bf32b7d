"""What fails beside cables: winches by both engines, brakes with a delay, sensors, refusals."""

import copy
import re
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import load_tension_sensor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import (
    Equipment,
    Failure,
    Failures,
    FailureSettings,
)
from cdpr_drake.systems.robots.settings import CableRobotSettings, WinchSettings
from cdpr_drake.systems.sensors.tension_sensor import TensionSensor
from tests.systems.robots.engines import made

ROBOT = load_robot("acrobot_small")
M = len(ROBOT.cables)
FAIL, END = 0.03, 0.09

SAME_STEPS = 1e-9
"""Difference of states of both engines by the same steps, see test_compiled_cable_robot."""

ENGINES = pytest.mark.parametrize("kind", [CableRobot, CompiledCableRobot])


def run(kind, mode, events, *, end=END, command=None, robot=ROBOT):
    """A robot whose winches are told to move, and its context at the end."""
    winches = WinchSettings() if mode == "ideal" else WinchSettings(kind="motor", mode=mode)
    how = CableRobotSettings(winches=winches, failures=FailureSettings(events=events))
    block = made(kind, robot, how)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    step = 1e-4
    assert step < automatic_step(robot, robot.home.transform(), "runge_kutta3", how)
    if kind is CableRobot:
        ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    else:
        block.integrate_by(StepRule(max_step=step))
    block.set_at_equilibrium(context, robot.home.transform())
    name = next(n for n in ("cable_velocities", "motor_torques") if block.HasInputPort(n))
    block.GetInputPort(name).FixValue(context, -0.02 * np.ones(M) if command is None else command)
    simulator.AdvanceTo(end)
    return block, simulator, context


def read(block, context, name):
    return block.GetOutputPort(name).Eval(context).copy()


@ENGINES
def test_an_ideal_winch_that_jams_stands_still_at_once(kind):
    block, simulator, context = run(
        kind, "ideal", [Failure(kind="winch_jams", time=FAIL, winch=3)], end=FAIL
    )
    before = read(block, context, "unstrained_lengths")
    simulator.AdvanceTo(END)
    moved = read(block, context, "unstrained_lengths") - before
    assert moved[3] == 0.0
    assert np.delete(moved, 3) == pytest.approx(-0.02 * (END - FAIL))
    assert read(block, context, "unstrained_length_rates")[3] == 0.0
    assert np.array_equal(read(block, context, "jammed"), np.arange(M) == 3)


@ENGINES
def test_a_drum_that_jams_settles_as_friction_does(kind):
    """Its speed fades with the settling time T, in which it goes on by T times its speed."""
    block, simulator, context = run(
        kind, "velocity", [Failure(kind="winch_jams", time=FAIL, winch=3)], end=FAIL
    )
    before = read(block, context, "unstrained_lengths")[3]
    rate = read(block, context, "unstrained_length_rates")[3]
    simulator.AdvanceTo(END)
    T = ROBOT.winch_law().friction.settling_time
    moved = read(block, context, "unstrained_lengths")[3] - before
    assert rate < -0.001
    assert moved == pytest.approx(T * rate, rel=1e-3)  # of the steps
    assert abs(read(block, context, "unstrained_length_rates")[3]) < 1e-9


@ENGINES
@pytest.mark.parametrize("friction", [True, False])
def test_a_motor_without_power_is_turned_by_its_cable(kind, friction):
    """Where its friction does not hold the cable, which on ACROBOT it does up to some newtons."""
    robot = copy.deepcopy(ROBOT)
    if not friction:
        robot.winch.friction.coulomb = robot.winch.friction.static = 0.0
    power_lost, still = [Failure(kind="power_lost", time=FAIL, winch=3)], np.zeros(M)
    block, simulator, context = run(
        kind, "velocity", power_lost, robot=robot, command=still, end=FAIL
    )
    before = read(block, context, "unstrained_lengths")
    simulator.AdvanceTo(END)
    torques, tensions = read(block, context, "applied_torques"), read(block, context, "tensions")
    assert torques[3] == 0.0
    assert np.all(np.delete(torques, 3) != 0.0)
    paid_out = read(block, context, "unstrained_lengths") - before
    if friction:
        assert abs(paid_out[3]) < 1e-9
    else:
        assert paid_out[3] > 2.0 * np.max(np.abs(np.delete(paid_out, 3)))
        assert tensions[3] == 0.0


@pytest.mark.parametrize("what", ["winch_jams", "power_lost"])
@pytest.mark.parametrize("mode", ["torque", "velocity"])
def test_both_engines_fail_alike(what, mode):
    command = -0.05 * np.ones(M) if mode == "torque" else None
    found = []
    for kind in (CableRobot, CompiledCableRobot):
        block, _, context = run(
            kind, mode, [Failure(kind=what, time=FAIL, winch=1)], command=command
        )
        names = ("platform_state", "unstrained_lengths", "unstrained_length_rates", "tensions")
        found.append(np.concatenate([read(block, context, name) for name in names]))
    np.testing.assert_allclose(*found, atol=SAME_STEPS * np.max(np.abs(found[0])))


def flags(events, end=0.3):
    builder = DiagramBuilder()
    block = builder.AddSystem(Failures(FailureSettings(events=events), 4, 3))
    logs = [
        LogVectorOutput(block.GetOutputPort(name), builder, 0.01)
        for name in ("broken", "jammed", "powerless")
    ]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(end)
    found = [log.FindLog(simulator.get_context()) for log in logs]
    return found[0].sample_times(), [log.data().T for log in found]


def test_each_begins_when_it_says_and_lasts():
    times, (broken, jammed, powerless) = flags([
        Failure(kind="cable_breaks", time=0.1, cable=3),
        Failure(kind="brake_closes", time=0.1, delay=0.055, winch=0),
        Failure(kind="power_lost", time=0.0, winch=2),
    ])  # fmt: skip
    # A row at an instant holds what stood there before.
    assert np.array_equal(broken[:, 3], times > 0.1 + 1e-9)
    assert np.array_equal(jammed[:, 0], times > 0.155)
    assert np.all(powerless[:, 2] == 1.0)
    assert np.all(broken[:, :3] == 0.0)
    assert np.all(jammed[:, 1:] == 0.0)


HAS = Equipment(8, 7, motors=False, sensors=("tension", "tracker"))


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (Failure(kind="cable_breaks", time=0.0), "cable: found none with cable_breaks"),
        (Failure(kind="cable_breaks", time=0.0, cable=8), "cable: found 8; accepted: 0 to 7"),
        (Failure(kind="winch_jams", time=0.0, winch=7), "winch: found 7; accepted: 0 to 6"),
        (Failure(kind="winch_jams", time=0.0, cable=1, winch=1), "cable: found 1 with winch_jams"),
        (Failure(kind="cable_breaks", time=0.0, cable=1, delay=0.1), "delay: found 0.1 with cable"),
        (Failure(kind="power_lost", time=0.0, winch=1), "kind: found power_lost with ideal"),
        (Failure(kind="sensor_freezes", time=0.0), "sensor: found none with sensor_freezes"),
        (
            Failure(kind="sensor_freezes", time=0.0, sensor="encoder"),
            "sensor: found encoder; accepted: tension, tracker",
        ),
        (
            Failure(kind="message_late", time=0.0, sensor="tension"),
            "delay: found none with message_late; accepted: a number of seconds",
        ),
        (
            Failure(kind="message_late", time=0.0, delay=0.1),
            "sensor: found none with message_late; accepted: tension, tracker",
        ),
        (
            Failure(kind="sensor_freezes", time=0.0, sensor="tracker", cable=1),
            "cable: found 1 with tracker; accepted: null",
        ),
    ],
)
def test_what_is_not_accepted(event, words):
    settings = FailureSettings(events=[Failure(kind="cable_breaks", time=0.0, cable=1), event])
    with pytest.raises(ScenarioError, match=re.escape(f"failures.events[1].{words}")):
        settings.check(HAS)


def test_unknown_kinds_are_named():
    with pytest.raises(ScenarioError, match="cable_thaws"):
        load_scenario(
            "acrobot_broken_cable", ["failures.events=[{kind: cable_thaws, time: 1.0, cable: 1}]"]
        )


def test_a_scenario_of_it_needs_a_diagram():
    assert "failures" in diagram_reason(load_scenario("acrobot_broken_cable"))


def test_a_sensor_that_freezes_gives_what_it_read_last():
    scenario = load_scenario("acrobot_broken_cable", [
        "sensors={tension: vlu850, encoder: servo_encoder, log: [tension, encoder]}",
        "integration.engine=compiled",
        "failures.events=[{kind: sensor_freezes, time: 0.2, sensor: tension, cable: 2}, "
        "{kind: sensor_freezes, time: 0.3, sensor: encoder}]",
    ])  # fmt: skip
    servo = build_visual_servo(scenario)
    context = servo.make_context()
    simulator = Simulator(servo.diagram, context)
    log = {}
    for time in (0.25, 0.45):
        simulator.AdvanceTo(time)
        for name in ("measured_tensions", "measured_lengths"):
            port = servo.readings.port(name)
            own = port.get_system().GetMyContextFromRoot(context)
            log[name, time] = port.Eval(own).copy()
    same = log["measured_tensions", 0.25] == log["measured_tensions", 0.45]
    assert same[2]
    assert np.sum(same) < M / 2
    assert np.all(log["measured_lengths", 0.25] != log["measured_lengths", 0.45])
    frozen = log["measured_lengths", 0.45]
    simulator.AdvanceTo(0.6)
    port = servo.readings.port("measured_lengths")
    assert np.array_equal(port.Eval(port.get_system().GetMyContextFromRoot(context)), frozen)


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
        time = (k + 0.5) / rate
        simulator.AdvanceTo(time)
        own = sensor.GetMyContextFromRoot(context)
        found = sensor.GetOutputPort("measured_tensions").Eval(own)
        first = round(begins * rate)
        seen = k if k < first else max(k - late, min(first - 1, k))
        assert found == pytest.approx([seen / rate, k / rate, seen / rate], abs=1e-12)


def test_a_run_with_late_messages_says_so():
    late = "failures.events=[{kind: message_late, time: 0.2, sensor: tension, delay: 0.05}]"
    scenario = load_scenario("acrobot_broken_redistributed", [
        late, "emergency=null", "duration=0.4", "log_rate=500", "integration.engine=compiled",
    ])  # fmt: skip
    result = run_scenario(scenario)
    readings, times = result.log["measured_tensions"], result.log["time"]
    held = (times > 0.21) & (times < 0.245)
    assert np.ptp(readings[held], axis=0) == pytest.approx(np.zeros(M))
    assert np.all(np.ptp(readings[times > 0.3], axis=0) > 0.0)
    events = summarize(result)["failures"]["events"]
    assert events[0]["what"] == "tension: messages are late"
