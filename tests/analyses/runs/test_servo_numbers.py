"""Summary and curves of a run against what its log, written by hand, says on paper."""

from importlib.metadata import version

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import drift
from cdpr_drake.analyses.studies.servo import estimate_jump
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from tests.analyses.runs.run_by_hand import (
    ESTIMATE_OFF,
    ESTIMATE_TURNED,
    FOUND,
    PLAN_OFF,
    PLAN_TURNED,
    SEEN,
    TIMES,
    changed,
    platform_poses,
    run_by_hand,
    with_plan,
)

BY_HAND = 1e-9
"""Pixels, metres and radians through projections, quaternions and back, absolute."""


SINGLE_PRECISION = 1e-3
"""Of pixels below 1600 kept in single precision, absolute."""

WIDE = 2.5
"""From an image of 640 px to one of 1600 px, as if it had that of the thesis."""

MIDDLE = np.array([319.5, 239.5])
"""Of the image: the desired pose has the target on the optical axis [px]."""


@pytest.fixture(scope="module")
def hand():
    return run_by_hand()


@pytest.fixture(scope="module")
def summary(hand):
    return hand.as_dict()


@pytest.fixture(scope="module")
def traces(hand):
    return hand.traces()


def in_the_image():
    """Distances from the line, by twice the area over start, end and point [px]."""
    (ax, ay), length = MIDDLE - SEEN[0], np.linalg.norm(MIDDLE - SEEN[0])
    return np.abs(ax * (SEEN[FOUND, 1] - SEEN[0, 1]) - ay * (SEEN[FOUND, 0] - SEEN[0, 0])) / length


def in_space(servo):
    """Places of the camera, the end of its line, and distances from that [m]."""
    places = np.array([(X @ servo.X_PC).translation() for X in platform_poses()])
    goal = (servo.X_WO @ servo.X_CdO.inverse()).translation()
    along = (goal - places[0]) / np.linalg.norm(goal - places[0])
    return places, goal, np.linalg.norm(np.cross(places - places[0], along), axis=1)


def test_the_image_path_is_where_the_target_was_seen(hand):
    """In pixels, without the rows that did not see it; the line starts at the first sample."""
    times, path, line = hand.image_path
    np.testing.assert_array_equal(times, [0.0, 1.5, 3.5])
    np.testing.assert_allclose(path, SEEN[FOUND], atol=BY_HAND)
    np.testing.assert_allclose(line, [[100.0, 50.0], MIDDLE], atol=BY_HAND)


def test_the_desired_point_need_not_be_the_middle_of_the_image():
    shifted = run_by_hand("acrobot_pbvs", "desired.position=[0.01, -0.02, 0.09]")
    pinhole = shifted.built.pinhole
    expected = [319.5 + pinhole.fx * 0.01 / 0.09, 239.5 - pinhole.fy * 0.02 / 0.09]
    np.testing.assert_allclose(shifted.image_path[2][1], expected, atol=BY_HAND)


def test_a_run_that_never_saw_its_target_has_no_image_path(hand):
    blind = changed(hand, log=hand.log | {"found": np.zeros((4, 1))})
    times, path, line = blind.image_path
    assert len(times) == 0
    assert path.shape == (0, 2)
    np.testing.assert_allclose(line, [MIDDLE] * 2, atol=BY_HAND)
    assert blind.as_dict()["image_deviation_px"] == {"max": None, "mean": None}


def test_the_image_and_deviations_in_it_also_as_if_it_had_1600_pixels(summary, traces):
    for name, scale in (("image_deviation_px", 1.0), ("image_deviation_px_1600x1200", WIDE)):
        away = scale * in_the_image()
        expected = {"max": np.max(away), "mean": np.mean(away)}
        assert summary[name] == pytest.approx(expected, abs=BY_HAND), name
    np.testing.assert_array_equal(traces["image_time"], TIMES[FOUND])
    np.testing.assert_array_equal(traces["image_size"], [1600.0, 1200.0])
    for name, expected in {
        "image_path": SEEN[FOUND], "image_line": np.array([SEEN[0], MIDDLE]),
        "image_deviation": in_the_image(),
    }.items():  # fmt: skip
        np.testing.assert_allclose(traces[name], WIDE * expected, atol=BY_HAND, err_msg=name)


