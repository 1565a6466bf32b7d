"""Reactions to a broken cable: what is told to whom and when, in a diagram and alone."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantValueSource,
    LogVectorOutput,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.emergency import EmergencyReaction, EmergencySettings
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.break_detector import BreakDetector

ROBOT = load_robot("acrobot_small")
M, RATE = len(ROBOT.cables), 100.0


def stepped(before, after, time):
    """A source of numbers that jump."""
    return TrajectorySource(
        PiecewisePolynomial.ZeroOrderHold([0.0, time, 100.0], np.array([before, after, after]).T)
    )


def logged(builder, block, names, duration):
    logs = [LogVectorOutput(block.GetOutputPort(name), builder, 1.0 / RATE) for name in names]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    found = [log.FindLog(simulator.get_context()) for log in logs]
    return found[0].sample_times(), [log.data().T for log in found]


@pytest.mark.parametrize("reaction", ["stop", "redistribute"])
def test_acts_after_its_delay_on_what_it_says(reaction):
    builder, flags = DiagramBuilder(), np.arange(M) == 2
    settings = EmergencySettings(reaction=reaction, delay=0.055, rate=RATE)
    block = builder.AddSystem(EmergencyReaction(settings, M))
    source = builder.AddSystem(stepped(np.zeros(M), flags.astype(float), 0.1))
    builder.Connect(source.get_output_port(), block.get_input_port())
    times, (jammed, left_out, halted) = logged(
        builder, block, ("jammed", "left_out", "halted"), 0.3
    )
    acts = times > 0.16 + 1e-9  # seen at 0.1 s, 0.06 s later at the next look; a row is before it
    assert np.array_equal(left_out, np.outer(acts, flags))
    assert np.array_equal(halted[:, 0], acts)
    assert np.array_equal(jammed, np.outer(acts, np.ones(M) if reaction == "stop" else flags))


def detected(lengths_after, tensions_after, in_a_row=3, **more):
    """What a detector finds whose inputs jump at 0.1 s."""
    cables, X_WP = ROBOT.cable_set().without_pulleys(), ROBOT.home.transform()
    paths, pull = cable_paths(X_WP, cables).lengths, np.full(M, 5.0)
    taut = paths / (1.0 + pull / cables.stiffness)
    builder = DiagramBuilder()
    block = builder.AddSystem(BreakDetector(cables, AlarmRule(1e-3, in_a_row), RATE, **more))
    sources = {
        "X_WP": ConstantValueSource(Value(RigidTransform(X_WP))),
        "lengths": stepped(taut, taut + lengths_after, 0.1),
        "tensions": stepped(pull, tensions_after * pull, 0.1),
    }
    for name, source in sources.items():
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), block.GetInputPort(name))
    return logged(builder, block, ("found_broken", "residuals"), 0.3)


def test_a_cable_that_is_wound_up_and_does_not_pull_is_found():
    broken = np.arange(M) == 4
    times, (found, residuals) = detected(np.where(broken, -0.005, 0.0), ~broken)
    assert np.array_equal(found, np.outer(times > 0.1 + 2.5 / RATE, broken))
    assert residuals[-1, 4] == pytest.approx(0.005, rel=0.02)


def test_a_slack_cable_is_not_found():
    slack = np.arange(M) == 4
    _, (found, residuals) = detected(np.where(slack, 0.01, 0.0), ~slack)
    assert np.all(found == 0.0)
    assert residuals[-1, 4] < 0.0


def test_it_is_the_one_that_fell_silent_at_once():
    """Another is slack, too, and believed to be longer than it is."""
    wound = np.where(np.arange(M) == 1, -0.005, 0.0)
    pulls = np.where(np.arange(M) == 4, 0.0, np.where(np.arange(M) == 1, 0.08, 1.0))
    _, (found, _) = detected(wound, pulls, slack_below=0.5)
    assert np.array_equal(np.flatnonzero(found[-1]), [4])


def test_one_that_pulls_is_there():
    shorter = np.where(np.arange(M) == 4, -0.005, 0.0)
    _, (found, _) = detected(shorter, np.ones(M), slack_below=0.5)
    assert np.all(found == 0.0)
    _, (found, _) = detected(shorter, np.ones(M))
    assert found[-1, 4] == 1.0


def test_of_several_the_largest_is_found():
    shorter = np.zeros(M)
    shorter[[1, 6]] = -0.003, -0.005
    _, (found, _) = detected(shorter, shorter == 0.0)
    assert np.array_equal(np.flatnonzero(found[-1]), [6])


CHEAP = ["duration=0.6", "integration.engine=compiled", "log_rate=500"]


def run(*changes):
    return run_scenario(load_scenario("acrobot_broken_redistributed", [*CHEAP, *changes])).log


def breaks(cable, time=0.2):
    return f"failures.events=[{{kind: cable_breaks, time: {time}, cable: {cable}}}]"


def test_drums_stand_still_after_a_stop():
    log = run(breaks(5), "emergency={reaction: stop, delay: 0.03}")
    settled = log["time"] > 0.2 + 0.03 + 0.02  # 20 settling times
    l0 = log["unstrained_lengths"][settled]
    assert np.ptp(l0, axis=0) == pytest.approx(np.zeros(M), abs=1e-9)
    assert np.ptp(log["unstrained_lengths"][~settled], axis=0).min() > 1e-4


def test_what_is_left_takes_the_wrench_and_a_break_is_found():
    log = run(breaks(5), "emergency={reaction: redistribute, known: found}")
    found = np.flatnonzero(log["found_broken"][-1])
    assert np.array_equal(found, [5])
    when = log["time"][np.argmax(log["found_broken"][:, 5] > 0.0)]
    assert 0.2 < when < 0.35
    later = log["time"] > when + 0.1
    assert np.max(log["wanted_tensions"][later, 5]) == 0.0
    assert np.min(np.max(log["wanted_tensions"][later], axis=1)) > 0.0


def test_without_a_break_it_changes_nothing():
    with_it = run("failures={}", "emergency={reaction: redistribute, known: found}")
    without = run("failures=null", "emergency=null")
    assert np.array_equal(with_it["X_WP"], without["X_WP"])
    assert np.all(with_it["found_broken"] == 0.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["emergency={reaction: stop, motion: continue}"], "emergency.motion: found continue"),
        (["failures=null"], "emergency: found a section without failures"),
        (
            ["winches={}", "torque_control=null"],
            "emergency.reaction: found redistribute with winches.mode velocity",
        ),
    ],
)
def test_what_is_refused(changes, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("acrobot_broken_redistributed", changes)
