"""The study of tension methods in its short form, and as a command."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    THESIS_GAINS,
    trials,
)
from cdpr_drake.analyses.studies.tension_methods.study import COVERAGE, STUDY, measure

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.cli.app import main
from tests.analyses.studies.made_up_studies import with_figures
from tests.messages import printed

RESULTS = "results.json"

TRACKING = 1e-4
"""Promised distance from a feasible trajectory with the exact model [m]."""


@pytest.fixture(scope="module")
def study():
    return STUDY(True, StudySession(workers=1))


def test_short_form_is_complete(study):
    assert not study.interrupted
    assert len(study.runs(experiment=tuple(EXPERIMENTS)[:2])) == 10
    assert set(study.runs(experiment=COVERAGE)["robot"]) == {"caroca_gazebo", "acrobot_large"}
    verdicts = {one.name: one.verdict for one in study.statements}
    assert tuple(verdicts) == STUDY.names_of_checks()
    assert verdicts["pseudo_inverse_negative"] == "in part"
    assert verdicts["closed_form_steady"] == "not confirmed"
    assert verdicts["lp_jumps"] == "not judged in the quick form"


def test_exact_methods_follow_and_hold_their_bounds(study):
    runs = study.runs(experiment=("thesis", "acrobot"))
    exact = runs(method=("linear_program", "quadratic_program"))
    assert len(exact) >= 3
    assert exact.largest("position_error_max_m") < TRACKING
    assert exact.total("failures") == exact.total("negative_tensions") == 0


def test_results_can_be_written_and_read(study, tmp_path):
    names = {"thesis_errors", "gains_linear_program", "coverage"}
    some, drawn = with_figures(study, *names)
    assert names < drawn < set(STUDY.figures)
    assert some.write(tmp_path) == {}
    assert {path.stem for path in tmp_path.glob("*.png")} == names
    results = json.loads((tmp_path / RESULTS).read_text())
    assert results == json.loads(json.dumps(some.as_dict()))
    assert results["parameters"]["start_least_shift_m"] > 0.0
    assert results["units"]["tension_max_n"] == "N"
    titles = [str(table.title) for table in study.tables()]
    assert [title.partition(":")[0] for title in titles[:4]] == [
        "thesis", "printed", "acrobot", "caroca_gazebo",
    ]  # fmt: skip


def test_full_plan_has_the_printed_runs():
    specs = trials(quick=False)
    made = {(s.experiment, s.method, s.stiffness) for s in specs}
    for method, gains in THESIS_GAINS.items():
        for gain in gains:
            assert ("thesis", method, gain) in made
    assert {spec.experiment for spec in specs} == set(EXPERIMENTS)
    assert all(s.duration == 100.0 for s in specs if s.experiment == "thesis")
    plan = STUDY.plan(Form())
    assert {case.keys["experiment"] for case in plan if case.alone} == {COVERAGE}


def test_a_stop_keeps_finished_runs_and_says_what_it_can():
    said = []
    session = StudySession(None, said.append, lambda: said[-1].done >= 2, workers=1)
    found = STUDY(True, session)
    assert found.interrupted
    assert len(found.runs) == 2
    assert not found.runs.has(experiment=COVERAGE)
    assert found.statements == []
    assert len(found.tables()) == 1


def test_a_run_is_the_same_when_it_is_run_again(study):
    run = study.runs.rows[1]
    (case,) = [one for one in study.cases if one.name == run.case]
    row = measure(case, 0)
    np.testing.assert_array_equal(row["tensions_n"], run["tensions_n"])
    assert row["position_error_max_m"] == run["position_error_max_m"]


def command(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


@pytest.fixture
def tiny(monkeypatch, study, tmp_path):
    """In place of the study, one that has a short result at once."""
    case, name = study.cases[0], "thesis_errors"
    small = replace(STUDY, figures={name: STUDY.figures[name]})
    done = {case.name: study.finished[case.name]}
    found = replace(study, study=small, cases=(case,), finished=done)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(STUDIES, "tension-methods", StudyEntry(lambda *_: found))
    return found


@pytest.mark.usefixtures("tiny")
def test_command_writes_a_folder_and_prints(capsys, tmp_path):
    code, out, _ = command(capsys, "tension-methods", "--quick", "--json", "--out", "there")
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "there" / RESULTS).read_text())
    code, out, _ = command(capsys, "tension-methods", "--out", "there", "--overwrite")
    assert code == 0
    assert "error max [um]" in " ".join(out.split())
    code, _, _ = command(capsys, "tension-methods")
    assert (tmp_path / "studies" / "tension-methods" / RESULTS).exists()


def test_command_keeps_what_an_interrupted_study_has(capsys, tmp_path, monkeypatch, tiny):
    found = replace(tiny, progress=WorkProgress("a run", 1, 2, 0.0))
    monkeypatch.setitem(STUDIES, "tension-methods", StudyEntry(lambda *_: found))
    code, _, err = command(capsys, "tension-methods", "--out", "there")
    assert code == 130
    assert "Interrupted" in err
    assert json.loads((tmp_path / "there" / RESULTS).read_text())["interrupted"]


def test_command_refuses_an_unknown_study(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = command(capsys, "tension-method")
    assert code == 2
    assert "tension-methods" in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
