"""The study of identification: a short form of what it repeats, and what it says of it."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies import identification
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.identification import CAMPAIGN, NAMES, NOISE, STUDY, noise_trial
from tests.figure_faults import figure_faults


@pytest.fixture(scope="module")
def trials():
    """Two seeds with six poses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identification, "POSES", 6)
        return [noise_trial(seed) for seed in range(2)]


def test_errors_are_as_the_covariance_and_the_bound_say(trials):
    found = {name: np.array([one[name] for one in trials]) for name in trials[0]}
    assert 2.0 < np.mean(found["squares"]) < 24.0  # chi-square of ten, twice
    assert np.sqrt(np.mean((found["errors"] / found["bound"]) ** 2)) < 2.0
    # What is reported of one log is what the truth gives, but for the noise of its noise levels.
    np.testing.assert_allclose(found["std"], found["bound"], rtol=0.25)
    assert np.median(found["random_bound"] / found["bound"]) > 1.2
    assert found["errors"].shape == (2, len(NAMES))


def misfit(force, moment):
    kept = {"length_m": 1e-5, "friction_nm": float("nan")}
    return {"force_n": force, "moment_nm": moment, **kept}


BEFORE = misfit(5.0, 0.2)
TEN = [1.0] * len(NAMES)
GOOD = {
    "errors": TEN, "std": TEN, "bound": TEN, "random_bound": [2.0] * len(NAMES), "squares": 10.0,
    "spread": 1.0, "tracking_m": [0.02, 8e-5, 7.5e-5], "tracking_rad": [0.1, 1e-3, 1e-3],
    "misfit_fitted": {"identified": misfit(0.12, 0.01), "believed": BEFORE},
    "misfit_validated": {"identified": misfit(0.12, 0.01), "believed": BEFORE}, "platform": TEN,
}  # fmt: skip
"""Of both kinds of trials."""


def study(quick=False, first=None, **every):
    """Three seeds of made-up numbers; those of the first one may differ."""

    def made_up(case, seed):
        return GOOD | every | ((first or {}) if seed == 0 else {})

    return replace(STUDY, measure=made_up)(quick, StudySession(workers=1, seeds=3))


def verdicts(found):
    return {one.name: one.verdict_words for one in found.statements}


@pytest.mark.parametrize("quick", [False, True])
def test_it_judges_tables_and_writes(quick, tmp_path):
    found = study(quick)
    assert verdicts(found) == dict.fromkeys(
        ("covariance", "bound", "designed", "outside", "tracking"), "confirmed"
    )
    assert found.runs.counts("kind") == {NOISE: 3, CAMPAIGN: 1 if quick else 3}
    assert len(found.tables()) == 2
    drawn = identification.figure(found.runs)
    assert figure_faults(drawn) == []
    assert all("[" in axes.get_ylabel() for axes in drawn.axes)
    assert found.write(tmp_path) == {}
    assert (tmp_path / "identification.png").exists()


LESS = {"identified": misfit(0.12, 0.016), "believed": BEFORE}


@pytest.mark.parametrize(
    ("name", "words", "changes"),
    [
        ("covariance", "not confirmed", {"squares": 20.0}),
        ("bound", "not confirmed", {"errors": [1.21] * len(NAMES)}),
        ("designed", "in part", {"random_bound": [1.4] * len(NAMES)}),
        ("designed", "not confirmed", {"random_bound": [0.9] * len(NAMES)}),
        ("outside", "in part (2 of 3)", {"first": {"misfit_validated": LESS}}),
        ("tracking", "in part (2 of 3)", {"first": {"tracking_m": [0.02, 9.1e-5, 7.5e-5]}}),
        ("tracking", "not confirmed", {"tracking_m": [0.02, 9.1e-5, 7.5e-5]}),
    ],
)
def test_what_does_not_hold_is_not_confirmed(name, words, changes):
    said = verdicts(study(**changes))
    assert said.pop(name) == words
    assert set(said.values()) == {"confirmed"}


def test_campaigns_are_fewer_than_seeds():
    counts = {case.name: STUDY.count(case, Form()) for case in STUDY.plan(Form())}
    assert counts == {NOISE: 100, CAMPAIGN: 10}