def test_the_camera_path_runs_from_its_first_sample_to_the_desired_pose(hand, summary, traces):
    servo, (places, goal, away) = hand.built, in_space(hand.built)
    for track, line in (
        (hand.camera_path, hand.camera_line),
        (traces["camera_path"], traces["camera_line"]),
    ):
        np.testing.assert_allclose(track, places, atol=BY_HAND)
        np.testing.assert_allclose(line, [places[0], goal], atol=BY_HAND)
    expected = {"max": np.max(away), "mean": np.mean(away)}
    assert summary["camera_deviation_m"] == pytest.approx(expected, abs=BY_HAND)
    np.testing.assert_allclose(traces["camera_deviation"], away, atol=BY_HAND)
    last = pose_row(platform_poses()[-1] @ servo.X_PC)
    wanted = pose_row(servo.X_WO @ servo.X_CdO.inverse())
    np.testing.assert_allclose(traces["camera_ends"], [last, wanted], atol=BY_HAND)


def test_a_camera_in_the_world_is_seen_from_its_target():
    """The target moves with the platform, so the path of the camera is in the target's frame."""
    hand = run_by_hand("acrobot_eye_to_hand")
    servo = hand.built
    track, line = (hand.camera_path, hand.camera_line)
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
    planned = with_plan(hand).as_dict()
    assert planned["plan_deviation_m"] == pytest.approx(
        {"max": max(PLAN_OFF), "mean": 0.02}, abs=BY_HAND
    )
    assert planned["plan_deviation_rad"] == pytest.approx(
        {"max": max(PLAN_TURNED), "mean": 0.15}, abs=BY_HAND
    )


def test_final_errors_are_of_the_last_pose_and_the_desired_one(hand, summary):
    servo = hand.built
    X_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ servo.X_WO
    between = servo.X_CdO.inverse() @ X_CO
    distance = np.linalg.norm(X_CO.translation() - servo.X_CdO.translation())
    assert summary["final_position_error_m"] == pytest.approx(distance, abs=BY_HAND)
    angle = between.rotation().ToAngleAxis().angle()
    assert summary["final_rotation_error_rad"] == pytest.approx(angle, abs=BY_HAND)


def test_final_errors_are_from_where_a_moving_target_is_at_the_end():
    """It sets out from (-0.06, -0.18, 0) m at 20 mm/s along y."""
    moving = run_by_hand("acrobot_moving_tag")
    servo = moving.built
    p_WO = np.array([-0.06, -0.18 + 0.02 * TIMES[-1], 0.0])
    p_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ p_WO
    distance = np.linalg.norm(p_CO - servo.X_CdO.translation())
    assert moving.end_error()[0] == pytest.approx(distance, abs=BY_HAND)


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
        "integration_step_s": hand.built.max_step,
    }
    assert {key: summary[key] for key in expected} == expected
    assert summary["versions"]["drake"] == version("drake")


def test_a_run_that_took_no_time_has_no_real_time_factor(hand):
    assert changed(hand, wall_time=0.0).as_dict()["realtime_factor"] is None
    assert changed(hand, wall_time=1.0).as_dict()["realtime_factor"] == 3.5


def test_broken_cables_are_named_with_their_times(hand):
    times = np.array([-1.0, 0.0, -1.0, 2.25, -1.0, -1.0, -1.0, -1.0])
    found = changed(hand, broken=times).as_dict()["broken_cables"]
    assert found == [{"cable": "C2", "time_s": 0.0}, {"cable": "C4", "time_s": 2.25}]
    assert changed(hand, broken=np.full(8, -1.0)).as_dict()["broken_cables"] == []


