"""Results appear whole or not at all, what is finished is kept, and nothing foreign is deleted."""

import errno
import json
import multiprocessing
import os
from pathlib import Path

import pytest

from cdpr_drake.analyses.reporting import output_folder
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.log_files import write_json, write_whole
from cdpr_drake.analyses.reporting.output_folder import (
    results_folder,
)
from cdpr_drake.analyses.reporting.written_files import MARKER, list_all, mark
from cdpr_drake.errors import OutputFolderError


def ours(folder):
    """A folder as an earlier run of this program left it, with a file `old`."""
    folder.mkdir()
    mark(folder)
    (folder / "old").write_text("1")
    list_all(folder)
    return folder


def thesis(folder):
    """A folder of somebody else."""
    folder.mkdir()
    (folder / "chapter_1.tex").write_text("years")
    return folder


def seen(folder):
    return sorted(name for name in os.listdir(folder) if name != MARKER)


def listed(folder):
    return json.loads((folder / MARKER).read_text())["files"]


def write_old(results):
    (results.path / "old").write_text("2")


def part(results):
    results.path.mkdir(exist_ok=True)
    write_whole(results.path / "part", "1")


def published(results):
    (results.path / "summary.json").write_text("{}")
    results.publish()
    (results.path / "figure").write_text("1")


def broken_off(prepared, target, work, problem=None, **options):
    """What a run ends by that does some work in its folder, and then fails."""

    def run():
        with prepared(target, **options) as results:
            work(results)
            raise problem or RuntimeError

    with pytest.raises((Exception, KeyboardInterrupt)) as caught:
        run()
    return caught.value


@pytest.mark.parametrize("name", ["a/b", "empty"])
def test_folder_appears_when_done(tmp_path, name):
    target = tmp_path / name
    (tmp_path / "empty").mkdir()
    with results_folder(target) as results:
        (results.path / "x").write_text("1")
        assert not (target / "x").exists()
    assert (target / "x").read_text() == "1"
    assert os.listdir(target.parent) == [target.name]


@pytest.mark.parametrize(
    ("work", "left"),
    [
        (published, ["figure", "summary.json"]),
        (lambda results: write_json(results.path / "results.json", {}), ["results.json"]),
        (write_old, None),
        (lambda results: None, None),
    ],
)
def test_what_is_finished_outlives_an_error_and_nothing_else(tmp_path, work, left):
    problem = broken_off(results_folder, tmp_path / "below" / "out", work)
    if left is None:
        assert os.listdir(tmp_path) == []
        return
    assert os.listdir(tmp_path / "below") == ["out"]
    assert seen(tmp_path / "below" / "out") == left
    notes = getattr(problem, "__notes__", [])
    assert any("what was finished" in note for note in notes) == (work is not published)


def test_a_disk_that_is_full_from_the_start_leaves_nothing(tmp_path, monkeypatch):
    def full(folder):
        (folder / MARKER).touch()
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(output_folder, "mark", full)
    with (
        pytest.raises(OutputFolderError, match="out: cannot be written: No space left"),
        results_folder(tmp_path / "out"),
    ):
        pass
    assert not os.listdir(tmp_path)


def fill_the_disk(results):
    with open("/dev/full", "w") as full:  # a disk without space
        full.write("x" * 100_000)


def test_a_full_disk_is_named_by_its_folder(tmp_path):
    target = tmp_path / "r"
    ended = broken_off(results_folder, target, fill_the_disk)
    assert (ended.errno, ended.filename) == (errno.ENOSPC, str(target))
    ended = broken_off(
        results_folder, target, lambda results: (results.path / "none" / "x").write_text("1")
    )
    assert (ended.errno, ended.filename) == (errno.ENOENT, str(target / "none" / "x"))
    assert os.listdir(tmp_path) == []


ELSEWHERE = "/elsewhere/x"
FULL = OSError(errno.ENOSPC, "full", ELSEWHERE)


@pytest.mark.parametrize(
    ("prepared", "problem", "named"),
    [
        (results_folder, FULL, ELSEWHERE),
        (results_folder, OSError(errno.EACCES, "not allowed"), None),
        (results_folder, OSError(errno.EACCES, "not allowed", ELSEWHERE), ELSEWHERE),
    ],
)
def test_what_fails_elsewhere_keeps_its_name(tmp_path, prepared, problem, named):
    ended = broken_off(prepared, tmp_path / "out", lambda results: None, problem)
    assert ended is problem
    assert ended.filename == named


