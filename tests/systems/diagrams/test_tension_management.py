"""Tension management in a servo: slack goes, and what is asked wrongly is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.run_stability import run_criterion, stability_along
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.correction_laws import (
    ConstantThreshold,
    CorrectionReadings,
    ExpectedLength,
    FollowedDistribution,
    InsidePolygon,
)
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_management import automatic_gain
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.tensions.correction_gain import tension_gain
from cdpr_drake.tensions.slack_correction import TensionFollower

PROJECTED = "camera.kind=projected"
SLACK_START = "acrobot_slack_start_tca"


def load(*changes):
    return load_scenario(SLACK_START, [PROJECTED, *changes])


@pytest.fixture(scope="module")
def with_correction():
    return run_scenario(load("duration=3", "sensors.tension=ideal"))


@pytest.fixture(scope="module")
def without():
    return run_scenario(load("duration=3", "tension_management=null"))


def first_taut(result, cable):
    """Time from which a cable pulls with a newton for the first time [s]."""
    pulls = result.log["tensions"][:, cable] > 1.0
    return result.log["time"][np.argmax(pulls)] if np.any(pulls) else np.inf


def test_slack_of_4_cm_goes_in_the_published_time(with_correction, without):
    published = 0.8
    for cable in (0, 1):
        assert published / 1.5 < first_taut(with_correction, cable) < 1.5 * published
        assert first_taut(without, cable) > 2.0


def test_what_is_logged_is_what_the_law_says(with_correction):
    """Ideal sensors, sampled at 25 Hz: the correction of a row is that of the tensions before."""
    log = with_correction.log
    rows = np.flatnonzero(np.isclose(log["time"] % 0.04, 0.02))
    added, thresholds = log["tension_corrections"][rows], log["tension_thresholds"][rows]
    assert np.all(thresholds == 1.0)
    assert np.all(added <= 0.0)
    assert np.min(added) == pytest.approx(-0.04)  # a slack cable: k_c times the threshold
    sampled = log["tensions"][rows - 1]
    np.testing.assert_allclose(added, -0.04 * np.maximum(1.0 - sampled, 0.0), atol=1e-12)


def test_the_servo_itself_is_not_changed(with_correction, without):
    first = with_correction.log["cable_velocities"][1]
    np.testing.assert_array_equal(first, without.log["cable_velocities"][1])


def test_a_summary_counts_taut_cables(with_correction, without):
    found = summarize(with_correction)
    assert found["taut_cables"] == {"min": 6, "end": 8}
    assert found["underactuated_s"] == 0.0
    assert found["least_stability_margin"] > 0.9
    other = summarize(without)
    assert other["taut_cables"]["min"] < 6
    assert other["underactuated_s"] > 0.2
    assert other["least_stability_margin"] is None


def test_stability_along_a_run_is_that_at_its_poses(without):
    along = stability_along(without)
    assert np.all(along.rank == np.minimum(along.taut, 6))  # generic poses
    assert np.all(along.margin[along.rank < 6] == 0.0)
    assert np.all(along.margin[along.rank == 6] > 0.5)
    assert along.underactuated_time() == pytest.approx(along.unstable_time())
    log, row = without.log, 40
    X, X_hat = (pose_from_row(log[name][row]) for name in ("X_WP", "X_WP_estimated"))
    taut = log["slack"][row] == 0.0
    again = run_criterion(without.servo).at(X, X_hat, taut, float(log["time"][row]))
    assert again == (along.rank[row], along.margin[row])


def test_a_perfect_belief_has_the_margin_one():
    servo = build_visual_servo(load("perturbations.slack=null", "cables.pulleys=false"))
    X_WP, criterion = servo.scenario.initial_pose.transform(), run_criterion(servo)
    for taut in (np.ones(8, bool), np.arange(8) != 3, np.arange(8) > 1):
        rank, margin = criterion.at(X_WP, X_WP, taut, 0.0)
        assert rank == 6
        assert margin == pytest.approx(1.0, abs=1e-9)
    assert criterion.at(X_WP, X_WP, np.arange(8) > 2, 0.0) == (5, 0.0)
    assert criterion.at(X_WP, X_WP, np.zeros(8, bool), 0.0) == (0, 0.0)


@pytest.mark.parametrize(
    "kind",
    [
        "{kind: adaptive, gain_per_length: 4}",
        "{kind: by_length, gain: 0.04, highest: [3], shortest: 0.5, longest: 1.5, "
        "shape: exponential}",
        "{kind: distribution, threshold: [0.5], integral: 0.01}",
        "{kind: length}",
        "{kind: polygon, margin: 2, gain: 0.02}",
        "{rate: 100, gain: 0.04}",
    ],
)
def test_every_kind_runs_and_takes_up_slack(kind):
    result = run_scenario(load("duration=2.5", f"tension_management={kind}"))
    log = result.log
    surplus = log["unstrained_lengths"][:, :2] - log["lengths"][:, :2]
    assert np.all(surplus[-1] < 0.5 * surplus[0])
    assert np.all(np.isfinite(log["tension_corrections"]))


@pytest.mark.parametrize(
    "kind", ["kind: constant, threshold: [9]", "kind: polygon, threshold: [5], margin: 2"]
)
def test_without_a_gain_it_takes_one_that_is_stable(kind):
    """The published gain chatters where many cables are corrected; loop and diagram are one."""

    def log(more, loop):
        changes = (f"tension_management={{{kind}{more}}}", f"integration.loop={loop}")
        shared = ("duration=3", "perturbations.slack=null", "integration.engine=compiled")
        return run_scenario(load(*shared, *changes)).log["tension_corrections"]

    own, there, published = log("", "compiled"), log("", "diagram"), log(", gain: 0.04", "compiled")
    np.testing.assert_array_equal(own, there)
    chatter, stated = (np.mean(np.abs(np.diff(c[-50:], 2, axis=0))) for c in (own, published))
    assert np.max(np.abs(own)) > 0.0
    assert stated > 10.0 * chatter


def test_without_a_gain_it_is_proportional_to_stiffness_and_to_the_period():
    """On cables a hundred times as stiff, and ten times as often; where modes do not matter."""

    def gain(ratio, rate):
        cables = load_robot("acrobot_large").cable_set()
        cables = replace(cables, stiffness=ratio * cables.stiffness, retardation=np.full(8, 2e-2))
        robot = load_robot("acrobot_large")
        return automatic_gain(robot, cables, robot.home.transform(), rate, 0.0).share

    np.testing.assert_allclose(gain(1.0, 25.0), 1e-2 * gain(1e-2, 25.0), rtol=1e-9)
    assert np.all(gain(1.0, 25.0) > 0.0)


@pytest.mark.parametrize("loop", ["compiled", "diagram"])
def test_a_summary_has_the_gain_that_nobody_stated(loop):
    """Of `tension_gain` at the pose of the start, less by the share that modes ask for."""
    shared = ("duration=0.2", "integration.engine=compiled", f"integration.loop={loop}")
    result = run_scenario(load("tension_management={}", *shared))
    found = summarize(result)["tension_gain"]
    lengths = result.log["lengths"][0]
    each = np.array(found["per_length_1_per_ns"])
    np.testing.assert_allclose(found["at_start_m_per_ns"], each * lengths, rtol=1e-12)
    scenario = result.servo.scenario
    cables = scenario.cables.cable_set(result.servo.robot)
    rate = scenario.controller.rate
    readings = scenario.sensors.rate("tension")
    delay = 0.0 if readings is None else 1.0 / readings
    most = tension_gain(cables.stiffness, rate, delay)  # of a cable of 1 m
    shares = each / most
    assert 0.0 < shares[0] <= 1.0
    np.testing.assert_allclose(shares, shares[0], rtol=1e-9)
    assert "tension_gain" not in summarize(
        run_scenario(load("tension_management={gain: 0.04}", *shared))
    )


def test_where_no_gain_is_stable_that_is_said():
    words = "tension_management.gain: found null; accepted for acrobot_large at 25 Hz with a delay"
    with pytest.raises(ScenarioError, match=words):
        build_visual_servo(load("cables.retardation_time=0", "tension_management={delay: 0.1}"))


def test_winches_commanded_by_position_get_the_correction():
    result = run_scenario(
        load("duration=1.5", "winches={kind: motor, mode: position}", "sensors.tension=ideal")
    )
    log = result.log
    assert np.all(log["unstrained_lengths"][-1, :2] < log["unstrained_lengths"][0, :2] - 0.03)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("{threshold: [60]}", "threshold: found 60; accepted: below 60 [N]"),
        ("{threshold: [1, 1, -0.5, 1, 1, 1, 1, 1]}", "threshold: found -0.5; accepted: at least 0"),
        (
            "{kind: by_length, highest: [-3], shortest: 1, longest: 2}",
            "highest: found -3; accepted",
        ),
        ("{threshold: [1, 2]}", "threshold: found 2 values; accepted: one, or one for each of"),
        ("{threshold: [1, 1, 1, 1, 1, 1, 1, 1, 1]}", "threshold: found 9 values"),
        ("{kind: distribution, threshold: [1, 1, 1, 1, 1, 1, 1, 1]}", "accepted: one, by kind"),
        ("{kind: distribution, threshold: [-1]}", "threshold: found -1; accepted: at least 0"),
        ("{kind: distribution, method: reference_program}", "tension_management.method"),
        ("{kind: polygon, threshold: [1, 1, 1, 1, 1, 1, 1, 1]}", "accepted: one, by kind polygon"),
        ("{kind: polygon, margin: 30}", "margin: found 30; accepted: at most 29.5 [N], half"),
        ("{kind: polygon, margin: -1}", "margin: found -1; accepted: a number >= 0 [N]"),
        ("{kind: polygon, set_point: kernel}", "tension_management.set_point: kernel: found red"),
        ("{kind: polygon, threshold: [-1]}", "threshold: found -1; accepted: at least 0"),
        ("{gain: -0.04}", "gain: found -0.04"),
        ("{kind: adaptive, gain_per_length: -1}", "gain_per_length: found -1"),
        ("{kind: length, slowness: 0.5}", "slowness: found 0.5"),
        ("{kind: by_length}", "highest: found none; accepted: a number"),
        ("{kind: by_length, highest: [3], shortest: 2, longest: 1}", "longest: found 1"),
        ("{kind: by_length, highest: [0.5], shortest: 1, longest: 2}", "not below threshold"),
        (
            "{kind: by_length, threshold: [0], highest: [1], shortest: 1, longest: 2, "
            "shape: exponential}",
            "threshold: found 0; accepted: above 0",
        ),
        ("{kind: magic}", "kind: found magic; accepted: one of constant"),
        ("{rate: 0}", "rate: found 0"),
    ],
)
def test_what_makes_no_sense_is_refused(change, words):
    with pytest.raises(ScenarioError) as refused:
        load(f"tension_management={change}")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_rate_that_is_no_multiple_of_the_step_is_refused():
    with pytest.raises(ScenarioError, match="rate: found 300; accepted: a whole number of steps"):
        load("tension_management={rate: 300}", "integration.max_step=0.001")
    assert load("tension_management={rate: 500}", "integration.max_step=0.001")


def readings(tensions, lengths, X_WP):
    there = {"tensions": np.array(tensions), "lengths": np.array(lengths), "X_WP": X_WP}
    return CorrectionReadings(there.__getitem__, 0.04)


def test_a_law_without_an_answer_adds_nothing_and_says_so():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    outside = RigidTransform([0.0, 0.0, 5.0])  # above the frame no tensions hold the platform
    law = FollowedDistribution(
        robot, cables, 0.5, 60.0, "quadratic_program", TensionFollower(0.01, 0.1)
    )
    memory = np.zeros(law.memory)
    memory[:8] = 1.0
    added, thresholds, could = law.step(readings(np.zeros(8), np.ones(8), outside), memory)
    assert not could
    assert np.all(added == 0.0)
    assert np.all(thresholds == 0.5)
    assert np.all(memory[:8] == 1.0)


def test_a_polygon_that_is_empty_adds_nothing_and_says_so():
    robot = load_robot("acrobot_large")
    outside = RigidTransform([0.0, 0.0, 5.0])
    for lower, X_WP in ((0.5, outside), (30.0, robot.home.transform())):
        law = InsidePolygon(robot, robot.cable_set(), lower, 60.0, 1.0, "barycenter", 0.04, 0.1)
        added, _, could = law.step(readings(np.zeros(8), np.ones(8), X_WP), np.zeros(0))
        assert not could
        assert np.all(added == 0.0)


def test_a_polygon_correction_is_slowed_down_as_a_whole():
    robot = load_robot("acrobot_large")
    X_WP, cables = robot.home.transform(), robot.cable_set()
    away = np.array([0.1, 9.0, 0.2, 8.0, 0.3, 9.0, 8.0, 9.0])
    found = [
        InsidePolygon(robot, cables, 1.0, 60.0, 1.0, "barycenter", 0.04, fastest).step(
            readings(away, np.ones(8), X_WP), np.zeros(0)
        )[0]
        for fastest in (10.0, 0.01)
    ]
    assert np.max(np.abs(found[1])) == pytest.approx(0.01)
    np.testing.assert_allclose(found[1], found[0] * 0.01 / np.max(np.abs(found[0])))


def test_expected_lengths_are_those_of_the_believed_pose():
    robot = load_robot("acrobot_large")
    cables = robot.cable_set().without_pulleys()
    X_WP = robot.home.transform()
    ends = X_WP.rotation().matrix() @ cables.p_PB + X_WP.translation()[:, None]
    lengths = np.linalg.norm(ends - cables.p_WA, axis=0)
    law = ExpectedLength(cables, allowance=0.0, slowness=1.0)
    longer = lengths + 0.02
    added, _, could = law.step(readings([0, 1, 2, 3, 4, 5, 6, 7], longer, X_WP), np.zeros(0))
    assert could
    np.testing.assert_allclose(added, [-0.5, -0.5, 0, 0, 0, 0, 0, 0], rtol=1e-12)


@settings(deadline=None, max_examples=20)
@given(st.lists(st.floats(-5.0, 80.0), min_size=8, max_size=8), st.integers(0, 2**31))
def test_the_block_adds_what_its_law_says(tensions, seed):
    law = ConstantThreshold(np.full(8, 2.0), np.full(8, 0.03))
    block = TensionCorrector(law, 8, 25.0)
    context = block.CreateDefaultContext()
    commanded = np.random.default_rng(seed).standard_normal(8)
    block.GetInputPort("commanded_velocities").FixValue(context, commanded)
    block.GetInputPort("tensions").FixValue(context, np.array(tensions))
    block.GetInputPort("lengths").FixValue(context, np.ones(8))
    block.GetInputPort("X_WP").FixValue(context, RigidTransform())
    total = block.GetOutputPort("cable_velocities")
    np.testing.assert_array_equal(total.Eval(context), commanded)
    block.CalcForcedDiscreteVariableUpdate(context, context.get_mutable_discrete_state())
    added, _, _ = law.step(readings(tensions, np.ones(8), RigidTransform()), np.zeros(0))
    np.testing.assert_array_equal(block.GetOutputPort("tension_corrections").Eval(context), added)
    np.testing.assert_array_equal(total.Eval(context), commanded + added)
