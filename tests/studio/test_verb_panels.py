"""The panels of verbs: workspaces, logs, studies and all commands, and what they show of results.

By NiceGUI's simulated user; what is read of a folder without a page, too.
"""

import io
import json
import shutil
import zipfile

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.studio.logs import Logs, read_comparison
from cdpr_drake.studio.views import View, read_numbers
from cdpr_drake.studio.workspace import (
    UNKNOWN,
    Plane,
    Workspaces,
    colors_of,
    draw_plane,
    read_regions,
    show_regions,
)
from tests.studio.pages import field, in_scene, open_panel, problems, shown, until

ROBOT = "acrobot_small"

OFFSET = 0.004
"""By which the first cable's length is wrong in the log of the test [m]."""

STATEMENT = {"words": "<b>says</b>", "printed": "1", "found": "2", "verdict": "confirmed"}
STUDY = {
    "study": "some", "quick": True, "spread_m": 1.25, "rows": {"done": 3, "of": 4},
    "statements": [STATEMENT, STATEMENT | {"verdict": "in part"}],
    "parts": {"a": {"x": 1}, "b": {"y": 2}},
    "cables": {"C1": {"length_m": 0.5}, "C2": {"length_m": None}},
    "runs": [{"seed": k, "summary": {"no": 1}} for k in range(100)],
}  # fmt: skip


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed, alone):
    """With a workspace, the log of a run, that log with a gap and a wrong zero, and a study.

    The words of the study are not harmless, and a link leads out of its folder.
    """
    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(computed, folder / "workspaces" / "small")
    shutil.copytree(alone, folder / "runs" / "short")
    log = pd.read_csv(alone / "log.csv")
    log.loc[6:, "time_s"] += 2.0
    log[["lengths.C1_m", "unstrained_lengths.C1_m"]] += OFFSET
    log.to_csv(folder / "wrong.csv", index=False)
    (folder / "notes.txt").write_text("not a log\n")
    study = folder / "studies" / "some"
    study.mkdir(parents=True)
    for name, words in (
        ("results.json", json.dumps(STUDY)), ("replay.html", "<p>moves</p>"), (".hidden", ""),
        ("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>"),
    ):  # fmt: skip
        (study / name).write_text(words)
    (study / "outside.png").symlink_to("/etc/hostname")
    return folder


def says(user, name, words):
    """Whether one of the tables of a name that are to be seen has some words."""
    tables = user.find(marker=name).elements if shown(user, name) else ()
    return any(words in table.content for table in tables)


async def press_start(user, bench, panel):
    """The job that a button starts."""
    jobs = len(bench.jobs.jobs)
    user.find(marker=f"start-{panel}").click()
    await until(lambda: len(bench.jobs.jobs) > jobs)
    return bench.jobs.jobs[-1]


async def test_workspaces_are_layers_with_the_numbers_of_the_command_and_a_plane(
    user, bench, computed
):
    open_panel(user, "workspace")
    view = bench.kept(Workspaces)
    await until(lambda: view.regions is not None)
    assert field(user, "workspaces-results").value == "small"
    rows = [line.split() for line in (computed / "printed.txt").read_text().splitlines()]
    printed = {row[0]: row[2:4] for row in rows if len(row) > 3}
    for name in ("all", "static", "wrench-feasible"):
        assert field(user, f"volume-{name}").content == f"{printed[name][1]} m^3"
    assert [layer.share.split()[0] for layer in view.regions.layers] == [
        printed[name][0] for name in ("all", "static", "wrench-feasible")
    ]
    assert view.visible == {"all"}
    field(user, "layer-static").value = True
    assert view.visible == {"all", "static"}
    assert list(field(user, "plane-along").options) == [0, 1, 2]
    field(user, "plane-of").value = "capacity-margin"
    field(user, "plane-index").value = 3
    assert (view.plane.along, view.plane.index) == (2, 3)
    assert f"z = {view.regions.axes[2][3]:.4g} m" in field(user, "plane-legend").content
    assert all(in_scene(bench, f"workspaces/{name}") for name in ("all", "static", "plane"))
    field(user, "plane-of").value = "none"
    assert not in_scene(bench, "workspaces/plane")
    assert problems(user) == []


@pytest.fixture(scope="module")
def meshcat():
    return open_meshcat()


