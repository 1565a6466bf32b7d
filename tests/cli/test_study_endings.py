"""How `cdpr study` and `cdpr reproduce` end when something fails late or they are stopped."""

import errno
import json
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.front import reproduction
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_files import write_figures
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.cli.app import main
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.errors import CdprError
from tests.messages import printed


class Squares:
    """Squares of the numbers of the items."""

    def __call__(self, start, stop):
        return {"squares": np.arange(start, stop) ** 2.0}


def good_figure():
    figure, axes = new_figure(1, 1, (3.0, 2.0), "Squares")
    axes.plot([0.0, 1.0])
    return figure


def bad_figure():
    raise ValueError("no such colour\nat all")


DRAWN = {"bad": bad_figure, "good": good_figure}


@dataclass(frozen=True, eq=False)
class ToyResult:
    found: dict
    progress: WorkProgress

    @property
    def interrupted(self):
        return self.progress.done < self.progress.total

    def as_dict(self):
        squares = self.found.get("squares", {}).get("squares", np.zeros(0))
        return {"interrupted": self.interrupted, "squares": squares.tolist(), "statements": []}

    def tables(self):
        return []

    def write(self, folder, formats):
        write_json(folder / "results.json", self.as_dict())
        return write_figures(folder, DRAWN, formats)


def study_toy(quick, session):
    arguments = {"study": "toy", "quick": quick}
    result = run_study_sweep({"squares": (Squares(), 4)}, 1, "items", arguments, session)
    return ToyResult(result.finished, result.progress)


@pytest.fixture(autouse=True)
def _toy(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "400")
    monkeypatch.setitem(STUDIES, "toy", StudyEntry(study_toy))