def test_overwrite_replaces_at_the_end(tmp_path):
    target = ours(tmp_path / "out")
    broken_off(results_folder, target, write_old, overwrite=True)
    assert (target / "old").read_text() == "1"
    with results_folder(target, overwrite=True) as results:
        (results.path / "new").write_text("2")
        assert seen(target) == ["old"]
    assert seen(target) == ["new"]
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize(
    ("prepared", "name", "overwrite", "words"),
    [
        (results_folder, "out", False, "add overwrite"),
        (results_folder, "thesis", True, "did not write"),
        (results_folder, "link", True, "did not write"),
        (results_folder, "file", True, "found a file"),
        (results_folder, "file/out", True, "cannot be written"),
        (results_folder, "/proc", True, "mount point"),
    ],
)
def test_what_is_there_is_refused_and_stays(tmp_path, prepared, name, overwrite, words):
    ours(tmp_path / "out")
    (tmp_path / "link").symlink_to(thesis(tmp_path / "thesis"))
    (tmp_path / "file").write_text("1")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(OutputFolderError, match=words), prepared(tmp_path / name, overwrite):
        pass
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "thesis" / "chapter_1.tex").read_text() == "years"


@pytest.mark.parametrize("prepared", [results_folder])
@pytest.mark.parametrize("name", [".", "..", "../..", "/", "below/.."])
def test_the_working_folder_and_what_is_above_it_is_refused(tmp_path, monkeypatch, prepared, name):
    here = tmp_path / "a" / "b"
    here.mkdir(parents=True)
    mark(here)
    monkeypatch.chdir(here)
    with pytest.raises(OutputFolderError, match="working folder"), prepared(Path(name), True):
        pass
    assert here.is_dir()


def test_files_that_came_meanwhile_are_not_replaced(tmp_path):
    def somebody_writes(results):
        (results.path / "summary.json").write_text("{}")
        thesis(tmp_path / "out")

    with pytest.raises(OutputFolderError, match="by now"), results_folder(tmp_path / "out") as run:
        somebody_writes(run)
    assert seen(tmp_path / "out") == ["chapter_1.tex"]
    assert seen(tmp_path / "out-results") == ["summary.json"]


def test_two_runs_do_not_share_a_folder(tmp_path):
    target = tmp_path / "out"
    with results_folder(target):
        with pytest.raises(OutputFolderError, match="another run"), results_folder(target):
            pass
        assert free_folder(target) == tmp_path / "out-2"
    assert target.is_dir()


def _killed(target, name):
    with results_folder(target) as results:
        (results.path / name).write_text("{}")
        os.kill(os.getpid(), 9)


@pytest.mark.parametrize(
    ("name", "left"), [("part", ["out"]), ("summary.json", ["out", "out-recovered"])]
)
def test_what_a_killed_run_left_is_removed_or_shown(tmp_path, name, left):
    target = tmp_path / "out"
    process = multiprocessing.get_context("fork").Process(target=_killed, args=(target, name))
    process.start()
    process.join()
    assert process.exitcode == -9
    with results_folder(target) as results:
        assert [path.name for path in results.recovered] == left[1:]
    assert sorted(os.listdir(tmp_path)) == left


def test_hidden_folders_of_others_stay(tmp_path):
    """Of somebody else, and of a run that is writing a folder with a longer name."""
    thesis(tmp_path / ".out-notes")
    with results_folder(tmp_path / "out-2") as other:
        with results_folder(tmp_path / "out"):
            pass
        assert (other.path / MARKER).is_file()
    assert seen(tmp_path) == [".out-notes", "out", "out-2"]
    assert seen(tmp_path / ".out-notes") == ["chapter_1.tex"]


def test_a_lock_that_a_killed_run_left_is_none(tmp_path):
    (tmp_path / ".run.lock").touch()
    assert free_folder(tmp_path / "run") == tmp_path / "run"
    with results_folder(tmp_path / "run"):
        pass
    assert os.listdir(tmp_path) == ["run"]


def test_free_folder_counts_up(tmp_path):
    assert free_folder(tmp_path / "run") == tmp_path / "run"
    (tmp_path / "run").mkdir()
    (tmp_path / "run-2").mkdir()
    assert free_folder(tmp_path / "run") == tmp_path / "run-3"
