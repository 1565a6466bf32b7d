"""What the title of each shipped scenario names, as checks of a run's summary and log.

Runs have projected targets; a run that only a diagram can do is made short, with events that come
sooner.
"""

import numpy as np

from cdpr_drake.systems.scenarios.files import scenario_names

SLACK, GONE = 1.0, 0.05
"""Cable seconds of slack from which a run counts as slack, and cable lengths [m] as taken up."""

TRACKING = 1e-4
"""Promised distance from a feasible trajectory with the exact model [m]."""


def closer(run):
    """Converged, or, in a run that was cut, with a smaller error than before."""
    errors = np.linalg.norm(run.log["error"], axis=1)
    return run.summary["outcome"] == "converged" or errors[-1] < 0.95 * np.max(errors)


def straight_in_image(run):
    return closer(run) and run.summary["image_deviation_px_1600x1200"]["max"] < 30.0


def straight_in_space(run):
    return closer(run) and run.summary["camera_deviation_m"]["max"] < 0.05


def follows(run):
    """The target is seen all the time, and the platform goes along."""
    path = np.sum(np.linalg.norm(np.diff(run.log["X_WP"][:, 4:], axis=0), axis=1))
    return path > 0.1 and np.mean(run.log["found"]) > 0.99


def turns_freely(run):
    """The features are those of five motions, and the sixth is not brought to zero by them."""
    return closer(run) and run.scheme == "circles"


def slack_at_start(run):
    return np.sum(run.log["surplus_lengths"][0] > 0.02) >= 2


def slack_at_end(run):
    return np.sum(run.log["slack"][-1] > 0.0) >= 1 or run.summary["slack_cable_seconds"] > 20.0


def corrected(run):
    return np.max(-run.log["tension_corrections"]) > 0.0


def slack_gone_after_5_s(run):
    return np.max(run.log["surplus_lengths"][run.log["time"] > 5.0]) < GONE


def slack_gone(run):
    return np.max(run.log["surplus_lengths"][-1]) < GONE


def held(run):
    """Where it shall be, within a centimetre, all the time."""
    return run.end[0] < 0.01


def sees_the_wind(run):
    pushed, seen = run.log["applied_wrench"][-1, 3:], run.log["wrench_estimated"][-1, 3:]
    return np.linalg.norm(seen - pushed) < 0.5 * np.linalg.norm(pushed)


def tracks(run):
    return run.summary["position_error_m"]["max"] < TRACKING


def mode_goes_over(run):
    """By pose first, by image in the end, with the dots in the image all the while."""
    modes, seen = run.log["servo_mode"][:, 0], np.all(run.log["found"][2:])
    return run.summary["servo_switches"] > 0 and modes[1] != modes[-1] and seen


def taut(run):
    return run.summary["slack_cable_seconds"] < SLACK


def has(*columns):
    return lambda run: all(name in run.log for name in columns)


def simulated(**settings):
    return lambda run: run.summary["simulated"].items() >= settings.items()


