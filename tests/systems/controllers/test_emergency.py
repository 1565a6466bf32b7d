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
from scipy.optimize import lsq_linear

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.break_detection import BreakRule
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import wrench_balance
from cdpr_drake.systems.controllers.emergency import EmergencyReaction, EmergencySettings
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
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
    builder.Connect(source.get_output_port(), block.GetInputPort("found_broken"))
    times, (jammed, left_out, halted) = logged(
        builder, block, ("jammed", "left_out", "halted"), 0.3
    )
    acts = times > 0.16 + 1e-9  # seen at 0.1 s, 0.06 s later at the next look; a row is before it
    assert np.array_equal(left_out, np.outer(acts, flags))
    assert np.array_equal(halted[:, 0], acts)
    assert np.array_equal(jammed, np.outer(acts, np.ones(M) if reaction == "stop" else flags))


RULE = BreakRule(noise=1e-3, points=0.0, pose=0.0, in_a_row=3)


def detected(lengths_after, tensions_after, rule=RULE, pull=5.0, again=None, **more):
    """What a detector finds whose inputs jump at 0.1 s, and tensions once more at 0.2 s."""
    cables, X_WP = ROBOT.cable_set().without_pulleys(), ROBOT.home.transform()
    paths, pull = cable_paths(X_WP, cables).lengths, np.full(M, pull)
    taut = paths / (1.0 + pull / cables.stiffness)
    builder = DiagramBuilder()
    block = builder.AddSystem(BreakDetector(cables, rule, RATE, **more))
    after = tensions_after * pull
    later = after if again is None else again * pull
    sources = {
        "X_WP": ConstantValueSource(Value(RigidTransform(X_WP))),
        "lengths": stepped(taut, taut + lengths_after, 0.1),
        "tensions": TrajectorySource(
            PiecewisePolynomial.ZeroOrderHold(
                [0.0, 0.1, 0.2, 9.0], np.array([pull, after, later, later]).T
            )
        ),
    }
    for name, source in sources.items():
        builder.AddSystem(source)
        builder.Connect(source.get_output_port(), block.GetInputPort(name))
    return logged(builder, block, ("found_broken", "residuals"), 0.3)


def only(which, value, others=0.0):
    """A number for a cable and another one for the rest."""
    return np.where(np.arange(M) == which, value, others)


def test_a_cable_that_is_wound_up_and_does_not_pull_is_found():
    times, (found, residuals) = detected(only(4, -0.005), only(4, 0.0, 1.0), silent=0.3)
    assert np.array_equal(found, np.outer(times > 0.1 + 2.5 / RATE, np.arange(M) == 4))
    released = 5.0 / ROBOT.cable_set().stiffness[4] * residual_length(4)
    assert residuals[-1, 4] == pytest.approx(0.005 + released, rel=1e-6)


def residual_length(cable):
    """Unstrained length of a cable that pulls with 5 N and ends 5 mm shorter [m]."""
    cables = ROBOT.cable_set().without_pulleys()
    path = cable_paths(ROBOT.home.transform(), cables).lengths[cable]
    return path / (1.0 + 5.0 / cables.stiffness[cable])


def test_a_slack_cable_is_not_found():
    _, (found, residuals) = detected(only(4, 0.01), only(4, 0.0, 1.0), silent=0.3)
    assert np.all(found == 0.0)
    assert residuals[-1, 4] < 0.0


def test_it_is_the_one_that_fell_silent_at_once():
    """Another is slack, too, and believed to be longer than it is."""
    pulls = np.where(np.arange(M) == 4, 0.0, np.where(np.arange(M) == 1, 0.08, 1.0))
    _, (found, _) = detected(only(1, -0.005), pulls, silent=0.5)
    assert np.array_equal(np.flatnonzero(found[-1]), [4])


def test_one_that_pulls_is_there():
    _, (found, _) = detected(only(4, -0.005), np.ones(M), silent=0.5)
    assert np.all(found == 0.0)
    _, (found, _) = detected(only(4, -0.005), np.zeros(M), silent=0.5, pull=0.4)
    assert found[-1, 4] == 1.0


