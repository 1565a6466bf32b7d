"""`cdpr study` and `cdpr reproduce`: how they end, late failures and stops included, and go on."""

import errno
import json
import shlex
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.front import reproduction
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reporting.progress import WorkProgress
from cdpr_drake.analyses.reproduction import digest_pdf
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION, MET_FITTED
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.visualization.figure_files import write_figures
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.cli.process import StopRequest
from cdpr_drake.cli.study import _command
from cdpr_drake.errors import CdprError
from tests.cli import commands
from tests.messages import printed

ROOT = Path(__file__).parents[2]
SQUARES = [0.0, 1.0, 4.0, 9.0]
STUDY, REPRODUCE = ("study", "toy", "--out", "r"), ("reproduce", "--only", "toy", "--out", "r")
BOTH = pytest.mark.parametrize("asked", [STUDY, REPRODUCE], ids=["study", "reproduce"])


class Squares:
    """Squares of the numbers of the items."""

    def __call__(self, start, stop):
        return {"squares": np.arange(start, stop) ** 2.0}


SQUARE = Squares.__call__


def good_figure():
    figure, axes = new_figure(1, 1, (3.0, 2.0), "Squares")
    axes.plot([0.0, 1.0])
    return figure


def bad_figure():
    raise ValueError("no such colour\nat all")


DRAWN = {"first": good_figure, "good": good_figure}


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
def _toy(monkeypatch, here):
    monkeypatch.setenv("COLUMNS", "400")
    monkeypatch.setitem(STUDIES, "toy", StudyEntry(study_toy))


@pytest.fixture
def spoiled(monkeypatch):
    """The first figure of the study cannot be drawn."""
    monkeypatch.setitem(DRAWN, "first", bad_figure)


@pytest.fixture
def run(capsys):
    """Runs a command; returns exit code, stdout and stderr."""
    return lambda *words: commands.run(capsys, *words, "--workers", "1")


@pytest.fixture
def stopped(run, monkeypatch):
    """The same, where Ctrl-C comes after two items."""

    def command(*words):
        asked = iter(range(2))
        with monkeypatch.context() as patch:
            patch.setattr(StopRequest, "__call__", lambda self: next(asked, None) is None)
            return run(*words)

    return command


@pytest.fixture
def disturbed(monkeypatch):
    """Lets something happen before an item is computed; a function of the item's number."""
    return lambda event: monkeypatch.setattr(
        Squares, "__call__", lambda self, start, stop: event(start) or SQUARE(self, start, stop)
    )


def results(folder):
    return json.loads((folder / "results.json").read_text())


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def report(folder):
    """The page, whole."""
    words = (folder / "report.html").read_text()
    assert words.endswith("</main></body></html>\n")
    assert [name for name in names(folder) if ".part-" in name] == []
    return words


def test_a_figure_that_fails_is_named_and_costs_no_other(run, spoiled, here):
    code, _, err = run(*STUDY)
    assert code == 3
    assert "cdpr: r/first.png: not written: no such colour\n" in err
    assert "The data is complete in r" in err
    assert results(here / "r")["squares"] == SQUARES
    made = [".cdpr_drake.json", "arguments.json", "good.png", "parts.npz", "results.json"]
    assert names(here / "r") == made


def test_figures_have_the_formats_asked_for_also_when_it_goes_on(run, here):
    assert run(*STUDY, "--format", "pdf,png")[0] == 0
    assert {"good.pdf", "good.png", "first.pdf"} < set(names(here / "r"))
    words = _command("toy", "o", True, False, ("pdf", "svg"))
    assert words == "cdpr study toy --out o --quick --format pdf,svg"
    assert "--format" not in _command("toy", "o", True, False, ("png",))


def test_an_interrupted_study_names_its_missing_figures_too(stopped, spoiled):
    code, _, err = stopped(*STUDY)
    assert code == 130
    assert "to continue:\ncdpr study toy --out r" in err
    assert "r/first.png: not written" in err


def test_an_interrupted_study_names_the_command_that_continues_it(run, stopped, here):
    code, out, err = stopped("study", "toy", "--quick", "--json")
    assert code == 130
    assert json.loads(out)["interrupted"]
    command = shlex.split(err.strip().splitlines()[-1])
    assert command[:3] == ["cdpr", "study", "toy"]
    assert results(here / "studies" / "toy")["interrupted"]
    code, out, err = run(*command[1:])
    assert code == 0
    assert "2 of 4 items were there already" in err
    assert json.loads(out)["squares"] == SQUARES
    code, again, err = run(*command[1:])
    assert "complete already, nothing was computed" in err
    assert again == out