@pytest.fixture
def run(capsys):
    """Runs a command; returns exit code, stdout and stderr."""

    def command(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([*arguments, "--workers", "1"])
        out, err = printed(capsys)
        return ended.value.code, out, err

    return command


@pytest.fixture
def stopped(run, monkeypatch):
    """The same, where Ctrl-C comes after two items."""

    def command(*arguments):
        asked = iter(range(2))
        with monkeypatch.context() as patch:
            patch.setattr(StopRequest, "__call__", lambda self: next(asked, None) is None)
            return run(*arguments)

    return command


def results(folder):
    return json.loads((folder / "results.json").read_text())


def test_a_figure_that_fails_is_named_and_costs_no_other(run, tmp_path):
    code, _, err = run("study", "toy", "--out", "r")
    assert code == 3
    assert "cdpr: r/bad.png: not written: no such colour\n" in err
    assert "The data is complete in r" in err
    assert results(tmp_path / "r")["squares"] == [0.0, 1.0, 4.0, 9.0]
    there = sorted(path.name for path in (tmp_path / "r").iterdir())
    assert there == [".cdpr_drake.json", "arguments.json", "good.png", "parts.npz", "results.json"]


def test_an_interrupted_study_names_its_missing_figures_too(stopped):
    code, _, err = stopped("study", "toy", "--out", "r")
    assert code == 130
    assert "to continue:\ncdpr study toy --out r" in err
    assert "r/bad.png: not written" in err


def test_a_reproduction_says_which_figures_are_missing_and_tries_again(run, monkeypatch):
    asked = ("reproduce", "--only", "toy", "--out", "r")
    code, _, err = run(*asked)
    assert code == 3
    assert "cdpr: toy: the data is complete; not written: bad.png: no such colour" in err
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    code, _, err = run(*asked)
    assert (code, "taken over" in err) == (0, False)
    code, _, err = run(*asked)
    assert (code, "taken over" in err) == (0, True)


def test_older_numbers_do_not_stand_for_those_that_could_not_be_written(
    run, stopped, monkeypatch, tmp_path
):
    stopped("study", "toy", "--out", "r")

    def full(path, found):
        raise OSError(28, "No space left on device", str(path))

    with monkeypatch.context() as patch:
        patch.setitem(globals(), "write_json", full)
        code, _, err = run("study", "toy", "--out", "r")
    assert code == 2
    assert "No space left on device" in err
    assert "complete" not in err
    code, _, err = run("study", "toy", "--out", "r")
    assert "complete already, nothing was computed" in err
    assert not results(tmp_path / "r")["interrupted"]


def test_what_stops_early_does_not_cost_the_older_results(run, stopped, tmp_path):
    run("study", "toy", "--out", "r")
    stopped("study", "toy", "--out", "r", "--overwrite")
    assert results(tmp_path / "r")["interrupted"]
    assert results(tmp_path / "r-before")["squares"] == [0.0, 1.0, 4.0, 9.0]
    run("study", "toy", "--out", "r", "--overwrite")
    assert not results(tmp_path / "r")["interrupted"]


@pytest.mark.parametrize(
    "command", [["study", "toy"], ["reproduce", "--only", "toy"]], ids=["study", "reproduce"]
)
def test_overwrite_keeps_what_is_not_cdprs_own_and_names_it(run, monkeypatch, tmp_path, command):
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    run(*command, "--out", "r")
    _, _, err = run(*command, "--out", "r", "--overwrite")
    assert "Kept" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["r"]
    (tmp_path / "r" / "notes.txt").write_text("years")
    code, _, err = run(*command, "--out", "r", "--overwrite")
    assert code == 0
    assert "Kept in r-kept: notes.txt: not written by cdpr" in err
    assert [path.name for path in (tmp_path / "r-kept").iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("begun", [False, True])
def test_what_fails_says_where_the_older_results_are(run, monkeypatch, tmp_path, begun):
    run("study", "toy", "--out", "r")

    def failing(quick, session):
        if begun:
            session.folder.mkdir()
        raise CdprError("no graphics here")

    monkeypatch.setitem(STUDIES, "toy", StudyEntry(failing))
    code, _, err = run("study", "toy", "--out", "r", "--overwrite")
    assert (code, "no graphics here" in err) == (2, True)
    kept = tmp_path / ("r-before" if begun else "r")
    assert results(kept)["squares"] == [0.0, 1.0, 4.0, 9.0]
    assert ("older results are in" in err) == begun


@pytest.mark.parametrize("command", [["study", "toy"], ["reproduce", "--only", "toy"]])
def test_a_second_ctrl_c_ends_it_at_once_and_says_what_is_kept(run, monkeypatch, command):
    store = Squares.__call__

    def twice(self, start, stop):
        if start == 2:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        return store(self, start, stop)

    with monkeypatch.context() as patch:
        patch.setattr(Squares, "__call__", twice)
        code, _, err = run(*command, "--out", "r")
    assert code == 130
    assert "what was finished is kept in" in err
    assert err.count("kept in") == 1
    code, _, err = run(*command, "--out", "r")
    assert code == 3
    assert "2 of 4 items were there already" in err or "continued: it was stopped before" in err


def interrupting(number, times, then):
    """What sends a signal to this process some times before it does something."""

    def call(*arguments):
        for _ in range(times):
            signal.raise_signal(number)
        return then(*arguments)

    return call


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("command", [["study", "toy"], ["reproduce", "--only", "toy"]])
def test_the_first_ctrl_c_is_answered_at_once(capfd, monkeypatch, command, number):
    """Before what is under way has ended, which may take a minute."""
    seen = []

    def looked_at(self, start, stop):
        if start == 2:
            printed(capfd)
            signal.raise_signal(number)
            seen.append(printed(capfd).err)
        return squares(self, start, stop)

    squares = Squares.__call__
    monkeypatch.setattr(Squares, "__call__", looked_at)
    with pytest.raises(SystemExit):
        main([*command, "--out", "r", "--workers", "1"])
    (line,) = seen[0].splitlines()
    assert line.startswith("Stopping: waits for what")
    assert "Ctrl-C again ends" in line


def report(folder):
    """The page, whole."""
    words = (folder / "report.html").read_text()
    assert words.endswith("</main></body></html>\n")
    assert [path.name for path in folder.iterdir() if ".part-" in path.name] == []
    return words


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_ctrl_c_ends_the_study_and_the_report_has_what_is_there(
    run, monkeypatch, tmp_path, number
):
    monkeypatch.setitem(STUDIES, "more", StudyEntry(study_toy))
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    begun = []

    def twice(self, start, stop):
        begun.append(start)
        if len(begun) == 7:  # in the second study
            interrupting(number, 2, lambda: None)()
        return squares(self, start, stop)

    squares = Squares.__call__
    with monkeypatch.context() as patch:
        patch.setattr(Squares, "__call__", twice)
        code, _, err = run("reproduce", "--only", "toy,more", "--out", "r")
    assert code == 130
    assert "toy: finished" in err
    assert "more: stopped" in err
    assert ">finished<" in report(tmp_path / "r")
    assert ">stopped<" in report(tmp_path / "r")
    code, _, err = run("reproduce", "--only", "toy,more", "--out", "r")
    assert code == 0
    assert ">stopped<" not in report(tmp_path / "r")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("before", [0, 1])
def test_a_signal_while_the_report_is_written_does_not_cost_it(
    run, monkeypatch, tmp_path, number, before
):
    """Also where one has asked the studies to stop already."""
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    squares = Squares.__call__
    monkeypatch.setattr(Squares, "__call__", interrupting(number, before, squares))
    write = reproduction.write_report
    monkeypatch.setattr(reproduction, "write_report", interrupting(number, 1, write))
    code, _, _ = run("reproduce", "--only", "toy", "--out", "r")
    assert code == 130 * before
    assert (">stopped<" if before else ">finished<") in report(tmp_path / "r")


def test_a_report_that_is_dropped_leaves_the_one_before(run, monkeypatch, tmp_path):
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    run("reproduce", "--only", "toy", "--out", "r")
    whole = report(tmp_path / "r")
    write = Path.write_text

    def half(path, words, **options):
        if "report.html" in path.name:
            write(path, words[: len(words) // 2], **options)
            interrupting(signal.SIGINT, 2, lambda: None)()
        return write(path, words, **options)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_text", half)
        code, _, err = run("reproduce", "--only", "toy", "--out", "r")
    assert code == 130
    assert "cdpr: stopped; what was finished is kept in" in err
    assert report(tmp_path / "r") == whole


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_figures_are_written_lets_them_be_written(
    run, monkeypatch, tmp_path, number
):
    def signalled():
        signal.raise_signal(number)
        return good_figure()

    monkeypatch.setitem(DRAWN, "bad", signalled)
    code, _, _ = run("study", "toy", "--out", "r")
    assert code == 0
    assert (tmp_path / "r" / "bad.png").exists()


@pytest.mark.parametrize(
    ("option", "value"),
    [("--seeds", "5:5"), ("--seeds", "-1"), ("--seeds", "0"), ("--seeds", "1000000000000"),
     ("--workers", "0"), ("--workers", "-3")],
)  # fmt: skip
def test_numbers_out_of_range_are_refused_before_anything_is_written(
    capsys, tmp_path, option, value
):
    with pytest.raises(SystemExit) as ended:
        main(["study", "fusion", "--quick", "--out", "r", option, value])
    said = printed(capsys).err
    assert ended.value.code == 2
    assert option in said
    assert value in said
    assert len(said.strip().splitlines()) == 1
    assert not any(tmp_path.iterdir())


def test_a_damaged_results_file_is_made_again_and_spoils_no_report(run, monkeypatch, tmp_path):
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    asked = ("reproduce", "--only", "toy", "--out", "r")
    run(*asked)
    damaged = tmp_path / "r" / "studies" / "toy" / "results.json"
    damaged.write_text('{"squares": [0.')
    code, _, err = run(*asked)
    assert (code, "taken over" in err) == (0, False)
    assert results(damaged.parent)["squares"] == [0.0, 1.0, 4.0, 9.0]


def test_a_reproduction_does_not_mix_with_results_of_a_study(run, tmp_path):
    run("study", "toy", "--out", "r")
    before = sorted(tmp_path.rglob("*"))
    code, _, err = run("reproduce", "--only", "toy", "--out", "r")
    assert (code, "cdpr reproduce did not write" in err) == (2, True)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_disk_that_is_full_at_any_write_costs_nothing_that_was_finished(
    run, monkeypatch, tmp_path
):
    monkeypatch.setitem(DRAWN, "bad", good_figure)
    run("study", "toy", "--out", "whole")
    wanted = {path.name: path.read_bytes() for path in (tmp_path / "whole").iterdir()}
    replace, codes = Path.replace, []
    for failing in range(1, 20):
        folder, left = tmp_path / f"r{failing}", iter(range(1, failing))

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
        stored = 0 if not (folder / "chunks").is_dir() else len(list((folder / "chunks").iterdir()))
        joined = failing > 7  # the four chunks, which are one file from then on
        assert (folder / "parts.npz").exists() == joined
        assert stored == (0 if joined else max(0, failing - 3))
        code, _, err = run("study", "toy", "--out", folder.name)
        assert code == 0
        there = {path.name: path.read_bytes() for path in folder.iterdir()}
        assert there == wanted
        if codes[-1] == 0:
            break
    assert codes == [2] * 8 + [3] * 2 + [0]  # marker, arguments, chunks, parts, numbers; figures
