"""Results in the page: workspaces, runs, logs, studies and answers, and which robot they are about.

By NiceGUI's simulated user; what is read of a folder without a page, too.
"""

import asyncio
import json
import shutil
import sys

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.logs.import_log import import_log
from cdpr_drake.analyses.runs.log import CHECKPOINT, PARTS
from cdpr_drake.analyses.runs.steering import Message
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay import RecordedScene
from cdpr_drake.errors import CdprError, OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.palette import TENSIONS, rgb
from cdpr_drake.studio import runs, workspace
from cdpr_drake.studio.boards import write_asked
from cdpr_drake.studio.jobs import Job
from cdpr_drake.studio.logs import Logs, read_comparison
from cdpr_drake.studio.panel import PANELS
from cdpr_drake.studio.plots import plot_row
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.run import run_pairs
from cdpr_drake.studio.runs import FinishedRun, RunJob
from cdpr_drake.studio.views import View, read_numbers
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.cli.commands import ended
from tests.studio.conftest import RUN, RUN_SETTINGS
from tests.studio.pages import LONGEST, another_tab, archive, do, field, in_scene, put, until
from tests.studio.served import write_scenario

ROBOT, OTHER = "acrobot_small", "planar"

OFFSET = 0.004
"""By which the first cable's length is wrong in the log of the test [m]."""

JPEG = b"\xff\xd8"

STATEMENT = {"words": "<b>says</b>", "printed": "1", "found": "2", "verdict": "confirmed"}
STUDY = {
    "study": "some", "quick": True, "spread_m": 1.25, "rows": {"done": 3, "of": 4},
    "statements": [STATEMENT, STATEMENT | {"verdict": "in part"}],
    "parts": {"a": {"x": 1}, "b": {"y": 2}},
    "cables": {"C1": {"length_m": 0.5}, "C2": {"length_m": None}},
    "runs": [{"seed": k, "summary": {"no": 1}} for k in range(100)],
}  # fmt: skip


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed, alone, beside):
    """With results of each kind, a scenario, and a log with a gap and a wrong zero.

    The words of the study are not harmless, and a link leads out of its folder.
    """
    folder = tmp_path_factory.mktemp("work")
    for source, place in (
        (computed, "workspaces/small"), (alone, "runs/first"), (alone, "runs/second"),
        (alone, "runs/broken"), (beside, "logs/small"),
    ):  # fmt: skip
        shutil.copytree(source, folder / place)
    about = subject_of(load_robot(ROBOT))
    for name in ("workspaces", "logs"):
        write_asked(folder / name / ".small.asked.json", (), about)
    for name, words in (
        ("studies/some/results.json", json.dumps(STUDY)), ("studies/some/.hidden", ""),
        ("studies/some/replay.html", "<p>moves</p>"), ("runs/broken/log.npz", "PK no archive"),
        ("studies/some/a.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>"),
        ("commands/small/results.json", json.dumps({"robot": ROBOT})), ("notes.txt", "no log\n"),
    ):  # fmt: skip
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(words)
    (folder / "studies" / "some" / "outside.png").symlink_to("/etc/hostname")
    log = pd.read_csv(alone / "log.csv")
    log.loc[6:, "time_s"] += 2.0
    log[["lengths.C1_m", "unstrained_lengths.C1_m"]] += OFFSET
    log.to_csv(folder / "wrong.csv", index=False)
    write_scenario(folder, **{"duration: 30.0": "duration: 0.5"})
    return folder


# Without a page.


def test_samples_are_thinned_evenly_and_the_newest_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "MOST_SAMPLES", 10)
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out")
    for number in range(100):
        job.take(Message("sample", {"t": number}))
        assert job.at(None)[0] == {"t": number}
    assert [sample["t"] for sample in job.samples] == [0, 16, 32, 48, 64, 80, 96, 99]


