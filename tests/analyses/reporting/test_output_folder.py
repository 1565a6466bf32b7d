"""Results appear whole or not at all."""

import os

import pytest

from cdpr_drake.analyses.reporting.output_folder import (
    continued_folder,
    free_folder,
    results_folder,
)
from cdpr_drake.errors import OutputFolderError


def test_folder_appears_when_done(tmp_path):
    target = tmp_path / "a" / "b"
    with results_folder(target) as work:
        (work / "x").write_text("1")
        assert not target.exists()
    assert (target / "x").read_text() == "1"
    assert os.listdir(tmp_path / "a") == ["b"]


def test_nothing_is_left_after_an_error(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), results_folder(target / "below") as work:
        (work / str(1 // 0)).write_text("1")
    assert os.listdir(tmp_path) == []


def test_old_results_are_kept(tmp_path):
    (tmp_path / "old").write_text("1")
    with pytest.raises(OutputFolderError, match="--overwrite"), results_folder(tmp_path):
        pass
    assert (tmp_path / "old").exists()


def test_overwrite_replaces(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (target / "old").write_text("1")
    with results_folder(target, overwrite=True) as work:
        (work / "new").write_text("2")
    assert os.listdir(target) == ["new"]


def test_overwrite_that_fails_keeps_the_old(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (target / "old").write_text("1")
    with pytest.raises(ZeroDivisionError), results_folder(target, overwrite=True):
        _ = 1 // 0
    assert os.listdir(target) == ["old"]


def test_an_empty_folder_is_fine(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    with results_folder(target) as work:
        (work / "new").write_text("2")
    assert os.listdir(target) == ["new"]


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
    (work / "part").write_text("1")
    raise ZeroDivisionError


def test_what_is_in_a_continued_folder_stays_whatever_happens(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), continued_folder(target) as work:
        failing(work)
    with continued_folder(target) as work:
        assert os.listdir(work) == ["part"]
    with continued_folder(target, overwrite=True) as work:
        assert not work.exists()


def test_free_folder_counts_up(tmp_path):
    assert free_folder(tmp_path / "run") == tmp_path / "run"
    (tmp_path / "run").mkdir()
    (tmp_path / "run-2").mkdir()
    assert free_folder(tmp_path / "run") == tmp_path / "run-3"
