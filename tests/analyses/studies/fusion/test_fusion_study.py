"""The study of fusion: its quick form, which goes on after a stop, and judges on made-up runs."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED, evaluate_checks
from cdpr_drake.analyses.studies.fusion.configurations import ALL, QUICK, configurations
from cdpr_drake.analyses.studies.fusion.slack_trials import SLACK_COLUMNS, slack_trials
from cdpr_drake.analyses.studies.fusion.statements import CHECKS
from cdpr_drake.analyses.studies.fusion.study import study_fusion
from cdpr_drake.analyses.studies.fusion.trials import COLUMNS, FusionTrial, trial_scenario


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The quick form and its folder, stopped after the first run and gone on with."""
    folder = tmp_path_factory.mktemp("study") / "fusion"
    done = []
    begun = study_fusion(
        True, StudySession(folder, done.append, lambda: any(p.done for p in done), workers=1)
    )
    return begun, study_fusion(True, StudySession(folder, workers=1)), folder


def test_the_quick_form_goes_on_and_is_written(quick):
    begun, result, folder = quick
    assert begun.interrupted
    assert not result.interrupted
    assert result.progress.found >= 1
    assert set(result.found) == {*QUICK, "image, 2 cm"}
    slack = dict(zip(SLACK_COLUMNS, result.found["image, 2 cm"]["numbers"][0], strict=True))
    assert 0.0 < slack["taut_s"] < 1.0
    assert slack["seen_error_m"] < 0.01
    assert slack["seen_share"] > 0.9
    for arrays in (result.found[name] for name in QUICK):
        assert np.all(np.isfinite(arrays["distance"][:, :-1]))
        assert np.all(arrays["numbers"][:, COLUMNS.index("lengths")] == 1.0)
    used = {name: result.found[name]["numbers"][0] for name in QUICK}
    assert used["on_board"][COLUMNS.index("external")] == 0.0
    assert used["external"][COLUMNS.index("on_board")] == 0.0
    assert used["both"][COLUMNS.index("external")] > 0.9
    result.write(folder)
    stored = json.loads((folder / "results.json").read_text())
    assert [c["name"] for c in stored["configurations"]] == list(QUICK)
    assert len(stored["statements"]) == len(CHECKS)
    assert (folder / "fusion.png").stat().st_size > 10_000
    assert all(table.row_count for table in result.tables())


def test_what_is_wrong_is_drawn_by_seed_and_every_configuration_loads():
    start = [
        trial_scenario(FusionTrial((), 1.0), seed).perturbations.initial_pose.position
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(start[0], start[1])
    assert np.linalg.norm(start[0] - start[2]) > 1e-4
    for one in configurations(quick=False):
        trial_scenario(one.trial(quick=False), 0)


def made_up(change=lambda name, numbers: None):
    """Runs of which everything stated is so, but for a change."""
    found = {}
    for one in ALL:
        numbers = dict.fromkeys(COLUMNS, 0.0) | {
            "mean_m": 4e-3, "mean_rad": 0.01, "nees": 6.0, "servo_m": 1e-4, "expected_m": 4e-3,
            "wrong_external": 0.9,
        }  # fmt: skip
        if one.name in ("on_board", "external", "external wrong"):
            numbers["mean_m"] = numbers["expected_m"] = 6e-3
        if "imu" in one.name or "depth" in one.name:
            numbers["mean_m"], numbers["mean_rad"] = 3e-3, 0.005
        if one.name in ("both, external wrong", "both, external wrong, no gates"):
            numbers["mean_m"] = 15e-3
        change(one.name, numbers)
        row = np.array([numbers[key] for key in COLUMNS])
        found[one.name] = {"numbers": np.repeat(row[np.newaxis], 4, 0)}
    for name, trial in slack_trials(quick=False).items():
        numbers = dict.fromkeys(SLACK_COLUMNS, 0.0) | {
            "taut_s": 0.5 if trial.kind == "image" else 20.0 * trial.surplus
        }
        change(name, numbers)
        row = np.array([numbers[key] for key in SLACK_COLUMNS])
        found[name] = {"numbers": np.repeat(row[np.newaxis], 4, 0)}
    return found


@pytest.mark.parametrize(
    ("judge", "name", "key", "value"),
    [
        ("both_as_good_as_the_better", "both", "mean_m", 0.02),
        ("wrong_calibration_is_found", "both, external wrong, told", "mean_m", 0.02),
        ("wrong_calibration_is_found", "both, external wrong, told", "wrong_external", 0.1),
        ("wrong_calibration_costs_nothing", "both, external wrong", "servo_m", 0.02),
        ("imu_improves_rotation", "both, imu", "mean_rad", 0.02),
        ("depth_improves_position", "external, depth", "mean_m", 0.02),
        ("survives_either_failure", "both, external off", "servo_m", 0.02),
        ("consistent", "both", "nees", 60.0),
        ("rate_by_seen_slack", "image, 8 cm", "taut_s", 3.0),
    ],
)
def test_judges_look_at_the_runs(judge, name, key, value):
    good = {s.name: s.verdict for s in evaluate_checks(CHECKS, made_up())}
    assert good[judge] == CONFIRMED

    def spoil(one, numbers):
        if one == name:
            numbers[key] = value

    spoiled = {s.name: s.verdict for s in evaluate_checks(CHECKS, made_up(spoil))}
    assert spoiled[judge] != CONFIRMED
    assert NOT_CONFIRMED in spoiled.values() or spoiled[judge] != good[judge]
