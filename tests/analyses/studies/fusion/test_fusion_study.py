"""The study of fusion: its quick form, which goes on after a stop, and judges on made-up runs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_IN_QUICK
from cdpr_drake.analyses.studies.framework.statement import judged
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.fusion.configurations import CONFIGURATIONS, QUICK
from cdpr_drake.analyses.studies.fusion.statements import CHECKS
from cdpr_drake.analyses.studies.fusion.study import STUDY
from cdpr_drake.analyses.studies.fusion.trials import trial_scenario
from tests.analyses.studies.made_up_studies import check_tables_are_made, made


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The quick form and its folder, stopped after the first run and gone on with."""
    folder = tmp_path_factory.mktemp("study") / "fusion"
    done = []
    begun = STUDY(True, StudySession(folder, done.append, lambda: any(p.done for p in done), 1))
    return begun, STUDY(True, StudySession(folder, workers=1)), folder


def test_the_quick_form_goes_on_and_is_written(quick):
    begun, result, folder = quick
    assert begun.interrupted
    assert not result.interrupted
    assert result.progress.found >= 1
    assert [run.case for run in result.runs] == [*QUICK, "image, 2 cm"]
    slack = result.runs.one(way="image")
    assert 0.0 < slack["taut_s"] < 1.0
    assert slack["seen_error_m"] < 0.01
    assert slack["seen_share"] > 0.9
    used = {name: result.runs.one(configuration=name) for name in QUICK}
    for run in used.values():
        assert np.all(np.isfinite(run["estimate_m"][:-1]))
        assert run["lengths"] == 1.0
    assert used["on_board"]["external"] == 0.0
    assert used["external"]["on_board"] == 0.0
    assert used["both"]["external"] > 0.9
    result.write(folder)
    stored = json.loads((folder / "results.json").read_text())
    assert {one["verdict"] for one in stored["statements"]} == {NOT_IN_QUICK}
    assert len(stored["statements"]) == len(CHECKS)
    assert (folder / "fusion.png").stat().st_size > 10_000
    check_tables_are_made(result)


def test_what_is_wrong_is_drawn_by_seed_and_every_configuration_loads():
    assert len(STUDY.plan(Form())) == len(CONFIGURATIONS) + 12
    assert len(STUDY.plan(Form(quick=True))) == 4
    start = [
        trial_scenario((), 1.0, seed).perturbations.initial_pose.position for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(start[0], start[1])
    assert np.linalg.norm(start[0] - start[2]) > 1e-4
    for _, changes in CONFIGURATIONS.values():
        trial_scenario(changes, 12.0, 0)


def made_up(case, seed):
    """A run of which everything stated is so."""
    name = case.name
    if "way" in case.keys:
        taut = 0.5 if case.keys["way"] == "image" else 20.0 * case.keys["surplus_m"]
        return {"taut_s": taut, "seen_error_m": 0.0}
    row = {
        "mean_m": 4e-3, "mean_rad": 0.01, "nees": 6.0, "servo_m": 1e-4, "expected_m": 4e-3,
        "wrong_external": 0.9, "lost_s": 0.0,
    }  # fmt: skip
    if name in ("on_board", "external", "external wrong"):
        row["mean_m"] = row["expected_m"] = 6e-3
    if "imu" in name or "depth" in name:
        row["mean_m"], row["mean_rad"] = 3e-3, 0.005
    if name in ("both, external wrong", "both, external wrong, no gates"):
        row["mean_m"] = 15e-3
    return row


@pytest.fixture(scope="module")
def good():
    """Made-up runs of the full form."""
    return made(STUDY, made_up, quick=False, seeds=2).runs


def test_what_is_stated_is_confirmed_and_one_seed_has_no_spread(good):
    assert {one.verdict for one in judged(CHECKS, good)} == {CONFIRMED}
    (said,) = judged(CHECKS[:1], good(seed=0), complete=True)
    assert said.verdict == "not judged"
    assert said.found == "runs are missing: a second seed, as one has no spread"


@pytest.mark.parametrize(
    ("check", "name", "key", "value"),
    [
        ("both_as_good_as_the_better", "both", "mean_m", 0.02),
        ("wrong_calibration_is_found", "both, external wrong, told", "mean_m", 0.02),
        ("wrong_calibration_is_found", "both, external wrong, told", "wrong_external", 0.1),
        ("wrong_calibration_costs_nothing", "both, external wrong", "servo_m", 0.02),
        ("imu_improves_rotation", "both, imu", "mean_rad", 0.02),
        ("depth_improves_position", "external, depth", "mean_m", 0.02),
        ("survives_either_failure", "both, external off", "servo_m", 0.02),
        ("survives_either_failure", "both, external off", "lost_s", 0.2),
        ("consistent", "both", "nees", 60.0),
        ("rate_by_seen_slack", "image, 8 cm", "taut_s", 3.0),
    ],
)
def test_checks_look_at_the_runs(good, check, name, key, value):
    spoiled = [
        replace(run, measured={**run.measured, key: value}) if run.case == name else run
        for run in good
    ]
    (said,) = judged([one for one in CHECKS if one.name == check], replace(good, rows=spoiled))
    assert said.verdict not in (CONFIRMED, "not judged")
