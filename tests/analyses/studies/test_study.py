"""The frame of studies, on a study of arithmetic: rows, resumption, failures, and results."""

import json
import os
import signal
import subprocess
import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.studies import study as module
from cdpr_drake.analyses.studies.rows import ROWS, digest
from cdpr_drake.analyses.studies.study import Case, Form, Study, run_study, unit_of
from cdpr_drake.errors import CdprError, OutputFolderError

CALLS = []


def square(x, seed=0):
    """A number, a word, a table of names and a curve."""
    CALLS.append((x, seed))
    return {"y_m": float(x * x + seed), "word": "w", "orders": {"a": 1.5}, "curve": np.arange(x)}


def cases(form):
    """Two that are the same call, one that is repeated, one that measures times."""
    yield Case(keys={"name": "one"}, call=partial(square, 3))
    yield Case(keys={"name": "same"}, call=partial(square, 3))
    yield Case(keys={"name": "timed"}, call=partial(square, 9), alone=True)
    yield Case(keys={"name": "seeds"}, call=partial(square, 2), seeds=form.times(4, 2))


def line(rows):
    figure = Figure()
    figure.subplots().plot(rows["y_m"])
    return figure


def no_line(rows):
    raise ValueError("nothing to draw")


FACTS = [{
    "name": "nine", "says": "It is 9 m.", "basis": "ours",
    "parts": [{"of": "y_m", "where": {"name": "one"}, "about": 9, "tolerance": 0.1},
              {"of": "orders.a", "where": {"name": "one"}, "above": 1}],
}]  # fmt: skip

STUDY = Study(
    name="squares", title="Squares", cases=cases, figures={"line": line},
    tables={"Sums": lambda rows: rows.groupby("name", sort=False)["y_m"].sum().reset_index()},
    numbers=lambda rows: {"sum": rows["y_m"].sum()}, facts=FACTS,
)  # fmt: skip


@pytest.fixture(autouse=True)
def _no_calls():
    CALLS.clear()


def run(folder=None, study=STUDY, **options):
    return run_study(study, folder, **{"quick": True, "workers": 1, **options})


def test_rows_come_in_the_order_of_the_plan_and_equal_calls_are_made_once(tmp_path):
    result = run(tmp_path / "r")
    assert [row["name"] for row in result.records] == ["one", "same", "timed", "seeds", "seeds"]
    assert CALLS == [(3, 0), (2, 0), (2, 1), (9, 0)]  # what measures times is last
    assert result.rows["y_m"].tolist() == [9.0, 9.0, 81.0, 4.0, 5.0]
    assert result.rows["arrays"][0]["curve"].tolist() == [0, 1, 2]
    assert list(result.rows["arrays"][0]) == ["curve"]


def test_results_have_rows_units_numbers_facts_and_tables(tmp_path):
    result = run(tmp_path / "r")
    found = json.loads((tmp_path / "r" / "results.json").read_text())
    assert found["units"] == {"y_m": "m"}
    assert found["runs"][0] == {"name": "one", "y_m": 9.0, "word": "w", "orders": {"a": 1.5}}
    assert found["runs"][4]["seed"] == 1
    assert found["numbers"] == {"sum": 108.0}
    assert found["statements"][0]["verdict"] == "confirmed"
    assert found["scorecard"] == {"verdicts": {}, "ours": {"confirmed": 1}}
    assert result.tables()["Sums"]["y_m"].tolist() == [9.0, 9.0, 81.0, 9.0]
    rows = pd.read_csv(tmp_path / "r" / "runs.csv")
    assert rows["y_m"].tolist() == [9.0, 9.0, 81.0, 4.0, 5.0]
    assert (tmp_path / "r" / "line.png").is_file()


def test_a_figure_says_that_it_shows_less_than_the_full_form():
    words = [run(quick=quick).plot().texts[0].get_text() for quick in (True, False)]
    assert words == ["quick form", ""]


def test_the_same_call_measures_nothing_again_and_more_seeds_only_these(tmp_path):
    run(tmp_path / "r")
    CALLS.clear()
    run(tmp_path / "r")
    assert CALLS == []
    result = run(tmp_path / "r", seeds=3)
    assert CALLS == [(2, 2)]
    assert len(result.records) == 6


def test_a_line_that_a_kill_has_cut_is_measured_again_to_the_same_bytes(tmp_path):
    run(tmp_path / "whole")
    CALLS.clear()
    run(tmp_path / "r", follow=Follow(stop=lambda: len(CALLS) == 3))
    path = tmp_path / "r" / ROWS
    path.write_text(path.read_text()[:-20])
    CALLS.clear()
    run(tmp_path / "r")
    assert CALLS == [(2, 1), (9, 0)]
    for name in ("results.json", "runs.csv", "line.png", "tables.html"):
        assert (tmp_path / "r" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_processes_give_the_same_results(tmp_path):
    here, there = run(tmp_path / "here"), run(tmp_path / "there", workers=2)
    assert here.as_dict() == there.as_dict()


def stumble(x):
    if x == 1:
        raise ValueError("not one")
    if x == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"x": x}


STUMBLING = Study(
    name="stumbling", title="Some calls fail",
    cases=lambda form: [Case(keys={"x": x}, call=partial(stumble, x)) for x in range(4)],
    figures={"bad": no_line}, facts=FACTS,
)  # fmt: skip


