"""What figures draw of a run, against a log that is written by hand."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_traces import estimate_jump, run_traces
from cdpr_drake.geometry.poses import pose_row
from tests.analyses.simulation.run_by_hand import (
    ESTIMATE_OFF,
    ESTIMATE_TURNED,
    FOUND,
    SEEN,
    TIMES,
    platform_poses,
    run_by_hand,
)

BY_HAND = 1e-9
"""Pixels, metres and radians through projections, quaternions and back, absolute."""

SINGLE_PRECISION = 1e-3
"""Of pixels below 1600 kept in single precision, absolute."""

WIDE = 2.5
"""From an image of 640 px to one of 1600 px."""


@pytest.fixture(scope="module")
def hand():
    return run_by_hand()


@pytest.fixture(scope="module")
def traces(hand):
    return run_traces(hand)


def test_the_image_is_scaled_to_1600_pixels(traces):
    np.testing.assert_array_equal(traces["image_time"], TIMES[FOUND])
    np.testing.assert_allclose(traces["image_path"], WIDE * SEEN[FOUND], atol=BY_HAND)
    line = WIDE * np.array([SEEN[0], [319.5, 239.5]])
    np.testing.assert_allclose(traces["image_line"], line, atol=BY_HAND)
    np.testing.assert_array_equal(traces["image_size"], [1600.0, 1200.0])
    along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    off = WIDE * SEEN[FOUND] - line[0]
    away = np.abs(off[:, 0] * along[1] - off[:, 1] * along[0])
    np.testing.assert_allclose(traces["image_deviation"], away, atol=BY_HAND)


def test_paths_in_space(hand, traces):
    servo = hand.servo
    places = np.array([(X @ servo.X_PC).translation() for X in platform_poses()])
    goal = (servo.X_WO @ servo.X_CdO.inverse()).translation()
    np.testing.assert_allclose(traces["camera_path"], places, atol=BY_HAND)
    np.testing.assert_allclose(traces["camera_line"], [places[0], goal], atol=BY_HAND)
    along = (goal - places[0]) / np.linalg.norm(goal - places[0])
    away = np.linalg.norm(np.cross(places - places[0], along), axis=1)
    np.testing.assert_allclose(traces["camera_deviation"], away, atol=BY_HAND)
    last = pose_row(platform_poses()[-1] @ servo.X_PC)
    wanted = pose_row(servo.X_WO @ servo.X_CdO.inverse())
    np.testing.assert_allclose(traces["camera_ends"], [last, wanted], atol=BY_HAND)
    p = np.array([X.translation() for X in platform_poses()])
    np.testing.assert_array_equal(traces["platform_path"], p)
    np.testing.assert_allclose(
        traces["estimate_path"], p + np.outer(ESTIMATE_OFF, [0.0, 1.0, 0.0]), atol=BY_HAND
    )


def test_errors_and_what_is_taken_over(hand, traces):
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
    exact = run_traces(replace(hand, log=hand.log | {"X_WP_estimated": rows}))
    assert estimate_jump(exact) == 0.0


def test_corners_are_kept_where_the_object_was_seen(hand, traces):
    pinhole, servo = hand.servo.pinhole, hand.servo
    assert traces["corner_paths"].shape == (
        int(np.sum(FOUND)) if FOUND.dtype == bool else len(FOUND),
        4,
        2,
    )
    seen = hand.log[f"{servo.target.mark}_px"][FOUND].reshape(-1, 4, 2)
    np.testing.assert_allclose(traces["corner_paths"], WIDE * seen, atol=SINGLE_PRECISION)
    goals = np.array(
        [pinhole.project((servo.X_CdO @ p)[:, None])[:, 0] for p in servo.target.points.T]
    )
    np.testing.assert_allclose(traces["corner_goals"], WIDE * goals, atol=BY_HAND)
