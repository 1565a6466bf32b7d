"""Whole runs of every scheme and of the open-loop baseline: goals, paths, followed targets.

Most go by the compiled loop, whose runs are those of the diagram (tests of `loops`).
"""

import numpy as np
import pytest

from cdpr_drake.analyses.runs.stability import stability_along
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_rows_distance
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from tests.systems.controllers.controller_cases import compiled_run, servo_run

LIMITS = {"acrobot": (0.5e-3, np.radians(0.5)), "caroca": (1.5e-3, np.radians(0.3))}
"""Final distance [m] and angle [rad] that each robot has to reach."""

THESIS_PIXEL = 640 / 1600
"""One pixel of the thesis' image in those of the scenarios."""

SCHEMES = ("pbvs", "pbvs_line", "hybrid", "ibvs", "circles")

LEFT = 1.2
"""Function over bound at most: the platform falls into other cables just after the switch, which
nobody foresees."""


def is_at_goal(result, robot):
    assert result.outcome == Outcome.CONVERGED
    distance, angle = result.end_error()
    assert distance < LIMITS[robot][0]
    assert angle < LIMITS[robot][1]


@pytest.mark.parametrize("robot", LIMITS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_reaches_its_goal(robot, scheme):
    run = servo_run if (robot, scheme) == ("acrobot", "ibvs") else compiled_run
    result = run(f"{robot}_{scheme}", "log_rate=25")
    is_at_goal(result, robot)
    names = result.built.feature_names
    assert result.log["error"].shape[1] == len(names)
    assert result.as_dict()["controller"] == result.built.scenario.controller.scheme
    if robot == "acrobot":
        shown = sum(len(axes.get_lines()) for axes in result.plot().axes[:-2])
        assert shown >= len(names)


@pytest.mark.parametrize(
    ("scheme", "image", "space"),
    [("pbvs", True, False), ("pbvs_line", False, True), ("hybrid", True, True)],
)
def test_paths_without_noise_are_straight_where_the_thesis_says(scheme, image, space):
    result = compiled_run(f"acrobot_{scheme}", "camera.pixel_noise=0", "log_rate=25")
    _, path, line = result.image_path
    track, camera_line = (result.camera_path, result.camera_line)
    pixels = np.max(distances_from_line(path, *line)) / THESIS_PIXEL
    metres = np.max(distances_from_line(track, *camera_line))
    assert (pixels < 1.0) == image
    assert (metres < 1e-3) == space


@pytest.mark.parametrize("name", ["acrobot_partitioned", "caroca_partitioned", "acrobot_switching"])
def test_a_partition_and_a_switch_reach_their_goal(name):
    """A bound is left by less than `LEFT` after a switch."""
    result = compiled_run(name, "log_rate=25")
    robot, _, scheme = name.partition("_")
    is_at_goal(result, robot)
    summary = result.as_dict()
    assert summary["controller"] == scheme
    result.plot()
    if scheme == "switching":
        mode = result.log["servo_mode"]
        assert summary["servo_switches"] == mode[-1, 1]
        assert summary["servo_switches"] > 0
        assert np.all(mode[:, 2:4] <= LEFT * mode[:, 4:])
    else:
        assert summary["servo_switches"] is None
    assert np.all(np.isnan(stability_along(result).margin))


@pytest.mark.parametrize(
    ("compensation", "noise", "steady"),
    [
        ("none", 0.1, 0.02 / 2.0),
        ("difference", 0.0, 0.0),  # noise of 0.1 px would shake the platform off its cables
        ("constant_velocity", 0.1, 0.0),
        ("constant_acceleration", 0.1, 0.0),
    ],
)
def test_a_moving_tag_is_followed_at_velocity_over_gain_or_without_error(
    compensation, noise, steady
):
    """0.02 m/s with a gain of 2/s; servoing thesis 1.4.6."""
    moving = ("stop.hold=20", "duration=9", "controller.lambda_infinity=2.0")
    overrides = [f"controller.compensation={compensation}", f"camera.pixel_noise={noise}"]
    result = compiled_run("acrobot_moving_tag", *overrides, *moving)
    late = result.log["time"] > 6.0
    rows = zip(result.log["X_WP"][late], result.log["time"][late], strict=True)
    errors = [result.built.seen_error(pose_from_row(row), time)[0] for row, time in rows]
    assert np.mean(errors) == pytest.approx(steady, abs=3e-4)  # noise of 0.1 px leaves 0.2 mm


def test_a_ring_that_goes_in_circles_is_followed_and_the_yaw_kept():
    result = compiled_run("acrobot_circling_ring", "duration=10")
    late = np.flatnonzero(result.log["time"] > 4.0)[::25]
    for row, time in zip(result.log["X_WP"][late], result.log["time"][late], strict=True):
        X_WP = pose_from_row(row)
        distance, angle = result.built.seen_error(X_WP, time)
        assert distance < 2e-3
        assert angle < np.radians(0.5)
        R = X_WP.rotation().matrix()
        assert abs(np.arctan2(R[1, 0], R[0, 0])) < np.radians(2.0)


def test_a_camera_in_the_world_moves_the_tag_on_the_platform():
    result = compiled_run("acrobot_eye_to_hand")
    assert result.outcome == Outcome.CONVERGED
    assert result.end_error()[0] < 8e-3  # 0.1 px of 55 px, 1.2 m away


def test_a_trajectory_is_tracked_at_its_pace():
    result = compiled_run("acrobot_trajectory")
    is_at_goal(result, "acrobot")
    assert 11.0 < result.sim_time < 14.0
    assert np.max(np.linalg.norm(result.log["error"][25:], axis=1)) < 0.02


def test_both_frames_make_the_same_run():
    """Servoing thesis A.3; one run may leave the other at the rate of round-off only."""
    logs = [
        servo_run("acrobot_hybrid", f"controller.frame={frame}", "duration=1").log
        for frame in ("platform", "base")
    ]
    for name in ("cable_velocities", "X_WP"):
        np.testing.assert_allclose(logs[0][name], logs[1][name], rtol=0.0, atol=1e-8)


def test_a_bundle_may_leave_the_image_in_part():
    tags = (
        "[{tag_id: 0, size: 0.05, pose: {position: [-0.035, 0, 0]}}, "
        "{tag_id: 5, size: 0.05, pose: {position: [0.035, 0, 0]}}]"
    )
    result = compiled_run("acrobot_pbvs", "target.kind=tag_bundle", f"target.tags={tags}")
    is_at_goal(result, "acrobot")


GAIN = 2.0

SETTLED, SWINGS = 2e-3, 1e-2
"""Speeds of the servo in the last third of a run, far below and above each other [m/s]."""


@pytest.mark.parametrize("estimator", ["control_integration", "first_image"])
def test_images_may_be_late_by_less_than_a_quarter_of_a_swing(estimator):
    """dx/dt = -gain x(t - delay) has roots to the left for gain delay < pi / 2 only; beyond, the
    gain that falls with the error bounds the swing."""
    for frames, settles in ((10, True), (26, False)):
        result = compiled_run(
            "acrobot_pbvs", "stop.hold=100", f"camera.latency_frames={frames}",
            f"estimator.kind={estimator}", "duration=15", "log_rate=25",
        )  # fmt: skip
        scenario, log = result.built.scenario, result.log
        assert scenario.controller.lambda_0 == GAIN
        assert (GAIN * frames / scenario.camera.rate < np.pi / 2.0) == settles
        late = log["time"] > 10.0
        speed = np.max(np.linalg.norm(log["platform_velocity"][late, 3:], axis=1))
        assert speed < SETTLED if settles else SWINGS < speed < 1.0, frames


HOLD = 0.1e-3
"""Velocities that are held for 40 ms sum up to the way, but for the order of the steps [m]."""

LAG = 2.5e-3
"""A plan of 6 cm/s moves on by this much while a velocity is held [m]."""

PLAN = "open_loop={duration: 4}"


@pytest.fixture(scope="module")
def exact():
    return servo_run("acrobot_pbvs", PLAN)


def test_an_open_loop_with_an_exact_model_arrives(exact):
    assert exact.outcome == Outcome.COMPLETED
    assert exact.sim_time == pytest.approx(4.5, abs=0.1)  # the plan, and the time to hold
    final = pose_from_row(exact.log["X_WP"][-1])
    distance, angle = pose_error(final, exact.built.desired_platform_pose())
    assert distance < HOLD
    assert angle < HOLD / 0.05


def test_an_open_loop_stays_on_its_plan_but_for_what_is_held(exact):
    distance, _ = pose_rows_distance(exact.log["X_WP"], exact.log["X_WP_planned"])
    assert np.max(distance) < 2.0 * LAG
    summary = exact.as_dict()
    assert summary["controller"] == "open_loop"
    assert summary["plan_deviation_m"]["max"] == pytest.approx(np.max(distance))
    assert summary["plan_deviation_m"]["mean"] < LAG
    facts = dict(exact.facts(summary))
    assert facts["from the plan"].endswith("deg")
    assert "from the straight line" not in facts


def test_lengths_change_by_those_of_the_plan(exact):
    """The integral of J V along the plan is the difference of the lengths at its ends."""
    servo, l0 = exact.built, exact.log["unstrained_lengths"]
    points = servo.robot.exit_points(), servo.robot.anchor_points()
    start, end = servo.scenario.initial_pose.transform(), servo.desired_platform_pose()
    wanted = cable_lengths(end, *points) - cable_lengths(start, *points)
    np.testing.assert_allclose(l0[-1] - l0[0], wanted, atol=HOLD)


def test_the_features_error_is_logged_and_moves_nothing(exact):
    """The tag elsewhere changes what is seen, not what is done."""
    elsewhere = servo_run("acrobot_pbvs", PLAN, "target.size=0.05", "camera.pixel_noise=3")
    np.testing.assert_array_equal(elsewhere.log["cable_velocities"], exact.log["cable_velocities"])
    seen = exact.log["found"][:, 0] > 0.0
    assert np.linalg.norm(exact.log["error"][seen][1]) > 0.1
    assert np.all(exact.log["gain"] == 0.0)


def test_a_wrong_model_leaves_the_plan_beside_the_goal_where_servoing_arrives():
    wrong = ["perturbations.exit_points=0.01", "perturbations.anchor_points=0.01"]
    blind, looking = (compiled_run("acrobot_pbvs", *more, *wrong) for more in ([PLAN], []))
    assert looking.outcome == Outcome.CONVERGED
    assert blind.as_dict()["final_position_error_m"] > 3e-3
    assert looking.as_dict()["final_position_error_m"] < 0.3e-3


def test_a_wrong_start_shifts_the_whole_way():
    blind = compiled_run("acrobot_pbvs", PLAN, "perturbations.initial_pose_shift.distance=0.02")
    final = pose_from_row(blind.log["X_WP"][-1])
    assert pose_error(final, blind.built.desired_platform_pose())[0] > 0.01


def test_an_open_loop_passes_its_waypoints_and_returns():
    points = (
        "{pose: {position: [0.2, -0.1, 0.2]}, duration: 2}, "
        "{pose: {position: [0.112, -0.032, 0.301], angles_deg: [-12, -10, 0]}, duration: 2}"
    )
    log = compiled_run("acrobot_pbvs", f"open_loop.waypoints=[{points}]").log
    middle = log["X_WP"][np.searchsorted(log["time"], 2.04), 4:]
    np.testing.assert_allclose(middle, [0.2, -0.1, 0.2], atol=2.0 * HOLD)
    np.testing.assert_allclose(log["X_WP"][-1], log["X_WP"][0], atol=HOLD)


def test_losing_sight_does_not_end_an_open_loop():
    away = "open_loop={waypoints: [{pose: {position: [0.15, -0.05, 0.25]}, duration: 1}]}"
    lost = ("target.pose.position=[-0.5, 0.5, 0.0]", "stop.target_lost=0.5")
    result = servo_run("acrobot_pbvs", away, *lost)
    assert result.outcome == Outcome.COMPLETED
    assert not np.any(result.log["found"])
