"""Tension management in a servo: slack goes in the published time; laws by hand, gains by rule."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.stability import run_criterion, stability_along
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
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.tensions.correction_gain import tension_gain
from cdpr_drake.tensions.slack_correction import TensionFollower
from tests.systems.diagrams.diagram_cases import ENGINE, LOOP, PROJECTED

ROBOT = load_robot("acrobot_large")
HOME, CABLES = ROBOT.home.transform(), ROBOT.cable_set()


def load(*changes):
    return load_scenario("acrobot_slack_start_tca", [PROJECTED, *changes])


@pytest.fixture(scope="module")
def with_correction():
    return ServoRun(load("duration=3", "sensors.tension=ideal")).simulate()


@pytest.fixture(scope="module")
def without():
    return ServoRun(load("duration=3", "tension_management=null", *LOOP)).simulate()


def first_taut(result, cable):
    """Time from which a cable pulls with a newton for the first time [s]."""
    pulls = result.log["tensions"][:, cable] > 1.0
    return result.log["time"][np.argmax(pulls)] if np.any(pulls) else np.inf


def test_slack_of_4_cm_goes_in_the_published_time(with_correction, without):
    published = 0.8
    for cable in (0, 1):
        assert published / 1.5 < first_taut(with_correction, cable) < 1.5 * published
        assert first_taut(without, cable) > 2.0


def test_a_log_has_the_corrections_of_the_law(with_correction, without):
    """Ideal sensors, sampled at 25 Hz: the correction of a row is that of the tensions before."""
    log = with_correction.log
    rows = np.flatnonzero(np.isclose(log["time"] % 0.04, 0.02))
    added = log["tension_corrections"][rows]
    assert np.all(log["tension_thresholds"][rows] == 1.0)
    assert np.all(added <= 0.0)
    assert np.min(added) == pytest.approx(-0.04)  # a slack cable: k_c times the threshold
    expected = -0.04 * np.maximum(1.0 - log["tensions"][rows - 1], 0.0)
    np.testing.assert_allclose(added, expected, atol=1e-12)
    # The servo itself is not changed.
    first = [run.log["cable_velocities"][1] for run in (with_correction, without)]
    np.testing.assert_allclose(*first, rtol=0.0, atol=1e-14)


def test_a_summary_counts_taut_cables(with_correction, without):
    found, other = with_correction.as_dict(), without.as_dict()
    assert found["taut_cables"] == {"min": 6, "end": 8}
    assert found["underactuated_s"] == 0.0
    assert found["least_stability_margin"] > 0.9
    assert other["taut_cables"]["min"] < 6
    assert other["underactuated_s"] > 0.2
    assert other["least_stability_margin"] is None


def test_stability_along_a_run_is_that_at_its_poses(without):
    along = stability_along(without)
    assert np.all(along.rank == np.minimum(along.taut, 6))  # generic poses
    assert np.all(along.margin[along.rank < 6] == 0.0)
    assert np.all(along.margin[along.rank == 6] > 0.5)
    assert along.underactuated_time() == pytest.approx(along.numbers()["unstable_s"])
    log, row = without.log, 40
    X, X_hat = (pose_from_row(log[name][row]) for name in ("X_WP", "X_WP_estimated"))
    taut = log["slack"][row] == 0.0
    again = run_criterion(without).at(X, X_hat, taut, float(log["time"][row]))
    assert again == (along.rank[row], along.margin[row])


WINCHES = "winches={kind: motor, mode: position}"

KINDS = [
    "{kind: adaptive, gain_per_length: 4}",
    "{kind: by_length, gain: 0.04, highest: [3], shortest: 0.5, longest: 1.5, shape: exponential}",
    "{kind: distribution, threshold: [0.5], integral: 0.01}",
    "{kind: length}",
    "{kind: polygon, margin: 2, gain: 0.02}",
    "{rate: 100, gain: 0.04}",
    "{kind: constant, gain: 0.04}",  # of winches that are commanded by position
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_runs_and_takes_up_slack(kind):
    changes = [f"tension_management={kind}", *[WINCHES] * ("constant" in kind)]
    log = ServoRun(load("duration=2.5", ENGINE, *changes)).simulate().log
    surplus = log["unstrained_lengths"][:, :2] - log["lengths"][:, :2]
    assert np.all(surplus[-1] < 0.5 * surplus[0])
    assert np.all(np.isfinite(log["tension_corrections"]))


@pytest.mark.parametrize(
    "kind", ["kind: constant, threshold: [9]", "kind: polygon, threshold: [5], margin: 2"]
)
def test_without_a_gain_management_takes_one_that_is_stable(kind):
    """The published gain chatters where many cables are corrected; loop and diagram are one."""

    def log(more, loop):
        changes = (f"tension_management={{{kind}{more}}}", f"integration.loop={loop}")
        shared = ("duration=3", "perturbations.slack=null", ENGINE)
        return ServoRun(load(*shared, *changes)).simulate().log["tension_corrections"]

    own, there, published = log("", "compiled"), log("", "diagram"), log(", gain: 0.04", "compiled")
    np.testing.assert_array_equal(own, there)
    chatter, stated = (np.mean(np.abs(np.diff(c[-50:], 2, axis=0))) for c in (own, published))
    assert np.max(np.abs(own)) > 0.0
    assert stated > 10.0 * chatter


def test_an_automatic_gain_is_proportional_to_stiffness_and_to_the_period():
    """On cables a hundred times as stiff, and ten times as often; where modes do not matter."""

    def gain(ratio, rate):
        cables = replace(CABLES, stiffness=ratio * CABLES.stiffness, retardation=np.full(8, 2e-2))
        return automatic_gain(ROBOT, cables, HOME, rate, 0.0).share

    np.testing.assert_allclose(gain(1.0, 25.0), 1e-2 * gain(1e-2, 25.0), rtol=1e-9)
    assert np.all(gain(1.0, 25.0) > 0.0)


@pytest.mark.parametrize("loop", ["compiled", "diagram"])
def test_a_summary_has_the_automatic_gain(loop):
    """Of `tension_gain` at the pose of the start, less by the share that modes ask for."""
    shared = ("duration=0.2", ENGINE, f"integration.loop={loop}")
    result = ServoRun(load("tension_management={}", *shared)).simulate()
    found, scenario = result.as_dict()["tension_gain"], result.built.scenario
    each = np.array(found["per_length_1_per_ns"])
    at_start = each * result.log["lengths"][0]
    np.testing.assert_allclose(found["at_start_m_per_ns"], at_start, rtol=1e-12)
    cables = scenario.cables.cable_set(result.built.robot)
    readings = scenario.sensors.rate("tension")
    delay = 0.0 if readings is None else 1.0 / readings
    shares = each / tension_gain(cables.stiffness, scenario.controller.rate, delay)  # of 1 m
    assert 0.0 < shares[0] <= 1.0
    np.testing.assert_allclose(shares, shares[0], rtol=1e-9)
    stated = ServoRun(load("tension_management={gain: 0.04}", *shared)).simulate()
    assert "tension_gain" not in stated.as_dict()


SLACK, ALLOWANCE = 0.04, 0.002
TAUT = 1e-3
"""A cable that is longer than its way by less counts as taut [m]."""

SEEN = f"tension_management={{kind: image, gain: 0.04, allowance: {ALLOWANCE}"


def slack_run(section, *more):
    slack = f"perturbations.slack=[{SLACK},{SLACK},0,0,0,0,0,0]"
    return load(ENGINE, "duration=0.8", "log_rate=100", slack, section, *more)


def slack_gone(scenario):
    """When the last cable comes taut [s], and the corrections."""
    log = ServoRun(scenario).simulate().log
    slack = np.any(log["surplus_lengths"][:, :2] > TAUT, axis=1)
    assert np.all(log["tension_corrections"] <= 0.0)
    return float(log["time"][np.flatnonzero(slack)[-1]]), log["tension_corrections"]


def test_slack_in_images_is_wound_in_sooner_than_by_tension():
    by_tension, _ = slack_gone(slack_run("tension_management={kind: constant, gain: 0.04}"))
    by_image, corrections = slack_gone(slack_run(f"{SEEN}}}"))
    assert by_image < 0.75 * by_tension
    # At the start 38 mm of 40 are beyond the allowance, in 0.2 s.
    assert np.min(corrections) == pytest.approx(-(SLACK - ALLOWANCE) / 0.2, rel=0.1)


def test_with_a_rendered_camera_cables_are_found_in_images():
    """As fast as by projected points, to what an image a tenth of a second later makes of it."""
    scenario = slack_run(f"{SEEN}, sight_rate: 10}}", "camera.kind=rendered")
    last, corrections = slack_gone(scenario)
    assert last < 0.6
    assert np.min(corrections) == pytest.approx(-(SLACK - ALLOWANCE) / 0.2, rel=0.1)


def test_a_loop_without_a_diagram_says_that_it_has_no_camera_of_cables():
    assert "cables" in diagram_reason(slack_run("tension_management={kind: image}"))


OUTSIDE = RigidTransform([0.0, 0.0, 5.0])
"""Above the frame no tensions hold the platform."""


def readings(tensions, lengths, X_WP):
    values = {"tensions": np.array(tensions), "lengths": np.array(lengths), "X_WP": X_WP}
    return CorrectionReadings(values.__getitem__, 0.04)


def polygon(lower=1.0, fastest=0.1):
    return InsidePolygon(ROBOT, CABLES, lower, 60.0, 1.0, "barycenter", 0.04, fastest)


def test_a_law_without_an_answer_adds_nothing_and_says_so():
    follower = TensionFollower(0.01, 0.1)
    straight = CABLES.without_pulleys()
    law = FollowedDistribution(ROBOT, straight, 0.5, 60.0, "quadratic_program", follower)
    memory = np.zeros(law.memory)
    memory[:8] = 1.0
    added, thresholds, could = law.step(readings(np.zeros(8), np.ones(8), OUTSIDE), memory)
    assert not could
    assert np.all(added == 0.0)
    assert np.all(thresholds == 0.5)
    assert np.all(memory[:8] == 1.0)
    for lower, X_WP in ((0.5, OUTSIDE), (30.0, HOME)):  # an empty polygon
        now = readings(np.zeros(8), np.ones(8), X_WP)
        added, _, could = polygon(lower).step(now, np.zeros(0))
        assert not could
        assert np.all(added == 0.0)


def test_a_polygon_correction_is_slowed_down_as_a_whole():
    away = readings([0.1, 9.0, 0.2, 8.0, 0.3, 9.0, 8.0, 9.0], np.ones(8), HOME)
    free, slow = (polygon(fastest=f).step(away, np.zeros(0))[0] for f in (10.0, 0.01))
    assert np.max(np.abs(slow)) == pytest.approx(0.01)
    np.testing.assert_allclose(slow, free * 0.01 / np.max(np.abs(free)))


def test_expected_lengths_are_those_of_the_believed_pose():
    cables = CABLES.without_pulleys()
    lengths = np.linalg.norm(HOME @ cables.p_PB - cables.p_WA, axis=0)
    law = ExpectedLength(cables, allowance=0.0, slowness=1.0)
    added, _, could = law.step(readings(np.arange(8), lengths + 0.02, HOME), np.zeros(0))
    assert could
    np.testing.assert_allclose(added, [-0.5, -0.5, 0, 0, 0, 0, 0, 0], rtol=1e-12)


BLOCK = TensionCorrector(ConstantThreshold(np.full(8, 2.0), np.full(8, 0.03)), 8, 25.0)


@settings(deadline=None, max_examples=20)
@given(st.lists(st.floats(-5.0, 80.0), min_size=8, max_size=8), st.integers(0, 2**31))
def test_the_block_adds_the_correction_of_its_law(tensions, seed):
    context = BLOCK.CreateDefaultContext()
    commanded = np.random.default_rng(seed).standard_normal(8)
    inputs = {"commanded_velocities": commanded, "tensions": np.array(tensions),
              "lengths": np.ones(8), "X_WP": RigidTransform()}  # fmt: skip
    for name, value in inputs.items():
        BLOCK.GetInputPort(name).FixValue(context, value)
    total = BLOCK.GetOutputPort("cable_velocities")
    np.testing.assert_array_equal(total.Eval(context), commanded)
    BLOCK.CalcForcedDiscreteVariableUpdate(context, context.get_mutable_discrete_state())
    added = 0.03 * -np.maximum(2.0 - np.array(tensions), 0.0)
    found = BLOCK.GetOutputPort("tension_corrections").Eval(context)
    np.testing.assert_allclose(found, added, rtol=1e-14, atol=0.0)
    np.testing.assert_array_equal(total.Eval(context), commanded + found)