async def test_a_run_that_is_watched_and_stopped_goes_on_by_the_command_with_the_same_log(
    tmp_path, alone
):
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out", settings=RUN_SETTINGS)
    job.tell("pause")
    job.begin()
    await until(lambda: (job.samples and job.state == "paused") or job.state.is_over, LONGEST)
    assert (job.state, job.samples[-1]["t"]) == ("paused", 0.0), job.message
    job.tell("step")
    row = pytest.approx(job.header["period"], abs=2e-3)  # of the log; a step of the integration
    await until(lambda: job.samples[-1]["t"] == row and job.state == "paused")
    await until(lambda: job.progress[0] == pytest.approx(job.samples[-1]["t"] / 0.2))
    await until(lambda: job.at(None)[1].startswith(JPEG))
    assert job.samples[-1]["t"] == row  # it stands
    job.tell("step", seconds=0.05)
    await until(lambda: job.samples[-1]["t"] > 0.05 and job.state == "paused")
    job.stop()
    assert await job.wait(LONGEST)
    assert job.message.endswith("the same command goes on")
    assert (job.folder / PARTS / CHECKPOINT).is_file()
    job = Job([*RUN, f"--out={job.folder}", "--json"], tmp_path, job.folder)
    job.begin()
    assert await job.wait(LONGEST)
    assert job.state == "finished", job.message
    assert {path.name for path in job.folder.iterdir()} == {path.name for path in alone.iterdir()}
    for name in ("log.csv", "scenario.yaml", "robot.yaml"):
        assert (job.folder / name).read_bytes() == (alone / name).read_bytes()
    assert job.result() == json.loads((job.folder / "summary.json").read_text())


def test_a_finished_run_has_the_rows_of_its_log_and_numbers_beside_those_of_another(alone, work):
    done = FinishedRun(alone)
    last, row = done.samples[-1], plot_row(done.samples[-1])
    with np.load(alone / "log.npz") as log:
        assert done.times.tolist() == log["time"].tolist()
        assert last["tensions"] == log["tensions"][-1].tolist()
        assert last["pose"] == log["X_WP"][-1].tolist()
    for name, unit in (("position_error", "m"), ("rotation_error", "rad")):
        assert last[name] == pytest.approx(done.summary[f"final_{name}_{unit}"], rel=1e-12)
    sample, jpeg = done.at(0.1)
    assert sample["t"] == done.times[np.argmin(np.abs(done.times - 0.1))]
    assert jpeg.startswith(JPEG)
    assert len(row) == 1 + sum(len(chart.series) for chart in done.charts)
    assert row[1] == pytest.approx(1e3 * last["position_error"])
    assert done.charts[1].limits == load_robot(ROBOT).tension_limits()
    with pytest.raises(OutputFolderError, match="broken: cannot be read"):
        FinishedRun(work / "runs" / "broken")
    other = done.summary | {"final_position_error_m": last["position_error"] + 0.01}
    pairs = {pair.name: pair for pair in run_pairs(done.summary, other)}
    assert pairs["final position error [m]"].difference == pytest.approx(0.01)
    assert pairs["tension min [N]"].difference == 0.0
    assert pairs["outcome"].one == done.summary["outcome"]
    assert not any("wall time" in name or "drake" in name for name in pairs)


def test_subjects_tell_every_change_of_a_robot():
    robot, other = load_robot(ROBOT), load_robot(ROBOT)
    assert subject_of(robot) == subject_of(other)
    other.cables[3].anchor_point[1] += 1e-12
    assert subject_of(robot).is_another(subject_of(other))


def words_of(volumes):
    """Share and volume as the table of the command has them."""
    return f"{100.0 * volumes['corners_share']:.2f} %", f"{volumes['corners_m3']:.4g} m^3"


def test_hulls_proven_boxes_and_stability_are_layers_and_planes_too(tmp_path):
    proven, stable, meshcat = tmp_path / "proven", tmp_path / "stable", open_meshcat()
    ended(
        "workspace", ROBOT, "--kind=static", "--grid=3,3,3", "--hull=0,0,0.3",
        "--rays=100", "--certify", "--boxes=400", f"--out={proven}",
    )  # fmt: skip
    numbers, regions = read_numbers(proven), workspace.read_regions(proven)
    layers = {layer.name: layer for layer in regions.layers}
    assert list(layers) == ["static", "hull", "boxes inside", "boxes open"]
    assert layers["hull"].volume == f"{numbers['hull']['volume_m3']:.4g} m^3"
    assert numbers["certified"]["outside_share"] == 0.0  # of so few boxes
    for name in ("inside", "open"):
        layer = layers[f"boxes {name}"]
        assert layer.share == f"{100.0 * numbers['certified'][f'{name}_share']:.2f} %"
        corners = layer.mesh[0].reshape(-1, 8, 3)
        assert layer.volume == f"{np.prod(np.ptp(corners, axis=1), axis=1).sum():.4g} m^3"
    workspace.show_regions(meshcat, regions, {"boxes open"})
    assert meshcat.HasPath("workspaces/hull")
    (proven / "boxes.npz").write_bytes(b"")
    with pytest.raises(CdprError, match=r"boxes.npz: found no boxes"):
        workspace.read_regions(proven)
    options = "--grid=3,3,3", "--verdict=sampled", "--draws=2", f"--out={stable}"
    ended("stability", ROBOT, *options)
    (volumes,), regions = read_numbers(stable)["workspaces"], workspace.read_regions(stable)
    assert [(layer.name, layer.volume) for layer in regions.layers] == [
        (name, words_of(volumes[name.removeprefix("baseline/")])[1])
        for name in ("baseline/SZ", "baseline/Z", "S")
    ]
    ((name, values),) = regions.values.items()
    assert values.shape == (3, 3, 3)
    workspace.draw_plane(meshcat, regions, workspace.Plane(name, 0, 2))
    assert meshcat.HasPath("workspaces/plane")


