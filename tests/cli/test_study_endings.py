"""`cdpr study` and `cdpr reproduce`: how they end, failures and stops included, and go on."""

import errno
import json
import os
import signal
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies import report
from cdpr_drake.analyses.studies.study import STUDIES, Case, Study
from tests.cli import commands
from tests.messages import printed

STUDY, REPRODUCE = ("study", "toy", "--out", "r"), ("reproduce", "--only", "toy", "--out", "r")
BOTH = pytest.mark.parametrize("words", [STUDY, REPRODUCE], ids=["study", "reproduce"])

EVENTS = {}
"""What happens before a number is squared."""


def square(x):
    EVENTS.get(x, lambda: None)()
    return {"square_m2": float(x * x)}


def line(rows):
    figure = Figure()
    figure.subplots().plot(rows["square_m2"])
    return figure


def no_line(rows):
    raise ValueError("no such colour\nat all")


@pytest.fixture(autouse=True)
def toy(monkeypatch, here):
    """A study of four squares; a change of it."""
    EVENTS.clear()
    monkeypatch.setenv("COLUMNS", "400")
    monkeypatch.setitem(STUDIES, "toy", "toy")

    def change(**parts):
        study = Study(**{
            "name": "toy", "title": "Squares", "figures": {"first": line, "good": line},
            "cases": lambda form: [Case(keys={"x": x}, call=partial(square, x)) for x in range(4)],
            "tables": {"toy table": lambda rows: rows[["x", "square_m2"]]}, **parts,
        })  # fmt: skip
        monkeypatch.setitem(
            sys.modules, "cdpr_drake.analyses.studies.toy", SimpleNamespace(STUDY=study)
        )

    change()
    return change


@pytest.fixture
def run(capsys):
    """Runs a command; returns exit code, stdout and stderr."""
    return lambda *words: commands.run(capsys, *words, "--workers", "1")


def signals(number, times=1):
    """What sends signals to this process."""
    return lambda: [signal.raise_signal(number) for _ in range(times)]


def results(folder):
    return json.loads((folder / "results.json").read_text())


def squares(folder):
    return [row["square_m2"] for row in results(folder)["runs"]]


def test_a_study_of_the_table_is_a_command(run, here):
    code, out, _ = run("study", "toy", "--quick", "--json")
    assert (code, json.loads(out)["study"]) == (0, "toy")
    assert squares(here / "studies" / "toy") == [0.0, 1.0, 4.0, 9.0]
    code, out, _ = run(*STUDY)
    assert code == 0
    assert "toy table" in out
    assert "results: r" in out
    assert "toy]" in run("study", "--help")[1]  # the last name of the list


def test_a_figure_that_fails_is_named_and_costs_no_other(run, toy, here):
    toy(figures={"first": no_line, "good": line})
    code, _, err = run(*STUDY, "--figure-format", "png,svg")
    assert code == 3
    assert "cdpr: r/first.png: not written: no such colour\n" in err
    assert squares(here / "r") == [0.0, 1.0, 4.0, 9.0]
    assert {path.name for path in (here / "r").glob("*.*g")} == {"good.png", "good.svg"}
    code, _, err = run("reproduce", "--only", "toy", "--out", "all")
    assert (code, "cdpr: all/toy/first.png: not written: no such colour\n" in err) == (3, True)


@BOTH
def test_a_stop_before_the_figures_leaves_them_to_the_same_command(run, toy, here, words):
    toy(figures={"first": lambda rows: (signals(signal.SIGINT)(), line(rows))[1], "good": line})
    code, _, err = run(*words)
    assert (code, "good.png: not written: not begun" in err) == (130, True)
    toy()
    assert run(*words)[0] == 0


@BOTH
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_keeps_what_is_done_and_the_same_command_goes_on(run, here, words, number):
    EVENTS[1] = signals(number)
    code, _, err = run(*words)
    assert code == 130
    assert "goes on" in err
    EVENTS.clear()
    code, _, err = run(*words)
    assert code == 0
    assert "2 of 4 runs were there already" in err
    folder = here / "r" / "toy" if words == REPRODUCE else here / "r"
    assert squares(folder) == [0.0, 1.0, 4.0, 9.0]


@BOTH
def test_a_second_ctrl_c_ends_it_at_once(run, words):
    EVENTS[2] = signals(signal.SIGINT, 2)
    assert run(*words)[0] == 130
    EVENTS.clear()
    code, _, err = run(*words)
    assert (code, "2 of 4 runs were there already" in err) == (0, True)


def test_the_first_ctrl_c_is_answered_at_once(capfd):
    """Before what is under way has ended, which may take a minute."""
    lines = []

    def look():
        printed(capfd)
        signal.raise_signal(signal.SIGINT)
        lines.append(printed(capfd).err)

    EVENTS[2] = look
    commands.ended(*STUDY, "--workers", "1")
    assert lines == ["Stopping: what has begun is finished and kept; Ctrl-C again ends this now\n"]


def test_the_default_folder_of_a_stopped_study_goes_on_and_a_whole_one_is_left_alone(run, here):
    EVENTS[1] = signals(signal.SIGINT)
    assert run("study", "toy")[0] == 130
    EVENTS.clear()
    assert "2 of 4 runs" in run("study", "toy")[2]
    assert "results: studies/toy-2" in run("study", "toy")[1]


