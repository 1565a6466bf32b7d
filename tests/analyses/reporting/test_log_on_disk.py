"""A log in files is the log that was put in, whatever ended the program between."""

import gc

import numpy as np
import pytest
from cdpr_drake.analyses.reporting.log_on_disk import LogOnDisk, log_block
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.analyses.reporting.log_files import write_log
from cdpr_drake.errors import OutputFolderError


def rows(count, start=0.0):
    times = start + np.arange(count, dtype=float)
    return {
        "time": times,
        "tensions": np.outer(times, [1.0, -2.0]),
        "gain": np.full((count, 1), 0.1),
    }


@given(cuts=st.lists(st.integers(0, 7), min_size=1, max_size=6), at=st.integers(0, 45))
def test_a_log_is_its_pieces_one_after_the_other(tmp_path_factory, cuts, at):
    log = LogOnDisk.create(tmp_path_factory.mktemp("run") / "parts", rows(3))
    whole, end = [rows(3)], 3
    for count in cuts:
        whole.append(rows(count, end))
        log.append(whole[-1])
        end += count
    assert list(log) == ["time", "tensions", "gain"]
    for name in log:
        expected = np.concatenate([part[name] for part in whole])
        np.testing.assert_array_equal(log[name], expected)
        np.testing.assert_array_equal(log_block(log, name, at, at + 4), expected[at : at + 4])


def test_rows_that_are_not_whole_are_left_out(tmp_path):
    folder = tmp_path / "parts"
    log = LogOnDisk.create(folder, rows(5))
    log.append({name: values for name, values in rows(2, 5.0).items() if name != "gain"} | {})
    with (folder / "tensions.f8").open("ab") as file:
        file.write(b"half a")
    again = LogOnDisk.open(folder)
    assert {name: len(again[name]) for name in again} == {"time": 5, "tensions": 5, "gain": 5}
    np.testing.assert_array_equal(again["tensions"], rows(5)["tensions"])


@pytest.mark.parametrize("harm", ["no folder", "no layout", "empty", "nonsense", "no rows"])
def test_what_is_no_log_is_refused(tmp_path, harm):
    folder = tmp_path / "parts"
    if harm != "no folder":
        LogOnDisk.create(folder, rows(0 if harm == "no rows" else 2))
        layout = folder / "layout.json"
        if harm == "no layout":
            layout.unlink()
        elif harm in ("empty", "nonsense"):
            layout.write_text("" if harm == "empty" else "[1, 2]")
    with pytest.raises(OutputFolderError, match="no log that can be read"):
        LogOnDisk.open(folder)


def test_it_stays_readable_when_its_folder_is_gone_and_then_frees_it(tmp_path):
    folder = tmp_path / "parts"
    log = LogOnDisk.create(folder, rows(4))
    log.remove()
    assert not folder.exists()
    np.testing.assert_array_equal(log["time"], rows(4)["time"])
    del log
    gc.collect()


def test_foreign_files_beside_it_stay(tmp_path):
    folder = tmp_path / "parts"
    log = LogOnDisk.create(folder, rows(4))
    (folder / "mine.txt").write_text("x")
    log.remove()
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]


def test_files_made_of_it_are_those_of_the_same_log_in_memory(tmp_path):
    log = LogOnDisk.create(tmp_path / "parts", rows(4500))
    for name, one in (("disk", log), ("memory", rows(4500))):
        (tmp_path / name).mkdir()
        write_log(tmp_path / name, one, ["a", "b"])
    for file in ("log.npz", "log.csv"):
        assert (tmp_path / "disk" / file).read_bytes() == (tmp_path / "memory" / file).read_bytes()
    with np.load(tmp_path / "disk" / "log.npz") as arrays:
        np.testing.assert_array_equal(arrays["tensions"], rows(4500)["tensions"])
