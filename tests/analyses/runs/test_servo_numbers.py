"""Summary and traces of a run against what its log, written by hand, says on paper."""

from importlib.metadata import version

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import TorqueSteps, drift
from cdpr_drake.analyses.studies.servo import estimate_jump
from cdpr_drake.systems.controllers.torque_settings import TorqueControl
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.monitoring.tension_watch import TensionExtremes
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
    poses_off,
    rows,
    run_by_hand,
)

BY_HAND = 1e-9
"""Pixels, metres and radians through projections, quaternions and back, absolute."""

SINGLE_PRECISION = 1e-3
"""Of pixels below 1600 kept in single precision, absolute."""

WIDE = 2.5
"""From an image of 640 px to one of 1600 px, as if it had that of the thesis."""

MIDDLE = np.array([319.5, 239.5])
"""Of the image: the desired pose has the target on the optical axis [px]."""

NOTHING = {"max": None, "mean": None}


@pytest.fixture(scope="module")
def hand():
    return run_by_hand()


@pytest.fixture(scope="module")
def traces(hand):
    return hand.traces()


def spread(values):
    return {"max": np.max(values), "mean": np.mean(values)}


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


def test_every_number_of_the_summary_is_that_of_the_log(hand):
    servo, summary = hand.built, hand.as_dict()
    X_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ servo.X_WO
    between = servo.X_CdO.inverse() @ X_CO
    expected = {
        "scenario": "acrobot_pbvs", "robot": "acrobot_small", "controller": "pbvs",
        "estimator": "control_integration", "camera": "projected", "seed": 0,
        "outcome": "timeout", "message": "slow", "sim_time_s": 3.5, "wall_time_s": 0.5,
        "realtime_factor": 7.0, "tension_n": {"min": 0.0, "max": 57.5}, "broken_cables": None,
        "integration_step_s": servo.max_step,
        "image_deviation_px": spread(in_the_image()),
        "image_deviation_px_1600x1200": spread(WIDE * in_the_image()),
        "camera_deviation_m": spread(in_space(servo)[2]),
        "final_position_error_m": np.linalg.norm(X_CO.translation() - servo.X_CdO.translation()),
        "final_rotation_error_rad": between.rotation().ToAngleAxis().angle(),
        "final_pose_estimate_error_m": 0.003, "final_pose_estimate_error_rad": 0.04,
        "pose_estimate_error_m": spread(ESTIMATE_OFF),
        "pose_estimate_error_rad": spread(ESTIMATE_TURNED),
        "plan_deviation_m": NOTHING, "plan_deviation_rad": NOTHING,
        # One cable for 0.5 s, two for 1 s; the last row lasts no time.
        "slack_cable_seconds": 2.5, "taut_cables": {"min": 6, "end": 7}, "underactuated_s": 0.0,
        "least_stability_margin": None, "least_jacobian_rank": None, "unstable_s": None,
    }  # fmt: skip
    for key, value in expected.items():
        assert summary[key] == pytest.approx(value, abs=BY_HAND), key
    assert summary["versions"]["drake"] == version("drake")


def test_numbers_that_few_runs_have(hand):
    planned = changed(hand, {"X_WP_planned": poses_off(PLAN_OFF, PLAN_TURNED)}).as_dict()
    for key, values in (("plan_deviation_m", PLAN_OFF), ("plan_deviation_rad", PLAN_TURNED)):
        assert planned[key] == pytest.approx(spread(values), abs=BY_HAND)
    assert changed(hand, wall_time=0.0).as_dict()["realtime_factor"] is None
    times = np.array([-1.0, 0.0, -1.0, 2.25, -1.0, -1.0, -1.0, -1.0])
    assert changed(hand, broken=times).as_dict()["broken_cables"] == [
        {"cable": "C2", "time_s": 0.0}, {"cable": "C4", "time_s": 2.25}
    ]  # fmt: skip
    assert changed(hand, broken=np.full(8, -1.0)).as_dict()["broken_cables"] == []


def test_the_image_path_is_where_the_target_was_seen_and_its_line_ends_at_the_desired_point(hand):
    """In pixels, without the rows that did not see it; the line starts at the first sample."""
    times, path, line = hand.image_path
    np.testing.assert_array_equal(times, TIMES[FOUND])
    np.testing.assert_allclose(path, SEEN[FOUND], atol=BY_HAND)
    np.testing.assert_allclose(line, [SEEN[0], MIDDLE], atol=BY_HAND)
    shifted = run_by_hand("acrobot_pbvs", "desired.position=[0.01, -0.02, 0.09]")
    pinhole = shifted.built.pinhole
    expected = np.add(MIDDLE, [pinhole.fx * 0.01 / 0.09, -pinhole.fy * 0.02 / 0.09])
    np.testing.assert_allclose(shifted.image_path[2][1], expected, atol=BY_HAND)
    blind = changed(hand, {"found": np.zeros((4, 1))})  # it never saw its target
    assert [len(part) for part in blind.image_path[:2]] == [0, 0]
    np.testing.assert_allclose(blind.image_path[2], [MIDDLE] * 2, atol=BY_HAND)
    assert blind.as_dict()["image_deviation_px"] == NOTHING


