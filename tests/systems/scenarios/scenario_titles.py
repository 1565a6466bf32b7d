"""What the title of each shipped scenario names, as a check of a run's summary and log.

Runs have projected targets; a run that only a diagram can do is made short, with events that come
sooner.
"""

import numpy as np

from cdpr_drake.systems.scenarios.files import scenario_names

SLACK, GONE = 1.0, 0.05
"""Cable seconds of slack from which a run counts as slack, and cable lengths [m] as taken up."""

SOON = "integration.engine=compiled"


def closer(run):
    """Converged, or, in a run that was cut, with a smaller error than before."""
    errors = np.linalg.norm(run.log["error"], axis=1)
    return run.summary["outcome"] == "converged" or errors[-1] < 0.95 * np.max(errors)


def straight_in_image(run):
    return closer(run) and run.summary["image_deviation_px_1600x1200"]["max"] < 30.0


def straight_in_space(run):
    return closer(run) and run.summary["camera_deviation_m"]["max"] < 0.05


def path(run):
    """Length of the platform's way [m]."""
    return float(np.sum(np.linalg.norm(np.diff(run.log["X_WP"][:, 4:], axis=0), axis=1)))


def follows(run):
    """The target is seen all the time, and the platform goes along."""
    return path(run) > 0.1 and np.mean(run.log["found"]) > 0.99


def turns_freely(run):
    """The features are those of five motions, and the sixth is not brought to zero by them."""
    return closer(run) and run.scheme == "circles"


def slack_at_start(run):
    return np.sum(run.log["surplus_lengths"][0] > 0.02) >= 2


def slack_at_end(run):
    return np.sum(run.log["slack"][-1] > 0.0) >= 1 or run.summary["slack_cable_seconds"] > 20.0


def corrected(run):
    late = run.log["surplus_lengths"][run.log["time"] > 5.0]
    return np.max(-run.log["tension_corrections"]) > 0.0 and np.max(late) < GONE


def held(run):
    """Where it shall be, within a centimetre, all the time."""
    return run.end[0] < 0.01


def sees_the_wind(run):
    pushed, seen = run.log["applied_wrench"][-1, 3:], run.log["wrench_estimated"][-1, 3:]
    return np.linalg.norm(seen - pushed) < 0.5 * np.linalg.norm(pushed)


def tracks(run):
    apart = np.linalg.norm(run.log["X_WP"][:, 4:] - run.log["X_WP_desired"][:, 4:], axis=1)
    return np.max(apart) < 0.02 and np.all(run.log["tensions"][1:] >= 0.0)


def has(*columns):
    return lambda run: all(name in run.log for name in columns)


def of(*checks, items=()):
    """What is asked of a run, all of it; and what makes a run of its own short."""
    return checks, items


def mode_goes_over(run):
    """By pose first, by image in the end, with the dots in the image all the while."""
    modes = run.log["servo_mode"][:, 0]
    return (
        run.summary["servo_switches"] > 0 and modes[1] != modes[-1] and np.all(run.log["found"][2:])
    )


def taut(run):
    return run.summary["slack_cable_seconds"] < SLACK