def test_colours_of_a_plane_go_from_the_least_to_the_largest_value():
    colors = workspace.colors_of(np.array([1.0, 3.0, 2.0, np.nan, -np.inf]), (1.0, 3.0))
    middle = (np.array(rgb(TENSIONS[3])) + rgb(TENSIONS[4])) / 2.0
    expected = [rgb(TENSIONS[0]), rgb(TENSIONS[-1]), middle, *[workspace.UNKNOWN] * 2]
    np.testing.assert_allclose(colors, expected)


def test_a_folder_has_facts_verdicts_tables_and_files(work):
    folder = work / "studies" / "some"
    results = View(read_numbers(folder), folder)
    assert results.facts == [
        ("study", "some"), ("quick", "yes"), ("spread [m]", "1.25"), ("rows done", "3"),
        ("rows of", "4"), ("parts a x", "1"), ("parts b y", "2"),
    ]  # fmt: skip
    assert (results.verdicts, results.remarks) == ("1 confirmed, 1 in part", "short form")
    heads, rows = results.tables["runs, the first 60 of 100 rows"]
    assert (heads, len(rows), rows[-1]) == (["seed"], 60, ["59"])
    cables = results.tables["cables, 2 rows"]
    assert cables == (["cables", "length [m]"], [["C1", "0.5"], ["C2", "–"]])
    assert list(results.files) == ["a.svg", "replay.html", "results.json"]


def test_broken_results_are_one_message(tmp_path):
    regions = "{}", '{"workspaces": 3}', '{"workspaces": []}'
    for read, refusal, texts in (
        (read_numbers, "results.json: ", ("", "[]", "\xff", "[" * 100_000)),
        (workspace.read_regions, "found no stored workspace", regions),
    ):
        for words in texts:
            (tmp_path / "results.json").write_text(words, encoding="latin-1")
            with pytest.raises(CdprError, match=refusal):
                read(tmp_path)


def test_a_comparison_has_the_rows_of_the_table(tmp_path, beside):
    charts, end, rows = read_comparison(beside)
    columns = 1 + sum(len(chart.series) for chart in charts)
    assert {len(row) for row in rows} == {columns}
    table = pd.read_csv(beside / "replay.csv")
    offsets = 1e3 * (table["C1_length_m"] - table["C1_predicted_length_m"])
    assert [row[1] for row in rows] == pytest.approx(offsets.tolist())
    assert end == rows[-1][0] == table["time_s"].iloc[-1]
    broken = shutil.copytree(beside, tmp_path / "broken")
    (broken / "replay.csv").write_text("time_s\n0\n")
    with pytest.raises(CdprError, match="broken: cannot be read"):
        read_comparison(broken)


# In the page.