def test_every_trace_is_that_of_the_log(hand, traces):
    servo, (places, goal, away) = hand.built, in_space(hand.built)
    p = np.array([X.translation() for X in platform_poses()])
    error = hand.log["error"].copy()
    error[1] = np.nan  # no gain: the target was not seen
    ends = platform_poses()[-1] @ servo.X_PC, servo.X_WO @ servo.X_CdO.inverse()
    goals = [servo.pinhole.project((servo.X_CdO @ q)[:, None])[:, 0] for q in servo.target.points.T]
    expected = {
        "image_time": TIMES[FOUND], "image_size": [1600.0, 1200.0],
        "image_path": WIDE * SEEN[FOUND], "image_line": WIDE * np.array([SEEN[0], MIDDLE]),
        "image_deviation": WIDE * in_the_image(), "corner_goals": WIDE * np.array(goals),
        "camera_path": places, "camera_line": [places[0], goal], "camera_deviation": away,
        "camera_ends": rows(ends), "platform_path": p,
        "estimate_path": p + np.outer(ESTIMATE_OFF, [0.0, 1.0, 0.0]),
        "estimate_distance": ESTIMATE_OFF, "estimate_angle": ESTIMATE_TURNED, "error": error,
        **{key: hand.log[key] for key in ("time", "cable_velocities", "tensions")},
    }  # fmt: skip
    for name, values in expected.items():
        np.testing.assert_allclose(traces[name], values, atol=BY_HAND, err_msg=name)
    seen = WIDE * hand.log["corners_px"][FOUND].reshape(-1, 4, 2)
    np.testing.assert_allclose(traces["corner_paths"], seen, atol=SINGLE_PRECISION)
    assert set(traces) == {*expected, "corner_paths"}


def test_a_camera_in_the_world_is_seen_from_its_target():
    """The target moves with the platform, so the path of the camera is in the target's frame."""
    hand = run_by_hand("acrobot_eye_to_hand")
    scenario, X_WC = hand.scenario, hand.built.mounting.X_WC(platform_poses()[0])
    X_PO = scenario.target.pose.transform()
    seen = [((X_WP @ X_PO).inverse() @ X_WC).translation() for X_WP in platform_poses()]
    np.testing.assert_allclose(hand.camera_path, seen, atol=BY_HAND)
    goal = scenario.desired.transform().inverse().translation()
    np.testing.assert_allclose(hand.camera_line, [seen[0], goal], atol=BY_HAND)


def test_a_moving_target_has_no_line_and_is_where_it_is_at_the_end():
    """It sets out from (-0.06, -0.18, 0) m at 20 mm/s along y."""
    moving = run_by_hand("acrobot_moving_tag")
    servo, p_WO = moving.built, np.array([-0.06, -0.18 + 0.02 * TIMES[-1], 0.0])
    p_CO = (platform_poses()[-1] @ servo.X_PC).inverse() @ p_WO
    distance = np.linalg.norm(p_CO - servo.X_CdO.translation())
    assert moving.end_error()[0] == pytest.approx(distance, abs=BY_HAND)
    for key in ("image_deviation_px", "image_deviation_px_1600x1200", "camera_deviation_m"):
        assert moving.as_dict()[key] == NOTHING


def test_a_diverged_run_has_no_numbers_and_no_warnings(hand):
    far = rows([*platform_poses()[:3], RigidTransform([1e200, 0.0, 0.0])])
    tensions = hand.log["tensions"].copy()
    tensions[3] = np.nan
    lost = changed(hand, {"X_WP": far, "tensions": tensions}, outcome=Outcome.DIVERGED).as_dict()
    assert lost["outcome"] == "diverged"
    assert lost["tension_n"] == {"min": None, "max": None}
    assert lost["final_position_error_m"] is None


def test_drift_is_the_slope_of_the_second_half():
    """A start that settles does not count, nor does a steady error."""
    times = np.linspace(0.0, 120.0, 601)
    settles = 0.5 * np.exp(-times)
    expected = 60.0 * 62e-6
    assert drift(times, 1e-3 + settles + 62e-6 * times) == pytest.approx(expected, rel=1e-6)
    assert drift(times, np.full(601, 1e-3)) == pytest.approx(0.0, abs=1e-15)
    assert drift(times[:4], np.zeros(4)) is None


def test_the_jump_is_of_the_error_and_not_of_the_path(hand, traces):
    """Errors of 1, 4, 2 and 3 mm along one direction: the largest change is 3 mm."""
    for part, expected in ((slice(None), 0.003), (slice(1), 0.0), (slice(2, None), 0.001)):
        some = {key: traces[key][part] for key in ("platform_path", "estimate_path")}
        assert estimate_jump(some) == pytest.approx(expected, abs=BY_HAND)
    exact = changed(hand, {"X_WP_estimated": hand.log["X_WP"]}).traces()
    assert estimate_jump(exact) == 0.0


@pytest.mark.parametrize(
    ("limits", "excess"), [((1.0, 60.0), 0.0), ((3.0, 60.0), 1.0), ((1.0, 49.5), 0.5)]
)
def test_torque_counts_what_is_beyond_limits_below_and_above(limits, excess):
    extremes = TensionExtremes(0.7, np.array([2.0, 4.0]), np.array([40.0, 50.0]))
    steps = TorqueSteps(1000, 10, 200.0, extremes, limits)
    numbers = steps.numbers(TorqueControl())
    assert (numbers["largest_excess_n"], numbers["relaxed_share"]) == (excess, 0.01)
    assert numbers["within_limits"] == (excess == 0.0)
