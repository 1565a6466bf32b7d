"""Studies of calibrations, of identification and of learning: trials in short, and verdicts."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.fits.robots import rest_poses
from cdpr_drake.analyses.studies import calibration, identification
from cdpr_drake.analyses.studies.facts import facts_of
from cdpr_drake.analyses.studies.study import study_named, with_names_of_tables
from cdpr_drake.models.robot_loader import load_robot

STRAIGHT = {"true": 2.8e-4, "believed before": 5e-3, "calibrated": 2.9e-4}


@pytest.fixture(scope="module")
def rows():
    """One seed of each kind, with poses at random; the servo is what `cdpr study` found."""
    with pytest.MonkeyPatch.context() as patch:
        poses, _ = rest_poses(load_robot(calibration.ROBOT), 25, np.random.default_rng(0))
        patch.setattr(calibration, "POSES", 25)
        patch.setattr(calibration, "START_POSES", 25)
        patch.setattr(calibration, "designed_poses", lambda: tuple(poses))
        patch.setattr(calibration, "straightness", lambda trial: STRAIGHT)
        kinds = ("camera", "half", "servo", "tracker", "start")
        return {kind: getattr(calibration, f"{kind}_row")(0) for kind in kinds}


def test_points_come_back_and_are_as_sure_as_they_say(rows):
    camera = rows["camera"]
    assert camera["exit_points_m"] < 2e-3  # it was 10 mm
    assert camera["anchor_points_m"] < 1.5e-3  # it was 5 mm
    assert 0.5 < camera["errors_chi_square"] / camera["errors_degrees"] < 1.6
    assert camera["errors_chi_square_straight"] != camera["errors_chi_square"]
    assert 0.8 < camera["residuals_chi_square"] / camera["residuals_degrees"] < 1.2
    assert rows["half"]["whole_chi_square"] == camera["errors_chi_square"]
    assert rows["tracker"]["errors_over_bound"].shape == (48,)
    assert rows["tracker"]["rms_over_bound"] < 2.0
    assert rows["servo"] == {"straightness_m": STRAIGHT}


def test_the_start_is_found_by_winches_and_tensions(rows):
    start = rows["start"]
    assert start["distance_m"] < 4.0 * start["distance_std_m"] < 0.04
    assert start["angle_deg"] < 4.0 * start["angle_std_deg"] < 8.0
    assert start["distance_m"] < 0.01
    assert start["angle_deg"] < 2.0


@pytest.fixture(scope="module")
def noise():
    """Two seeds of identification with six poses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identification, "POSES", 6)
        return [identification.noise_row(seed) for seed in range(2)]


def test_errors_are_as_the_covariance_and_the_bound_say(noise):
    table = pd.DataFrame(noise)
    errors, std, bound = (identification.lists(table, name) for name in ("errors", "std", "bound"))
    assert 2.0 < table["squares"].mean() < 24.0  # chi-square of ten, twice
    assert np.sqrt(np.mean((errors / bound) ** 2)) < 2.0
    # What is reported of one log is what the truth gives, but for the noise of its noise levels.
    np.testing.assert_allclose(std, bound, rtol=0.25)
    assert np.median([list(one.values()) for one in table["random_over_designed"]]) > 1.2
    assert errors.shape == (2, len(identification.NAMES))


CALIBRATED = {
    "camera": {
        "exit_points_m": 9e-4, "anchor_points_m": 4e-4, "errors_chi_square": 60.0,
        "errors_chi_square_straight": 70.0, "errors_degrees": 60, "residuals_chi_square": 900.0,
        "residuals_degrees": 900,
    },
    "half": {
        "whole_chi_square": 60.0, "whole_chi_square_straight": 70.0,
        "half_chi_square": 60.0, "half_chi_square_straight": 62.5,
    },
    "tracker": {"rms_over_bound": 1.0},
    "start": {"distance_m": 5e-3, "distance_std_m": 5e-3, "angle_deg": 1.0, "angle_std_deg": 1.0},
    "servo": {"straightness_m": STRAIGHT},
}  # fmt: skip
IDENTIFIED = {
    "noise": {
        "squares": 10.0, "rms_over_bound": 1.0,
        "random_over_designed": dict.fromkeys(identification.NAMES, 2.0),
    },
    "campaign": {"tracking_excess": 0.1, "force_ratio": 1.0, "moment_ratio": 1.0},
}  # fmt: skip
GOOD = {"calibration": CALIBRATED, "identification": IDENTIFIED}


def verdicts(name, first=None, **every):
    """Of three seeds of made-up numbers; those of the first one may differ."""
    table = pd.DataFrame([
        {"kind": kind, "seed": seed, **numbers, **{
            column: value
            for column, value in {**every, **((first or {}) if seed == 0 else {})}.items()
            if column in numbers
        }}
        for kind, numbers in GOOD[name].items()
        for seed in range(3)
    ])  # fmt: skip
    table = with_names_of_tables(table)
    judged = [fact.judge(table, study_named(name).finds, {}, "") for fact in facts_of(name)]
    return {one["name"]: f"{one['verdict']} {one['held']} of {one['of']}" for one in judged}


@pytest.mark.parametrize("study", GOOD)
def test_good_numbers_are_confirmed(study):
    assert all(words.startswith("confirmed") for words in verdicts(study).values())


@pytest.mark.parametrize(
    ("study", "name", "words", "changes"),
    [
        ("calibration", "points", "not confirmed 1 of 2", {"exit_points_m": 1.1e-3}),
        ("calibration", "covariance", "in part 0 of 1", {"residuals_chi_square": 985.0}),
        ("calibration", "covariance", "not confirmed 0 of 1", {"residuals_chi_square": 1000.0}),
        ("calibration", "curvature", "not confirmed 0 of 1", {"half_chi_square_straight": 65.1}),
        ("calibration", "curvature", "not confirmed 0 of 1",
         {"whole_chi_square_straight": 59.0}),
        ("calibration", "bound", "not confirmed 0 of 1", {"rms_over_bound": 1.21}),
        ("calibration", "start", "in part 2 of 3", {"first": {"angle_deg": 2.1}}),
        ("calibration", "told", "not confirmed 0 of 1", {"first": {"distance_std_m": 1.5e-3}}),
        ("calibration", "servo", "in part 2 of 3",
         {"first": {"straightness_m": STRAIGHT | {"true": 1e-4}}}),
        ("identification", "covariance", "not confirmed 0 of 1", {"squares": 20.0}),
        ("identification", "bound", "not confirmed 0 of 1", {"rms_over_bound": 1.21}),
        ("identification", "designed", "in part 0 of 1",
         {"random_over_designed": dict.fromkeys(identification.NAMES, 1.4)}),
        ("identification", "designed", "not confirmed 0 of 1",
         {"random_over_designed": dict.fromkeys(identification.NAMES, 0.9)}),
        ("identification", "outside", "in part 2 of 3", {"first": {"moment_ratio": 1.6}}),
        ("identification", "tracking", "in part 2 of 3", {"first": {"tracking_excess": 0.21}}),
        ("identification", "tracking", "not confirmed 0 of 3", {"tracking_excess": 0.21}),
    ],
)  # fmt: skip
def test_what_does_not_hold_is_not_confirmed(study, name, words, changes):
    others = verdicts(study, **changes)
    assert others.pop(name) == words
    assert all(one.startswith("confirmed") for one in others.values())