async def test_workspaces_are_layers_with_the_numbers_of_the_command_and_a_plane(user, bench):
    await do(user, "tab-workspace")
    view = bench.kept(workspace.Workspaces)
    await until(lambda: view.regions is not None)
    numbers = json.loads((view.regions.folder / "results.json").read_text())["workspaces"]
    assert [layer.name for layer in view.regions.layers] == ["all", "static", "wrench-feasible"]
    for layer in view.regions.layers:
        assert (layer.share, layer.volume) == words_of(numbers[layer.name])
        assert field(user, f"volume-{layer.name}").content == layer.volume
    await do(user, "layer-static")
    assert view.visible == {"all", "static"}
    assert list(field(user, "plane-along").options) == [0, 1, 2]
    await do(user, "plane-of=capacity-margin")
    field(user, "plane-index").value = 3
    assert (view.plane.along, view.plane.index) == (2, 3)
    assert f"z = {view.regions.axes[2][3]:.4g} m" in field(user, "plane-legend").content
    assert all(in_scene(bench, f"workspaces/{name}") for name in ("all", "static", "plane"))
    await do(user, "plane-of=none")
    assert not in_scene(bench, "workspaces/plane")
    assert user.notify.messages == []


CHOOSE = {
    "run": ("run: first", "run=first"),
    "compared": ("compare: second", "compare=second"),
    "answer": ("commands-results: small", "commands-results=small"),
}
"""Steps to results that have to be chosen."""


async def show(user, bench, panel, name):
    """Opens a panel, and waits for a result there."""
    await do(user, f"tab-{panel}", *CHOOSE.get(name, ()))
    await until(lambda: bench.results.subject(name) is not None)


def make_heavier(bench):
    put(bench.robot, ("platform", "mass"), 5.25)


async def test_results_are_marked_when_the_robot_or_the_pose_has_changed(user, bench, monkeypatch):
    shows = [(panel, name) for panel in PANELS for name in PANELS[panel].results]
    for panel, name in shows:
        await show(user, bench, panel, name)
    await do(user, "about-study: robots of their own")
    await do(user, "about-answer: whether it was as it is now is not known")

    def said():
        names = {name for _, name in shows} - {"study", "answer"}
        return {name: field(user, f"about-{name}").text for name in names}

    await until(lambda: not any(said().values()))
    # As while numbers are being computed.
    monkeypatch.setattr(bench, "ask", bench.results.changed.emit)
    for change, words in (
        (lambda: make_heavier(bench), f"of {ROBOT} as it was before"),
        (lambda: bench.take_opened(bench.files.open(OTHER)), f"of {ROBOT}, not of {OTHER}"),
    ):
        change()
        assert [name for name, remark in said().items() if words not in remark] == []
        bench.robot.undo()
        assert not any(said().values())
    bench.move_to([value + 0.01 for value in bench.coordinates])
    remarks = {name: remark for name, remark in said().items() if remark}
    assert remarks == {"pose-numbers": "Numbers: of the pose before, not of this one."}


async def test_workspaces_leave_the_scene_of_another_robot_and_come_back(user, bench):
    await show(user, bench, "workspace", "workspaces")

    async def scene_has(regions):
        await until(lambda: in_scene(bench, "workspaces/all") == regions)

    await scene_has(True)
    make_heavier(bench)
    await do(user, "layer-wrench-feasible")  # what is switched on meanwhile is not there
    await scene_has(False)
    assert "not in the scene" in field(user, "regions-note").text
    bench.robot.undo()
    await scene_has(True)
    bench.draws(Subject("another", "x"))  # a run of another robot
    await scene_has(False)
    bench.draws(None)
    await scene_has(True)


async def test_the_scene_has_a_run_once_for_all_tabs_while_its_panel_is_shown(
    user, bench, monkeypatch
):
    drawn, draw, built, build = [], bench.draw, [], RecordedScene.__init__
    monkeypatch.setattr(bench, "draw", lambda work, *done: (drawn.extend(done), draw(work, *done)))
    monkeypatch.setattr(RecordedScene, "__init__", lambda *of: (built.append(of), build(*of))[1])
    bench.take_opened(bench.files.open(OTHER))
    await show(user, bench, "run", "run")
    await until(lambda: bench.drawn is not None)
    assert bench.drawn.robot == ROBOT
    await do(user, "tab-robot")
    await until(lambda: bench.drawn is None)
    assert bench.kept(runs.RunBoard).in_scene is None
    field(user, "cursor").value = 0.1  # as another tab moves it
    await until(lambda: not bench.is_computing)
    assert in_scene(bench, "visualizer")
    del drawn[:], built[:]
    await do(user, "tab-run")
    await until(lambda: bench.drawn is not None)
    async with another_tab(user):
        await do(user, "outcome: timeout")
        await asyncio.sleep(1.0)
    assert len(drawn) == 1
    await do(user, "run=second", "run-results:")  # of the same robot in the same scenario
    await until(lambda: len(drawn) == 2)
    await do(user, "tab-robot")
    await until(lambda: bench.drawn is None)
    assert built == []  # both robots were, once
    assert all(in_scene(bench, path) for path in ("visualizer", "cables"))