def test_other_arguments_are_refused_and_overwrite_begins_anew(run, stopped, here):
    asked = ("study", "toy", "--out", "a [b]")
    stopped(*asked, "--quick")
    kept = names(here / "a [b]" / "chunks")
    assert len(kept) == 2
    code, _, err = run(*asked)
    assert code == 2
    assert "quick is true there, false here" in err
    assert len(err.strip().splitlines()) == 1
    assert names(here / "a [b]" / "chunks") == kept
    _, _, err = stopped(*asked, "--quick", "--overwrite")
    assert "were there already" not in err
    words = shlex.split(err.strip().splitlines()[-1])
    assert words == ["cdpr", *asked, "--quick", "--workers", "1"]
    (here / "r").mkdir()
    (here / "r" / "thesis.txt").write_text("x")
    code, _, err = run(*STUDY)
    assert (code, names(here / "r")) == (2, ["thesis.txt"])
    assert "holds files already" in err


KILLED = commands.killed_after(
    2,
    commands.STORE,
    f"""
sys.path.append({str(ROOT)!r})
from tests.cli.test_study_endings import STUDIES, StudyEntry, study_toy
STUDIES["toy"] = StudyEntry(study_toy)
""",
)


def test_a_killed_study_continues(run, here):
    # In one process; workers that are left behind: `test_a_killed_sweep_continues_and_says_so`.
    words = [sys.executable, "-c", KILLED, *STUDY, "--workers", "1"]
    assert subprocess.run(words, check=False).returncode == -signal.SIGKILL
    assert not (here / "r" / "results.json").exists()
    code, _, err = run(*STUDY)
    assert (code, "2 of 4 items were there already" in err) == (0, True)
    assert results(here / "r")["squares"] == SQUARES


