"""The paths and deviations behind the summary."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_summary import (
    camera_path,
    drift,
    final_errors,
    image_path,
    summarize,
)
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row, pose_rows_distance
from cdpr_drake.systems.diagrams.load import load_scenario

ROUNDING = 1e-12
"""Two formulas for the same point."""

CONVERGED_PIXELS = 1.0
"""The path ends this near to the desired image point [px]."""


@pytest.fixture(scope="module")
def result():
    return run_scenario(load_scenario("acrobot_pbvs", ["camera.kind=projected"]))


def test_image_path_ends_at_the_desired_point(result):
    times, path, line = image_path(result)
    assert path.shape == (len(times), 2)
    pinhole = result.servo.pinhole
    np.testing.assert_allclose(line[1], [pinhole.cx, pinhole.cy], atol=1e-9)
    assert np.linalg.norm(path[-1] - line[1]) < CONVERGED_PIXELS


def test_camera_path_is_that_of_the_camera_frame(result):
    track, _ = camera_path(result)
    for index in (0, 100, -1):
        X_WP = pose_from_row(result.log["X_WP"][index])
        expected = (X_WP @ result.servo.X_PC).translation()
        np.testing.assert_allclose(track[index], expected, atol=ROUNDING)


def test_noiseless_image_path_is_straight():
    """The ideal property of this feature, servoing thesis 1.4.4."""
    exact = run_scenario(
        load_scenario("acrobot_pbvs", ["camera.kind=projected", "camera.pixel_noise=0.0"])
    )
    assert summarize(exact)["image_deviation_px"]["max"] < 0.5


def test_slack_seconds_count_cables(result):
    dt = np.diff(result.log["time"])
    expected = float(np.sum(result.log["slack"][:-1].sum(axis=1) * dt))
    assert summarize(result)["slack_cable_seconds"] == pytest.approx(expected)


def test_surplus_is_what_lengths_exceed_the_straight_paths_by(result):
    log, cables = result.log, result.servo.cable_robot.forces.cable_set()
    row = int(np.argmax(np.max(log["surplus_lengths"], axis=1)))
    straight = cable_paths(pose_from_row(log["X_WP"][row]), cables).lengths
    largest = np.max(log["unstrained_lengths"][row] - straight)
    assert largest > 0.0
    assert summarize(result)["surplus_over_chord_m"]["max"] == pytest.approx(largest)


def test_final_errors_belong_to_the_last_row(result):
    X_WP = pose_from_row(result.log["X_WP"][-1])
    X_CO = (X_WP @ result.servo.X_PC).inverse() @ result.servo.X_WO
    distance = np.linalg.norm(X_CO.translation() - result.servo.X_CdO.translation())
    assert final_errors(result)[0] == pytest.approx(distance, abs=ROUNDING)


def test_drift_is_the_slope_of_the_second_half():
    """A start that settles does not count, nor does a steady error."""
    times = np.linspace(0.0, 120.0, 601)
    settles = 0.5 * np.exp(-times)
    expected = 60.0 * 62e-6
    assert drift(times, 1e-3 + settles + 62e-6 * times) == pytest.approx(expected, rel=1e-6)
    assert drift(times, np.full(601, 1e-3)) == pytest.approx(0.0, abs=1e-15)
    assert drift(times[:4], np.zeros(4)) is None


def test_drift_stands_in_the_summary(result):
    found = summarize(result)["pose_estimate_drift_m_per_min"]
    distance, _ = pose_rows_distance(result.log["X_WP"], result.log["X_WP_estimated"])
    half = result.log["time"] >= result.log["time"][-1] / 2.0
    slope = np.polyfit(result.log["time"][half], distance[half], 1)[0]
    assert found == pytest.approx(60.0 * slope, rel=1e-6)
