"""A servo on the fused pose: what is refused, what is wired, what a covered camera does to it."""

import numpy as np
import pytest

from cdpr_drake.analyses.runs import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.spatial import pose_rows_distance
from cdpr_drake.systems.diagrams import load_scenario

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
