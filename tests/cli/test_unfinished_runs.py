"""A run that is killed, or that cannot write any more, leaves what it had simulated."""

import errno
import json
import subprocess
import sys
import time

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.log_on_disk import PARTS, LogOnDisk
from cdpr_drake.analyses.simulation import log_keeper
from cdpr_drake.errors import OutputFolderError
from tests.cli.test_cli import refuse, run

PROJECTED = ("simulate", "acrobot_pbvs", "--camera", "projected")


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def full_disk(monkeypatch, after):
    """Lets the disk be full once the log has some rows."""
    monkeypatch.setattr(log_keeper, "MOST_ROWS", 10)
    append = LogOnDisk.append

    def refused(self, rows):
        if self._rows >= after:
            raise OSError(errno.ENOSPC, "No space left on device")
        append(self, rows)

    monkeypatch.setattr(LogOnDisk, "append", refused)


@pytest.mark.usefixtures("without_pictures")
def test_the_log_of_a_run_on_disk_is_that_of_one_in_memory(capsys, tmp_path, monkeypatch):
    for name, most in (("at_once", 10**9), ("in_pieces", 7)):
        monkeypatch.setattr(log_keeper, "MOST_ROWS", most)
        assert run(capsys, *PROJECTED, "--duration", "0.5", "--out", name)[0] == 0
        assert not (tmp_path / name / PARTS).exists()
    for file in ("log.npz", "log.csv"):
        pieces = (tmp_path / "in_pieces" / file).read_bytes()
        assert pieces == (tmp_path / "at_once" / file).read_bytes()


@pytest.mark.parametrize("scenario", ["acrobot_pbvs", "acrobot_computed_torque"])
@pytest.mark.usefixtures("replay_only")
def test_a_full_disk_keeps_what_was_simulated(capsys, tmp_path, monkeypatch, scenario):
    full_disk(monkeypatch, after=15)
    camera = ["--camera", "projected"] if scenario == "acrobot_pbvs" else []
    arguments = ["simulate", scenario, *camera, "--duration", "1.5", "--out", "out"]
    said = refuse(capsys, *arguments)
    assert "No space left on device" in said
    assert "what was simulated is in" in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out-unfinished"]
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)

    code, out, _ = run(capsys, "simulate", "--finish", "out-unfinished", "--json")
    assert code == 0
    summary = json.loads(out)
    assert (summary["outcome"], summary["realtime_factor"]) == ("interrupted", None)
    folder = tmp_path / "out-unfinished"
    with np.load(folder / "log.npz") as arrays:
        rows = len(arrays["time"])
        assert arrays["time"][-1] == summary["sim_time_s"] > 0.1
    assert rows >= 15
    assert (folder / "replay.html").is_file()
    assert not (folder / PARTS).exists()
    assert "holds no log" in refuse(capsys, "simulate", "--finish", "out-unfinished")

    # What was kept is the beginning of the run that was not disturbed.
    assert run(capsys, *arguments)[0] == 0
    with np.load(folder / "log.npz") as part, np.load(tmp_path / "out" / "log.npz") as whole:
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][:rows])


def has_rows(folder):
    """Whether a log in the making has its first rows, whole."""
    try:
        return LogOnDisk.open(folder).rows > 0
    except OutputFolderError:
        return False


@pytest.mark.usefixtures("without_pictures")
def test_a_killed_run_is_found_by_the_next_and_can_be_finished(capsys, tmp_path):
    command = [sys.executable, "-m", "cdpr_drake", *PROJECTED, "--out", "out"]
    long = ("--duration", "500", "--set", "stop.hold=400", "--set", "stop.target_lost=400")
    with subprocess.Popen([*command, *long], cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        while not any(map(has_rows, tmp_path.glob(f".out-work-*/{PARTS}"))):
            time.sleep(0.05)
            assert process.poll() is None
        process.kill()
    assert not (tmp_path / "out").exists()
    code, _, err = run(capsys, *PROJECTED, "--duration", "0.2", "--out", "out")
    assert code == 0
    assert "--finish out-unfinished" in err
    assert run(capsys, "simulate", "--finish", "out-unfinished", "--json")[0] == 0
    summary = json.loads((tmp_path / "out-unfinished" / "summary.json").read_text())
    assert summary["message"] == "the program ended before the run did"
    assert summary["sim_time_s"] > 0.0


@pytest.mark.usefixtures("without_pictures")
def test_a_killed_run_can_be_finished_by_its_own_name(capsys, tmp_path, monkeypatch):
    full_disk(monkeypatch, after=15)
    refuse(capsys, *PROJECTED, "--duration", "1.5", "--out", "out")
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out-unfinished").rename(tmp_path / ".out-work-abc")  # as if it had been killed
    code, out, _ = run(capsys, "simulate", "--finish", "out")
    assert code == 0
    assert "out-unfinished" in out


def test_finish_refuses(capsys, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("x")
    assert "holds no log" in refuse(capsys, "simulate", "--finish", "mine")
    assert "holds no log" in refuse(capsys, "simulate", "--finish", "nothing")
    assert "not there" in refuse(capsys, "simulate", "--finish", "no/such/folder")
    assert "--finish: accepted with" in refuse(capsys, *PROJECTED, "--finish", "mine")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["mine", "thesis.tex"]
