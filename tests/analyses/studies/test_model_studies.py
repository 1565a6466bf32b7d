"""Studies of calibrations, of identification and of learning: trials in short, and verdicts."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.studies import adaptation, identification
from cdpr_drake.analyses.studies.calibration import statements as of_calibration
from cdpr_drake.analyses.studies.calibration import study as calibration
from cdpr_drake.analyses.studies.calibration import trials
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.models.robot_loader import load_robot
from tests.analyses.studies.made_up_studies import check_told_apart_and_written, made, verdicts
from tests.figure_faults import figure_faults

STRAIGHT = {"true": 2.8e-4, "believed before": 5e-3, "calibrated": 2.9e-4}
KINDS = ("CAMERA", "HALF_SIZE", "SERVO", "TRACKER", "START")
CAMERA, HALF_SIZE, SERVO, TRACKER, START = (getattr(of_calibration, kind) for kind in KINDS)


@pytest.fixture(scope="module")
def rows():
    """One seed of each kind, with poses at random; the servo is what `cdpr study` found."""
    with pytest.MonkeyPatch.context() as patch:
        poses, _ = rest_poses(load_robot(trials.ROBOT), 25, np.random.default_rng(0))
        patch.setattr(trials, "POSES", 25)
        patch.setattr(trials, "START_POSES", 25)
        patch.setattr(trials, "designed_poses", lambda: tuple(poses))
        patch.setattr(calibration, "straightness", lambda trial: STRAIGHT)
        return {
            kind: calibration.measure(Case(name=kind, keys={"kind": kind}), 0)
            for kind in (CAMERA, HALF_SIZE, SERVO, TRACKER, START)
        }


def test_points_come_back_and_are_as_sure_as_they_say(rows):
    found = rows[CAMERA]
    assert found["exit_points_m"] < 2e-3  # it was 10 mm
    assert found["anchor_points_m"] < 1.5e-3  # it was 5 mm
    assert 0.5 < found["errors_chi_square"] / found["errors_degrees"] < 1.6
    assert found["errors_chi_square_straight"] != found["errors_chi_square"]
    assert 0.8 < found["residuals_chi_square"] / found["residuals_degrees"] < 1.2
    assert rows[HALF_SIZE]["whole_chi_square"] == found["errors_chi_square"]
    assert rows[TRACKER]["errors_over_bound"].shape == (48,)
    assert np.sqrt(np.mean(rows[TRACKER]["errors_over_bound"] ** 2)) < 2.0
    assert rows[SERVO] == {"straightness_m": STRAIGHT}


def test_the_start_is_found_by_winches_and_tensions(rows):
    found = rows[START]
    assert found["distance_m"] < 4.0 * found["distance_std_m"] < 0.04
    assert found["angle_deg"] < 4.0 * found["angle_std_deg"] < 8.0
    assert found["distance_m"] < of_calibration.START_WITHIN
    assert found["angle_deg"] < of_calibration.TURN_WITHIN


@pytest.fixture(scope="module")
def noise():
    """Two seeds of identification with six poses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identification, "POSES", 6)
        return [identification.noise_trial(seed) for seed in range(2)]


def test_errors_are_as_the_covariance_and_the_bound_say(noise):
    found = {name: np.array([one[name] for one in noise]) for name in noise[0]}
    assert 2.0 < np.mean(found["squares"]) < 24.0  # chi-square of ten, twice
    assert np.sqrt(np.mean((found["errors"] / found["bound"]) ** 2)) < 2.0
    # What is reported of one log is what the truth gives, but for the noise of its noise levels.
    np.testing.assert_allclose(found["std"], found["bound"], rtol=0.25)
    assert np.median(found["random_bound"] / found["bound"]) > 1.2
    assert found["errors"].shape == (2, len(identification.NAMES))


CALIBRATED = {
    "exit_points_m": 9e-4, "anchor_points_m": 4e-4, "errors_chi_square": 60.0,
    "errors_chi_square_straight": 70.0, "errors_degrees": 60, "residuals_chi_square": 900.0,
    "residuals_degrees": 900, "whole_chi_square": 60.0, "whole_chi_square_straight": 70.0,
    "half_chi_square": 60.0, "half_chi_square_straight": 62.5, "errors_over_bound": np.ones(48),
    "distance_m": 5e-3, "distance_std_m": 5e-3, "angle_deg": 1.0, "angle_std_deg": 1.0,
    "straightness_m": STRAIGHT,
}  # fmt: skip
"""Of all kinds of trials."""


def misfit(force, moment):
    kept = {"length_m": 1e-5, "friction_nm": float("nan")}
    return {"force_n": force, "moment_nm": moment, **kept}


def misfits(moment):
    return {"identified": misfit(0.12, moment), "believed": misfit(5.0, 0.2)}


TEN = np.ones(len(identification.NAMES)).tolist()
IDENTIFIED = {
    "errors": TEN, "std": TEN, "bound": TEN, "random_bound": [2.0] * len(TEN), "squares": 10.0,
    "spread": 1.0, "tracking_m": [0.02, 8e-5, 7.5e-5], "tracking_rad": [0.1, 1e-3, 1e-3],
    "misfit_fitted": misfits(0.01), "misfit_validated": misfits(0.01), "platform": TEN,
}  # fmt: skip
"""Of both kinds of trials."""

