"""The summary of a run against what its log says on paper."""

from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.simulation.run_summary import (
    camera_path,
    final_errors,
    image_path,
    summarize,
)
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from tests.analyses.simulation.run_by_hand import (
    ESTIMATE_OFF,
    ESTIMATE_TURNED,
    FOUND,
    PLAN_OFF,
    PLAN_TURNED,
    SEEN,
    TIMES,
    platform_poses,
    run_by_hand,
    with_plan,
)

BY_HAND = 1e-9
"""Pixels, metres and radians through projections, quaternions and back, absolute."""


@pytest.fixture(scope="module")
def hand():
    return run_by_hand()


@pytest.fixture(scope="module")
def summary(hand):
    return summarize(hand)


def test_the_image_path_is_where_the_target_was_seen(hand):
    """In pixels, without the rows that did not see it; the line starts at the first sample."""
    times, path, line = image_path(hand)
    np.testing.assert_array_equal(times, [0.0, 1.5, 3.5])
    np.testing.assert_allclose(path, SEEN[FOUND], atol=BY_HAND)
    np.testing.assert_allclose(line[0], [100.0, 50.0], atol=BY_HAND)
    # The desired pose has the target on the optical axis, whose pixel is the middle of the image.
    np.testing.assert_allclose(line[1], [319.5, 239.5], atol=BY_HAND)


def test_the_desired_point_need_not_be_the_middle_of_the_image():
    shifted = run_by_hand("acrobot_pbvs", "desired.position=[0.01, -0.02, 0.09]")
    pinhole = shifted.servo.pinhole
    expected = [319.5 + pinhole.fx * 0.01 / 0.09, 239.5 - pinhole.fy * 0.02 / 0.09]
    np.testing.assert_allclose(image_path(shifted)[2][1], expected, atol=BY_HAND)


def test_a_run_that_never_saw_its_target_has_no_image_path(hand):
    blind = replace(hand, log=hand.log | {"found": np.zeros((4, 1))})
    times, path, line = image_path(blind)
    assert len(times) == 0
    assert path.shape == (0, 2)
    np.testing.assert_allclose(line, [[319.5, 239.5]] * 2, atol=BY_HAND)
    assert summarize(blind)["image_deviation_px"] == {"max": None, "mean": None}


def test_deviations_in_the_image_by_the_area_of_triangles(hand, summary):
    """Twice the area over start, end and point, by the length of the line."""
    start, end = SEEN[0], np.array([319.5, 239.5])
    (ax, ay), length = end - start, np.linalg.norm(end - start)
    away = [abs(ax * (v - start[1]) - ay * (u - start[0])) / length for u, v in SEEN[FOUND]]
    found = summary["image_deviation_px"]
    assert found["max"] == pytest.approx(max(away), abs=BY_HAND)
    assert found["mean"] == pytest.approx(sum(away) / 3.0, abs=BY_HAND)
    # As if the image of 640 px had the 1600 of the thesis.
    scaled = summary["image_deviation_px_1600x1200"]
    assert scaled["max"] == pytest.approx(2.5 * max(away), abs=BY_HAND)
    assert scaled["mean"] == pytest.approx(2.5 * sum(away) / 3.0, abs=BY_HAND)


def test_the_camera_path_runs_from_its_first_sample_to_the_desired_pose(hand, summary):
    servo = hand.servo
    track, line = camera_path(hand)
    places = np.array([(X @ servo.X_PC).translation() for X in platform_poses()])
    np.testing.assert_allclose(track, places, atol=BY_HAND)
    goal = (servo.X_WO @ servo.X_CdO.inverse()).translation()
    np.testing.assert_allclose(line, [places[0], goal], atol=BY_HAND)
    along = (goal - places[0]) / np.linalg.norm(goal - places[0])
    away = np.linalg.norm(np.cross(places - places[0], along), axis=1)
    assert summary["camera_deviation_m"]["max"] == pytest.approx(np.max(away), abs=BY_HAND)
    assert summary["camera_deviation_m"]["mean"] == pytest.approx(np.mean(away), abs=BY_HAND)


def test_a_camera_in_the_world_is_seen_from_its_target():
    """The target moves with the platform, so the path of the camera is in the target's frame."""
    hand = run_by_hand("acrobot_eye_to_hand")
    servo = hand.servo
    track, line = camera_path(hand)
    X_WC = servo.mounting.X_WC(platform_poses()[0])
    X_PO = servo.scenario.target.pose.transform()
    seen = [(X_WP @ X_PO).inverse() @ X_WC for X_WP in platform_poses()]
    np.testing.assert_allclose(track, [X.translation() for X in seen], atol=BY_HAND)
    goal = servo.scenario.desired.transform().inverse().translation()
    np.testing.assert_allclose(line, [track[0], goal], atol=BY_HAND)


