"""The results of a run, as they are looked at and handed over."""

import io
import json
import shutil
import zipfile

import numpy as np
import pytest

from cdpr_drake.errors import OutputFolderError
from cdpr_drake.studio.workbench.finished_run import FinishedRun, is_run, zipped
from cdpr_drake.studio.workbench.plot_rows import charts_of, plot_row


def test_rows_are_those_of_the_log(alone):
    done = FinishedRun(alone)
    with np.load(alone / "log.npz") as log:
        assert done.times.tolist() == log["time"].tolist()
        last = done.samples[-1]
        assert last["tensions"] == log["tensions"][-1].tolist()
        assert last["pose"] == log["X_WP"][-1].tolist()
    summary = json.loads((alone / "summary.json").read_text())
    assert last["position_error"] == pytest.approx(summary["final_position_error_m"], rel=1e-12)
    assert last["rotation_error"] == pytest.approx(summary["final_rotation_error_rad"], rel=1e-12)
    assert done.row_at(0.1) == np.argmin(np.abs(done.times - 0.1))
    assert done.image(0).startswith(b"\xff\xd8")
    row = plot_row(last)
    charts = charts_of(done.cables, done.limits)
    assert len(row) == 1 + sum(len(chart.series) for chart in charts)
    assert row[1] == pytest.approx(1e3 * last["position_error"])
    assert charts[1].plain()["limits"] == list(done.limits)


def test_what_is_no_run_is_refused(alone, tmp_path):
    assert not is_run(tmp_path)
    with pytest.raises(OutputFolderError, match="holds no results of a run"):
        FinishedRun(tmp_path)
    broken = tmp_path / "broken"
    shutil.copytree(alone, broken)
    (broken / "log.npz").write_bytes(b"PK no archive")
    with pytest.raises(OutputFolderError, match="broken: cannot be read"):
        FinishedRun(broken)


def test_the_archive_has_every_file_and_follows_no_link(alone, tmp_path):
    folder = tmp_path / "short"
    shutil.copytree(alone, folder)
    (folder / "elsewhere").symlink_to("/etc/hostname")
    file = io.BytesIO()
    zipped(folder, file)
    with zipfile.ZipFile(file) as archive:
        files = {path.name for path in alone.iterdir()}
        assert {f"short/{name}" for name in files} == set(archive.namelist())
        assert archive.read("short/log.csv") == (alone / "log.csv").read_bytes()
    with pytest.raises(OutputFolderError, match="not there any more"):
        zipped(tmp_path / "gone", file)
