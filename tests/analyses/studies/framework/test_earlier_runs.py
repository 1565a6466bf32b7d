"""Runs by earlier code: taken over where their cases are the same, counted, never by themselves."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.front.studies import run_study
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reproduction.runner import RunSettings, run_studies
from cdpr_drake.analyses.studies.catalogue import StudyEntry
from cdpr_drake.analyses.studies.framework import study as frame
from cdpr_drake.analyses.studies.framework.study import Case, Study
from cdpr_drake.analyses.sweeps.earlier_runs import EARLIER
from cdpr_drake.analyses.sweeps.folder import SweepFolder
from cdpr_drake.errors import CdprError, OutputFolderError

OLD, NEW = "0.0.1 old", "0.0.2 new"


def cases(form):
    yield Case(name="a", keys={"size": "a"}, data=1.0)
    yield Case(name="b", keys={"size": "b"}, data=2.0)
    yield Case(name="timed", keys={"size": "timed"}, data=3.0, alone=True)


def measure(case, seed):
    return {"value_m": case.data + seed, "curve_m": np.arange(seed + 1.0)}


def computes_nothing(case, seed):
    raise AssertionError(f"{case.name} {seed} was computed")


def only_b(case, seed):
    assert case.name in ("b", "timed")
    return measure(case, seed)


def other_b(form):
    for case in cases(form):
        yield replace(case, data=2.5) if case.name == "b" else case


STUDY = Study(name="tiny", title="Tiny", cases=cases, measure=measure, seeds=(2, 1))
UNTIMED = replace(STUDY, cases=lambda form: (case for case in cases(form) if not case.alone))


@pytest.fixture
def earlier(tmp_path, monkeypatch):
    """A folder of all runs by other code; what follows is by newer code."""
    monkeypatch.setattr(frame, "code_version", lambda: OLD)
    run(STUDY, tmp_path / "earlier")
    monkeypatch.setattr(frame, "code_version", lambda: NEW)
    return tmp_path / "earlier"


def run(study, folder, **session):
    result = study(False, StudySession(folder, workers=1, **session))
    result.write(folder)
    return result


def told(folder):
    return json.loads((folder / "results.json").read_text())


def test_runs_are_taken_over_and_counted(earlier, tmp_path):
    run(replace(STUDY, measure=only_b), tmp_path / "now", earlier=earlier)
    assert told(tmp_path / "now")["by_earlier_code"] == {OLD: 4}
    assert told(tmp_path / "now")["runs"] == told(earlier)["runs"]
    assert "by_earlier_code" not in told(earlier)


def test_what_measures_times_is_measured_again(earlier, tmp_path):
    with pytest.raises(AssertionError, match="timed 0 was computed"):
        run(replace(STUDY, measure=computes_nothing), tmp_path / "now", earlier=earlier)


def test_a_case_that_is_asked_otherwise_is_computed(earlier, tmp_path):
    changed = replace(STUDY, cases=other_b, measure=only_b)
    result = run(changed, tmp_path / "now", earlier=earlier)
    assert result.runs.mean("value_m", size="b") == 3.0
    assert told(tmp_path / "now")["by_earlier_code"] == {OLD: 2}


def test_other_parameters_take_nothing_over_and_say_which(earlier, tmp_path):
    changed = replace(STUDY, parameters=lambda form: {"gain": 2})
    result = run(changed, tmp_path / "now", earlier=earlier)
    assert result.earlier.words() == (
        "no earlier runs were taken over: parameters.gain is not there, 2 here"
    )


def test_an_unfinished_folder_gives_what_it_has_and_more_seeds_are_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(frame, "code_version", lambda: OLD)
    answers = iter([False, True])
    UNTIMED(
        False,
        StudySession(
            tmp_path / "earlier", workers=1, seeds=1, should_stop=lambda: next(answers, True)
        ),
    )
    monkeypatch.setattr(frame, "code_version", lambda: NEW)
    result = run(UNTIMED, tmp_path / "now", earlier=tmp_path / "earlier")
    assert result.earlier.counts() == {OLD: 1}
    assert len(result.runs) == 4


def test_a_continued_study_still_tells_and_a_second_step_names_the_first_code(
    earlier, tmp_path, monkeypatch
):
    run(STUDY, tmp_path / "now", earlier=earlier)
    assert run(STUDY, tmp_path / "now").earlier.counts() == {OLD: 4}
    monkeypatch.setattr(frame, "code_version", lambda: "0.0.3 newest")
    third = run(STUDY, tmp_path / "third", earlier=tmp_path / "now")
    assert third.earlier.counts() == {OLD: 4}


def test_killed_while_runs_are_taken_over_they_stay_those_of_earlier_code(
    earlier, tmp_path, monkeypatch
):
    stored = SweepFolder.store

    def killed(self, task, start, stop, arrays):
        if task != "a, seed 0":
            raise KeyboardInterrupt
        stored(self, task, start, stop, arrays)

    with monkeypatch.context() as patched:
        patched.setattr(SweepFolder, "store", killed)
        with pytest.raises(KeyboardInterrupt):
            run(STUDY, tmp_path / "now", earlier=earlier)
    result = run(replace(STUDY, measure=only_b), tmp_path / "now", earlier=earlier)
    assert result.earlier.counts() == {OLD: 4}


def test_nothing_is_taken_over_unless_it_is_asked_for(earlier):
    with pytest.raises(OutputFolderError, match=r"cdpr_drake is \"0.0.1 old\" there"):
        run(STUDY, earlier)
    assert not (earlier / EARLIER).exists()


def test_other_folders_are_refused(earlier, tmp_path):
    with pytest.raises(OutputFolderError, match="found no study; accepted: a folder of cdpr study"):
        run(STUDY, tmp_path / "now", earlier=tmp_path)
    with pytest.raises(OutputFolderError, match='found study "tiny"; accepted: "other"'):
        run(replace(STUDY, name="other"), tmp_path / "other", earlier=earlier)


@pytest.mark.parametrize("text", ["no JSON", "[1]", '{"cases": 3}', '{"cases": {"a": 5}}'])
def test_a_file_of_nonsense_is_one_line(earlier, tmp_path, text):
    (earlier / "arguments.json").write_text(text)
    with pytest.raises(OutputFolderError, match=r"arguments.json: found no (JSON|cases)"):
        run(STUDY, tmp_path / "now", earlier=earlier)


def test_the_front_door_refuses_before_anything_is_written(earlier, tmp_path):
    with pytest.raises(OutputFolderError, match='found study "tiny"; accepted: "stability-ranges"'):
        run_study("stability-ranges", tmp_path / "now", runs_from=earlier)
    with pytest.raises(CdprError, match="runs_from: accepted with a folder"):
        run_study("stability-ranges", runs_from=earlier)
    assert not (tmp_path / "now").exists()


def test_a_reproduction_says_whose_runs_a_study_has(tmp_path, monkeypatch):
    entries = {"tiny": StudyEntry(UNTIMED)}
    lines = []
    monkeypatch.setattr(frame, "code_version", lambda: OLD)
    run_studies(entries, made(tmp_path / "before"), RunSettings(workers=1))
    monkeypatch.setattr(frame, "code_version", lambda: NEW)
    entries["lacking"] = StudyEntry(replace(UNTIMED, name="lacking"))
    settings = RunSettings(workers=1, say=lines.append, runs_from=tmp_path / "before")
    states = run_studies(entries, made(tmp_path / "after"), settings)
    assert states["tiny"].note == f"runs that earlier code computed: 4 of 4 by {OLD}"
    assert states["lacking"].note == ""
    assert any(line.startswith("lacking: all is computed: ") for line in lines)


def made(folder):
    folder.mkdir()
    return folder
