"""A folder has one writer at a time, and its lock harms no file of anybody else."""

import errno
import multiprocessing
import os
import stat
import time

import pytest

from cdpr_drake.analyses.reporting import folder_lock
from cdpr_drake.analyses.reporting.folder_lock import free_folder, locked
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.errors import OutputFolderError

WRITERS, ROUNDS = 8, 200


def _rounds(folder, counts):
    """Takes the lock again and again; who holds it makes a file that must not be there yet."""
    witness = folder.with_name("witness")
    done = twice = 0
    while done < ROUNDS:
        try:
            with locked(folder):
                try:
                    os.close(os.open(witness, os.O_CREAT | os.O_EXCL))
                except FileExistsError:
                    twice += 1
                time.sleep(2e-4)  # others come meanwhile
                witness.unlink(missing_ok=True)
                done += 1
        except OutputFolderError as problem:
            if "another run" not in str(problem):
                raise
    counts.put((done, twice))


def test_two_of_many_writers_never_hold_a_lock_at_the_same_time(tmp_path, monkeypatch):
    monkeypatch.setattr(folder_lock, "PAUSE", 1e-4)
    context = multiprocessing.get_context("fork")
    counts = context.SimpleQueue()
    writers = [
        context.Process(target=_rounds, args=(tmp_path / "out", counts)) for _ in range(WRITERS)
    ]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0] * WRITERS
    assert [counts.get() for _ in writers] == [(ROUNDS, 0)] * WRITERS
    assert os.listdir(tmp_path) == []


def foreign_link(lock):
    lock.with_name("thesis.tex").write_text("years")
    lock.symlink_to("thesis.tex")


def dangling_link(lock):
    lock.symlink_to("nowhere")


def foreign_file(lock):
    lock.write_text("years")


def second_name(lock):
    lock.with_name("empty").touch()
    os.link(lock.with_name("empty"), lock)


def folder(lock):
    lock.mkdir()


def pipe(lock):
    os.mkfifo(lock)


def of_somebody_else(lock):
    if os.geteuid() != 0:
        pytest.skip("only root makes files of others")
    lock.touch()
    os.chown(lock, 12345, 12345)


def contents(path):
    """Kind, owner, time and content of all below a folder."""
    found = {}
    for name in sorted(os.listdir(path)):
        about = os.lstat(path / name)
        words = (path / name).read_text() if stat.S_ISREG(about.st_mode) else ""
        found[name] = (about.st_ino, about.st_uid, about.st_mtime_ns, words)
    return found


FOREIGN = [
    foreign_link, dangling_link, foreign_file, second_name, folder, pipe, of_somebody_else,
]  # fmt: skip


@pytest.mark.parametrize("make", FOREIGN)
def test_what_is_no_lock_of_ours_is_refused_in_a_line_and_stays(tmp_path, make):
    make(tmp_path / ".out.lock")
    before = contents(tmp_path)
    with pytest.raises(OutputFolderError) as refused, results_folder(tmp_path / "out"):
        pass
    assert len(str(refused.value).splitlines()) == 1
    assert ".out.lock beside it, which is no lock of cdpr and stays" in str(refused.value)
    assert contents(tmp_path) == before
    assert free_folder(tmp_path / "out") == tmp_path / "out-2"
    assert contents(tmp_path) == before


def test_a_lock_that_somebody_put_in_the_place_of_ours_stays(tmp_path):
    lock = tmp_path / ".out.lock"
    with locked(tmp_path / "out"):
        lock.unlink()
        lock.write_text("mine")
    assert lock.read_text() == "mine"


def test_a_lock_is_private_and_gone_at_the_end_whatever_happens(tmp_path):
    with locked(tmp_path / "out"):
        assert stat.S_IMODE((tmp_path / ".out.lock").stat().st_mode) == 0o600
    with pytest.raises(ZeroDivisionError), locked(tmp_path / "out"):
        _ = 1 // 0
    assert os.listdir(tmp_path) == []


def test_a_lock_that_is_held_for_an_instant_costs_nobody_a_run(tmp_path, monkeypatch):
    """As by who looks for a free name."""
    other, waits = locked(tmp_path / "out"), []
    other.__enter__()

    def wait(seconds):
        waits.append(seconds)
        if len(waits) == 3:
            other.__exit__(None, None, None)

    monkeypatch.setattr(folder_lock.time, "sleep", wait)
    with locked(tmp_path / "out"):
        assert len(waits) == 3


def test_a_held_lock_is_refused_in_the_end(tmp_path):
    with locked(tmp_path / "out"):
        before = os.listdir("/proc/self/fd")
        with pytest.raises(OutputFolderError, match="another run"), locked(tmp_path / "out"):
            pass
        assert len(os.listdir("/proc/self/fd")) == len(before)  # every try is closed
        assert (tmp_path / ".out.lock").exists()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with (
        pytest.raises(OutputFolderError, match="cannot be written: No such file"),
        locked(tmp_path / "none" / "out"),
    ):
        pass


def test_a_process_without_files_to_open_looks_for_no_other_name(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(folder_lock.os, "open", full)
    with pytest.raises(OSError, match="Too many open files"):
        free_folder(tmp_path / "out")