async def test_two_robots_are_shown_beside_each_other(user, bench):
    field(user, "robot-beside").value = True
    await do(user, "other-robot: acrobot_large", "other-robot=acrobot_large")
    await do(user, "robot-pairs: platform mass [kg]")
    assert "5.25" not in field(user, "robot-pairs").content
    make_heavier(bench)
    await do(user, "robot-pairs: 5.25")


async def test_a_finished_run_is_looked_at_compared_and_downloaded(user, alone):
    await do(user, "tab-run", "run: broken", "run=broken", "run-state: unreadable")
    await do(user, "run=first", "outcome: timeout", "camera:")
    camera = field(user, "camera")
    before = camera.props["src"]
    assert before.startswith("data:image/jpeg;base64,")
    field(user, "cursor").value = 0.0
    await until(lambda: camera.props["src"] != before)
    compare = field(user, "compare")
    assert sorted(compare.options.values()) == ["broken", "none", "second"]
    await do(user, "compare=second", "run=second", "compare: first")
    assert compare.value == ""  # it is not compared with itself
    await do(user, "compare=first", "run-pairs: final position error [m]")
    async with another_tab(user):
        await do(user, "both-runs:", "download")
        files = await archive(user)
    assert files["second/log.csv"] == (alone / "log.csv").read_bytes()


async def test_a_run_is_of_the_robot_that_is_open_and_of_no_other(user, bench, work):
    await do(user, "tab-run")
    board = bench.kept(runs.RunBoard)

    async def runs_robot(words, *settings):
        await do(user, f"run-robot: {words}")
        await until(lambda: board.draft.settings() == settings)

    async def start_is_refused():
        make_heavier(bench)
        await do(user, "run-robot: save it")
        user.notify.messages.clear()
        await do(user, "start")
        await until(lambda: "save it" in str(user.notify.messages))
        assert bench.jobs.jobs == []

    await runs_robot(f"Runs {ROBOT}, the robot that is open.")
    assert board.draft.own_robot == ROBOT
    bench.take_opened(bench.files.open("acrobot_large"))
    await runs_robot(f"instead of the scenario's {ROBOT}", "robot=acrobot_large")
    assert board.draft.check().robot == "acrobot_large"
    await start_is_refused()
    await bench.save("mine.yaml", overwrite=False)
    await until(lambda: board.draft.check().robot == str(work / "mine.yaml"))
    await do(user, "open-own-robot")
    await runs_robot(f"Runs {ROBOT}, the robot that is open.")
    assert bench.robot.value.name == ROBOT
    await start_is_refused()  # its own robot is in no file now


async def test_wrong_values_and_robots_are_refused_by_form_and_by_command(user, bench):
    await do(user, "tab-workspace", "workspace-grid=five", "start-workspaces")
    await do(user, "workspace-grid: --grid: found 'five'")
    bench.robot.change(bench.robot.text + "\n# changed\n")
    await do(user, "workspace-grid=", "start-workspaces")
    await until(lambda: "save it" in str(user.notify.messages))
    assert bench.jobs.jobs == []
    bench.robot.undo()
    await do(user, "workspace-force=-1", "start-workspaces")  # the verb refuses it, no parser
    await until(lambda: field(user, "workspace-force").error)
    assert [job.state for job in bench.jobs.jobs] == ["failed"]
    assert field(user, "workspace-grid").error is None


async def test_a_command_about_the_open_robot_leaves_its_answer(user, bench, work):
    await do(user, "tab-commands", "verb-commands=new", "new-name=mine", "verb-commands=tension")
    await do(user, "tension-method=infinity_norm", "start-commands")
    await until(lambda: bench.results.subject("answer") == bench.questions.subject)
    job, folder = bench.jobs.jobs[-1], work / "commands" / f"{ROBOT}-tension"
    assert job.arguments == ("tension", "--json", f"--robot={ROBOT}", "--method=infinity_norm")
    assert json.loads((folder / "results.json").read_text()) == job.result()
    assert len(job.result()["tensions_n"]) == 8
    await do(user, f"table-Numbers: {job.result()['tensions_n'][0]:.4g}, ")