CHECKS = [
    (closer, "acrobot_broken_cable acrobot_elastic acrobot_friction acrobot_fusion "
     "acrobot_pan_tilt acrobot_partitioned acrobot_pbvs acrobot_pbvs_taut acrobot_pbvs_textured "
     "acrobot_pulleys acrobot_pushed acrobot_sensors acrobot_switching acrobot_trajectory "
     "caroca_catenary caroca_partitioned caroca_pbvs caroca_switching caroca_world planar_pbvs"),
    (taut, "acrobot_pbvs_taut caroca_catenary caroca_circles caroca_hybrid caroca_ibvs "
     "caroca_partitioned caroca_pbvs caroca_pbvs_line caroca_switching"),
    (straight_in_image, "acrobot_hybrid acrobot_ibvs acrobot_trajectory caroca_hybrid caroca_ibvs"),
    (straight_in_space, "acrobot_hybrid acrobot_pbvs_line caroca_hybrid caroca_pbvs_line"),
    (follows, "acrobot_circling_ring acrobot_mobile_robot acrobot_moving_tag acrobot_perception"),
    (turns_freely, "acrobot_circles caroca_circles"),
    (mode_goes_over, "acrobot_switching caroca_switching"),
    (slack_at_start, "acrobot_slack_start acrobot_slack_start_tca acrobot_torque_servo "
     "caroca_slack_start caroca_slack_start_tca"),
    (slack_at_end, "acrobot_slack_start"),
    (corrected, "acrobot_slack_start_tca caroca_slack_start_tca"),
    (slack_gone_after_5_s, "acrobot_slack_start_tca"),
    (slack_gone, "caroca_slack_start_tca"),
    (held, "acrobot_against_wind mobile_bases_winches"),
    (sees_the_wind, "acrobot_against_wind"),
    (tracks, "acrobot_computed_torque caroca_computed_torque planar_computed_torque"),
    (simulated(pulleys=True), "acrobot_elastic acrobot_pulleys caroca_catenary"),
    (simulated(cable_model="elastic"), "acrobot_elastic"),
    (simulated(cable_model="catenary"), "caroca_catenary"),
    (has("applied_torques", "friction_torques"), "acrobot_elastic"),
    (has("tension_corrections"), "acrobot_mobile_robot"),
    (has("X_WP_planned", "X_WP_consecutive_images", "X_WP_cable_lengths", "X_WP_fusion"),
     "acrobot_open_loop"),
    (has("measured_tensions", "measured_lengths", "X_WP_measured", "X_WP_metrology"),
     "acrobot_sensors"),
    (lambda run: run.summary["adaptation"]["points_rms_after_m"]
     < 0.95 * run.summary["adaptation"]["points_rms_before_m"], "acrobot_adaptation"),
    (lambda run: len(run.summary["failures"]["events"]) == 1, "acrobot_broken_cable"),
    (lambda run: np.any(run.log["tensions"][-20:].max(axis=0) == 0.0), "acrobot_broken_cable"),
    (lambda run: run.summary["failures"]["reacts_at_s"] is not None,
     "acrobot_broken_redistributed"),
    (lambda run: np.sum(run.log["tensions"][-1] > 0.5) == 7, "acrobot_broken_redistributed"),
    (lambda run: run.summary["outcome"] == "converged", "acrobot_eye_to_hand"),
    (lambda run: np.max(np.abs(run.log["friction_torques"])) > 0.01, "acrobot_friction"),
    (lambda run: run.log["X_WP"][-1, 4] > run.log["X_WP"][0, 4] + 0.005, "acrobot_led_by_hand"),
    (lambda run: run.end[0] < 1e-3, "acrobot_moving_tag"),
    (lambda run: run.summary["controller"] == "open_loop", "acrobot_open_loop"),
    (lambda run: run.summary["plan_deviation_m"]["max"] < 0.01, "acrobot_open_loop"),
    (lambda run: np.all(run.log["found"][-50:]), "acrobot_pan_tilt"),
    # All of it: tests/systems/pick_and_place/test_pick_and_place.py.
    (lambda run: "approach" in run.summary["phases"], "acrobot_pick_and_place"),
    (lambda run: run.summary["disturbances"]["largest_force_n"] > 1.0, "acrobot_pushed"),
    (lambda run: run.log["tensions"][-1].sum() < 0.5 * run.log["tensions"][0].sum(),
     "acrobot_set_down"),
    (lambda run: abs(run.summary["world"]["contact"]["final_force_n"] - 5.0) < 0.5,
     "acrobot_table_edge"),
    (lambda run: run.log["X_WP"][-1, 5] > run.log["X_WP"][0, 5] + 0.005, "acrobot_table_edge"),
    (lambda run: run.summary["torque_control"]["taut_after_s"] is not None,
     "acrobot_torque_servo"),
    (lambda run: run.end[1] < 1e-4, "cable_arm_computed_torque"),
    (lambda run: run.summary["outcome"] == "target_lost", "caroca_slack_start"),
    (lambda run: run.summary["world"] is not None, "caroca_world"),
]  # fmt: skip
"""What is asked of a run, and of which scenarios. A new scenario is named at least once."""

SOON = "integration.engine=compiled"

SHORTER = {
    "acrobot_adaptation": [SOON, "duration=4"],
    "acrobot_against_wind": ["duration=0.5"],
    "acrobot_broken_cable": [
        SOON, "duration=2", "failures.events=[{kind: cable_breaks, time: 0.5, cable: 1}]",
    ],
    "acrobot_broken_redistributed": [
        SOON, "duration=1.5", "failures.events=[{kind: cable_breaks, time: 0.5, cable: 2}]",
    ],
    "acrobot_fusion": [SOON, "duration=2"],
    "acrobot_led_by_hand": ["duration=1"],
    "acrobot_pan_tilt": [SOON, "duration=4"],
    "acrobot_perception": [SOON, "duration=3"],
    "acrobot_pushed": [
        SOON, "duration=2",
        "disturbances.pushes=[{kind: wind, wind: [3.0, 1.0, 0.0], drag_area: 0.02}, "
        "{kind: push, start: 0.5, end: 0.7, force: [0, 1, 0], point: [0, 0, 0.05]}, "
        "{kind: payload, start: 1.0, mass: 0.04, point: [0.05, 0, 0]}]",
    ],
    "acrobot_set_down": [
        "duration=1", "initial_pose.position=[0, 0, 0.1]",
        "open_loop.waypoints=[{pose: {position: [0, 0, 0.09]}, duration: 0.8}]",
    ],
    "acrobot_table_edge": ["trajectory.pause=0.8", "duration=2"],
    "acrobot_torque_servo": [SOON, "duration=2"],
    "caroca_world": [SOON, "duration=3"],
}  # fmt: skip
"""What makes a run of its own short."""

NAMED = {name for _, names in CHECKS for name in names.split()}
assert set(scenario_names()) == NAMED, "each shipped scenario has a check, and no other"
