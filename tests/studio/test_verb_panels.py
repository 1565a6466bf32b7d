"""The panels of verbs: workspaces, logs, studies and all commands, by NiceGUI's simulated user."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.logs import Logs, log_contents, log_files, read_comparison
from cdpr_drake.studio.workspace import Workspaces
from tests.studio.pages import field, in_scene, open_panel, problems, shown, until

ROBOT = "acrobot_small"

OFFSET = 0.004
"""By which the first cable's length is wrong in the log of the test [m]."""


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed, alone):
    """With a workspace, a study, the log of a run, and that log with a gap and a wrong zero."""
    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(computed, folder / "workspaces" / "small")
    shutil.copytree(alone, folder / "runs" / "short")
    study = folder / "studies" / "tension-methods"
    study.mkdir(parents=True)
    statement = {"words": "says", "printed": "1", "found": "2", "verdict": "confirmed"}
    (study / "results.json").write_text(json.dumps({"study": "x", "statements": [statement]}))
    (study / "figure.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    log = pd.read_csv(alone / "log.csv")
    log.loc[6:, "time_s"] += 2.0
    log[["lengths.C1_m", "unstrained_lengths.C1_m"]] += OFFSET
    log.to_csv(folder / "wrong.csv", index=False)
    (folder / "notes.txt").write_text("not a log\n")
    return folder


async def press_start(user, bench, tab):
    """The job that a button starts."""
    jobs = len(bench.jobs.jobs)
    user.find(marker=f"start-{tab}").click()
    await until(lambda: len(bench.jobs.jobs) > jobs)
    return bench.jobs.jobs[-1]


async def test_results_of_the_folder_are_layers_with_the_volumes_of_the_command(
    user, bench, computed
):
    open_panel(user, "workspace")
    view = bench.kept(Workspaces)
    await until(lambda: view.regions is not None)
    assert field(user, "workspaces-results").value == "small"
    answer = json.loads((computed / "results.json").read_text())["workspaces"]
    for name, numbers in answer.items():
        assert field(user, f"volume-{name}").content == f"{numbers['corners_m3']:.4g} m^3"
    assert view.visible == {"all"}
    field(user, "layer-static").value = True
    assert view.visible == {"all", "static"}
    field(user, "plane-of").value = "capacity-margin"
    field(user, "plane-index").value = 3
    assert (view.plane.along, view.plane.index) == (2, 3)
    assert f"z = {view.regions.axes[2][3]:.4g} m" in field(user, "plane-legend").content
    assert all(in_scene(bench, f"workspaces/{name}") for name in ("all", "static", "plane"))
    assert problems(user) == []


async def test_a_robot_that_is_not_saved_is_not_asked_about(user, bench):
    open_panel(user, "workspace")
    await until(lambda: shown(user, "workspace-grid"))
    bench.robot.change(bench.robot.text + "\n# changed\n")
    user.find(marker="start-workspaces").click()
    await until(lambda: problems(user))
    assert "save it" in problems(user)[-1]
    assert bench.jobs.jobs == []


async def test_wrong_values_are_said_at_their_fields_by_form_and_by_command(user, bench):
    open_panel(user, "workspace")
    await until(lambda: shown(user, "workspace-force"))
    for key, value in (("force", "much"), ("grid", "five")):
        cell = field(user, f"workspace-{key}")
        cell.value = value
        user.find(marker="start-workspaces").click()
        await until(lambda cell=cell: cell.error)
        assert f"--{key}: found '{value}'" in cell.error
        cell.value = ""
    assert bench.jobs.jobs == []
    field(user, "workspace-force").value = "-1"  # which the verb refuses, not the parser
    job = await press_start(user, bench, "workspaces")
    await until(lambda: field(user, "workspace-force").error)
    assert job.state == "failed"
    assert field(user, "workspace-grid").error is None


async def start(user, bench, name, /, **values):
    """The job of a verb that is started in the panel of all commands."""
    open_panel(user, "commands")
    field(user, "verb-commands").value = name
    for key, value in values.items():
        await until(lambda key=key: shown(user, f"{name}-{key}"))
        field(user, f"{name}-{key}").value = value
    return await press_start(user, bench, "commands")


async def test_a_command_without_a_folder_answers_with_its_json(user, bench, work):
    job = await start(user, bench, "tension", method="infinity_norm")
    await until(lambda: bench.results.subject("answer") is not None)
    answer = json.loads((work / "commands" / f"{ROBOT}-tension" / "results.json").read_text())
    assert answer == job.result()
    assert len(answer["tensions_n"]) == 8
    assert job.arguments == ("tension", "--json", f"--robot={ROBOT}", "--method=infinity_norm")
    assert bench.results.subject("answer").digest == bench.subject.digest
    await until(lambda: shown(user, "table-Numbers"))


async def test_a_command_that_writes_files_shows_them(user, bench, work):
    await start(user, bench, "new", kind="controller", name="mine")
    await until(lambda: field(user, "commands-results").value == "new")
    await until(lambda: (work / "commands" / "new" / "results.json").is_file())
    assert (work / "commands" / "new" / "mine.py").is_file()


async def test_finished_studies_are_a_gallery_with_verdicts_and_figures(user):
    open_panel(user, "studies")
    await until(lambda: shown(user, "card-tension-methods"))
    await until(lambda: shown(user, "statements"))
    assert "confirmed" in field(user, "statements").content
    assert field(user, "figure").value == "figure.svg"


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
    broken = shutil.copytree(beside, tmp_path / "broken")
    (broken / "replay.csv").write_text("time_s\n0\n")
    with pytest.raises(CdprError, match="broken: cannot be read"):
        read_comparison(broken)


async def test_a_log_is_compared_with_the_open_robot_as_the_command_does(user, bench, work, beside):
    def says(name, words):
        return shown(user, name) and any(
            words in table.content for table in user.find(marker=name).elements
        )

    open_panel(user, "logs")
    await until(lambda: shown(user, "logs-empty"))
    field(user, "log").value = "notes.txt"
    await until(lambda: any("notes.txt" in words for words in problems(user)))
    field(user, "log").value = "wrong.csv"
    await until(lambda: says("table-Numbers", "rows gaps</th><td>1<"))
    assert says("table-columns", "C8_length_m")
    await press_start(user, bench, "logs")
    await until(lambda: bench.results.subject("log") is not None)
    assert bench.results.subject("log").digest == bench.subject.digest
    await until(lambda: shown(user, "table-cables"))
    offset, right = (
        json.loads((folder / "summary.json").read_text())["cables"]["C1"]["length_offset_m"]
        for folder in (work / "logs" / bench.kept(Logs).board.shown, beside)
    )
    assert offset - right == pytest.approx(OFFSET, abs=1e-5)  # residuals are 3e-6 m
    assert says("table-cables", f"C1</th><td>{offset:.4g}<")