def test_one_that_was_named_and_pulls_is_named_no_more():
    """Cable 1 falls farther and is named first; when it pulls, it is the other one."""
    wound = np.where(np.isin(np.arange(M), (1, 4)), -0.005, 0.0)
    falls = np.where(np.arange(M) == 4, 0.05, np.where(np.arange(M) == 1, 0.0, 1.0))
    times, (found, _) = detected(wound, falls, again=only(4, 0.05, 1.0), silent=0.5)
    first = np.argmax(np.any(found > 0.0, axis=1))
    assert np.array_equal(np.flatnonzero(found[first]), [1])
    assert np.array_equal(np.flatnonzero(found[-1]), [4])
    assert np.all(found.sum(axis=1) <= 1.0)
    changes = times[np.argmax(found[:, 4] > 0.0)]
    assert 0.2 < changes < 0.2 + 6.0 / RATE


def test_what_is_wrong_with_points_counts_as_far_as_the_cable_turned():
    """At the same pose, so that a cable that pulled has the plain limit, and another one all."""
    rule = BreakRule(noise=1e-3, points=0.01, pose=0.0, in_a_row=3)
    _, (found, _) = detected(only(4, -0.005), only(4, 0.0, 1.0), rule, silent=0.3)
    assert found[-1, 4] == 1.0
    _, (found, _) = detected(only(4, -0.005), np.zeros(M), rule, silent=0.5, pull=0.4)
    assert np.all(found == 0.0)
    _, (found, _) = detected(only(4, -0.012), np.zeros(M), rule, silent=0.5, pull=0.4)
    assert found[-1, 4] == 1.0


def test_what_was_taken_back_is_asked_again_but_for_brakes():
    for reaction, after in (("redistribute", 0.0), ("stop", 1.0)):
        builder = DiagramBuilder()
        block = builder.AddSystem(EmergencyReaction(EmergencySettings(reaction=reaction), M))
        flags = TrajectorySource(
            PiecewisePolynomial.ZeroOrderHold(
                [0.0, 0.1, 0.2, 9.0],
                np.array([only(2, 0.0), only(2, 1.0), only(2, 0.0), only(2, 0.0)]).T,
            )
        )
        builder.AddSystem(flags)
        builder.Connect(flags.get_output_port(), block.GetInputPort("found_broken"))
        times, (left_out, jammed) = logged(builder, block, ("left_out", "jammed"), 0.3)
        told = (times > 0.1 + 1e-9) & (times <= 0.2 + 1e-9)
        assert np.array_equal(
            left_out[:, 2] > 0.0, told if reaction != "stop" else times > 0.1 + 1e-9
        )
        assert np.all(jammed[-1] == after)


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


ALONE = "emergency={reaction: stop, delay: 100.0, known: found, watch: {}}"
TOLD = ("found_jammed", "found_powerless", "frozen_tension", "frozen_encoder")


@pytest.mark.parametrize(
    ("event", "name", "which"),
    [
        ("{kind: winch_jams, time: 0.3, winch: 3}", "found_jammed", 3),
        ("{kind: power_lost, time: 0.3, winch: 5}", "found_powerless", 5),
        ("{kind: sensor_freezes, time: 0.3, sensor: tension, cable: 2}", "frozen_tension", 2),
        ("{kind: sensor_freezes, time: 0.3, sensor: encoder, cable: 2}", "frozen_encoder", 2),
    ],
)
def test_other_failures_are_told_of_what_failed(event, name, which):
    log = run(f"failures.events=[{event}]", ALONE)
    first = {
        other: log["time"][np.argmax(np.any(log[other] > 0.0, axis=1))]
        for other in TOLD
        if np.any(log[other])
    }
    assert min(first, key=lambda other: first[other]) == name
    assert 0.3 < first[name] < 0.56  # an encoder of a drum that hardly turns is the last
    assert np.array_equal(np.flatnonzero(log[name][-1]), [which])


@pytest.mark.parametrize(("kind", "name"), [("dead", "camera_dark"), ("frozen", "camera_late")])
def test_a_camera_that_shows_nothing_new_is_told(kind, name):
    log = run("failures={}", ALONE, f"camera.fault={{kind: {kind}, start: 0.3, duration: 9.0}}")
    told = {other: np.any(log[other]) for other in (*TOLD, "camera_dark", "camera_late")}
    assert told == {other: other == name for other in told}


