"""The logs panel: what is in a log, and a log beside the model of the robot that is open."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.logs import TAB, log_contents, log_files, read_comparison
from cdpr_drake.studio.verb_panel import view_of
from tests.studio.pages import field, open_panel, problems, shown, until

ROBOT = "acrobot_small"

OFFSET = 0.004
"""By which the first cable's length is wrong in the log of the test [m]."""


@pytest.fixture(scope="module")
def work(tmp_path_factory, alone):
    """With the log of a run, and the same log with a gap and a wrong zero of C1."""
    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(alone, folder / "runs" / "short")
    log = pd.read_csv(alone / "log.csv")
    log.loc[6:, "time_s"] += 2.0
    log[["lengths.C1_m", "unstrained_lengths.C1_m"]] += OFFSET
    log.to_csv(folder / "wrong.csv", index=False)
    (folder / "notes.txt").write_text("not a log\n")
    return folder


def test_logs_of_the_folder_and_of_runs_have_the_contents_of_the_front_door(work):
    assert log_files(WorkingFolder(work)) == ["notes.txt", "wrong.csv", "runs/short/log.csv"]
    (view, picture), log = log_contents(work / "wrong.csv"), import_log(work / "wrong.csv")
    assert dict(view.facts)["rows gaps"] == "1"
    heads, rows = next(table for title, table in view.tables.items() if "columns" in title)
    assert heads == ["columns", "rows", "least", "largest"]
    assert [row[0] for row in rows] == list(log.frame)
    assert picture.startswith(b"\x89PNG")


def test_a_comparison_has_the_rows_of_the_table(tmp_path, beside):
    charts, end, rows = read_comparison(beside)
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


async def test_a_log_is_compared_with_the_open_robot_as_the_command_does(user, bench, work, beside):
    open_panel(user, "logs")
    await until(lambda: shown(user, "logs-empty"))
    field(user, "log").value = "notes.txt"
    await until(lambda: any("notes.txt" in words for words in problems(user)))
    field(user, "log").value = "wrong.csv"
    await until(lambda: "rows gaps</th><td>1<" in _content(user, "table-Numbers"))
    assert "C8_length_m" in _content(user, "table-columns")
    user.find(marker="start-logs").click()
    await until(lambda: bench.results.subject("log") is not None)
    assert bench.results.subject("log").digest == bench.subject.digest
    await until(lambda: shown(user, "table-cables"))
    offset, right = (
        json.loads((folder / "summary.json").read_text())["cables"]["C1"]["length_offset_m"]
        for folder in (work / "logs" / view_of(bench, TAB).board.shown, beside)
    )
    assert offset - right == pytest.approx(OFFSET, abs=1e-5)  # residuals are 3e-6 m
    assert f"C1</th><td>{offset:.4g}<" in _content(user, "table-cables")


def _content(user, name):
    return field(user, name).content if shown(user, name) else ""
