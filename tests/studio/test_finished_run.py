"""The results of a run, as they are looked at and compared."""

import json
import shutil

import numpy as np
import pytest

from cdpr_drake.errors import OutputFolderError
from cdpr_drake.studio.finished_run import FinishedRun, is_run
from cdpr_drake.studio.plots import charts_of, plot_row
from cdpr_drake.studio.watch import run_pairs


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
    (broken / "log.npz").unlink()
    assert not is_run(broken)


def test_a_run_beside_another_has_numbers_of_both(alone):
    summary = json.loads((alone / "summary.json").read_text())
    other = summary | {"final_position_error_m": summary["final_position_error_m"] + 0.01}
    pairs = {pair.name: pair for pair in run_pairs(summary, other)}
    assert pairs["final position error [m]"].difference == pytest.approx(0.01)
    assert pairs["tension min [N]"].difference == 0.0
    assert pairs["outcome"].one == summary["outcome"]
    assert not any("wall time" in name or "drake" in name for name in pairs)