async def test_studies_are_a_gallery_with_verdicts_and_files_and_nothing_in_them_is_run(user):
    await do(user, "tab-studies", "card-some:", "statements: confirmed")
    await do(user, "statements: &lt;b&gt;says", "shown-figure: image/svg+xml")
    with user.scope(marker="studies-shown"):
        assert field(user, "figure").options == ["a.svg"]
        field(user, "page-replay.html").value = True
        await do(user, "result-page:")
        page = field(user, "result-page").props
        assert (page["srcdoc"], page["sandbox"]) == ("<p>moves</p>", "allow-scripts")
        user.find("All as a zip archive").click()
    names = {"results.json", "a.svg", "replay.html", ".hidden"}  # it follows no link
    assert (await archive(user)).keys() == {f"some/{name}" for name in names}


async def test_a_log_is_compared_with_the_open_robot_as_the_command_does(user, bench, work, beside):
    shutil.rmtree(work / "logs")
    await do(user, "tab-logs", "logs-empty:")
    logs = [f"runs/{name}/log.csv" for name in ("broken", "first", "second")]
    assert field(user, "log").options == ["notes.txt", "wrong.csv", *logs]
    await do(user, "start-logs")
    await until(lambda: "LOG: found nothing" in str(user.notify.messages))
    await do(user, "log=notes.txt")
    await until(lambda: "notes.txt" in str(user.notify.messages))
    columns = [f"table-columns: >{name}<" for name in import_log(work / "wrong.csv").frame]
    await do(user, "log=wrong.csv", "table-Numbers: rows gaps</th><td>1<", *columns)
    await do(user, "shown-figure: image/png", "start-logs", "logs-state: finished")
    await until(lambda: bench.results.subject("log") == bench.questions.subject)
    offset, right = (
        json.loads((folder / "summary.json").read_text())["cables"]["C1"]["length_offset_m"]
        for folder in (work / "logs" / bench.kept(Logs).board.shown, beside)
    )
    assert offset - right == pytest.approx(OFFSET, abs=1e-5)  # residuals are 3e-6 m
    await do(user, f"table-cables: C1</th><td>{offset:.4g}<")


async def test_a_wrong_value_starts_nothing_and_a_run_fails_or_is_found_again(
    user, bench, monkeypatch
):
    def run_by(program):
        monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", program))

    run_by("import sys; print('cdpr: no space left on device', file=sys.stderr); sys.exit(2)")
    await do(user, "tab-run", "field-duration=-3")
    duration, before = field(user, "field-duration"), [*bench.jobs.jobs]
    await until(lambda: duration.props.get("error"))
    await do(user, "start", "scenario-problem: not accepted yet: duration")
    assert bench.jobs.jobs == before
    await do(user, "field-duration=0.2")
    await until(lambda: not duration.props.get("error"))
    await do(user, "start", "run-problem: no space left on device", "run-state: failed")
    run_by("import time; time.sleep(3600)")
    await do(user, "start", "run-state: starting")  # in the same folder
    async with another_tab(user):
        await do(user, "run-state: starting", "stop", "run-state: stopped")


async def test_buttons_break_and_push_and_the_scenario_keeps_it(user, bench, work):
    await do(user, "tab-run", "paused", "by-hand", f"scenario={work / 'acrobot_pbvs.yaml'}")
    await do(user, "start", "hand-cable: C3")  # at once, while the form is on its way
    field(user, "hand-cable").value = 2
    await do(user, "break", "hand-done: C3 breaks")
    await until(lambda: 2 not in field(user, "hand-cable").options)
    field(user, "push-force").value = 0.0
    await do(user, "push", "hand-done: force: found")
    field(user, "push-force").value = 4.0
    await do(user, "push-direction=-y", "push", "hand-done: push of 4 N for 0.3 s")
    await do(user, "speed=as fast as possible", "go-on")
    job = bench.jobs.jobs[-1]
    assert await job.wait(LONGEST)
    await until(lambda: not field(user, "break").enabled)
    scenario = load_scenario(str(job.folder / "scenario.yaml"))
    assert scenario.duration == 0.5
    (event,) = scenario.failures.events
    assert (event.kind, event.cable) == ("cable_breaks", 2)
    assert scenario.disturbances.pushes[-1].force.tolist() == [0.0, -4.0, 0.0]