def computed_regions(folder, *words):
    """What a command leaves in a folder, and its regions."""
    with pytest.raises(SystemExit):
        main([*words, "--grid=3,3,3", f"--out={folder}", "--json"])
    return json.loads((folder / "results.json").read_text()), read_regions(folder)


def test_a_hull_and_proven_boxes_are_layers_too(tmp_path, meshcat):
    told, regions = computed_regions(
        tmp_path / "proven", "workspace", ROBOT, "--kind=static", "--hull=0,0,0.3", "--rays=100",
        "--certify", "--boxes=400",
    )  # fmt: skip
    layers = {layer.name: layer for layer in regions.layers}
    assert list(layers) == ["static", "hull", "boxes inside", "boxes open"]
    assert layers["hull"].volume == f"{told['hull']['volume_m3']:.4g} m^3"
    assert told["certified"]["outside_share"] == 0.0  # of so few boxes
    for name in ("inside", "open"):
        layer = layers[f"boxes {name}"]
        assert layer.share == f"{100.0 * told['certified'][f'{name}_share']:.2f} %"
        corners = layer.mesh[0].reshape(-1, 8, 3)
        assert layer.volume == f"{np.prod(np.ptp(corners, axis=1), axis=1).sum():.4g} m^3"
    show_regions(meshcat, regions, {"boxes open"})
    assert meshcat.HasPath("workspaces/hull")
    assert meshcat.HasPath("workspaces/boxes open")
    (tmp_path / "proven" / "boxes.npz").write_bytes(b"")
    with pytest.raises(CdprError, match=r"boxes.npz: found no boxes"):
        read_regions(tmp_path / "proven")


def test_workspaces_of_stability_are_layers_and_their_margin_a_plane(tmp_path, meshcat):
    told, regions = computed_regions(
        tmp_path / "stable", "stability", ROBOT, "--verdict=sampled", "--draws=2"
    )
    (volumes,) = told["workspaces"]
    assert [(layer.name, layer.volume) for layer in regions.layers] == [
        (name, f"{volumes[name.removeprefix('baseline/')]['corners_m3']:.4g} m^3")
        for name in ("baseline/SZ", "baseline/Z", "S")
    ]
    ((name, values),) = regions.values.items()
    assert values.shape == (3, 3, 3)
    draw_plane(meshcat, regions, Plane(name, 0, 2))
    assert meshcat.HasPath("workspaces/plane")


def test_colours_of_a_plane_go_from_the_least_to_the_largest_value():
    colors = colors_of(np.array([1.0, 3.0, 2.0, np.nan, -np.inf]), (1.0, 3.0))
    middle = (np.array(rgb(TENSIONS[3])) + rgb(TENSIONS[4])) / 2.0
    expected = [rgb(TENSIONS[0]), rgb(TENSIONS[-1]), middle, UNKNOWN, UNKNOWN]
    np.testing.assert_allclose(colors, expected)


async def test_wrong_values_and_robots_are_refused_by_form_and_by_command(user, bench):
    open_panel(user, "workspace")
    await until(lambda: shown(user, "workspace-force"))
    force, grid = field(user, "workspace-force"), field(user, "workspace-grid")
    for cell, words in ((force, "--force: found 'much'"), (grid, "--grid: found 'five'")):
        cell.value = words.split("'")[1]
        user.find(marker="start-workspaces").click()
        await until(lambda cell=cell: cell.error)
        assert words in cell.error
        cell.value = ""
    bench.robot.change(bench.robot.text + "\n# changed\n")
    user.find(marker="start-workspaces").click()
    await until(lambda: any("save it" in words for words in problems(user)))
    assert bench.jobs.jobs == []
    bench.robot.undo()
    force.value = "-1"  # which the verb refuses, not the parser
    job = await press_start(user, bench, "workspaces")
    await until(lambda: force.error)
    assert (job.state, grid.error) == ("failed", None)


@pytest.mark.parametrize(
    ("name", "values", "folder", "words"),
    [("tension", {"method": "infinity_norm"}, f"{ROBOT}-tension",
      [f"--robot={ROBOT}", "--method=infinity_norm"]),
     ("new", {"kind": "controller", "name": "mine"}, "new", [])],
)  # fmt: skip
async def test_a_command_leaves_its_answer_and_its_files(
    user, bench, work, name, values, folder, words
):
    open_panel(user, "commands")
    field(user, "verb-commands").value = name
    for key, value in values.items():
        await until(lambda key=key: shown(user, f"{name}-{key}"))
        field(user, f"{name}-{key}").value = value
    job = await press_start(user, bench, "commands")
    place = work / "commands" / folder
    await until(lambda: (place / "results.json").is_file())
    assert field(user, "commands-results").value == folder
    await until(lambda: bench.results.subject("answer") is not None)
    if name == "new":
        assert (place / "mine.py").is_file()
        return
    assert json.loads((place / "results.json").read_text()) == job.result()
    assert len(job.result()["tensions_n"]) == 8
    assert job.arguments == (name, "--json", *words)
    assert bench.results.subject("answer").digest == bench.subject.digest
    await until(lambda: shown(user, "table-Numbers"))