TITLES = {
    "acrobot_adaptation": of(
        lambda run: run.summary["adaptation"]["points_rms_after_m"]
        < 0.95 * run.summary["adaptation"]["points_rms_before_m"],
        items=[SOON, "duration=4"],
    ),
    "acrobot_against_wind": of(held, sees_the_wind, items=["duration=0.5"]),
    "acrobot_broken_cable": of(
        lambda run: len(run.summary["failures"]["events"]) == 1,
        lambda run: np.any(run.log["tensions"][-20:].max(axis=0) == 0.0),
        closer,
        items=[
            SOON, "duration=2", "failures.events=[{kind: cable_breaks, time: 0.5, cable: 1}]",
        ],
    ),
    "acrobot_broken_redistributed": of(
        lambda run: run.summary["failures"]["reacts_at_s"] is not None,
        lambda run: np.sum(run.log["tensions"][-1] > 0.5) == 7,
        items=[
            SOON, "duration=1.5", "failures.events=[{kind: cable_breaks, time: 0.5, cable: 2}]",
        ],
    ),
    "acrobot_circles": of(turns_freely),
    "acrobot_circling_ring": of(follows),
    "acrobot_computed_torque": of(tracks),
    "acrobot_elastic": of(
        closer, has("applied_torques", "friction_torques"),
        lambda run: run.summary["simulated"]["cable_model"] == "elastic",
        lambda run: run.summary["simulated"]["pulleys"],
    ),
    "acrobot_eye_to_hand": of(lambda run: run.summary["outcome"] == "converged"),
    "acrobot_friction": of(
        closer, lambda run: np.max(np.abs(run.log["friction_torques"])) > 0.01
    ),
    "acrobot_fusion": of(closer, items=[SOON, "duration=2"]),
    "acrobot_hybrid": of(straight_in_image, straight_in_space),
    "acrobot_ibvs": of(straight_in_image),
    "acrobot_led_by_hand": of(
        lambda run: run.log["X_WP"][-1, 4] > run.log["X_WP"][0, 4] + 0.005,
        items=["duration=1"],
    ),
    "acrobot_mobile_robot": of(follows, has("tension_corrections")),
    "acrobot_moving_tag": of(follows, lambda run: run.end[0] < 1e-3),
    "acrobot_open_loop": of(
        lambda run: run.summary["controller"] == "open_loop",
        has("X_WP_planned", "X_WP_consecutive_images", "X_WP_cable_lengths", "X_WP_fusion"),
        lambda run: run.summary["plan_deviation_m"]["max"] < 0.01,
    ),
    "acrobot_pan_tilt": of(
        closer, lambda run: np.all(run.log["found"][-50:]), items=[SOON, "duration=4"]
    ),
    "acrobot_partitioned": of(closer),
    "acrobot_pbvs": of(closer),
    "acrobot_pbvs_line": of(straight_in_space),
    "acrobot_pbvs_taut": of(closer, taut),
    "acrobot_pbvs_textured": of(closer),
    "acrobot_perception": of(follows, items=[SOON, "duration=3"]),
    # All of it: tests/systems/pick_and_place/test_pick_and_place.py.
    "acrobot_pick_and_place": of(lambda run: "approach" in run.summary["phases"]),
    "acrobot_pulleys": of(closer, lambda run: run.summary["simulated"]["pulleys"]),
    "acrobot_pushed": of(
        closer, lambda run: run.summary["disturbances"]["largest_force_n"] > 1.0,
        items=[
            SOON, "duration=2",
            "disturbances.pushes=[{kind: wind, wind: [3.0, 1.0, 0.0], drag_area: 0.02}, "
            "{kind: push, start: 0.5, end: 0.7, force: [0, 1, 0], point: [0, 0, 0.05]}, "
            "{kind: payload, start: 1.0, mass: 0.04, point: [0.05, 0, 0]}]",
        ],
    ),
    "acrobot_sensors": of(
        closer, has("measured_tensions", "measured_lengths", "X_WP_measured", "X_WP_metrology")
    ),
    "acrobot_set_down": of(
        lambda run: run.log["tensions"][-1].sum() < 0.5 * run.log["tensions"][0].sum(),
        items=["duration=1", "initial_pose.position=[0, 0, 0.1]",
               "open_loop.waypoints=[{pose: {position: [0, 0, 0.09]}, duration: 0.8}]"],
    ),
    "acrobot_slack_start": of(slack_at_start, slack_at_end),
    "acrobot_slack_start_tca": of(slack_at_start, corrected),
    "acrobot_switching": of(closer, mode_goes_over),
    "acrobot_table_edge": of(
        lambda run: abs(run.summary["world"]["contact"]["final_force_n"] - 5.0) < 0.5,
        lambda run: run.log["X_WP"][-1, 5] > run.log["X_WP"][0, 5] + 0.005,
        items=["trajectory.pause=0.8", "duration=2"],
    ),
    "acrobot_torque_servo": of(
        slack_at_start, lambda run: run.summary["torque_control"]["taut_after_s"] is not None,
        items=[SOON, "duration=2"],
    ),
    "acrobot_trajectory": of(closer, straight_in_image),
    "cable_arm_computed_torque": of(lambda run: run.end[1] < 1e-4),
    "caroca_catenary": of(
        closer, taut, lambda run: run.summary["simulated"]["cable_model"] == "catenary",
        lambda run: run.summary["simulated"]["pulleys"],
    ),
    "caroca_circles": of(turns_freely, taut),
    "caroca_computed_torque": of(tracks),
    "caroca_hybrid": of(straight_in_image, straight_in_space, taut),
    "caroca_ibvs": of(straight_in_image, taut),
    "caroca_partitioned": of(closer, taut),
    "caroca_pbvs": of(closer, taut),
    "caroca_pbvs_line": of(straight_in_space, taut),
    "caroca_slack_start": of(
        slack_at_start, lambda run: run.summary["outcome"] == "target_lost"
    ),
    "caroca_slack_start_tca": of(
        slack_at_start, lambda run: np.max(-run.log["tension_corrections"]) > 0.0,
        lambda run: np.max(run.log["surplus_lengths"][-1]) < GONE,
    ),
    "caroca_switching": of(closer, mode_goes_over, taut),
    "caroca_world": of(
        closer, lambda run: run.summary["world"] is not None, items=[SOON, "duration=3"]
    ),
    "mobile_bases_winches": of(held),
    "planar_computed_torque": of(tracks),
    "planar_pbvs": of(closer),
}  # fmt: skip
"""By name. A new scenario has a row."""

assert set(TITLES) == set(scenario_names()), "each shipped scenario has a row, and no other"