def test_a_watch_needs_motors_by_torque():
    with pytest.raises(ScenarioError, match=r"emergency\.watch: found a section with winches"):
        load_scenario(
            "acrobot_broken_redistributed",
            ["emergency={reaction: stop, watch: {}}", "winches={}", "torque_control=null"],
        )


def test_a_watch_is_as_fast_as_its_looks_allow():
    with pytest.raises(ScenarioError, match=r"emergency\.watch: bandwidth of a motor's watch"):
        load_scenario(
            "acrobot_broken_redistributed", ["emergency={reaction: stop, watch: {bandwidth: 90}}"]
        )


def test_a_retreat_ends_where_the_cables_left_hold_the_platform():
    """Of the pose that is reached, by bounded least squares; it is not held where it broke."""
    log = run(breaks(7), "emergency={reaction: retreat}", "duration=2.2")
    robot = load_robot("acrobot_large")
    own = np.arange(M) != 7
    balances = [wrench_balance(robot, pose_from_row(row)) for row in log["X_WP"][[100, -1]]]
    missing = [
        np.linalg.norm(lsq_linear(one.W[:, own], -one.wrench, bounds=(0.0, 60.0)).fun)
        for one in balances
    ]
    assert missing[0] > 0.1
    assert missing[1] < 1e-6
    goal, belief = log["X_WP_retreat"][-1], log["X_WP_estimated"][-1]
    assert np.linalg.norm(belief[4:] - goal[4:]) < 0.01  # the belief itself drifts when it falls
    assert np.ptp(log["X_WP"][-50:, 4:], axis=0) == pytest.approx(np.zeros(3), abs=0.004)


def test_a_descent_ends_above_the_ground():
    log = run(breaks(2), "emergency={reaction: descend, speed: 0.3}", "duration=2.6")
    robot = load_robot("acrobot_large")

    def over(rows):
        low = [np.min((pose_from_row(row) @ robot.cable_set().p_PB)[2]) for row in rows]
        return np.array(low) - robot.frame.lower[2]

    true = over(log["X_WP"])
    assert true[0] > 0.1
    assert true.min() > 0.0
    # The belief drifts while the platform falls.
    assert over(log["X_WP_estimated"][-1:])[0] == pytest.approx(0.02, abs=0.01)


def test_braking_asks_for_what_leaves_least_energy():
    """Beside bounded least squares in the metric of energy, where the cables cannot end motion."""
    scenario = load_scenario("acrobot_broken_redistributed", ["emergency={reaction: brake}"])
    servo = build_visual_servo(scenario)
    assert servo.torque is not None
    robot, broken = load_robot("acrobot_large"), np.arange(M) == 5
    law = servo.torque.law.without(broken, braking=True)
    X_WP, pull = scenario.initial_pose.transform(), np.full(M, 20.0)
    memory, rates = law.fresh_memory(), np.zeros(M)
    for k in range(400):  # wanted tensions have a largest rate
        command, memory = law.step(memory, np.zeros(6), X_WP, np.array([pull, rates]), 1e-3 * k)
    assert command.relaxed
    inertia = platform_inertia(robot)
    G = inertia.CalcRotationalInertia().CopyToFullMatrix3()
    root = np.sqrt([*np.diag(G), *[inertia.get_mass()] * 3])
    W = -cable_jacobian(X_WP, law_cables(scenario, robot)).T
    upper = np.where(broken, 1e-9, 60.0)

    def energy(tensions):
        return float(np.sum(((W @ tensions - command.wrench) / root) ** 2))

    best = lsq_linear(W / root[:, None], command.wrench / root, bounds=(0.0, upper)).x
    other = lsq_linear(W, command.wrench, bounds=(0.0, upper)).x
    assert energy(command.tensions) == pytest.approx(energy(best), rel=1e-4)
    assert energy(other) > 1.01 * energy(best)


def law_cables(scenario, robot):
    cables = scenario.cables.cable_set(robot)
    return cables if scenario.controller.pulleys else cables.without_pulleys()