def test_errors_of_estimate_and_plan(hand, summary):
    expected = {
        "final_pose_estimate_error_m": 0.003,
        "final_pose_estimate_error_rad": 0.04,
        "pose_estimate_error_m": {"max": 0.004, "mean": np.mean(ESTIMATE_OFF)},
        "pose_estimate_error_rad": {"max": 0.05, "mean": np.mean(ESTIMATE_TURNED)},
    }
    for key, value in expected.items():
        assert summary[key] == pytest.approx(value, abs=BY_HAND), key
    assert summary["plan_deviation_m"] == {"max": None, "mean": None}
    assert summary["plan_deviation_rad"] == {"max": None, "mean": None}
    planned = summarize(with_plan(hand))
    assert planned["plan_deviation_m"] == pytest.approx(
        {"max": max(PLAN_OFF), "mean": 0.02}, abs=BY_HAND
    )
    assert planned["plan_deviation_rad"] == pytest.approx(
        {"max": max(PLAN_TURNED), "mean": 0.15}, abs=BY_HAND
    )


def test_final_errors_are_of_the_last_pose_and_the_desired_one(hand, summary):
    servo = hand.servo
    X_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ servo.X_WO
    between = servo.X_CdO.inverse() @ X_CO
    distance = np.linalg.norm(X_CO.translation() - servo.X_CdO.translation())
    assert summary["final_position_error_m"] == pytest.approx(distance, abs=BY_HAND)
    angle = between.rotation().ToAngleAxis().angle()
    assert summary["final_rotation_error_rad"] == pytest.approx(angle, abs=BY_HAND)


def test_final_errors_are_from_where_a_moving_target_is_at_the_end():
    """It sets out from (-0.06, -0.18, 0) m at 20 mm/s along y."""
    moving = run_by_hand("acrobot_moving_tag")
    servo = moving.servo
    p_WO = np.array([-0.06, -0.18 + 0.02 * TIMES[-1], 0.0])
    p_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ p_WO
    distance = np.linalg.norm(p_CO - servo.X_CdO.translation())
    assert final_errors(moving)[0] == pytest.approx(distance, abs=BY_HAND)


def test_slack_seconds_last_from_a_row_to_the_next(summary):
    """One cable for 0.5 s, two for 1 s; the last row lasts no time."""
    assert summary["slack_cable_seconds"] == pytest.approx(2.5, abs=BY_HAND)
    assert TIMES[-1] == 3.5


def test_words_and_numbers_of_the_run(hand, summary):
    expected = {
        "scenario": "acrobot_pbvs",
        "robot": "acrobot_small",
        "controller": "pbvs",
        "estimator": "control_integration",
        "camera": "projected",
        "seed": 0,
        "outcome": "timeout",
        "message": "slow",
        "sim_time_s": 3.5,
        "wall_time_s": 0.5,
        "realtime_factor": 7.0,
        "tension_n": {"min": 0.0, "max": 57.5},
        "broken_cables": None,
        "integration_step_s": hand.servo.max_step,
    }
    assert {key: summary[key] for key in expected} == expected
    assert summary["versions"]["drake"] == version("drake")


def test_a_run_that_took_no_time_has_no_real_time_factor(hand):
    assert summarize(replace(hand, wall_time=0.0))["realtime_factor"] is None
    assert summarize(replace(hand, wall_time=1.0))["realtime_factor"] == 3.5


def test_broken_cables_are_named_with_their_times(hand):
    times = np.array([-1.0, 0.0, -1.0, 2.25, -1.0, -1.0, -1.0, -1.0])
    found = summarize(replace(hand, broken=times))["broken_cables"]
    assert found == [{"cable": "C2", "time_s": 0.0}, {"cable": "C4", "time_s": 2.25}]
    assert summarize(replace(hand, broken=np.full(8, -1.0)))["broken_cables"] == []


def test_a_moving_target_has_no_line_and_a_plan_has_a_name():
    moving = summarize(run_by_hand("acrobot_moving_tag"))
    for key in ("image_deviation_px", "image_deviation_px_1600x1200", "camera_deviation_m"):
        assert moving[key] == {"max": None, "mean": None}
    assert summarize(run_by_hand("acrobot_open_loop"))["controller"] == "open_loop"


def test_a_diverged_run_has_no_numbers_and_no_warnings(hand):
    far = [*platform_poses()[:3], RigidTransform([1e200, 0.0, 0.0])]
    rows = np.array([pose_row(X) for X in far])
    tensions = hand.log["tensions"].copy()
    tensions[3] = np.nan
    lost = replace(
        hand, outcome=Outcome.DIVERGED, log=hand.log | {"X_WP": rows, "tensions": tensions}
    )
    found = summarize(lost)
    assert found["outcome"] == "diverged"
    assert found["tension_n"] == {"min": None, "max": None}
    assert found["final_position_error_m"] is None
