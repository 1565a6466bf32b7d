"""Simulated campaigns: robots that are calibrated or identified, and used with what was found."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.fits import campaign as fits_campaign
from cdpr_drake.analyses.fits import identify_campaign
from cdpr_drake.analyses.fits.campaign import (
    Scene,
    calibrate_campaign,
    calibrated,
    calibrated_scenario,
    point_errors,
    record,
)
from cdpr_drake.analyses.fits.dynamics import IdentificationTask, fit_dynamics
from cdpr_drake.analyses.fits.robots import rest_poses
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.analyses.planning.path_files import read_path
from cdpr_drake.analyses.reporting.provenance import BELIEVED_FILE
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import CalibrationError, CdprError, OutputFolderError
from cdpr_drake.geometry.poses import place_error
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

COMMAND = Follow(results=Path("runs"))
"""Of a command: results in a folder are read again."""

# Calibration.

CHANGES = (
    "camera.kind=projected", "perturbations.exit_points=0.01", "integration.engine=compiled",
)  # fmt: skip


@pytest.fixture(scope="module")
def campaign():
    scene = Scene.of(load_scenario("acrobot_pbvs_line", CHANGES))
    recorded = record(scene, scene.telling_poses(12))
    return scene, recorded, calibrated(scene, recorded)


def misses(recorded):
    """Distances of the platform from where it was sent [m]."""
    return list(map(place_error, recorded.poses, recorded.goals))


def test_a_campaign_with_slack_cables_and_one_tag_makes_the_robot_better(campaign):
    scene, recorded, calibration = campaign
    assert np.isnan(recorded.log.lengths).any()  # slack cables tell nothing
    assert 0 < np.max(misses(recorded)) < 0.1
    errors = point_errors(scene, calibration)
    assert errors["exit_points_before_m"] == pytest.approx(0.01)
    assert errors["exit_points_after_m"] < 0.006
    assert calibration.result.spread() < 1.5


def test_the_servo_believes_what_was_found_and_all_is_written(tmp_path, monkeypatch):
    scenario, out = load_scenario("acrobot_pbvs_line", CHANGES), tmp_path / "out"
    fit = calibrate_campaign(scenario, poses=8, propose=3, folder=out)
    said = json.loads((out / "results.json").read_text())
    assert json.loads(json.dumps(fit.as_dict())) == said
    assert fit.folder == out
    assert list(said["servo"]) == ["believed before", "calibrated", "true"]
    assert len(read_path(out / "next_poses.csv").poses) == 3 == len(said["next_poses"]["poses"])
    again = load_scenario(str(out / "scenario.yaml"))
    assert again.perturbations.believed_robot == str(out / BELIEVED_FILE)
    assert {path.stem for path in out.glob("*.png")} == {"calibration", "correlation"}
    assert not (out / "inputs.json").exists()  # the robot that was found is no file of the user
    assert "calibrated" in repr(fit)
    with pytest.raises(OutputFolderError, match="poses is 8 there, 9 here"):
        calibrate_campaign(scenario, poses=9, propose=3, folder=out)
    with monkeypatch.context() as patch:
        patch.delattr(fits_campaign, "record")
        again = calibrate_campaign(scenario, poses=8, propose=3, folder=out, follow=COMMAND)
    assert json.loads(json.dumps(again.as_dict())) == said
    assert repr(again) == repr(fit)


def test_a_campaign_goes_where_it_is_sent(campaign):
    scene, recorded, _ = campaign
    goals = recorded.poses[:7]
    again = record(scene, goals)
    assert again.log.count <= len(goals)
    assert np.max(misses(again)) < 0.1
    with pytest.raises(CalibrationError, match="accepted: at least 6, of more poses"):
        record(scene, goals[:2])


def test_the_first_pose_follows_from_the_lengths_and_errors_that_remain_stay(campaign):
    scenario = calibrated_scenario(*campaign, "acrobot_small")
    assert scenario.perturbations.exit_points == 0.0
    believed = scenario.perturbations.initial_pose.position
    assert np.linalg.norm(believed - campaign[0].scenario.initial_pose.position) < 0.05


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


# Identification.

SHORT = ("trajectory.pause=0.2", "duration=3.0", "integration.engine=compiled")


def short_scenario():
    scenario = load_scenario("acrobot_computed_torque", SHORT)
    scenario.trajectory.stretches = [replace(scenario.trajectory.stretches[0], duration=1.5)]
    return scenario


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """A campaign of eight poses, whose robot tracks one stretch; its folder and its numbers."""
    folder = tmp_path_factory.mktemp("campaigns") / "one"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify_campaign, "POSES", 8)
        fit = identify_campaign.identify_campaign(short_scenario(), folder=folder)
    return folder, fit, json.loads((folder / "results.json").read_text())


def test_it_is_written_and_shows_itself(identified):
    folder, fit, said = identified
    assert fit.folder == folder
    assert fit.fits
    assert not fit.failed
    assert json.loads(json.dumps(fit.as_dict())) == said
    assert {path.stem for path in folder.glob("*.png")} == {"validation", "parameters", "tracking"}
    assert "Tracking of acrobot_computed_torque" in repr(fit)
    robot = load_robot(str(folder / "robot.yaml"))
    assert robot.platform.mass == fit.model.platform.mass
    stiffness = [u.value for u in fit.unknowns if u.name.endswith("stiffness")]
    np.testing.assert_allclose(robot.stiffness(), stiffness, rtol=1e-9)
    with pytest.raises(CdprError, match="found 'trackin'; did you mean tracking"):
        fit.plot("trackin")


def test_it_is_read_again(identified, monkeypatch):
    folder, fit, said = identified
    monkeypatch.delattr(identify_campaign, "simulate_campaign")
    again = identify_campaign.identify_campaign(short_scenario(), folder=folder, follow=COMMAND)
    assert json.loads(json.dumps(again.as_dict())) == said
    assert repr(again) == repr(fit)


def test_the_true_robot_tracks_as_well_with_what_was_found(identified):
    tracking = identified[2]["campaign"]["tracking"]
    before, after, true = (tracking[w]["mean_m"] for w in ("believed before", "identified", "true"))
    assert after < 0.02 * before
    assert after < 1.2 * true


def test_parameters_are_found_and_another_motion_is_explained(identified):
    said = identified[2]
    for one in said["parameters"]:
        what = one["name"].partition(".")[0]
        if what in ("mass", "center_of_mass", "inertia") or one["name"].endswith("stiffness"):
            assert abs(one["value"] - one["true"]) < 4.0 * one["std"], one["name"]
        elif "true" in one and one["name"].endswith("coulomb"):
            # Turning motors are smoothed: friction is off by more than its noise.
            assert one["value"] == pytest.approx(one["true"], rel=0.06), one["name"]
    outside = said["log_not_fitted"]
    assert outside["identified"]["force_n"] < 0.1 * outside["believed"]["force_n"]
    assert said["residuals_over_sigma"] == pytest.approx(1.0, abs=0.25)


def test_the_logs_that_it_leaves_say_the_same(identified):
    folder, fit, _ = identified
    believed = load_robot(str(folder / "believed_robot.yaml"))
    log = read_measurements(folder / "excitation.csv", [cable.name for cable in believed.cables])
    task = IdentificationTask(
        robot=believed, unknown=fit.source.task.unknown, pulleys=False,
        sigma_lengths=identify_campaign.SIGMA_LENGTHS,
    )  # fmt: skip
    again = fit_dynamics(task, log, bandwidth=identify_campaign.BANDWIDTH).result
    assert np.max(np.abs(again.values - fit.result.values) / fit.result.std) < 1e-6


def test_its_scenario_runs_with_the_robot_that_was_found(identified):
    folder = identified[0]
    belief = f"perturbations.believed_robot={folder / 'believed_robot.yaml'}"

    def largest_error(*changes):
        changes = ("integration.engine=compiled", "duration=1.0", *changes)
        log = TensionRun(load_scenario(str(folder / "scenario.yaml"), changes)).simulate().log
        return np.max(np.linalg.norm((log["X_WP"] - log["X_WP_desired"])[:, 4:], axis=1))

    # Ideal tensions: only the platform and its distribution are believed.
    assert largest_error() < 0.05 * largest_error(belief)
