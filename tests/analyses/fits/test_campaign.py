import json

import numpy as np
import pytest

from cdpr_drake.analyses.fits.campaign import (
    Scene,
    calibrate_campaign,
    calibrated,
    calibrated_scenario,
    point_errors,
    record,
)
from cdpr_drake.analyses.fits.poses import rest_poses
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE, write_run_inputs
from cdpr_drake.errors import CalibrationError, OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.load import load_scenario

CHANGES = (
    "camera.kind=projected", "perturbations.exit_points=0.01", "integration.engine=compiled",
)  # fmt: skip


@pytest.fixture(scope="module")
def campaign():
    scene = Scene.of(load_scenario("acrobot_pbvs_line", CHANGES))
    recorded = record(scene, scene.telling_poses(12))
    return scene, recorded, calibrated(scene, recorded)


def test_a_campaign_with_slack_cables_and_one_tag_makes_the_robot_better(campaign):
    scene, recorded, calibration = campaign
    assert np.isnan(recorded.log.lengths).any()  # slack cables tell nothing
    assert 0 < np.max(recorded.misses) < 0.1
    errors = point_errors(scene, calibration)
    assert errors["exit_points_before_m"] == pytest.approx(0.01)
    assert errors["exit_points_after_m"] < 0.006
    assert calibration.result.spread() < 1.5


def test_the_servo_believes_what_was_found_and_all_is_written(tmp_path):
    scenario, out = load_scenario("acrobot_pbvs_line", CHANGES), tmp_path / "out"
    found = calibrate_campaign(scenario, poses=8, propose=3, folder=out)
    told = json.loads((out / "results.json").read_text())
    assert json.loads(json.dumps(found.as_dict())) == told
    assert found.folder == out
    assert list(told["servo"]) == ["believed before", "calibrated", "true"]
    assert len(read_path(out / "next_poses.csv").poses) == 3 == len(told["next_poses"]["poses"])
    again = load_scenario(str(out / "scenario.yaml"))
    assert again.perturbations.believed_robot == str(out / BELIEVED_FILE)
    assert {path.stem for path in out.glob("*.png")} == {"calibration", "correlation"}
    assert not (out / "inputs.json").exists()  # the robot that was found is no file of the user
    assert "calibrated" in repr(found)
    with pytest.raises(OutputFolderError, match="add overwrite"):
        calibrate_campaign(scenario, poses=8, folder=out)


def test_a_campaign_goes_where_it_is_sent(campaign):
    scene, recorded, _ = campaign
    goals = recorded.poses[:7]
    again = record(scene, goals)
    assert again.log.count <= len(goals)
    assert np.max(again.misses) < 0.1
    with pytest.raises(CalibrationError, match="accepted: at least 6, of more poses"):
        record(scene, goals[:2])


def test_the_first_pose_is_that_of_the_lengths_and_errors_that_remain_stay(campaign):
    scenario = calibrated_scenario(*campaign, "acrobot_small")
    assert scenario.perturbations.exit_points == 0.0
    believed = scenario.perturbations.initial_pose.position
    assert np.linalg.norm(believed - campaign[0].scenario.initial_pose.position) < 0.05


def test_a_run_keeps_the_robot_that_was_believed(tmp_path):
    scenario = load_scenario("acrobot_pbvs", ["perturbations.believed_robot=acrobot_small"])
    write_run_inputs(tmp_path, scenario, load_robot("acrobot_small"))
    again = load_scenario(str(tmp_path / "scenario.yaml"))
    assert again.perturbations.believed_robot == str(tmp_path / BELIEVED_FILE)
    robot = load_robot(again.robot)
    np.testing.assert_array_equal(believed_robot(again, robot).cables.p_WA, robot.cable_set().p_WA)


def test_a_target_without_tags_is_refused():
    scenario = load_scenario("acrobot_pbvs_line", CHANGES)
    scenario.target.kind = "circles"
    with pytest.raises(CalibrationError, match="accepted: a tag or tag_bundle that rests"):
        calibrate_campaign(scenario, poses=6)


def test_poses_of_rest_are_held_by_tensions_within_the_limits():
    robot = load_robot("acrobot_small")
    poses, tensions = rest_poses(robot, 4, np.random.default_rng(0))
    assert len(poses) == 4
    assert np.all(tensions >= 0.01 * robot.platform.mass * robot.gravity * (1 - 1e-9))
    with pytest.raises(CalibrationError, match="accepted: at least 1"):
        rest_poses(robot, 1, np.random.default_rng(0), least=59.0)