def test_a_moving_target_has_no_line_and_a_plan_has_a_name():
    moving = run_by_hand("acrobot_moving_tag").as_dict()
    for key in ("image_deviation_px", "image_deviation_px_1600x1200", "camera_deviation_m"):
        assert moving[key] == {"max": None, "mean": None}
    assert run_by_hand("acrobot_open_loop").as_dict()["controller"] == "open_loop"


def test_a_diverged_run_has_no_numbers_and_no_warnings(hand):
    far = [*platform_poses()[:3], RigidTransform([1e200, 0.0, 0.0])]
    rows = np.array([pose_row(X) for X in far])
    tensions = hand.log["tensions"].copy()
    tensions[3] = np.nan
    lost = changed(
        hand, outcome=Outcome.DIVERGED, log=hand.log | {"X_WP": rows, "tensions": tensions}
    )
    found = lost.as_dict()
    assert found["outcome"] == "diverged"
    assert found["tension_n"] == {"min": None, "max": None}
    assert found["final_position_error_m"] is None


def test_drift_is_the_slope_of_the_second_half():
    """A start that settles does not count, nor does a steady error."""
    times = np.linspace(0.0, 120.0, 601)
    settles = 0.5 * np.exp(-times)
    expected = 60.0 * 62e-6
    assert drift(times, 1e-3 + settles + 62e-6 * times) == pytest.approx(expected, rel=1e-6)
    assert drift(times, np.full(601, 1e-3)) == pytest.approx(0.0, abs=1e-15)
    assert drift(times[:4], np.zeros(4)) is None


# Curves.


def test_errors_and_what_is_taken_over(hand, traces):
    p = np.array([X.translation() for X in platform_poses()])
    np.testing.assert_array_equal(traces["platform_path"], p)
    p[:, 1] += ESTIMATE_OFF
    np.testing.assert_allclose(traces["estimate_path"], p, atol=BY_HAND)
    np.testing.assert_allclose(traces["estimate_distance"], ESTIMATE_OFF, atol=BY_HAND)
    np.testing.assert_allclose(traces["estimate_angle"], ESTIMATE_TURNED, atol=BY_HAND)
    assert np.all(np.isnan(traces["error"][1]))  # no gain: the target was not seen
    seen = [0, 2, 3]
    np.testing.assert_array_equal(traces["error"][seen], hand.log["error"][seen])
    for key in ("time", "cable_velocities", "tensions"):
        np.testing.assert_array_equal(traces[key], hand.log[key])


def test_the_jump_is_of_the_error_and_not_of_the_path(hand, traces):
    """Errors of 1, 4, 2 and 3 mm along one direction: the largest change is 3 mm."""
    assert estimate_jump(traces) == pytest.approx(0.003, abs=BY_HAND)
    one = {key: traces[key][:1] for key in ("platform_path", "estimate_path")}
    assert estimate_jump(one) == 0.0
    two = {key: traces[key][2:] for key in ("platform_path", "estimate_path")}
    assert estimate_jump(two) == pytest.approx(0.001, abs=BY_HAND)
    rows = np.array([pose_row(X) for X in platform_poses()])
    exact = changed(hand, log=hand.log | {"X_WP_estimated": rows}).traces()
    assert estimate_jump(exact) == 0.0


def test_corners_are_kept_where_the_object_was_seen(hand, traces):
    pinhole, servo = hand.built.pinhole, hand.built
    assert traces["corner_paths"].shape == (3, 4, 2)
    seen = hand.log[f"{servo.target.mark}_px"][FOUND].reshape(-1, 4, 2)
    np.testing.assert_allclose(traces["corner_paths"], WIDE * seen, atol=SINGLE_PRECISION)
    goals = np.array(
        [pinhole.project((servo.X_CdO @ p)[:, None])[:, 0] for p in servo.target.points.T]
    )
    np.testing.assert_allclose(traces["corner_goals"], WIDE * goals, atol=BY_HAND)
