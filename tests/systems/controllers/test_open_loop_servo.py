"""The open-loop baseline: exact with an exact model, off by what the model is off."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_rows_distance
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome

HELD = 0.1e-3
"""Velocities that are held for 40 ms sum up to the way, but for the order of the steps [m]."""

LAG = 2.5e-3
"""A plan of 6 cm/s moves on by this much while a velocity is held [m]."""

PLAN = "open_loop={duration: 4}"


def run(*overrides, name="acrobot_pbvs"):
    return run_scenario(load_scenario(name, ["camera.kind=projected", *overrides]))


@pytest.fixture(scope="module")
def exact():
    return run(PLAN)


def test_with_an_exact_model_it_arrives(exact):
    assert exact.outcome == Outcome.COMPLETED
    assert exact.sim_time == pytest.approx(4.5, abs=0.1)  # the plan, and the time to hold
    final = pose_from_row(exact.log["X_WP"][-1])
    distance, angle = pose_error(final, exact.servo.desired_platform_pose())
    assert distance < HELD
    assert angle < HELD / 0.05


def test_it_stays_on_its_plan_but_for_what_is_held(exact):
    distance, _ = pose_rows_distance(exact.log["X_WP"], exact.log["X_WP_planned"])
    assert np.max(distance) < 2.0 * LAG
    summary = summarize(exact)
    assert summary["controller"] == "open_loop"
    assert summary["plan_deviation_m"]["max"] == pytest.approx(np.max(distance))
    assert summary["plan_deviation_m"]["mean"] < LAG
    facts = dict(SCENARIO_KINDS["visual_servo"].facts(summary))
    assert facts["from the plan"].endswith("deg")
    assert "from the straight line" not in facts


def test_lengths_change_by_what_the_plan_asks_for(exact):
    """The integral of J V along the plan is the difference of the lengths at its ends."""
    servo, log = exact.servo, exact.log
    A, B = servo.robot.exit_points(), servo.robot.anchor_points()
    ends = [servo.scenario.initial_pose.transform(), servo.desired_platform_pose()]
    wanted = cable_lengths(ends[1], A, B) - cable_lengths(ends[0], A, B)
    paid_out = log["unstrained_lengths"][-1] - log["unstrained_lengths"][0]
    np.testing.assert_allclose(paid_out, wanted, atol=HELD)


def test_the_features_error_is_logged_and_moves_nothing(exact):
    """The tag elsewhere changes what is seen, not what is done."""
    elsewhere = run(PLAN, "target.size=0.05", "camera.pixel_noise=3")
    np.testing.assert_array_equal(elsewhere.log["cable_velocities"], exact.log["cable_velocities"])
    seen = exact.log["found"][:, 0] > 0.0
    assert np.linalg.norm(exact.log["error"][seen][1]) > 0.1
    assert np.all(exact.log["gain"] == 0.0)


def test_a_wrong_model_leaves_it_beside_the_goal_where_servoing_arrives():
    wrong = ["perturbations.exit_points=0.01", "perturbations.anchor_points=0.01"]
    blind, looking = run(PLAN, *wrong), run(*wrong)
    assert looking.outcome == Outcome.CONVERGED
    errors = [summarize(result)["final_position_error_m"] for result in (blind, looking)]
    assert errors[0] > 3e-3
    assert errors[1] < 0.3e-3


def test_a_wrong_start_shifts_the_whole_way():
    blind = run(PLAN, "perturbations.initial_pose_shift.distance=0.02")
    final = pose_from_row(blind.log["X_WP"][-1])
    assert pose_error(final, blind.servo.desired_platform_pose())[0] > 0.01


def test_it_passes_its_waypoints_and_returns(exact):
    points = (
        "{pose: {position: [0.2, -0.1, 0.2]}, duration: 2}, "
        "{pose: {position: [0.112, -0.032, 0.301], angles_deg: [-12, -10, 0]}, duration: 2}"
    )
    result = run(f"open_loop.waypoints=[{points}]")
    log = result.log
    middle = log["X_WP"][np.searchsorted(log["time"], 2.04), 4:]
    np.testing.assert_allclose(middle, [0.2, -0.1, 0.2], atol=2.0 * HELD)
    np.testing.assert_allclose(log["X_WP"][-1], log["X_WP"][0], atol=HELD)


def test_losing_sight_does_not_end_it():
    away = "open_loop={waypoints: [{pose: {position: [0.15, -0.05, 0.25]}, duration: 1}]}"
    result = run(away, "target.pose.position=[-0.5, 0.5, 0.0]", "stop.target_lost=0.5")
    assert result.outcome == Outcome.COMPLETED
    assert not np.any(result.log["found"])


def test_ports_are_those_of_a_servo_and_the_plan():
    servo = build_visual_servo(load_scenario("acrobot_pbvs", ["camera.kind=projected", PLAN])).servo
    inputs = [servo.get_input_port(i).get_name() for i in range(servo.num_input_ports())]
    outputs = [servo.get_output_port(i).get_name() for i in range(servo.num_output_ports())]
    assert inputs == ["X_CO", "found", "corners", "X_WP"]
    assert outputs == [
        "cable_velocities", "platform_velocity", "error", "gain", "X_WP_planned",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("open_loop={duration: 0}", "> 0"),
        ("open_loop={waypoints: [{pose: {position: [0, 0, 0.2]}}]}", "duration: missing"),
        ("open_loop={time: 3}", "unknown key"),
        (
            "open_loop={waypoints: [{pose: {position: [0, 0, 3]}, duration: 2}]}",
            r"open_loop.waypoints\[0\].pose.position: found \(0, 0, 3\), outside the frame",
        ),
    ],
)
def test_bad_input_is_refused(override, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("acrobot_pbvs", [override])