def test_a_call_that_fails_is_named_and_the_others_are_kept(tmp_path):
    lines = []
    result = run(tmp_path / "r", STUMBLING, workers=2, follow=Follow(say=lines.append))
    assert result.interrupted
    assert [row["x"] for row in result.records] == [0, 3]
    assert sorted(result.failed.values()) == sorted(lines) == [
        "x 1: ValueError: not one", "x 2: its process died (SIGKILL; out of memory?)",
    ]  # fmt: skip
    assert result.statements[0]["verdict"] == "interrupted"
    assert result.undrawn == {"bad.png": "nothing to draw"}


def test_a_stop_keeps_what_is_done_and_the_same_call_goes_on(tmp_path):
    first = run(tmp_path / "r", follow=Follow(stop=lambda: len(CALLS) == 2))
    assert first.interrupted
    assert first.as_dict()["rows"] == {"done": 3, "of": 5}  # of two calls
    assert not run(tmp_path / "r").interrupted
    assert len(CALLS) == 4


def test_progress_counts_what_an_earlier_command_left(tmp_path):
    run(tmp_path / "r", follow=Follow(stop=lambda: len(CALLS) == 2))
    told = []
    run(tmp_path / "r", follow=Follow(progress=told.append))
    assert [(one.done, one.total, one.found) for one in told] == [
        (2, 4, 2), (3, 4, 2), (4, 4, 2)
    ]  # fmt: skip
    assert told[1].what == "name seeds, seed 1"
    assert told[0].left is None


KILLED = """
import os, signal, sys
from tests.analyses.studies import test_study as mine
def stop():
    if len(mine.CALLS) == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)
mine.run(sys.argv[1], follow=mine.Follow(stop=stop))
"""


@pytest.mark.parametrize("after", [1, 3])
def test_a_killed_study_goes_on_to_the_same_bytes(tmp_path, after):
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, tmp_path / "r", str(after)], check=False, timeout=300
    )
    assert ended.returncode == -signal.SIGKILL
    run(tmp_path / "r")
    assert len(CALLS) == 4 - after
    run(tmp_path / "whole")
    names = {"results.json", "runs.csv", "line.png", "tables.html"}
    for name in names:
        assert (tmp_path / "r" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_rows_of_other_code_are_refused_or_taken_over(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "code_version", lambda: "old")
    run(tmp_path / "old")
    monkeypatch.undo()
    with pytest.raises(OutputFolderError, match=r"code is.*by runs_from"):
        run(tmp_path / "old")
    CALLS.clear()
    result = run(tmp_path / "new", runs_from=tmp_path / "old", seeds=3)
    assert CALLS == [(2, 2)]
    assert result.as_dict()["by_earlier_code"] == 4
    assert result.rows["arrays"][0]["curve"].tolist() == [0, 1, 2]


REFUSED = {
    "study": (lambda path: run_study("tension-metods"), "did you mean tension-methods"),
    "recipe": (lambda path: run(path, recipe="other"), "recipe: 'other' is unknown for squares"),
    "seeds": (lambda path: run(path, seeds=0), "seeds: found 0; accepted: 1 to 10000"),
    "runs from": (lambda path: run(path / "r", runs_from=path), "accepted: a folder of this study"),
    "other form": (
        lambda path: (run(path / "r"), run(path / "r", quick=False)),
        "quick is true there, false here; name another folder or add overwrite",
    ),
}


@pytest.mark.parametrize("text", ["nonsense\n", "[1]\n", "3\n", '["a", 1]\n', '["a", "b", {}]\n'])
def test_rows_of_nonsense_are_one_line(tmp_path, text):
    run(tmp_path / "old")
    (tmp_path / "old" / ROWS).write_text(text)
    with pytest.raises(CdprError, match=r"rows.jsonl: line 1: found no row of a study"):
        run(tmp_path / "new", runs_from=tmp_path / "old")


@pytest.mark.parametrize(("call", "words"), REFUSED.values(), ids=REFUSED)
def test_refusal(tmp_path, call, words):
    with pytest.raises(CdprError, match=words) as caught:
        call(tmp_path)
    assert len(str(caught.value).splitlines()) == 1


def test_a_quick_form_that_is_coarse_judges_nothing():
    coarse = Study(name="squares", title="", cases=cases, coarse=True, facts=FACTS)
    assert run(study=coarse).statements[0]["verdict"] == "not judged in the quick form"
    assert run(study=coarse, quick=False).statements[0]["verdict"] == "confirmed"


def test_a_digest_knows_function_and_arguments():
    assert digest(partial(square, 3)) == digest(partial(square, np.int64(3)))
    others = [partial(square, 4), partial(square, 3, seed=1), partial(stumble, 3)]
    assert len({digest(one) for one in [partial(square, 3), *others]}) == 4


@pytest.mark.parametrize(
    ("column", "unit"),
    [("error_m", "m"), ("speed_m_s", "m/s"), ("moment_n_m", "N m"), ("m", ""), ("name", "")],
)
def test_units_are_the_ends_of_names(column, unit):
    assert unit_of(column) == unit


def test_tables_of_names_are_columns_at_any_depth():
    rows = pd.DataFrame({"a": [1, 2], "of": [{"b": 3, "c": {"d": 4}}, {"b": 5, "c": None}]})
    spread = module.with_names_of_tables(rows)
    assert spread["of.b"].tolist() == [3, 5]
    assert spread["of.c.d"].fillna(0).tolist() == [4, 0]


def test_a_form_says_how_often():
    assert [Form().times(5), Form(quick=True).times(5), Form(seeds=9).times(5, most=3)] == [5, 1, 3]
