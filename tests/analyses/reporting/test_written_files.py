"""A results folder knows which files are its own: others outlive --overwrite."""

import json
import multiprocessing
import os

import pytest

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.log_files import write_json, write_whole
from cdpr_drake.analyses.reporting.output_folder import continued_folder, results_folder
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
from cdpr_drake.errors import OutputFolderError


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


def sweep(target, number="1", overwrite=False):
    """The same by a command that works in its folder from the start."""
    with continued_folder(target, overwrite) as found:
        (target / "chunks").mkdir(parents=True, exist_ok=True)
        mark(target)
        write_whole(target / "log.csv", number)
        with whole_file(target / "chunks" / "a.npz") as part:
            part.write_text(number)
        write_pictures(target, {"figure.png": lambda path: path.write_text(number)})
    return found


WRITERS = pytest.mark.parametrize("write", [results, sweep])
OWN = ["chunks/a.npz", "figure.png", "log.csv"]


@WRITERS
def test_a_folder_lists_its_files_and_overwrite_leaves_nothing_of_them(tmp_path, write):
    target = tmp_path / "out"
    write(target)
    assert json.loads((target / MARKER).read_text())["files"] == OWN
    assert not (target / JOURNAL).exists()
    before = (target / MARKER).read_bytes()
    assert write(target, "2", overwrite=True).kept == []
    assert os.listdir(tmp_path) == ["out"]
    assert tree(target) == OWN
    assert (target / "figure.png").read_text() == "2"
    assert (target / MARKER).read_bytes() == before  # the same bytes, whenever it is written


@WRITERS
def test_others_files_outlive_overwrite_and_are_named(tmp_path, write):
    target = tmp_path / "out"
    write(target)
    (target / "notes.txt").write_text("years")
    (target / "chunks" / "mine.npz").write_text("mine")
    (target / "thesis" / "empty").mkdir(parents=True)
    (target / "log.csv").write_text("what I found")  # a file of ours that the user changed
    later(target / "log.csv")
    kept = write(target, "2", overwrite=True).kept
    folder = tmp_path / "out-kept"
    assert kept == [(["chunks/mine.npz", "log.csv", "notes.txt", "thesis/"], folder)]
    assert sorted(os.listdir(tmp_path)) == ["out", "out-kept"]
    assert tree(folder) == ["chunks/mine.npz", "log.csv", "notes.txt"]
    assert (folder / "log.csv").read_text() == "what I found"
    assert (folder / "thesis" / "empty").is_dir()
    assert tree(target) == OWN
    # What is kept is the user's: no results folder any more.
    assert not (folder / MARKER).exists()


@WRITERS
def test_a_folder_of_an_older_version_is_kept_whole(tmp_path, write):
    target = tmp_path / "out"
    write(target)
    (target / MARKER).write_text('{"program": "cdpr_drake", "version": "0.0.1"}\n')
    kept = write(target, "2", overwrite=True).kept
    assert [folder for _, folder in kept] == [tmp_path / "out-kept"]
    assert tree(tmp_path / "out-kept") == OWN
    assert (tmp_path / "out-kept" / "log.csv").read_text() == "1"


def _killed(target):
    with continued_folder(target):
        target.mkdir(exist_ok=True)
        mark(target)
        write_whole(target / "first.csv", "1")
        with whole_file(target / "second.csv") as part:
            part.write_text("half")
            os.kill(os.getpid(), 9)


def killed(target):
    process = multiprocessing.get_context("fork").Process(target=_killed, args=(target,))
    process.start()
    process.join()
    assert process.exitcode == -9


def test_what_a_killed_program_wrote_is_known(tmp_path):
    target = tmp_path / "out"
    killed(target)
    assert [whole_name(name) or name for name in tree(target)] == [
        JOURNAL,
        "second.csv",
        "first.csv",
    ]
    (target / "notes.txt").write_text("years")
    assert others_in(target) == ["notes.txt"]
    # The next one goes on, without the half file.
    with continued_folder(target):
        assert tree(target) == [JOURNAL, "first.csv", "notes.txt"]
    assert json.loads((target / MARKER).read_text())["files"] == ["first.csv"]
    killed(target)
    sweep(target, overwrite=True)
    assert tree(tmp_path / "out-kept") == ["notes.txt"]
    assert tree(target) == OWN


