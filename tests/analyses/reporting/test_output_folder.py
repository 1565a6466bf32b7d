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
from cdpr_drake.analyses.reporting.log_on_disk import LAYOUT, PARTS
from cdpr_drake.analyses.reporting.output_folder import (
    continued_folder,
    results_folder,
    resumed_folder,
    unfinished_folder,
)
from cdpr_drake.analyses.reporting.written_files import MARKER, list_all, mark
from cdpr_drake.errors import OutputFolderError


def ours(folder, **files):
    """A folder as an earlier run of this program left it."""
    folder.mkdir()
    mark(folder)
    for name, words in files.items():
        (folder / name).write_text(words)
    list_all(folder)
    return folder


def seen(folder):
    return sorted(name for name in os.listdir(folder) if name != MARKER)


def test_folder_appears_when_done(tmp_path):
    target = tmp_path / "a" / "b"
    with results_folder(target) as results:
        (results.path / "x").write_text("1")
        assert not target.exists()
    assert (target / "x").read_text() == "1"
    assert os.listdir(tmp_path / "a") == ["b"]


def test_what_is_published_outlives_a_late_error(tmp_path):
    target = tmp_path / "out"

    def late_error(results):
        (results.path / "summary.json").write_text("{}")
        assert results.publish() == target
        (results.path / "figure").write_text("1")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), results_folder(target) as results:
        late_error(results)
    assert seen(target) == ["figure", "summary.json"]
    assert os.listdir(tmp_path) == ["out"]


def test_results_of_finished_runs_outlive_an_error(tmp_path):
    def failing():
        with results_folder(tmp_path / "out") as results:
            write_json(results.path / "results.json", {"runs": 31})
            raise RuntimeError("at run 32")

    with pytest.raises(RuntimeError) as caught:
        failing()
    assert json.loads((tmp_path / "out" / "results.json").read_text()) == {"runs": 31}
    assert any("what was finished" in note for note in caught.value.__notes__)


