"""The study of calibrations: trials in a short form, and what it says of what it found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.calibration.candidate_poses import rest_poses
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.calibration import study as module
from cdpr_drake.analyses.studies.calibration import trials
from cdpr_drake.analyses.studies.calibration.statements import (
    CAMERA,
    HALF_SIZE,
    SERVO,
    START,
    START_WITHIN,
    TRACKER,
    TURN_WITHIN,
)
from cdpr_drake.analyses.studies.calibration.study import STUDY, measure
from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.models.robot_loader import load_robot

STRAIGHT = {"true": 2.8e-4, "believed before": 5e-3, "calibrated": 2.9e-4}


@pytest.fixture(scope="module")
def rows():
    """One seed of each kind, with poses at random; the servo is what `cdpr study` found."""
    with pytest.MonkeyPatch.context() as patch:
        poses, _ = rest_poses(load_robot(trials.ROBOT), 25, np.random.default_rng(0))
        patch.setattr(trials, "POSES", 25)
        patch.setattr(trials, "START_POSES", 25)
        patch.setattr(trials, "designed_poses", lambda: tuple(poses))
        patch.setattr(module, "straightness", lambda trial: STRAIGHT)
        return {
            kind: measure(Case(name=kind, keys={"kind": kind}), 0)
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
    assert found["distance_m"] < START_WITHIN
    assert found["angle_deg"] < TURN_WITHIN


GOOD = {
    "exit_points_m": 9e-4, "anchor_points_m": 4e-4, "errors_chi_square": 60.0,
    "errors_chi_square_straight": 70.0, "errors_degrees": 60, "residuals_chi_square": 900.0,
    "residuals_degrees": 900, "whole_chi_square": 60.0, "whole_chi_square_straight": 70.0,
    "half_chi_square": 60.0, "half_chi_square_straight": 62.5, "errors_over_bound": np.ones(48),
    "distance_m": 5e-3, "distance_std_m": 5e-3, "angle_deg": 1.0, "angle_std_deg": 1.0,
    "straightness_m": STRAIGHT,
}  # fmt: skip
"""Of all kinds of trials."""


def study(quick=False, first=None, **every):
    """Three seeds of made-up numbers; those of the first one may differ."""

    def made_up(case, seed):
        return GOOD | every | ((first or {}) if seed == 0 else {})

    return replace(STUDY, measure=made_up)(quick, StudySession(workers=1, seeds=3))


def verdicts(found):
    return {one.name: one.verdict_words for one in found.statements}


def test_it_judges_tables_and_writes(tmp_path):
    found = study()
    assert set(verdicts(found).values()) == {"confirmed"}
    assert len(found.statements) == 7
    assert len(found.tables()) == 2
    assert found.write(tmp_path) == {}
    written = json.loads((tmp_path / "results.json").read_text())
    assert written["parameters"]["START_OFF"] == 0.3
    assert (tmp_path / "calibration.png").is_file()


@pytest.mark.parametrize(
    ("name", "words", "every"),
    [
        ("points", "not confirmed", {"exit_points_m": 1.1e-3}),
        ("covariance", "in part (1 of 2)", {"residuals_chi_square": 985.0}),
        ("covariance", "not confirmed", {"residuals_chi_square": 1000.0}),
        ("curvature", "not confirmed", {"half_chi_square_straight": 65.1}),
        ("curvature", "not confirmed", {"whole_chi_square_straight": 59.0}),
        ("bound", "not confirmed", {"errors_over_bound": np.full(48, 1.21)}),
        ("start", "in part (2 of 3)", {"first": {"angle_deg": 2.1}}),
        ("told", "not confirmed", {"first": {"distance_std_m": 1.5e-3}}),
        ("servo", "in part (2 of 3)", {"first": {"straightness_m": STRAIGHT | {"true": 1e-4}}}),
    ],
)
def test_what_does_not_hold_is_not_confirmed(name, words, every):
    said = verdicts(study(**every))
    assert said.pop(name) == words
    assert set(said.values()) == {"confirmed"}


def test_the_quick_form_has_one_seed_of_what_takes_long():
    found = study(quick=True)
    assert found.runs.counts("kind") == {CAMERA: 3, HALF_SIZE: 1, SERVO: 1, TRACKER: 3, START: 3}
    assert verdicts(found)["curvature"] == "not judged in the quick form"
    full = {case.name: STUDY.count(case, Form()) for case in STUDY.plan(Form())}
    assert full == {CAMERA: 100, HALF_SIZE: 20, SERVO: 5, TRACKER: 100, START: 100}