GOOD = {"calibration": CALIBRATED, "identification": IDENTIFIED}


def study(one, quick=False, first=None, **every):
    """Three seeds of made-up numbers; those of the first one may differ."""

    def made_up(case, seed):
        return GOOD[one.name] | every | ((first or {}) if seed == 0 else {})

    return made(one, made_up, quick, seeds=3)


def test_calibrations_are_judged_tabled_and_written(tmp_path):
    found = study(calibration.STUDY)
    assert list(verdicts(found).values()) == ["confirmed"] * 7
    assert len(found.tables()) == 2
    assert found.write(tmp_path) == {}
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["parameters"]["START_OFF"] == 0.3
    assert (tmp_path / "calibration.png").is_file()


@pytest.mark.parametrize("quick", [False, True])
def test_identifications_are_judged_tabled_and_written(quick, tmp_path):
    found = study(identification.STUDY, quick)
    assert verdicts(found) == dict.fromkeys(
        ("covariance", "bound", "designed", "outside", "tracking"), "confirmed"
    )
    campaigns = 1 if quick else 3
    assert found.runs.counts("kind") == {
        identification.NOISE: 3, identification.CAMPAIGN: campaigns
    }  # fmt: skip
    assert len(found.tables()) == 2
    drawn = identification.figure(found.runs)
    assert figure_faults(drawn) == []
    assert all("[" in axes.get_ylabel() for axes in drawn.axes)
    assert found.write(tmp_path) == {}
    assert (tmp_path / "identification.png").exists()


@pytest.mark.parametrize(
    ("one", "name", "words", "changes"),
    [
        (calibration, "points", "not confirmed", {"exit_points_m": 1.1e-3}),
        (calibration, "covariance", "in part (1 of 2)", {"residuals_chi_square": 985.0}),
        (calibration, "covariance", "not confirmed", {"residuals_chi_square": 1000.0}),
        (calibration, "curvature", "not confirmed", {"half_chi_square_straight": 65.1}),
        (calibration, "curvature", "not confirmed", {"whole_chi_square_straight": 59.0}),
        (calibration, "bound", "not confirmed", {"errors_over_bound": np.full(48, 1.21)}),
        (calibration, "start", "in part (2 of 3)", {"first": {"angle_deg": 2.1}}),
        (calibration, "told", "not confirmed", {"first": {"distance_std_m": 1.5e-3}}),
        (calibration, "servo", "in part (2 of 3)",
         {"first": {"straightness_m": STRAIGHT | {"true": 1e-4}}}),
        (identification, "covariance", "not confirmed", {"squares": 20.0}),
        (identification, "bound", "not confirmed", {"errors": [1.21] * len(TEN)}),
        (identification, "designed", "in part", {"random_bound": [1.4] * len(TEN)}),
        (identification, "designed", "not confirmed", {"random_bound": [0.9] * len(TEN)}),
        (identification, "outside", "in part (2 of 3)",
         {"first": {"misfit_validated": misfits(0.016)}}),
        (identification, "tracking", "in part (2 of 3)",
         {"first": {"tracking_m": [0.02, 9.1e-5, 7.5e-5]}}),
        (identification, "tracking", "not confirmed", {"tracking_m": [0.02, 9.1e-5, 7.5e-5]}),
    ],
)  # fmt: skip
def test_what_does_not_hold_is_not_confirmed(one, name, words, changes):
    said = verdicts(study(one.STUDY, **changes))
    assert said.pop(name) == words
    assert set(said.values()) == {"confirmed"}


def test_what_takes_long_is_done_with_fewer_seeds():
    found = study(calibration.STUDY, quick=True)
    assert found.runs.counts("kind") == {CAMERA: 3, HALF_SIZE: 1, SERVO: 1, TRACKER: 3, START: 3}
    assert verdicts(found)["curvature"] == "not judged in the quick form"
    counts = {
        case.name: one.count(case, Form())
        for one in (calibration.STUDY, identification.STUDY)
        for case in one.plan(Form())
    }
    assert counts == {
        CAMERA: 100, HALF_SIZE: 20, SERVO: 5, TRACKER: 100, START: 100,
        identification.NOISE: 100, identification.CAMPAIGN: 10,
    }  # fmt: skip


def learning(case, seed, wrong=False):
    """Learning is better than the wrong model and near the true one; with `wrong` contrary."""
    model, learns = case.keys["model"], case.keys["model"] == adaptation.LEARNT
    size = {adaptation.TRUE: 1.0, adaptation.LEARNT: 2.0 if wrong else 1.1}.get(model, 1.5)
    return {
        "outcome": "converged", "error_m": 1e-4 * size, "way_m": 0.3 * size,
        "deviation_m": 0.01 * size, "off_m": 0.002 * size, "slack_s": 5.0 * size,
        "before_m": 0.01 if learns else None,
        "after_m": (0.02 if wrong else 0.005) if learns else None,
        "largest_sigmas": (4.0 if wrong else 2.0) if learns else None,
        "excited": 22 if learns else None, "believed": 5 if learns else None,
        "rejected": 0 if learns else None, "doubts": [],
        "doubted": learns and (case.keys["flaw"] != adaptation.NOTHING) != wrong,
    }  # fmt: skip


def test_statements_tell_good_learning_from_bad(tmp_path):
    check_told_apart_and_written(adaptation.STUDY, learning, tmp_path)
