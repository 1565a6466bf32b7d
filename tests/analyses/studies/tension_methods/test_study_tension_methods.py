"""The study of tension methods in its short form, and as a command."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.tension_methods.experiments import (
    EXPERIMENTS,
    THESIS_GAINS,
    make_plan,
)
from cdpr_drake.analyses.studies.tension_methods.figures import FIGURES
from cdpr_drake.analyses.studies.tension_methods.study import study_tension_methods
from cdpr_drake.analyses.studies.tension_methods.trial import TrialTask
from cdpr_drake.cli.app import main
from tests.messages import printed

RESULTS = "results.json"

TRACKING = 1e-4
"""Promised distance from a feasible trajectory with the exact model [m]."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    said = []
    return study_tension_methods(True, StudySession(folder, said.append, workers=1)), folder, said


def test_short_form_is_complete(study):
    found, _, said = study
    assert not found.interrupted
    assert len(found.runs) == len(found.plan.specs)
    assert {row.robot for row in found.coverage} == {"caroca_gazebo", "acrobot_large"}
    assert found.statements
    done = [progress.done for progress in said]
    assert done == sorted(done)
    assert done[-1] <= said[-1].total


def test_exact_methods_follow_and_hold_their_bounds(study):
    found, _, _ = study
    exact = [r for r in found.runs if r.spec.method in ("linear_program", "quadratic_program")]
    assert len(exact) >= 3
    for run in exact:
        assert run.largest_error < TRACKING
        assert run.failures == run.negative_tensions == 0


def test_results_can_be_written_and_read(study, tmp_path):
    found, _, _ = study
    found.write(tmp_path)
    results = json.loads((tmp_path / RESULTS).read_text())
    assert results == json.loads(json.dumps(found.as_dict()))
    assert results["parameters"]["start_least_shift_m"] > 0.0
    assert results["versions"]["drake"]
    names = {path.name for path in tmp_path.glob("*.png")}
    assert names >= {"thesis_errors.png", "gains_linear_program.png", "coverage.png"}
    assert {name.removesuffix(".png") for name in names} <= set(FIGURES)
    titles = [str(table.title) for table in found.tables()]
    assert any(title.startswith("thesis") for title in titles)


def test_full_plan_has_the_printed_runs():
    plan = make_plan(quick=False)
    made = {(s.experiment, s.method, s.stiffness) for s in plan.specs}
    for method, gains in THESIS_GAINS.items():
        for gain in gains:
            assert ("thesis", method, gain) in made
    assert {spec.experiment for spec in plan.specs} == set(EXPERIMENTS)
    assert all(s.duration == 100.0 for s in plan.specs if s.experiment == "thesis")


def without_times(results):
    """Numbers without what depends on the machine."""
    timed = ("wall_time_s", "items", "microseconds", "kernel_microseconds")
    if isinstance(results, dict):
        return {key: without_times(value) for key, value in results.items() if key not in timed}
    return [without_times(value) for value in results] if isinstance(results, list) else results


def test_a_stop_keeps_finished_runs_and_the_same_call_continues(study, tmp_path):
    said = []
    session = StudySession(tmp_path, said.append, lambda: said[-1].done >= 2, workers=1)
    found = study_tension_methods(True, session)
    assert found.interrupted
    assert len(found.runs) == 2
    assert not found.coverage
    assert not found.write(tmp_path)
    assert len(json.loads((tmp_path / RESULTS).read_text())["runs"]) == 2
    assert len(found.tables()) == 1
    continued = study_tension_methods(True, StudySession(tmp_path, workers=1))
    assert continued.progress.found == 2
    assert not continued.interrupted
    assert without_times(continued.as_dict()) == without_times(study[0].as_dict())


def test_a_run_is_the_same_when_it_is_read_again(study):
    for run in study[0].runs[:2]:
        again = TrialTask(run.spec)(0, 1)
        read = TrialTask(run.spec).result(again)
        assert without_times(read.as_dict()) == without_times(run.as_dict())
        assert {type(value) for value in read.as_dict().values()} == {
            type(value) for value in run.as_dict().values()
        }
        np.testing.assert_array_equal(read.tensions, run.tensions)


def command(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


@pytest.fixture
def tiny(monkeypatch, study, tmp_path):
    """In place of the study, one that has a short result at once."""
    found = replace(study[0], runs=study[0].runs[:1], coverage=())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(STUDIES, "tension-methods", StudyEntry(lambda *_: found))
    return found


@pytest.mark.usefixtures("tiny")
def test_command_writes_a_folder_and_prints(capsys, tmp_path):
    code, out, _ = command(capsys, "tension-methods", "--quick", "--json", "--out", "there")
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "there" / RESULTS).read_text())
    code, _, err = command(capsys, "tension-methods", "--out", "there")
    assert code == 2
    assert "--overwrite" in err
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
