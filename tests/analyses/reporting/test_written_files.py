"""A results folder knows which files are its own: others outlive --overwrite."""

import json
import os

import pytest

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.analyses.reporting.written_files import (
    JOURNAL,
    MARKER,
    claim,
    list_all,
    mark,
    new_part,
    others_in,
    remove_written,
    whole_file,
    whole_name,
)


def later(path):
    """Gives a file a time after all that were written until now."""
    os.utime(path, ns=(2**62, 2**62))


def tree(folder):
    """Names of all files below a folder but for its marker."""
    found = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    return sorted(name for name in found if name != MARKER)


def results(target, number="1", overwrite=False):
    """A run that leaves data, chunks, and a figure that comes after the data."""
    with results_folder(target, overwrite) as found:
        (found.path / "log.csv").write_text(number)
        (found.path / "chunks").mkdir()
        (found.path / "chunks" / "a.npz").write_text(number)
        found.publish()
        write_pictures(target, {"figure.png": lambda path: path.write_text(number)})
    return found


OWN = ["chunks/a.npz", "figure.png", "log.csv"]


def test_a_folder_lists_its_files_and_overwrite_leaves_nothing_of_them(tmp_path):
    target = tmp_path / "out"
    results(target)
    assert json.loads((target / MARKER).read_text())["files"] == OWN
    assert not (target / JOURNAL).exists()
    before = (target / MARKER).read_bytes()
    assert results(target, "2", overwrite=True).kept == []
    assert os.listdir(tmp_path) == ["out"]
    assert tree(target) == OWN
    assert (target / "figure.png").read_text() == "2"
    assert (target / MARKER).read_bytes() == before  # the same bytes, whenever it is written


def test_others_files_outlive_overwrite_and_are_named(tmp_path):
    target = tmp_path / "out"
    results(target)
    (target / "notes.txt").write_text("years")
    (target / "chunks" / "mine.npz").write_text("mine")
    (target / "thesis" / "empty").mkdir(parents=True)
    (target / "log.csv").write_text("what I found")  # a file of ours that the user changed
    later(target / "log.csv")
    kept = results(target, "2", overwrite=True).kept
    folder = tmp_path / "out-kept"
    assert kept == [(["chunks/mine.npz", "log.csv", "notes.txt", "thesis/"], folder)]
    assert sorted(os.listdir(tmp_path)) == ["out", "out-kept"]
    assert tree(folder) == ["chunks/mine.npz", "log.csv", "notes.txt"]
    assert (folder / "log.csv").read_text() == "what I found"
    assert (folder / "thesis" / "empty").is_dir()
    assert tree(target) == OWN
    # What is kept is the user's: no results folder any more.
    assert not (folder / MARKER).exists()


def test_a_folder_of_an_older_version_is_kept_whole(tmp_path):
    target = tmp_path / "out"
    results(target)
    (target / MARKER).write_text('{"program": "cdpr_drake", "version": "0.0.1"}\n')
    kept = results(target, "2", overwrite=True).kept
    assert [folder for _, folder in kept] == [tmp_path / "out-kept"]
    assert tree(tmp_path / "out-kept") == OWN
    assert (tmp_path / "out-kept" / "log.csv").read_text() == "1"


@pytest.mark.parametrize("words", ["", "[]", "no", '{"files": 3}', '{"files": [[1]]}', "\x00"])
def test_a_marker_that_says_nothing_makes_nothing_ours(tmp_path, words):
    target = tmp_path / "out"
    target.mkdir()
    (target / MARKER).write_text(words)
    (target / "thesis.tex").write_text("years")
    assert others_in(target) == ["thesis.tex"]
    remove_written(target)
    assert tree(target) == ["thesis.tex"]


def test_results_that_were_left_hidden_are_listed_when_they_are_shown(tmp_path):
    target = tmp_path / "out"
    hidden = tmp_path / ".out-work-abc"
    hidden.mkdir()
    mark(hidden)
    (hidden / "summary.json").write_text("{}")
    old = tmp_path / ".out-before-123"
    old.mkdir()
    (old / "a.csv").write_text("1")
    list_all(old)
    (old / "notes.txt").write_text("years")
    with results_folder(target) as found:
        assert [path.name for path in found.recovered] == ["out-recovered"]
        assert [(names, folder.name) for names, folder in found.kept] == [
            (["notes.txt"], "out-kept")
        ]
    assert json.loads((tmp_path / "out-recovered" / MARKER).read_text())["files"] == [
        "summary.json"
    ]
    assert tree(tmp_path / "out-kept") == ["notes.txt"]


def test_claiming_outside_a_folder_in_work_does_nothing(tmp_path):
    claim(tmp_path / "x")
    write_whole(tmp_path / "x", "1")
    assert os.listdir(tmp_path) == ["x"]


@pytest.mark.parametrize("name", ["summary.json", MARKER])
def test_a_file_in_the_making_follows_no_link(name, tmp_path):
    """Links in a folder that others may write to, by all names that could be foreseen."""
    victim = tmp_path / "victim"
    victim.write_text("years of work")
    folder = tmp_path / "out"
    folder.mkdir()
    for link in (f".part-{name}", f".part-abcdefgh-{name}", f".{name}.part"):
        (folder / link).symlink_to(victim)
    names = set()
    for _ in range(3):
        if name == MARKER:
            mark(folder)
            (folder / name).unlink()
        else:
            with whole_file(folder / name) as part:
                names.add(part.name)
                assert part.stat().st_size == 0
                assert whole_name(part.name) == name
                part.write_text("new")
    assert victim.read_text() == "years of work"
    assert name == MARKER or len(names) == 3


def test_who_writes_the_marker_removes_what_was_left_of_it_and_nothing_else(tmp_path):
    left = new_part(tmp_path / MARKER)  # of who was killed
    foreign = [
        tmp_path / ".part-abcdefgh-theirs.csv", tmp_path / f".part-short-{MARKER}",
        tmp_path / f".{MARKER}.part",
    ]  # fmt: skip
    for path in foreign:
        path.write_text("years of work")
    kept = tmp_path / f".part-abcdefgh-{MARKER}"
    kept.mkdir()
    mark(tmp_path)
    assert not left.exists()
    assert set(tmp_path.iterdir()) == {*foreign, kept, tmp_path / MARKER}


def test_files_get_the_rights_that_others_get(tmp_path):
    write_whole(tmp_path / "a.csv", "1")
    (tmp_path / "b.csv").write_text("1")
    assert (tmp_path / "a.csv").stat().st_mode == (tmp_path / "b.csv").stat().st_mode