def test_a_reproduction_says_which_figures_are_missing_and_tries_again(run, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setitem(DRAWN, "first", bad_figure)
        code, _, err = run(*REPRODUCE)
    assert code == 3
    assert "cdpr: toy: the data is complete; not written: first.png: no such colour" in err
    code, _, err = run(*REPRODUCE)
    assert (code, "taken over" in err) == (0, False)
    code, _, err = run(*REPRODUCE)
    assert (code, "taken over" in err) == (0, True)


def test_older_numbers_do_not_stand_for_those_that_could_not_be_written(
    run, stopped, monkeypatch, here
):
    stopped(*STUDY)

    def full(path, found):
        raise OSError(28, "No space left on device", str(path))

    with monkeypatch.context() as patch:
        patch.setitem(globals(), "write_json", full)
        code, _, err = run(*STUDY)
    assert (code, "complete" in err) == (2, False)
    assert "No space left on device" in err
    assert "complete already, nothing was computed" in run(*STUDY)[2]
    assert not results(here / "r")["interrupted"]


def test_what_stops_early_does_not_cost_the_older_results(run, stopped, here):
    run(*STUDY)
    stopped(*STUDY, "--overwrite")
    assert results(here / "r")["interrupted"]
    assert results(here / "r-before")["squares"] == SQUARES
    run(*STUDY, "--overwrite")
    assert not results(here / "r")["interrupted"]


@BOTH
def test_overwrite_keeps_what_is_not_cdprs_own_and_names_it(run, here, asked):
    run(*asked)
    assert "Kept" not in run(*asked, "--overwrite")[2]
    assert names(here) == ["r"]
    (here / "r" / "notes.txt").write_text("years")
    code, _, err = run(*asked, "--overwrite")
    assert code == 0
    assert "Kept in r-kept: notes.txt: not written by cdpr" in err
    assert names(here / "r-kept") == ["notes.txt"]


@pytest.mark.parametrize("begun", [False, True])
def test_what_fails_says_where_the_older_results_are(run, monkeypatch, here, begun):
    run(*STUDY)

    def failing(quick, session):
        if begun:
            session.folder.mkdir()
        raise CdprError("no graphics here")

    monkeypatch.setitem(STUDIES, "toy", StudyEntry(failing))
    code, _, err = run(*STUDY, "--overwrite")
    assert (code, "no graphics here" in err) == (2, True)
    assert results(here / ("r-before" if begun else "r"))["squares"] == SQUARES
    assert ("older results are in" in err) == begun


def test_a_study_that_fails_is_named_and_so_is_the_exit_code(run, monkeypatch):
    def broken(quick, session):
        raise RuntimeError("no such thing")

    monkeypatch.setitem(STUDIES, "case-8", StudyEntry(broken))
    code, out, err = run("reproduce", "--only", "case-8", "--out", "r")
    assert code == 5
    assert "cdpr: study failed: case-8: RuntimeError: no such thing" in err
    assert "study failed" in out


def interrupting(number, times, then=lambda: None):
    """What sends a signal to this process some times before it does something."""

    def call(*arguments):
        for _ in range(times):
            signal.raise_signal(number)
        return then(*arguments)

    return call


@BOTH
def test_a_second_ctrl_c_ends_it_at_once_and_says_what_is_kept(run, disturbed, asked):
    disturbed(lambda item: item == 2 and interrupting(signal.SIGINT, 2)())
    code, _, err = run(*asked)
    assert code == 130
    assert "what was finished is kept in" in err
    assert err.count("kept in") == 1
    disturbed(lambda item: None)
    code, _, err = run(*asked)
    assert code == 0
    assert "2 of 4 items were there already" in err or "continued: it was stopped before" in err


@pytest.mark.parametrize(("asked", "number"), [(STUDY, signal.SIGTERM), (REPRODUCE, signal.SIGINT)])
def test_the_first_ctrl_c_is_answered_at_once(capfd, disturbed, asked, number):
    """Before what is under way has ended, which may take a minute."""
    seen = []

    def looked_at(item):
        if item == 2:
            printed(capfd)
            signal.raise_signal(number)
            seen.append(printed(capfd).err)

    disturbed(looked_at)
    commands.ended(*asked, "--workers", "1")
    (line,) = seen[0].splitlines()
    assert line.startswith("Stopping: waits for what")
    assert "Ctrl-C again ends" in line


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_ctrl_c_ends_the_study_and_the_report_has_what_is_there(
    run, monkeypatch, disturbed, here, number
):
    monkeypatch.setitem(STUDIES, "more", StudyEntry(study_toy))
    asked = ("reproduce", "--only", "toy,more", "--out", "r")
    begun = []

    def twice(item):
        begun.append(item)
        if len(begun) == 7:  # in the second study
            interrupting(number, 2)()

    disturbed(twice)
    code, _, err = run(*asked)
    assert code == 130
    assert "toy: finished" in err
    assert "more: stopped" in err
    assert ">finished<" in report(here / "r")
    assert ">stopped<" in report(here / "r")
    assert run(*asked)[0] == 0
    assert ">stopped<" not in report(here / "r")


@pytest.mark.parametrize(("number", "before"), [(signal.SIGINT, 0), (signal.SIGTERM, 1)])
def test_a_signal_while_the_report_is_written_does_not_cost_it(
    run, monkeypatch, disturbed, here, number, before
):
    """Also where one has asked the studies to stop already."""
    disturbed(lambda item: interrupting(number, before)())
    write = reproduction.write_report
    monkeypatch.setattr(reproduction, "write_report", interrupting(number, 1, write))
    assert run(*REPRODUCE)[0] == 130 * before
    assert (">stopped<" if before else ">finished<") in report(here / "r")


def test_a_report_that_is_dropped_leaves_the_one_before(run, monkeypatch, here):
    run(*REPRODUCE)
    whole = report(here / "r")
    write = Path.write_text

    def half(path, words, **options):
        if "report.html" in path.name:
            write(path, words[: len(words) // 2], **options)
            interrupting(signal.SIGINT, 2)()
        return write(path, words, **options)

    monkeypatch.setattr(Path, "write_text", half)
    code, _, err = run(*REPRODUCE)
    assert code == 130
    assert "cdpr: stopped; what was finished is kept in" in err
    assert report(here / "r") == whole


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_figures_are_written_lets_them_be_written(run, monkeypatch, here, number):
    monkeypatch.setitem(DRAWN, "first", interrupting(number, 1, good_figure))
    assert run(*STUDY)[0] == 0
    assert {"first.png", "good.png"} < set(names(here / "r"))


def test_a_damaged_results_file_is_made_again_and_spoils_no_report(run, here):
    run(*REPRODUCE)
    damaged = here / "r" / "studies" / "toy" / "results.json"
    damaged.write_text('{"squares": [0.')
    code, _, err = run(*REPRODUCE)
    assert (code, "taken over" in err) == (0, False)
    assert results(damaged.parent)["squares"] == SQUARES


def test_a_reproduction_does_not_mix_with_results_of_a_study(run, here):
    run(*STUDY)
    before = sorted(here.rglob("*"))
    code, _, err = run(*REPRODUCE)
    assert (code, "cdpr reproduce did not write" in err) == (2, True)
    assert sorted(here.rglob("*")) == before


def test_a_disk_that_is_full_at_any_write_costs_nothing_that_was_finished(run, monkeypatch, here):
    run("study", "toy", "--out", "whole")
    wanted = {path.name: path.read_bytes() for path in (here / "whole").iterdir()}
    replace, codes = Path.replace, []
    for failing in range(1, 20):
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
        stored = 0 if not (folder / "chunks").is_dir() else len(names(folder / "chunks"))
        joined = failing > 7  # the four chunks, which are one file from then on
        assert (folder / "parts.npz").exists() == joined
        assert stored == (0 if joined else max(0, failing - 3))
        assert run("study", "toy", "--out", folder.name)[0] == 0
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == wanted
        if codes[-1] == 0:
            break
    assert codes == [2] * 8 + [3] * 2 + [0]  # marker, arguments, chunks, parts, numbers; figures


def test_without_reportlab_the_rest_is_there_and_a_line_says_so(run, monkeypatch, here):
    monkeypatch.setattr(digest_pdf, "find_spec", lambda name: None)
    code, _, err = run(*REPRODUCE)
    assert code == 0
    words = "digest.pdf was not written: reportlab is not installed: pip install 'cdpr_drake"
    assert err.count(words) == 1
    assert report(here / "r")
    assert "digest.pdf" not in names(here / "r")


def test_a_digest_that_fails_is_named_and_the_rest_is_there(run, monkeypatch, here):
    def without_room():
        def full(path, story):
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(reproduction, "write_digest", full)
            return run(*REPRODUCE)

    code, _, err = without_room()
    assert code == 3
    assert "cdpr: digest.pdf was not written: [Errno 28] No space left on device" in err
    assert {"report.html", "summary.json"} < set(names(here / "r"))
    assert not [name for name in names(here / "r") if "digest" in name]
    assert run(*REPRODUCE)[0] == 0
    assert "digest.pdf" in names(here / "r")
    assert "(the one that is there is of an earlier report)" in without_room()[2]


REAL, ASKED = "worked-examples", ("worked-examples", "toy")


def test_a_study_as_it_is_beside_another_and_again(run, here):
    asked = ("reproduce", "--quick", "--only", ",".join(ASKED), "--out", "r")
    code, out, _ = run(*asked, "--json")
    assert code == 0
    found = json.loads(out)
    assert [state["status"] for state in found["studies"]] == ["finished"] * 2
    mine = [item for item in found["items"] if REAL in item["studies"]]
    judged = {"confirmed", "in part", "not confirmed", "not testable", "shown"}
    judged |= {MET_CONSTRUCTION, MET_FITTED}
    assert {item["verdict"] for item in mine} - {"not judged"} <= judged  # the quick form judges
    assert "missing" not in found["scorecard"]["all"]
    assert json.loads((here / "r" / "summary.json").read_text()) == found
    page = report(here / "r")
    drawn = {(item["source"], path) for item in found["items"] for path in item["figures"]}
    assert page.count("<figure id=") == len(drawn)  # once for each thesis that has it
    for name in ASKED:
        assert (here / "r" / "studies" / name / "results.json").is_file()
    code, out, err = run(*asked, "--beside", "r")
    assert code == 0
    assert err.count("finished before by the same code, taken over") == 2
    assert "2 studies, report:" in out
    assert "digest:" in out
    assert (here / "r" / "digest.pdf").read_bytes().startswith(b"%PDF-")
    assert "<small>was" not in page
    assert "0 facts have another verdict, 0 are new, 0 are" in report(here / "r")
    code, _, err = run("reproduce", "--only", REAL, "--out", "r")
    assert code == 2
    assert "holds a reproduction in the quick form, the full form is asked for" in err