def test_a_folder_has_facts_verdicts_tables_and_files(work):
    folder = work / "studies" / "some"
    results = View(read_numbers(folder), folder)
    assert results.facts == [
        ("study", "some"), ("quick", "yes"), ("spread [m]", "1.25"), ("rows done", "3"),
        ("rows of", "4"), ("parts a x", "1"), ("parts b y", "2"),
    ]  # fmt: skip
    assert results.verdicts == "1 confirmed, 1 in part"
    assert results.remarks == "short form"
    heads, rows = results.tables["runs, the first 60 of 100 rows"]
    assert (heads, len(rows), rows[-1]) == (["seed"], 60, ["59"])
    cables = results.tables["cables, 2 rows"]
    assert cables == (["cables", "length [m]"], [["C1", "0.5"], ["C2", "–"]])
    assert list(results.files) == ["a.svg", "replay.html", "results.json"]


@pytest.mark.parametrize(
    ("read", "words", "refusal"),
    [(read_numbers, "", "results.json: "), (read_numbers, "[]", "results.json: "),
     (read_numbers, "\xff", "results.json: "), (read_numbers, "[" * 100_000, "results.json: "),
     (read_regions, "{}", "found no stored workspace"),
     (read_regions, '{"workspaces": 3}', "found no stored workspace"),
     (read_regions, '{"workspaces": []}', "found no stored workspace")],
    ids=range(7),
)  # fmt: skip
def test_broken_results_are_one_message(tmp_path, read, words, refusal):
    (tmp_path / "results.json").write_text(words, encoding="latin-1")
    with pytest.raises(CdprError, match=refusal):
        read(tmp_path)


async def test_studies_are_a_gallery_with_verdicts_and_files_and_nothing_in_them_is_run(user):
    open_panel(user, "studies")
    await until(lambda: shown(user, "card-some"))
    await until(lambda: says(user, "statements", "confirmed"))
    assert says(user, "statements", "&lt;b&gt;says")
    await until(lambda: says(user, "shown-figure", "image/svg+xml"))
    assert field(user, "figure").options == ["a.svg"]
    field(user, "page-replay.html").value = True
    await until(lambda: shown(user, "result-page"))
    page = field(user, "result-page").props
    assert (page["srcdoc"], page["sandbox"]) == ("<p>moves</p>", "allow-scripts")
    user.find("All as a zip archive").click()
    sent = await user.download.next(timeout=1200.0)
    with zipfile.ZipFile(io.BytesIO(sent.content)) as archive:  # which follows no link
        names = {"results.json", "a.svg", "replay.html", ".hidden"}
        assert {f"some/{name}" for name in names} == set(archive.namelist())


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
    open_panel(user, "logs")
    await until(lambda: shown(user, "logs-empty"))
    log = field(user, "log")
    assert log.options == ["notes.txt", "wrong.csv", "runs/short/log.csv"]
    log.value = "notes.txt"
    await until(lambda: any("notes.txt" in words for words in problems(user)))
    log.value = "wrong.csv"
    await until(lambda: says(user, "table-Numbers", "rows gaps</th><td>1<"))
    for name in import_log(work / "wrong.csv").frame:
        assert says(user, "table-columns", f">{name}<")
    assert says(user, "shown-figure", "image/png")
    await press_start(user, bench, "logs")
    await until(lambda: bench.results.subject("log") is not None)
    assert bench.results.subject("log").digest == bench.subject.digest
    offset, right = (
        json.loads((folder / "summary.json").read_text())["cables"]["C1"]["length_offset_m"]
        for folder in (work / "logs" / bench.kept(Logs).board.shown, beside)
    )
    assert offset - right == pytest.approx(OFFSET, abs=1e-5)  # residuals are 3e-6 m
    await until(lambda: says(user, "table-cables", f"C1</th><td>{offset:.4g}<"))
