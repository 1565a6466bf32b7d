"""Wrenches by tensions and lengths on a simulated robot: bias over seeds, friction, a scenario."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink

from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.wrench_observers import OBSERVERS
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.wrench_estimation import reading_error
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.wrench_estimator import WrenchEstimation, WrenchEstimator
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS, SensorSettings

WRENCH = np.array([0.05, -0.04, 0.03, 2.0, -1.5, 1.0])
SEEDS, RATE = 100, 200.0


@pytest.fixture(scope="module")
def pushed():
    """Tensions and unstrained lengths of a robot that a wrench begins to push, and its pose."""
    robot, builder = load_robot("acrobot_large"), DiagramBuilder()
    how = CableRobotSettings(
        cables=CableSettings(stiffness_ratio=0.01, retardation_time=0.002, pulleys=False),
        damping=DampingSettings(translation=20.0, rotation=0.2),
    )
    block = builder.AddSystem(CompiledCableRobot(robot, how))
    block.integrate_by(StepRule(max_step=1e-3))
    for port, value in (("applied_wrench", WRENCH), ("cable_velocities", np.zeros(8))):
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), block.GetInputPort(port))
    sinks = {}
    for name in ("tensions", "unstrained_lengths"):
        sinks[name] = builder.AddSystem(VectorLogSink(8, 1.0 / RATE))
        builder.Connect(block.GetOutputPort(name), sinks[name].get_input_port())
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    own = block.GetMyMutableContextFromRoot(context)
    block.set_at_equilibrium(own, robot.home.transform())
    simulator.AdvanceTo(3.0)
    log = {name: sink.FindLog(context).data().T for name, sink in sinks.items()}
    return robot, block, log, block.GetOutputPort("X_WP").Eval(own)


def estimates(robot, cables, log, settings, sensors, seed):
    """What a `WrenchEstimator` says at the end of readings of sensors with a seed."""
    makers = {name: SENSORS[name].make for name in ("tension", "encoder")}
    tension = makers["tension"](sensors.model("tension"), robot, seed, RATE)
    encoder = makers["encoder"](sensors.model("encoder"), robot, seed, RATE)
    block = WrenchEstimator(
        settings, EncoderLengths(cables, elastic=True), rigid_platform(robot),
        robot.home.transform(), reading_error(sensors, robot, settings.believed_share()),
    )  # fmt: skip
    context = block.CreateDefaultContext()
    for number, (t, l0) in enumerate(zip(log["tensions"], log["unstrained_lengths"], strict=True)):
        readings = tension.reading(tension.measure(t, number))
        lengths = encoder.reading(encoder.measure(l0, number))
        block.GetInputPort("measured_tensions").FixValue(context, readings)
        block.GetInputPort("measured_lengths").FixValue(context, lengths)
        block.ExecuteForcedEvents(context)
    return [
        block.GetOutputPort(n).Eval(context).copy() for n in ("wrench_estimated", "wrench_sigma")
    ]


@pytest.mark.parametrize("kind", list(OBSERVERS))
def test_bias_and_sigma_over_seeds(pushed, kind):
    """VLU850 on every cable, constant error and noise; encoders; the platform at rest."""
    robot, block, log, _ = pushed
    late = {name: rows[-100:] for name, rows in log.items()}
    sensors = SensorSettings(tension="vlu850", encoder="servo_encoder")
    settings = WrenchEstimation(kind=kind, bandwidth=5.0)
    cables = block.forces.cable_set()
    # Lengths are counted from where it stands.
    at_rest = replace_home(robot, pushed[3])
    found = [estimates(at_rest, cables, late, settings, sensors, s) for s in range(SEEDS)]
    errors = np.array([wrench for wrench, _ in found]) - WRENCH
    sigma = np.mean([s for _, s in found], axis=0)
    bias = np.mean(errors, axis=0)
    assert np.all(np.abs(bias) < 3.0 * sigma / np.sqrt(SEEDS))
    spread = np.std(errors, axis=0, ddof=1)
    SPREAD = 4.0 / np.sqrt(2.0 * SEEDS)  # four deviations of a standard deviation of 100 numbers
    np.testing.assert_allclose(spread, sigma, rtol=SPREAD)


def replace_home(robot, X_WP):
    """The robot with another home, from which its winches count."""
    angles = X_WP.rotation()
    pose = replace(robot.home, position=X_WP.translation())
    assert angles.IsNearlyIdentity(0.05)  # what the home leaves out
    return replace(robot, home=pose)


def test_it_is_exact_with_ideal_readings(pushed):
    robot, block, log, _ = pushed
    block_of = WrenchEstimator(
        WrenchEstimation(kind="momentum", bandwidth=5.0),
        EncoderLengths(block.forces.cable_set(), elastic=True), rigid_platform(robot),
        robot.home.transform(), reading_error(SensorSettings(), robot, 0.0),
    )  # fmt: skip
    context = block_of.CreateDefaultContext()
    for t, l0 in zip(log["tensions"], log["unstrained_lengths"], strict=True):
        block_of.GetInputPort("measured_tensions").FixValue(context, t)
        block_of.GetInputPort("measured_lengths").FixValue(context, l0)
        block_of.ExecuteForcedEvents(context)
    found = block_of.GetOutputPort("wrench_estimated").Eval(context)
    SWING = 2e-3  # of the wrench: the platform has not come to rest quite after 3 s
    np.testing.assert_allclose(found, WRENCH, atol=SWING * np.max(WRENCH))
    assert np.all(block_of.GetOutputPort("wrench_sigma").Eval(context) == 0.0)


@pytest.mark.parametrize(("lengths", "skipped"), [(9.0, [1, 0]), (None, [0, 0])])
def test_lengths_that_fit_no_pose_are_counted(pushed, lengths, skipped):
    robot, block, log, _ = pushed
    block_of = WrenchEstimator(
        WrenchEstimation(kind="static", bandwidth=5.0),
        EncoderLengths(block.forces.cable_set(), elastic=True), rigid_platform(robot),
        robot.home.transform(), reading_error(SensorSettings(), robot, 0.0),
    )  # fmt: skip
    context = block_of.CreateDefaultContext()
    for k, (t, l0) in enumerate(
        zip(log["tensions"][:2], log["unstrained_lengths"][:2], strict=True)
    ):
        wrong = k == 1 and lengths is not None
        counted = l0 + lengths * np.arange(8.0) if wrong else l0  # no pose is so far from all
        block_of.GetInputPort("measured_tensions").FixValue(context, t)
        block_of.GetInputPort("measured_lengths").FixValue(context, counted)
        block_of.ExecuteForcedEvents(context)
    assert block_of.GetOutputPort("wrench_skipped").Eval(context).tolist() == skipped


RUN = ("duration=2.5", "integration.engine=compiled", "log_rate=100")

SETTLED = 1.5
"""From then on [s] cables no longer ring from the first steps of the winches, at which some go
slack, which is faster than the estimator samples."""


def bias_when_settled(result):
    """Largest mean error of a component of the force [N]."""
    there = result.log["time"] > SETTLED
    wrong = result.log["wrench_estimated"] - result.log["applied_wrench"]
    return np.max(np.abs(np.mean(wrong[there, 3:], axis=0)))


def test_a_scenario_logs_sums_up_and_draws_it():
    changes = (*RUN, "wrench_estimation={kind: static, bandwidth: 2}")
    result = run_scenario(load_scenario("acrobot_pushed", changes))
    summary = summarize(result)["wrench_estimation"]
    assert summary["kind"] == "static"
    assert summary["force_rms_n"] < 0.3
    assert summary["samples_without_pose"] == result.log["wrench_skipped"][-1, 0]
    assert bias_when_settled(result) < 0.05
    assert "wrench" in {name.split(".")[0] for name in run_figures(result, ("png",))}
    true, found = result.log["applied_wrench"][-20:], result.log["wrench_estimated"][-20:]
    assert np.max(np.abs(true - found)) < 0.5 * np.max(np.abs(true))


def test_friction_of_pulleys_that_is_not_known_is_seen_and_known_is_undone():
    bias = {}
    for known in ("null", "0"):
        section = (
            "{kind: static, bandwidth: 5, pulley_friction: 0.1, "
            f"believed_pulley_friction: {known}}}"
        )
        result = run_scenario(
            load_scenario("acrobot_pushed", (*RUN, f"wrench_estimation={section}"))
        )
        bias[known] = bias_when_settled(result)
    assert bias["0"] > 3.0 * bias["null"]


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        ("planar_pbvs", (), "found a section for planar, 2T1R"),
        ("acrobot_pushed", ("cables.model=catenary",), "accepted: cables that do not sag"),
        ("acrobot_pushed", ("wrench_estimation.kind=fast",), "kind: found fast"),
    ],
)
def test_what_is_refused(name, changes, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario(name, ("wrench_estimation={}", *changes))