def test_a_file_that_the_user_changed_between_two_sessions_stays_the_users(tmp_path):
    target = tmp_path / "out"
    sweep(target)
    (target / "log.csv").write_text("what I found")
    later(target / "log.csv")
    with continued_folder(target):
        write_json(target / "more.json", {})
    os.utime(target / "log.csv", ns=(0, 0))  # whatever its time says by now
    sweep_kept = others_in(target)
    assert sweep_kept == ["log.csv"]


def test_an_unfinished_run_keeps_all_beside(tmp_path):
    target = tmp_path / "out"
    results(target)
    (target / "notes.txt").write_text("years")
    with results_folder(target, overwrite=True) as found:
        (found.path / "log.csv").write_text("2")
        found.unfinished = True
    assert found.kept == []
    assert tree(tmp_path / "out-before") == [*OWN, "notes.txt"]


def test_folders_inside_a_folder_keep_their_own_lists(tmp_path):
    """As the studies of a reproduction."""
    target = tmp_path / "out"
    for write in (results, sweep):
        with continued_folder(target, overwrite=target.exists()):
            target.mkdir()
            mark(target)
            (target / "studies").mkdir()
            write(target / "studies" / "one")
            write_whole(target / "report.html", "1")
        listed = json.loads((target / MARKER).read_text())["files"]
        assert listed == ["report.html", "studies/one/"]
        assert os.listdir(tmp_path) == ["out"]
    (target / "studies" / "one" / "chunks" / "notes.txt").write_text("years")
    with continued_folder(target, overwrite=True) as found:
        target.mkdir()
    assert [names for names, _ in found.kept] == [["studies/one/chunks/notes.txt"]]
    assert tree(tmp_path / "out-kept") == ["studies/one/chunks/notes.txt"]


def test_a_list_leads_nowhere_else(tmp_path):
    """It may come with a folder of somebody else's, or a folder may be a link by now."""
    for name in ("a", "b"):
        (tmp_path / "elsewhere" / name).mkdir(parents=True)
        (tmp_path / "elsewhere" / name / "thesis.tex").write_text("years")
    target = tmp_path / "out"
    target.mkdir()
    (target / "link").symlink_to(tmp_path / "elsewhere" / "a")
    names = ["../elsewhere/b/thesis.tex", f"{tmp_path}/elsewhere/b/thesis.tex", "link/thesis.tex"]
    names += ["", ".", "..", "/", 7, None, "link/", "../elsewhere/b/"]
    (target / MARKER).write_text(json.dumps({"files": names}))
    (target / JOURNAL).write_text("".join(f"{json.dumps(name)}\n" for name in names))
    before = tree(tmp_path / "elsewhere")
    with continued_folder(target, overwrite=True) as found:
        target.mkdir()
    assert tree(tmp_path / "elsewhere") == before
    assert [names for names, _ in found.kept] == [["link"]]
    assert (tmp_path / "out-kept" / "link").is_symlink()


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


def test_a_mark_keeps_the_list_that_is_there(tmp_path):
    target = tmp_path / "out"
    sweep(target)
    before = (target / MARKER).read_bytes()
    mark(target)
    assert (target / MARKER).read_bytes() == before


def test_claiming_outside_a_folder_in_work_does_nothing(tmp_path):
    claim(tmp_path / "x")
    write_whole(tmp_path / "x", "1")
    assert os.listdir(tmp_path) == ["x"]


def test_a_journal_is_no_way_to_write_elsewhere(tmp_path):
    target = tmp_path / "out"
    sweep(target)
    (tmp_path / "thesis.tex").write_text("years")
    (target / JOURNAL).symlink_to(tmp_path / "thesis.tex")
    with pytest.raises(OutputFolderError, match="cannot be written"), continued_folder(target):
        write_whole(target / "new.csv", "1")
    assert (tmp_path / "thesis.tex").read_text() == "years"


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