def raise_error():
    raise RuntimeError("no such thing")


def test_a_row_that_fails_is_named_and_the_others_are_kept(run, here):
    EVENTS[2] = raise_error
    for words, folder in ((STUDY, here / "r"), (REPRODUCE[:-1], here / "all" / "toy")):
        command = (*words, "all") if words != STUDY else words
        code, _, err = run(*command)
        assert code == 5
        assert "failed: toy: " * (words != STUDY) + "x 2: RuntimeError: no such thing" in err
        assert squares(folder) == [0.0, 1.0, 9.0]
    EVENTS.clear()
    assert run(*STUDY)[0] == 0


def test_a_study_that_fails_does_not_end_the_others(run, toy, monkeypatch, here):
    calls = iter([raise_error, lambda: {"sum": 1.0}])
    toy(numbers=lambda rows: next(calls)())
    monkeypatch.setitem(STUDIES, "other", "toy")
    code, _, err = run("reproduce", "--quick", "--only", "toy,other", "--out", "r")
    assert code == 5
    assert "cdpr: study failed: toy: RuntimeError: no such thing" in err
    assert results(here / "r" / "other")["numbers"] == {"sum": 1.0}


def test_other_arguments_are_refused_and_overwrite_begins_anew(run, here):
    EVENTS[1] = signals(signal.SIGINT)
    run("study", "toy", "--out", "a [b]", "--quick")
    before = (here / "a [b]" / "rows.jsonl").read_bytes()
    code, _, err = run("study", "toy", "--out", "a [b]")
    assert (code, len(err.strip().splitlines())) == (2, 1)
    assert "quick is true there, false here" in err
    assert "--overwrite" in err
    assert (here / "a [b]" / "rows.jsonl").read_bytes() == before
    EVENTS.clear()
    code, _, err = run("study", "toy", "--out", "a [b]", "--quick", "--overwrite")
    assert (code, "were there already" in err) == (0, False)


def test_a_reproduction_does_not_mix_with_results_of_a_study(run, here):
    run(*STUDY)
    before = sorted(here.rglob("*"))
    code, _, err = run(*REPRODUCE)
    assert (code, "holds other results" in err) == (2, True)
    assert sorted(here.rglob("*")) == before


def test_a_disk_that_is_full_at_any_write_costs_nothing_that_was_finished(
    run, toy, monkeypatch, here
):
    toy(figures={"line": line})
    run("study", "toy", "--out", "whole")
    files = {path.name: path.read_bytes() for path in (here / "whole").glob("[!.]*")}
    replace, codes = Path.replace, []
    for failing in range(1, 40):
        folder, left = here / f"r{failing}", iter(range(1, failing))

        def full(part, target, left=left):
            if next(left, None) is None:
                raise OSError(errno.ENOSPC, "No space left on device", str(part))
            return replace(part, target)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", full)
            code, _, err = run("study", "toy", "--out", folder.name)
        codes.append(code)
        assert code == 0 or "No space left on device" in err
        assert "Traceback" not in err
        code, _, err = run("study", "toy", "--out", folder.name)
        assert code == 0
        assert {path.name: path.read_bytes() for path in folder.glob("[!.]*")} == files
        if codes[-1] == 0:
            break
    assert set(codes) == {0, 2, 3}


def test_a_report_that_is_dropped_leaves_the_one_before(run, monkeypatch, here):
    run(*REPRODUCE)
    page = (here / "r" / "report.html").read_bytes()
    monkeypatch.setattr(report, "page_of", lambda found: signals(signal.SIGINT, 2)())
    assert run(*REPRODUCE)[0] == 130
    assert (here / "r" / "report.html").read_bytes() == page


def test_a_report_of_a_study_again_and_beside_an_older_one(run, here):
    words = ("reproduce", "--quick", "--only", "worked-examples", "--out", "r")
    code, out, _ = run(*words, "--json")
    assert code == 0
    found = json.loads(out)
    assert {fact["verdict"] for fact in found["facts"]} > {"confirmed", "not confirmed"}
    assert found["studies"] == {"worked-examples": True}
    page = (here / "r" / "report.html").read_text()
    assert page.rstrip().endswith("</html>")
    assert page.count("data:image/png") == page.count("<img")
    assert "Changed since" not in page
    before = (here / "r" / "facts.json").read_text()
    (here / "older.json").write_text(before.replace('"confirmed"', '"in part"', 1))
    code, out, err = run(*words, "--against", "older.json")
    assert (code, "4 of 4 runs were there already" in err) == (0, True)
    assert "report: r/report.html" in out
    assert "Changed since" in (here / "r" / "report.html").read_text()
    code, _, err = run("reproduce", "--only", "worked-examples", "--out", "r")
    assert (code, "quick is true there, false here" in err) == (2, True)


def test_without_a_browser_a_pdf_is_said_to_be_missing(run, monkeypatch):
    monkeypatch.setenv("PATH", os.devnull)
    code, _, err = run(*REPRODUCE, "--pdf")
    assert (code, "--pdf: no browser here prints" in err) == (3, True)
