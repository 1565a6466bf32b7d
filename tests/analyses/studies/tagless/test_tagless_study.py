"""The study of textured squares: its starts, what it asks for, what it says of what it found."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import evaluate_checks
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.tagless import trials
from cdpr_drake.analyses.studies.tagless.statements import CHECKS, task_name
from cdpr_drake.analyses.studies.tagless.study import study_tagless
from cdpr_drake.analyses.studies.tagless.trials import (
    DURATION,
    RATE,
    SCHEMES,
    TARGETS,
    ApproachTask,
    is_lost,
    starts,
)
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

ROWS = round(DURATION * RATE) + 1


def row(distance, angle, outcome=Outcome.TIMEOUT):
    return [distance, angle, float(outcome), 0.0, 1.0, 0.3]


def canned(task, start, stop):
    """What would be found without rendering: a tag at 0.1 mm, textures at half of that."""
    share = 1.0 if task.target == "tag" else 0.5
    runs = np.array([row(1e-4 * share, 0.02 * share)] * (stop - start))
    curve = np.tile(np.geomspace(0.3, 1e-4, ROWS), (stop - start, 1))
    return {"runs": runs, "distance": curve, "angle": curve}


def test_starts_are_the_same_for_all_and_see_the_target():
    few, more = starts(2), starts(4)
    for one, other in zip(few, more, strict=False):
        np.testing.assert_array_equal(np.concatenate(one), np.concatenate(other))
    settings = {}
    for target in ("tag", "map"):
        scenario = load_scenario(trials.SCENARIO, ApproachTask("2.5d", target).overrides(3))
        np.testing.assert_array_equal(scenario.initial_pose.position, more[3][0])
        assert scenario.controller.scheme == "2.5d"
        settings[target] = scenario.camera, scenario.target.size, scenario.duration
    assert settings["tag"] == settings["map"]
    assert scenario.target.kind == "textured"


def test_it_judges_tables_and_writes(tmp_path, monkeypatch):
    monkeypatch.setattr(trials, "approaches", canned)
    study = study_tagless(False, StudySession(workers=1, seeds=2))
    assert len(study.found) == len(SCHEMES) * len(TARGETS)
    assert {s.verdict for s in study.statements()} == {"confirmed"}
    assert len(study.tables()) == 2
    study.write(tmp_path)
    said = json.loads((tmp_path / "results.json").read_text())
    assert len(said["starts"]) == 2
    assert said["parameters"]["SEED"] == trials.SEED
    assert (tmp_path / "tagless.png").exists()


def test_the_quick_form_says_what_it_does_not_judge(monkeypatch):
    monkeypatch.setattr(trials, "approaches", canned)
    said = {s.name: s.verdict for s in study_tagless(True, StudySession(workers=1)).statements()}
    assert said["pbvs"] == "confirmed"
    assert said["hybrid"] == "not judged in the quick form"


def test_worse_squares_and_lost_runs_are_not_confirmed():
    """Four times the tag's error on one texture; a run that ended, one that stayed 10 mm away."""
    found = {
        task_name(scheme, target): canned(ApproachTask(scheme, target), 0, 3)
        for scheme in SCHEMES
        for target in TARGETS
    }
    worse = found["pbvs print"]["runs"]
    worse[:, 0] = 4e-4
    found["ibvs map"]["runs"][1] = row(np.nan, np.nan, Outcome.TARGET_LOST)
    found["ibvs map"]["runs"][2] = row(1e-2, 1.0)
    np.testing.assert_array_equal(is_lost(found["ibvs map"]["runs"]), [False, True, True])
    said = {s.name: s for s in evaluate_checks(CHECKS, found)}
    assert said["pbvs"].verdict == "in part"
    assert said["ibvs"].verdict == "confirmed"
    assert said["losses"].verdict == "in part"
    assert "map 0 + 2 + 0 runs" in said["losses"].found


def test_the_command_line_knows_it():
    assert STUDIES["tagless"].continues
    assert STUDIES["tagless"].repeats


@pytest.mark.parametrize("target", TARGETS)
def test_tasks_have_names_good_for_files(target):
    assert task_name("2.5d", target).replace(" ", "").replace(".", "").isalnum()
