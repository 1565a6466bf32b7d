import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.fits import identify_campaign as campaign
from cdpr_drake.analyses.fits.dynamics import IdentificationTask, fit_dynamics
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario

SHORT = ("trajectory.pause=0.2", "duration=3.0", "integration.engine=compiled")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign of eight poses, whose robot tracks one stretch."""
    kept, campaign.POSES = campaign.POSES, 8
    try:
        scenario = load_scenario("acrobot_computed_torque", SHORT)
        first = replace(scenario.trajectory.stretches[0], duration=1.5)
        scenario.trajectory.stretches = [first]
        folder = tmp_path_factory.mktemp("campaigns") / "one"
        run = campaign.identify_campaign(scenario, folder=folder)
    finally:
        campaign.POSES = kept
    return folder, run


def test_it_is_written_and_shows_itself(folder):
    place, run = folder
    assert run.folder == place
    assert run.fits
    assert not run.failed
    assert json.loads(json.dumps(run.as_dict())) == json.loads((place / "results.json").read_text())
    assert {path.stem for path in place.glob("*.png")} == {"validation", "parameters", "tracking"}
    assert "Tracking of acrobot_computed_torque" in repr(run)
    assert load_robot(str(place / "robot.yaml")).platform.mass == run.model.platform.mass
    with pytest.raises(CdprError, match="found 'trackin'; did you mean tracking"):
        run.plot("trackin")


def test_tracking_is_that_of_the_true_robot_with_what_was_found(folder):
    tracking = folder[1].source.tracking
    before, found, true = (tracking[w]["mean_m"] for w in ("believed before", "identified", "true"))
    assert found < 0.02 * before
    assert found < 1.2 * true


def test_parameters_are_found_and_another_motion_is_explained(folder):
    said = json.loads((folder[0] / "results.json").read_text())
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


def test_the_logs_that_it_leaves_say_the_same(folder):
    place, run = folder
    believed = load_robot(str(place / "believed_robot.yaml"))
    log = read_measurements(place / "excitation.csv", [cable.name for cable in believed.cables])
    task = IdentificationTask(
        robot=believed, unknown=run.source.identification.task.unknown, pulleys=False,
        sigma_lengths=campaign.SIGMA_LENGTHS,
    )  # fmt: skip
    again = fit_dynamics(task, log, bandwidth=campaign.BANDWIDTH)
    first = run.result
    assert np.max(np.abs(again.result.values - first.values) / first.std) < 1e-6


def test_its_scenario_runs_with_the_robot_that_was_found(folder):
    path = str(folder[0] / "scenario.yaml")
    changes = ("integration.engine=compiled", "duration=1.0")
    good = TensionRun(load_scenario(path, changes)).simulate()
    belief = f"perturbations.believed_robot={folder[0] / 'believed_robot.yaml'}"
    bad = TensionRun(load_scenario(path, (*changes, belief))).simulate()

    def off(run):
        return np.linalg.norm((run.log["X_WP"] - run.log["X_WP_desired"])[:, 4:], axis=1)

    # Ideal tensions: only the platform and its distribution are believed.
    assert np.max(off(good)) < 0.05 * np.max(off(bad))


def test_beliefs_beside_predictive_control_are_refused(folder):
    wrong = f"perturbations.believed_robot={folder[0] / 'robot.yaml'}"
    with pytest.raises(ScenarioError, match="believed_robot: found beside predictive"):
        load_scenario("acrobot_computed_torque", (wrong, "predictive.steps=5"))
