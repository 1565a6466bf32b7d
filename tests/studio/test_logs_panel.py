"""The logs panel: what is in a log, and a log beside the model of the robot that is open."""

import json
import shutil

import numpy as np
import pytest

from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.logs import _views, log_contents, log_files, read_comparison
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from tests.studio.pages import field, open_panel, problems, shown, until

ROBOT = "acrobot_small"

OFFSET = 0.004
"""By which the first cable's length is wrong in the log of the test [m]."""


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """With a log of lengths at the poses of a small circle, a gap, and a wrong zero of C1."""
    folder = tmp_path_factory.mktemp("work")
    robot = load_robot(ROBOT)
    cables, home = robot.cable_set(), robot.home.transform()
    times = np.r_[0.0:1.0:0.05, 3.0:4.0:0.05]
    heads = ["time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]
    lines = [",".join([*heads, *(f"{cable.name}_length_m" for cable in robot.cables)])]
    for t in times:
        p = home.translation() + 0.05 * np.array([np.cos(t), np.sin(t), 0.0])
        row = np.r_[home.rotation().ToQuaternion().wxyz(), p]
        lengths = cable_paths(pose_from_row(row), cables).lengths
        lengths[0] += OFFSET
        cells = [t, *p, *row[:4], *lengths]
        lines.append(",".join(f"{value:.9g}" for value in cells))
    (folder / "circle.csv").write_text("\n".join(lines) + "\n")
    (folder / "notes.txt").write_text("not a log\n")
    return folder


def test_contents_are_those_of_the_front_door(work):
    (view, picture), log = log_contents(work / "circle.csv"), import_log(work / "circle.csv")
    assert dict(view.facts)["rows gaps"] == "1"
    heads, rows = view.tables["columns, 16 rows"]
    assert heads == ["columns", "rows", "least", "largest"]
    assert [row[0] for row in rows] == list(log.frame)
    assert picture.startswith(b"\x89PNG")


def test_a_run_leaves_a_log_that_is_offered(work, alone, tmp_path):
    shutil.copy(work / "circle.csv", tmp_path)
    shutil.copytree(alone, tmp_path / "runs" / "short")
    assert log_files(WorkingFolder(tmp_path)) == ["circle.csv", "runs/short/log.csv"]


def test_a_comparison_has_the_rows_of_the_table(tmp_path, beside):
    robot, charts, end, rows = read_comparison(beside)
    assert robot == ROBOT
    columns = 1 + sum(len(chart.series) for chart in charts)
    assert all(len(row) == columns for row in rows)
    table = np.genfromtxt(beside / "replay.csv", delimiter=",", names=True)
    offsets = 1e3 * (table["C1_length_m"] - table["C1_predicted_length_m"])
    assert [row[1] for row in rows] == pytest.approx(offsets)
    assert end == rows[-1][0] == table["time_s"][-1]
    broken = tmp_path / "broken"
    shutil.copytree(beside, broken)
    (broken / "replay.csv").write_text("time_s\n0\n")
    with pytest.raises(CdprError, match="broken: cannot be read"):
        read_comparison(broken)


async def test_a_log_is_compared_with_the_open_robot_as_the_command_does(user, bench, work):
    open_panel(user, "logs")
    await until(lambda: shown(user, "logs-empty"))
    field(user, "log").value = "circle.csv"
    await until(lambda: "rows gaps</th><td>1<" in _content(user, "table-Numbers"))
    assert "C8_length_m" in _content(user, "table-columns")
    user.find(marker="compare-log").click()
    await until(lambda: bench.results.subject("log") is not None)
    about = bench.results.subject("log")
    assert about.digest == bench.subject.digest
    name = _views[bench].board.shown
    told = json.loads((work / "logs" / name / "summary.json").read_text())
    assert told["cables"]["C1"]["length_offset_m"] == pytest.approx(OFFSET, abs=1e-6)
    await until(lambda: "C1</th><td>0.004<" in _content(user, "table-cables"))


async def test_a_file_that_is_no_log_is_said(user):
    open_panel(user, "logs")
    field(user, "log").value = "notes.txt"
    await until(lambda: any("notes.txt" in words for words in problems(user)))


def _content(user, name):
    try:
        return field(user, name).content
    except (AssertionError, ValueError):
        return ""