def test_nothing_is_left_after_an_early_error(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), results_folder(target / "below") as results:
        (results.path / str(1 // 0)).write_text("1")
    assert os.listdir(tmp_path) == []


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


def test_a_full_disk_is_named_by_its_folder(tmp_path):
    target = tmp_path / "r"
    with (
        pytest.raises(OSError, match="No space") as ended,
        results_folder(target),
        open("/dev/full", "w") as full,  # a disk without space
    ):
        full.write("x" * 100_000)
    assert ended.value.filename == str(target)
    with pytest.raises(FileNotFoundError) as ended, results_folder(target) as results:
        (results.path / "none" / "x").write_text("1")
    assert ended.value.filename == str(target / "none" / "x")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    "problem",
    [OSError(errno.ENOSPC, "full", "/elsewhere/x"), OSError(errno.EACCES, "not allowed"),
     OSError(errno.EACCES, "not allowed", "/elsewhere/x")],
)  # fmt: skip
def test_what_fails_elsewhere_keeps_its_name(tmp_path, problem):
    named = problem.filename
    with pytest.raises(OSError, match=r"full|not allowed") as ended, results_folder(tmp_path / "r"):
        raise problem
    assert ended.value.filename == named


def unfinished_log(folder):
    """A log in the making."""
    (folder / PARTS).mkdir()
    (folder / PARTS / LAYOUT).write_text("{}")


def test_the_log_of_a_run_that_fails_gets_a_name_that_can_be_seen(tmp_path):
    def failing():
        with results_folder(tmp_path / "out") as results:
            unfinished_log(results.path)
            raise RuntimeError

    with pytest.raises(RuntimeError) as caught:
        failing()
    assert os.listdir(tmp_path) == ["out-unfinished"]
    assert any(f"is in {tmp_path / 'out-unfinished'}" in note for note in caught.value.__notes__)
    # It goes on there, and what is written then is known as the program's own.
    with resumed_folder(tmp_path / "out-unfinished") as results:
        assert results.published
        write_whole(results.path / "summary.json", "{}")
    files = json.loads((tmp_path / "out-unfinished" / MARKER).read_text())["files"]
    assert files == [f"{PARTS}/{LAYOUT}", "summary.json"]


def test_a_published_run_that_fails_keeps_its_name_and_its_log(tmp_path):
    def failing():
        with results_folder(tmp_path / "out") as results:
            unfinished_log(results.path)
            results.publish()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        failing()
    assert os.listdir(tmp_path) == ["out"]


def test_old_results_are_kept(tmp_path):
    target = ours(tmp_path / "out", old="1")
    with pytest.raises(OutputFolderError, match="allow overwrite"), results_folder(target):
        pass
    assert seen(target) == ["old"]


def test_overwrite_replaces_at_the_end(tmp_path):
    target = ours(tmp_path / "out", old="1")
    with results_folder(target, overwrite=True) as results:
        (results.path / "new").write_text("2")
        assert seen(target) == ["old"]
    assert seen(target) == ["new"]
    assert os.listdir(tmp_path) == ["out"]


def test_overwrite_that_fails_keeps_the_old(tmp_path):
    target = ours(tmp_path / "out", old="1")
    with pytest.raises(ZeroDivisionError), results_folder(target, overwrite=True):
        _ = 1 // 0
    assert seen(target) == ["old"]


@pytest.mark.parametrize("prepared", [results_folder, continued_folder])
def test_foreign_folders_are_never_replaced(tmp_path, prepared):
    thesis = tmp_path / "thesis"
    thesis.mkdir()
    (thesis / "chapter_1.tex").write_text("years")
    with pytest.raises(OutputFolderError, match="did not write"), prepared(thesis, overwrite=True):
        pass
    assert (thesis / "chapter_1.tex").read_text() == "years"


@pytest.mark.parametrize("prepared", [results_folder, continued_folder])
@pytest.mark.parametrize("name", [".", "..", "../..", "/", "below/.."])
def test_the_working_folder_and_what_is_above_it_is_refused(tmp_path, monkeypatch, prepared, name):
    here = tmp_path / "a" / "b"
    here.mkdir(parents=True)
    mark(here)
    monkeypatch.chdir(here)
    with (
        pytest.raises(OutputFolderError, match="working folder"),
        prepared(Path(name), overwrite=True),
    ):
        pass
    assert here.is_dir()


def test_a_mount_point_is_refused():
    with pytest.raises(OutputFolderError, match="mount point"), results_folder(Path("/proc")):
        pass


def test_a_link_is_followed_to_what_it_means(tmp_path):
    thesis = tmp_path / "thesis"
    thesis.mkdir()
    (thesis / "chapter_1.tex").write_text("years")
    (tmp_path / "link").symlink_to(thesis)
    with (
        pytest.raises(OutputFolderError, match="did not write"),
        results_folder(tmp_path / "link", overwrite=True),
    ):
        pass
    assert seen(thesis) == ["chapter_1.tex"]


def test_files_that_came_meanwhile_are_not_replaced(tmp_path):
    target = tmp_path / "out"

    def somebody_writes(results):
        (results.path / "summary.json").write_text("{}")
        target.mkdir()
        (target / "mine").write_text("1")

    with pytest.raises(OutputFolderError, match="by now"), results_folder(target) as results:
        somebody_writes(results)
    assert seen(target) == ["mine"]
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
        (results.path / "new").write_text("1")
        assert [path.name for path in results.recovered] == left[1:]
    assert sorted(os.listdir(tmp_path)) == left


def test_hidden_folders_of_others_stay(tmp_path):
    """Of somebody else, and of a run that is writing a folder with a longer name."""
    foreign = tmp_path / ".out-notes"
    foreign.mkdir()
    with results_folder(tmp_path / "out-2") as other:
        with results_folder(tmp_path / "out"):
            pass
        assert (other.path / MARKER).is_file()
    assert foreign.is_dir()
    assert seen(tmp_path) == [".out-notes", "out", "out-2"]


def test_a_lock_that_a_killed_run_left_is_none(tmp_path):
    (tmp_path / ".run.lock").touch()
    assert free_folder(tmp_path / "run") == tmp_path / "run"
    with results_folder(tmp_path / "run"):
        pass
    assert os.listdir(tmp_path) == ["run"]


def test_an_empty_folder_is_fine(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    with results_folder(target) as results:
        (results.path / "new").write_text("2")
    assert seen(target) == ["new"]


def test_a_file_is_refused(tmp_path):
    target = tmp_path / "out"
    target.write_text("1")
    with pytest.raises(OutputFolderError, match="found a file"), results_folder(target):
        pass


def test_a_folder_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("1")
    target = tmp_path / "file" / "out"
    with pytest.raises(OutputFolderError, match="cannot be written"), results_folder(target):
        pass


def failing(work):
    work.mkdir()
    write_whole(work / "part", "1")
    raise ZeroDivisionError


def test_what_is_in_a_continued_folder_stays_whatever_happens(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), continued_folder(target) as results:
        failing(results.path)
    with continued_folder(target) as results:
        assert seen(results.path) == ["part"]


def test_overwriting_a_continued_folder_keeps_the_old_until_the_end(tmp_path):
    target = ours(tmp_path / "out", old="1")
    with pytest.raises(ZeroDivisionError), continued_folder(target, overwrite=True) as results:
        failing(results.path)
    assert seen(tmp_path / "out-before") == ["old"]
    assert seen(target) == ["part"]
    with continued_folder(target, overwrite=True) as results:
        assert not results.path.exists()
        results.path.mkdir()
    assert sorted(os.listdir(tmp_path)) == ["out", "out-before"]


@pytest.mark.parametrize(
    ("problem", "named"),
    [(OSError(errno.ENOSPC, "full", "/elsewhere/x"), "/elsewhere/x"),
     (OSError(errno.ENOSPC, "full", "out/x"), None), (OSError(errno.ENOSPC, "full"), None)],
)  # fmt: skip
def test_what_fails_in_a_continued_folder_is_said_of_it_and_what_fails_elsewhere_not(
    tmp_path, problem, named
):
    if problem.filename == "out/x":
        problem.filename = str(tmp_path / "out" / "x")
    with pytest.raises((OSError, OutputFolderError)) as ended, continued_folder(tmp_path / "out"):
        raise problem
    if named is None:
        assert str(ended.value) == f"{tmp_path / 'out'}: cannot be written: full"
    else:
        assert ended.value is problem


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("noted", [True, False])
@pytest.mark.parametrize("problem", [KeyboardInterrupt, RuntimeError])
def test_ctrl_c_says_once_where_what_was_finished_is(tmp_path, problem, noted, there):
    def stopped():
        with continued_folder(tmp_path / "out") as results:
            if there:
                results.path.mkdir()
            ended = problem()
            if noted:
                ended.add_note("what was finished is elsewhere")
            raise ended

    with pytest.raises(problem) as caught:
        stopped()
    notes = [f"what was finished is kept in {tmp_path / 'out'}; the same command continues"]
    notes = notes if there and not noted and problem is KeyboardInterrupt else []
    assert getattr(caught.value, "__notes__", []) == notes + noted * [
        "what was finished is elsewhere"
    ]


@pytest.mark.parametrize("begun", [True, False])
def test_older_results_have_their_name_again_where_nothing_came_in_their_place(tmp_path, begun):
    target = ours(tmp_path / "out", old="1")

    def failing_run():
        with continued_folder(target, overwrite=True) as results:
            if begun:
                results.path.mkdir()
            raise RuntimeError

    with pytest.raises(RuntimeError) as caught:
        failing_run()
    notes = [f"older results are in {tmp_path / 'out-before'}"] * begun
    assert getattr(caught.value, "__notes__", []) == notes
    assert seen(tmp_path / "out-before" if begun else target) == ["old"]


@pytest.mark.parametrize("name", ["out", ".out-work-abc"])
def test_the_log_of_a_killed_run_is_found_by_its_name(tmp_path, name):
    (tmp_path / name).mkdir()
    mark(tmp_path / name)
    unfinished_log(tmp_path / name)
    with unfinished_folder(tmp_path / "out") as found:
        assert found == tmp_path / ("out" if name == "out" else "out-unfinished")
        assert (found / PARTS / LAYOUT).is_file()
        write_whole(found / "summary.json", "{}")
    assert "summary.json" in json.loads((found / MARKER).read_text())["files"]


@pytest.mark.parametrize("prepared", [unfinished_folder, resumed_folder])
def test_where_there_is_no_log_that_is_said(tmp_path, prepared):
    (tmp_path / "out").mkdir()
    with pytest.raises(OutputFolderError, match="holds no log"), prepared(tmp_path / "out"):
        pass
    with pytest.raises(OutputFolderError, match="not there"), prepared(tmp_path / "a" / "out"):
        pass


def test_free_folder_counts_up(tmp_path):
    assert free_folder(tmp_path / "run") == tmp_path / "run"
    (tmp_path / "run").mkdir()
    (tmp_path / "run-2").mkdir()
    assert free_folder(tmp_path / "run") == tmp_path / "run-3"
