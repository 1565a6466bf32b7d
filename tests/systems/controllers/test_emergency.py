"""Reactions to a broken cable, in a block alone and in runs; bounded least squares as oracle."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.primitives import ConstantValueSource
from scipy.optimize import lsq_linear

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.estimation.break_detection import BreakRule
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import wrench_balance
from cdpr_drake.sections.emergency.break_detector import BreakDetector
from cdpr_drake.sections.emergency.reaction import EmergencyReaction
from cdpr_drake.systems.controllers.break_reactions import ReactionRule
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from tests.systems.controllers.controller_cases import logged, steps_source

ROBOT = load_robot("acrobot_small")
M, RATE = len(ROBOT.cables), 100.0
CABLES = ROBOT.cable_set().without_pulleys()
PATHS = cable_paths(ROBOT.home.transform(), CABLES).lengths


def only(which, value, others=0.0):
    """A number for a cable and another one for the rest."""
    return np.where(np.arange(M) == which, value, others)


@pytest.mark.parametrize("reaction", ["stop", "redistribute"])
def test_a_reaction_acts_after_its_delay_on_the_cables_that_are_named(reaction):
    block = EmergencyReaction(ReactionRule(reaction, delay=0.055, rate=RATE), M)
    flags = steps_source(only(2, 0.0), only(2, 1.0), times=[0.1])
    names = ("jammed", "left_out", "halted")
    times, (jammed, left_out, halted) = logged(block, {"found_broken": flags}, names, RATE)
    acts = times > 0.16 + 1e-9  # seen at 0.1 s, 0.06 s later at the next look; a row is before it
    assert np.array_equal(left_out, np.outer(acts, only(2, 1.0)))
    assert np.array_equal(halted[:, 0], acts)
    whole = only(2, 1.0, 1.0 if reaction == "stop" else 0.0)
    assert np.array_equal(jammed, np.outer(acts, whole))


@pytest.mark.parametrize(("reaction", "brakes"), [("redistribute", 0.0), ("stop", 1.0)])
def test_a_cable_that_is_named_no_more_is_used_again_but_brakes_stay(reaction, brakes):
    block = EmergencyReaction(ReactionRule(reaction), M)
    flags = steps_source(only(2, 0.0), only(2, 1.0), only(2, 0.0), times=[0.1, 0.2])
    times, (left_out, jammed) = logged(block, {"found_broken": flags}, ("left_out", "jammed"), RATE)
    named = times > 0.1 + 1e-9
    if reaction != "stop":
        named &= times <= 0.2 + 1e-9
    assert np.array_equal(left_out[:, 2] > 0.0, named)
    assert np.all(jammed[-1] == brakes)


RULE = BreakRule(noise=1e-3, points=0.0, pose=0.0, in_a_row=3)
POINTS = BreakRule(noise=1e-3, points=0.01, pose=0.0, in_a_row=3)
ALL, NONE = np.ones(M), np.zeros(M)


def detected(wound, share, rule=RULE, pull=5.0, again=None, silent=0.5):
    """Findings of a detector whose inputs jump at 0.1 s, and tensions once more at 0.2 s."""
    pull = np.full(M, pull)
    taut = PATHS / (1.0 + pull / CABLES.stiffness)
    later = share if again is None else again
    sources = {
        "X_WP": ConstantValueSource(Value(RigidTransform(ROBOT.home.transform()))),
        "lengths": steps_source(taut, taut + wound, times=[0.1]),
        "tensions": steps_source(pull, share * pull, later * pull, times=[0.1, 0.2]),
    }
    block = BreakDetector(CABLES, rule, RATE, silent=silent)
    times, (found, residuals) = logged(block, sources, ("found_broken", "residuals"), RATE)
    return times, found, residuals


def test_a_cable_that_is_wound_up_and_does_not_pull_is_found():
    times, found, residuals = detected(only(4, -0.005), only(4, 0.0, 1.0), silent=0.3)
    assert np.array_equal(found, np.outer(times > 0.1 + 2.5 / RATE, np.arange(M) == 4))
    unstrained = PATHS[4] / (1.0 + 5.0 / CABLES.stiffness[4])
    released = 5.0 / CABLES.stiffness[4] * unstrained
    assert residuals[-1, 4] == pytest.approx(0.005 + released, rel=1e-6)


SILENT = {
    "slack": (only(4, 0.01), only(4, 0.0, 1.0), {"silent": 0.3}, []),
    # Another is slack, too, and believed to be longer than it is.
    "the one that fell silent at once": (
        only(1, -0.005), np.where(np.arange(M) == 4, 0.0, only(1, 0.08, 1.0)), {}, [4]),
    "one that pulls": (only(4, -0.005), ALL, {}, []),
    "one that never pulled": (only(4, -0.005), NONE, {"pull": 0.4}, [4]),
    # At the same pose: a cable that pulled has the plain limit, another one that of points.
    "points, it pulled": (only(4, -0.005), only(4, 0.0, 1.0), {"rule": POINTS, "silent": 0.3}, [4]),
    "points, never pulled": (only(4, -0.005), NONE, {"rule": POINTS, "pull": 0.4}, []),
    "points, farther": (only(4, -0.012), NONE, {"rule": POINTS, "pull": 0.4}, [4]),
}  # fmt: skip


@pytest.mark.parametrize("case", SILENT)
def test_a_silent_cable_is_found_if_its_length_says_so_too(case):
    wound, share, more, broken = SILENT[case]
    _, found, residuals = detected(wound, share, **more)
    assert np.array_equal(np.flatnonzero(found[-1]), broken)
    if not broken:
        assert np.all(found == 0.0)
    if case == "slack":
        assert residuals[-1, 4] < 0.0


def test_a_cable_that_was_named_and_pulls_is_named_no_more():
    """Cable 1 falls farther and is named first; when it pulls, it is the other one."""
    wound = only(1, -0.005) + only(4, -0.005)
    falls = np.where(np.arange(M) == 4, 0.05, only(1, 0.0, 1.0))
    times, found, _ = detected(wound, falls, again=only(4, 0.05, 1.0))
    first = np.argmax(np.any(found > 0.0, axis=1))
    assert np.array_equal(np.flatnonzero(found[first]), [1])
    assert np.array_equal(np.flatnonzero(found[-1]), [4])
    assert np.all(found.sum(axis=1) <= 1.0)
    assert 0.2 < times[np.argmax(found[:, 4] > 0.0)] < 0.2 + 6.0 / RATE


SCENARIO = "acrobot_broken_redistributed"
CHEAP = ["duration=0.6", "integration.engine=compiled", "log_rate=500"]


def run(*changes):
    return ServoRun(load_scenario(SCENARIO, [*CHEAP, *changes])).simulate().log


def breaks(cable):
    return f"failures.events=[{{kind: cable_breaks, time: 0.2, cable: {cable}}}]"


def test_drums_stand_still_after_a_stop():
    log = run(breaks(5), "emergency={reaction: stop, delay: 0.03}", "duration=0.4")
    settled = log["time"] > 0.2 + 0.03 + 0.02  # 20 settling times
    l0 = log["unstrained_lengths"]
    assert np.ptp(l0[settled], axis=0) == pytest.approx(np.zeros(M), abs=1e-9)
    assert np.ptp(l0[~settled], axis=0).min() > 1e-4


def test_a_break_is_found_and_the_cables_left_take_the_wrench():
    log = run(breaks(5), "emergency={reaction: redistribute, known: found}")
    assert np.array_equal(np.flatnonzero(log["found_broken"][-1]), [5])
    when = log["time"][np.argmax(log["found_broken"][:, 5] > 0.0)]
    assert 0.2 < when < 0.35
    later = log["wanted_tensions"][log["time"] > when + 0.1]
    assert np.max(later[:, 5]) == 0.0
    assert np.min(np.max(later, axis=1)) > 0.0


def test_without_a_break_a_reaction_changes_nothing():
    section = "emergency={reaction: redistribute, known: found}"
    ready = run("failures={}", section, "duration=0.3")
    without = run("failures=null", "emergency=null", "duration=0.3")
    assert np.array_equal(ready["X_WP"], without["X_WP"])
    assert np.all(ready["found_broken"] == 0.0)


ALONE = "emergency={reaction: stop, delay: 100.0, known: found, watch: {}}"
WATCHED = ("found_jammed", "found_powerless", "frozen_tension", "frozen_encoder")


@pytest.mark.parametrize(
    ("event", "name", "which"),
    [
        ("{kind: winch_jams, time: 0.3, winch: 3}", "found_jammed", 3),
        ("{kind: power_lost, time: 0.3, winch: 5}", "found_powerless", 5),
        ("{kind: sensor_freezes, time: 0.3, sensor: tension, cable: 2}", "frozen_tension", 2),
        ("{kind: sensor_freezes, time: 0.3, sensor: encoder, cable: 2}", "frozen_encoder", 2),
    ],
)
def test_a_watch_names_first_what_failed(event, name, which):
    log = run(f"failures.events=[{event}]", ALONE)
    first = {
        other: log["time"][np.argmax(np.any(log[other] > 0.0, axis=1))]
        for other in WATCHED
        if np.any(log[other])
    }
    assert min(first, key=lambda other: first[other]) == name
    assert 0.3 < first[name] < 0.56  # an encoder of a drum that hardly turns is the last
    assert np.array_equal(np.flatnonzero(log[name][-1]), [which])


@pytest.mark.parametrize(("kind", "name"), [("dead", "camera_dark"), ("frozen", "camera_late")])
def test_a_watch_names_a_camera_that_shows_nothing_new(kind, name):
    log = run("failures={}", ALONE, f"camera.fault={{kind: {kind}, start: 0.3, duration: 9.0}}")
    flags = {other: np.any(log[other]) for other in (*WATCHED, "camera_dark", "camera_late")}
    assert flags == {other: other == name for other in flags}


def test_a_retreat_ends_where_the_cables_left_hold_the_platform():
    """Of the pose that is reached, by bounded least squares; it is not held where it broke."""
    log = run(breaks(7), "emergency={reaction: retreat}", "duration=2.2")
    robot, own = load_robot("acrobot_large"), np.arange(M) != 7
    missing = []
    for row in log["X_WP"][[100, -1]]:
        balance = wrench_balance(robot, pose_from_row(row))
        best = lsq_linear(balance.W[:, own], -balance.wrench, bounds=(0.0, 60.0))
        missing.append(np.linalg.norm(best.fun))
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


def test_braking_leaves_the_least_energy():
    """Beside bounded least squares in the metric of energy, where the cables cannot end motion."""
    scenario = load_scenario(SCENARIO, ["emergency={reaction: brake}"])
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
    cables = scenario.cables.cable_set(robot)
    if not scenario.controller.pulleys:
        cables = cables.without_pulleys()
    W = -cable_jacobian(X_WP, cables).T
    upper = np.where(broken, 1e-9, 60.0)

    def energy(tensions):
        return float(np.sum(((W @ tensions - command.wrench) / root) ** 2))

    best = lsq_linear(W / root[:, None], command.wrench / root, bounds=(0.0, upper)).x
    other = lsq_linear(W, command.wrench, bounds=(0.0, upper)).x
    assert energy(command.tensions) == pytest.approx(energy(best), rel=1e-4)
    assert energy(other) > 1.01 * energy(best)
