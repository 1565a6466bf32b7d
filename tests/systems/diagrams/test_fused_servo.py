"""A servo on the fused pose: what is refused, what is wired, what a covered camera does to it."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.systems.diagrams.calibration_findings import calibration_facts, found_calibrations
from cdpr_drake.systems.diagrams.load import load_scenario

COMPILED = ["integration.engine=compiled", "log_rate=25"]
FUSION = "estimator.sensor_fusion"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["estimator.platform_tag=null", "estimator.compare=[]"], "estimator.platform_tag"),
        ([f"{FUSION}.imu=true"], "sensors.imu"),
        ([f"{FUSION}.on_board=false"], "told_object: found none"),
        ([f"{FUSION}.external=false", f"{FUSION}.external_depth=kinect"], "external_depth: found"),
        (["camera.kind=rendered"], "camera.fault"),
        (["estimator.platform_tag.rate=99"], "platform_tag.rate: found 99; accepted: at most 30"),
        (["target.motion={velocity: [0.01, 0, 0]}"], "does not rest"),
        (["robot=planar"], "planar"),
        (
            [f"{FUSION}.{s}=false" for s in ("on_board", "external", "lengths", "steer")],
            "found no source",
        ),
        (
            [f"{FUSION}.external_doubt={{position: 0.003}}"],
            "external_doubt.position: found 0.003; accepted: more than external_position",
        ),
    ],
)
def test_what_is_not_there_is_refused_by_name(changes, words):
    with pytest.raises(ScenarioError, match="accepted") as refused:
        load_scenario("acrobot_fusion", changes)
    assert words in str(refused.value)
    assert all(len(line) <= 500 for line in str(refused.value).splitlines())


@pytest.fixture(scope="module", params=[False, True], ids=["asked for", "by IMU"])
def covered(request):
    """The camera on board is covered from the third image on; all other sources are there."""
    changes = [
        *COMPILED,
        "duration=1.0",
        "estimator.compare=[control_integration]",
        "camera.fault={kind: dead, start: 0.08, duration: 9}",
        f"{FUSION}.external_depth=kinect",
        f"{FUSION}.on_board_depth=ideal",
    ]
    if request.param:
        changes += ["sensors.imu={type: adis16448}", f"{FUSION}.imu=true"]
    return run_scenario(load_scenario("acrobot_fusion", changes)).log


def test_it_says_which_sources_it_used(covered):
    sources = covered["fusion_sources"]
    assert sources.shape[1] == 5
    on_board, external, lengths, _, depth = sources[2:].T
    assert np.all(on_board[2:] == 0.0)
    assert np.mean(external == 1.0) > 0.9
    assert np.all(lengths > 0.5)
    assert np.mean(depth > 0.7) > 0.9
    assert np.nanmean(covered["fusion_nis"][2:, 1]) < 3.0
    deviations = np.sqrt(np.diagonal(covered["fusion_covariance"][2:].reshape(-1, 6, 6), 0, 1, 2))
    assert np.all((deviations > 1e-5) & (deviations < 0.05))


def test_the_servo_goes_on_while_its_camera_is_covered(covered):
    assert not np.any(covered["found"][4:])
    speed = np.linalg.norm(covered["platform_velocity"][5:, 3:], axis=1)
    assert np.min(speed) > 0.01


def test_the_fused_pose_is_better_than_what_was_asked_for(covered):
    fused, _ = pose_rows_distance(covered["X_WP"], covered["X_WP_estimated"])
    asked, _ = pose_rows_distance(covered["X_WP"], covered["X_WP_control_integration"])
    assert np.mean(fused[5:]) < np.mean(asked[5:])


def test_without_doubt_it_says_how_a_calibration_fits(covered):
    found = found_calibrations(covered["fusion_calibration"][-1])
    assert {one["probability_worse"] for one in found.values()} == {None}
    assert all(one["judged"] in ("as told", "nothing learnt") for one in found.values())
    assert 1e-4 < found["external"]["position_deviation_m"] < 0.01
    assert len(calibration_facts(found)) == 2


DOUBTED = [
    *COMPILED, "duration=1.0", "estimator.compare=[]", "camera.fault=null",
    f"{FUSION}.on_board_doubt={{}}", f"{FUSION}.external_doubt={{position: 0.05, rotation_deg: 3}}",
]  # fmt: skip


def run_doubted(*changes):
    """What is found of both cameras, and the estimate's largest error but for the start [m]."""
    log = run_scenario(load_scenario("acrobot_fusion", [*DOUBTED, *changes])).log
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    return found_calibrations(log["fusion_calibration"][-1]), np.max(distance[5:])


def test_a_camera_in_the_world_that_is_wrong_is_found_and_does_no_harm():
    """6 cm and 2 deg wrong from the start, which two right sources contradict: the start, wrong by
    1 cm, and the target's first image say nothing of it, so the pose stays as good as the start."""
    changes = ["perturbations.external_camera_shift={distance: 0.06, angle_deg: 2}"]
    found, largest = run_doubted(*changes)
    assert found["external"]["judged"] == "worse than told"
    assert found["external"]["probability_worse"] > 0.95
    assert found["on_board"]["judged"] != "worse than told"
    assert abs(found["external"]["position_m"] - 0.06) < 0.03
    assert largest < 0.015
    # Nobody doubts it: the same camera takes the pose with it, and the summary says that it or
    # something else does not fit.
    trusted, with_it = run_doubted(*changes, f"{FUSION}.external_doubt=null", f"{FUSION}.gate=0")
    assert with_it > 2.0 * largest
    assert trusted["external"]["judged"] == "does not fit"


def test_a_camera_that_is_knocked_under_way_is_calibrated_anew():
    """Its doubt is settled then: what was told of it is forgotten."""
    knock = "{kind: off, start: 0.2, duration: 9, offset: [0.02, 0.02, 0.0], angles_deg: [0, 1, 0]}"
    found, largest = run_doubted(f"estimator.platform_tag.fault={knock}", f"{FUSION}.patience=0.3")
    assert found["external"]["probability_worse"] == 1.0
    assert 0.01 < found["external"]["position_m"] < 0.06
    assert largest < 0.015
