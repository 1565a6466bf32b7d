"""A loop is its diagram: the same numbers at the same times, for all schemes and estimators."""

import numpy as np
import pytest

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.systems.monitoring.run_monitor import Outcome

ROUNDING = 1e-15
"""The loop's quaternions are computed from matrices by another kernel than Drake's; no other number
of a log differs, but where kernels search: their search begins where the last one ended."""

CATENARY_TENSION, CATENARY_PATH = 2e-3, 1e-7
"""The same of catenaries [N, m], which are searched from the last ones; of a diagram they are those
of its warm-up."""

KNOWN_TAG = (
    "estimator.known_tag={tag_id: 5, size: 0.08, period: 0.2, "
    "pose: {position: [0.1, 0.1, 0], angles_deg: [0, 0, 0]}}"
)
NEED_SECOND_CAMERA = ("eye_to_hand", "sensor_fusion")
"""Estimators that only a diagram can do, as `diagram_reason` says: their camera is a second one."""

SENSORS = ("sensors.log=[tension, encoder, tracker]", "sensors.tension=tractel")


def both(name, *overrides, duration=0.5):
    common = ["camera.kind=projected", "integration.engine=compiled", f"duration={duration}"]
    return tuple(
        ServoRun(load_scenario(name, [*common, f"integration.loop={loop}", *overrides])).simulate()
        for loop in ("diagram", "compiled")
    )


def same(diagram, loop, tolerance=ROUNDING):
    assert (diagram.loop, loop.loop) == ("diagram", "compiled")
    assert (diagram.outcome, diagram.sim_time) == (loop.outcome, loop.sim_time)
    assert list(diagram.log) == list(loop.log)
    for name, values in diagram.log.items():
        assert values.shape == loop.log[name].shape
        np.testing.assert_allclose(loop.log[name], values, rtol=0.0, atol=tolerance, err_msg=name)
    if tolerance == ROUNDING:
        np.testing.assert_array_equal(diagram.step_errors, loop.step_errors)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("acrobot_pbvs", ["camera.rate=30", "camera.latency_frames=2", "log_rate=70"]),
        ("acrobot_pbvs_line", ["next_tasks=[{time: 0.2, desired: {position: [0, 0, 0.2], "
                               "angles_deg: [180, 0, 180]}}]"]),
        ("acrobot_hybrid", ["controller.free_rotation=true"]),
        ("acrobot_ibvs", ["perturbations.image_bias=[2, -1]"]),
        ("acrobot_circles", []),
        ("acrobot_partitioned", ["controller.partition={edge_distance: 60, goal: turned}"]),
        ("acrobot_switching", ["controller.switching={bound_ratio: 1.01, first: pose}"]),
        ("acrobot_moving_tag", ["controller.compensation=constant_velocity"]),
        ("acrobot_eye_to_hand", []),
        ("acrobot_trajectory", []),
        ("acrobot_open_loop", []),
        ("acrobot_friction", []),
        ("acrobot_slack_start_tca", []),
        ("acrobot_slack_start_tca", ["perturbations.slack_at_rest=true"]),
        ("acrobot_mobile_robot", ["tension_management.rate=512", "log_rate=30"]),
        ("planar_pbvs", []),
    ],
)  # fmt: skip
def test_every_scheme_gives_its_diagram_s_numbers(name, overrides):
    same(*both(name, *overrides))


@pytest.mark.parametrize("kind", [kind for kind in ESTIMATORS if kind not in NEED_SECOND_CAMERA])
def test_every_estimator_gives_its_diagram_s_numbers(kind):
    same(*both("acrobot_sensors", f"estimator.kind={kind}", KNOWN_TAG, SENSORS[0], duration=0.5))


def test_catenaries_differ_by_what_their_search_leaves():
    diagram, loop = both("caroca_catenary", duration=0.2)
    path = np.abs(diagram.log["X_WP"] - loop.log["X_WP"])
    assert np.max(path) < CATENARY_PATH
    assert np.max(np.abs(diagram.log["tensions"] - loop.log["tensions"])) < CATENARY_TENSION


@pytest.mark.parametrize(
    ("changes", "duration", "outcome"),
    [
        ((), 20.0, Outcome.CONVERGED),
        (("target.motion={velocity: [1.0, 0, 0]}", "stop.target_lost=0.1"), 2.0,
         Outcome.TARGET_LOST),
    ],
)  # fmt: skip
def test_a_run_ends_at_the_same_time(changes, duration, outcome):
    diagram, loop = both("acrobot_pbvs", *changes, duration=duration)
    assert diagram.outcome == outcome
    same(diagram, loop)
