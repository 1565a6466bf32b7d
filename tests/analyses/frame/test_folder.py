"""Results folders: what goes on, what is refused, and that nothing foreign is lost."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cdpr_drake.analyses.frame.folder import (
    LOCK,
    PART,
    Folder,
    differences,
    foreign_files,
    free_folder,
    is_locked,
    read_marker,
    results_folder,
)
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.written_files import MARKER
from cdpr_drake.errors import OutputFolderError

WANTED = {"robot": "planar", "steps": [1, 2], "seed": 1}


def written(path, arguments=WANTED, complete=True, **options):
    """A folder with a file."""
    with Folder(path, arguments, **options) as folder:
        folder.write_text("log.csv", "time_s\n")
        if complete:
            folder.complete()
    return path


def names(path):
    return sorted(one.name for one in path.iterdir())


def test_a_folder_has_its_files_and_a_marker(tmp_path):
    path = written(tmp_path / "run")
    assert names(path) == [MARKER, LOCK, "log.csv"]
    assert read_marker(path) == {"arguments": WANTED, "complete": True, "files": ["log.csv"]}
    assert not is_locked(path)


def test_the_same_arguments_go_on_in_an_unfinished_folder(tmp_path):
    path = written(tmp_path / "run", complete=False)
    (path / f"{PART}plot.png").write_bytes(b"half")  # what a kill left
    with Folder(path, WANTED) as folder:
        assert folder.resumed
        assert names(path) == [MARKER, LOCK, "log.csv"]


def test_overwriting_removes_own_files_only_once_all_is_accepted(tmp_path):
    path = written(tmp_path / "run")
    with pytest.raises(OutputFolderError, match="seed is 1 there, 2 here"):
        written(path, {**WANTED, "seed": 2})
    assert (path / "log.csv").exists()
    with Folder(path, {**WANTED, "seed": 2}, overwrite=True) as folder:
        assert not folder.resumed
        assert names(path) == [MARKER, LOCK]
        folder.write_text("other.csv", "")
    assert names(path) == [MARKER, LOCK, "other.csv"]


def test_complete_results_that_grow_are_gone_on_with(tmp_path):
    path = written(tmp_path / "run")
    with Folder(path, WANTED, grows=True) as folder:
        assert folder.resumed


def _edit(path):
    written(path)
    later = (path / MARKER).stat().st_mtime_ns + 10**9
    (path / "log.csv").write_text("mine")
    os.utime(path / "log.csv", ns=(later, later))


def _another(path):
    written(path)
    (path / "notes.txt").write_text("mine")


def _no_marker(path):
    path.mkdir()
    (path / "thesis.tex").write_text("mine")


REFUSALS = {
    "an edited file": (_edit, "changed since: log.csv"),
    "another file": (_another, "did not write, or that changed since: notes.txt"),
    "a folder of somebody": (_no_marker, "thesis.tex"),
    "complete results": (written, "holds complete results of this command"),
    "a file": (lambda path: path.write_text("mine"), "found a file; accepted: a folder"),
    "a damaged marker": (
        lambda path: (written(path) / MARKER).write_text("{"),
        "did not write, or that changed since",
    ),
}


@pytest.mark.parametrize(("make", "words"), REFUSALS.values(), ids=REFUSALS)
@pytest.mark.parametrize("overwrite", [False, True])
def test_what_is_refused_stays_as_it_is(tmp_path, make, words, overwrite):
    path = tmp_path / "run"
    make(path)
    overwrite = overwrite and make is not written  # which is accepted
    before = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
    with pytest.raises(OutputFolderError, match=words), Folder(path, WANTED, overwrite=overwrite):
        pass
    assert {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()} == before


def test_the_working_folder_and_those_above_are_refused(tmp_path, monkeypatch):
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    for path in (Path(), tmp_path, tmp_path / "below" / ".." / "below"):
        with pytest.raises(OutputFolderError, match="the working folder, one above it"):
            Folder(path, WANTED)


def test_one_command_at_a_time_writes(tmp_path):
    path = tmp_path / "run"
    with Folder(path, WANTED) as folder:
        folder.write_text("log.csv", "")
        assert is_locked(path)
        with (
            pytest.raises(OutputFolderError, match="another command writes there"),
            Folder(path, WANTED),
        ):
            pass


def test_a_folder_in_which_nothing_was_written_goes_and_an_empty_one_stays(tmp_path):
    with pytest.raises(KeyError), Folder(tmp_path / "new", WANTED):
        raise KeyError
    assert not (tmp_path / "new").exists()
    (tmp_path / "mine").mkdir()
    with Folder(tmp_path / "mine", WANTED):
        pass
    assert names(tmp_path / "mine") == []


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = written(tmp_path / "run", complete=False)

    def stumble(part):
        part.write_text("half")
        raise KeyError

    with Folder(path, WANTED) as folder:
        assert list(folder.write_all({"log.csv": stumble})) == ["log.csv"]
    assert (path / "log.csv").read_text() == "time_s\n"
    assert names(path) == [MARKER, LOCK, "log.csv"]


def test_a_full_disk_is_one_line_and_what_is_there_stays(tmp_path, monkeypatch):
    path = written(tmp_path / "run", complete=False)

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with Folder(path, WANTED) as folder:
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(OutputFolderError, match="No space left on device; what was finished"):
            folder.write_json("results.json", {})
        monkeypatch.undo()
    assert (path / "log.csv").read_text() == "time_s\n"
    with Folder(path, WANTED) as folder:
        assert folder.resumed
        assert "results.json" not in names(path)


def test_one_figure_that_fails_costs_no_other(tmp_path):
    def fail(path):
        raise ValueError("no data\nat all")

    def left_out(path):
        raise NothingToDraw

    with Folder(tmp_path / "run", WANTED) as folder:
        writers = {"a.txt": lambda path: path.write_text("a"), "b.txt": fail}
        assert folder.write_all({**writers, "c.txt": left_out}) == {"b.txt": "no data"}
        assert folder.write_all(writers, stop=lambda: True).keys() == writers.keys()
    assert "b.txt" not in names(tmp_path / "run")


def test_a_new_folder_has_the_next_number_and_an_unfinished_one_is_found(tmp_path):
    base = tmp_path / "run"
    assert free_folder(base, WANTED) == base
    written(base)
    assert free_folder(base, WANTED) == tmp_path / "run-2"
    written(tmp_path / "run-2", complete=False)
    assert free_folder(base, WANTED) == tmp_path / "run-2"
    assert free_folder(base, {"seed": 3}) == tmp_path / "run-3"
    with Folder(tmp_path / "run-2", WANTED):
        assert free_folder(base, WANTED) == tmp_path / "run-3"


def test_differences_name_each_place():
    there = {"seed": 1, "robot": {"mass": 1.0}, "points": [1, 2], "old": True}
    here = {"seed": 2, "robot": {"mass": 1.0}, "points": [1, 3], "new": "x" * 99}
    assert list(differences(there, here)) == [
        "seed is 1 there, 2 here", "points[1] is 2 there, 3 here", "old is true there, not here",
        "new is not there, another here",
    ]  # fmt: skip


def place(name, arguments, results, folder=None, grows=False):
    """Where a verb keeps what it computes; None if it keeps nothing."""
    with results_folder(name, arguments, folder, False, results, grows) as opened:
        if opened is not None:
            opened.write_text("numbers.txt", "1")
            opened.complete()
        return opened and opened.path


def test_a_verb_keeps_results_in_a_new_folder_or_in_that_of_its_arguments(tmp_path):
    results, named = tmp_path / "workspaces", tmp_path / "mine"
    assert place("robot", WANTED, None) is None
    assert place("robot", WANTED, None, named) == named
    new = [place("plans/robot", WANTED, results) for _ in range(2)]
    assert new == [tmp_path / "plans" / name for name in ("robot", "robot-2")]
    first, again, other = (
        place("robot", arguments, results, grows=True)
        for arguments in (WANTED, WANTED, {"seed": 7})
    )
    assert first == again != other
    assert first.parent == other.parent == results


WRITER = """
import sys
from cdpr_drake.analyses.frame.folder import Folder
with Folder(sys.argv[1], {"seed": 1}) as folder:
    for number in range(10_000):
        folder.write_text(f"{number:04d}.txt", "x" * 2000)
        print(number, flush=True)
"""


@pytest.mark.parametrize("number", [0, 7, 40])
def test_a_killed_writer_leaves_whole_files_that_are_its_own(tmp_path, number):
    path = tmp_path / "run"
    process = subprocess.Popen([sys.executable, "-c", WRITER, path], stdout=subprocess.PIPE)
    for line in process.stdout:
        if int(line) == number:
            break
    time.sleep(0.001 * number)  # another place in the loop
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert foreign_files(path) == []
    with Folder(path, {"seed": 1}) as folder:
        assert folder.resumed
        files = [name for name in names(path) if name not in (MARKER, LOCK)]
        assert len(files) > number
        assert all((path / name).stat().st_size == 2000 for name in files)
    assert json.loads((path / MARKER).read_text())["complete"] is False
