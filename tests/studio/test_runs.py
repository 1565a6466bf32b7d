"""Runs, live and finished: their samples, and what a person does in the run panel."""

import asyncio
import io
import json
import shutil
import sys
import zipfile

import numpy as np
import pytest

from cdpr_drake.analyses.runs.steering import Message
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio import runs
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import JobManager, JobState
from cdpr_drake.studio.plots import plot_row
from cdpr_drake.studio.run import run_pairs, run_panel
from cdpr_drake.studio.runs import FinishedRun, RunBoard, RunJob
from cdpr_drake.studio.session import Workbench
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.studio.conftest import RUN_SETTINGS
from tests.studio.pages import field, problems, shown, simulated, type_into, until
from tests.studio.run_page import write_scenario

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""

JPEG = b"\xff\xd8"


def test_samples_are_thinned_evenly_and_the_newest_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "MOST_SAMPLES", 10)
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out")
    for number in range(100):
        job.take(Message("sample", {"t": number}))
        assert job.at(None)[0] == {"t": number}
    assert [sample["t"] for sample in job.samples] == [0, 16, 32, 48, 64, 80, 96, 99]


async def test_a_run_that_is_watched_paused_and_stepped_has_the_same_log(tmp_path, alone):
    job = RunJob("acrobot_pbvs", tmp_path, tmp_path / "out", settings=RUN_SETTINGS)
    job.tell("pause")
    job.begin()
    await until(
        lambda: (job.samples and job.state == JobState.PAUSED) or job.state.is_over, LONGEST
    )
    assert (job.state, job.samples[-1]["t"]) == (JobState.PAUSED, 0.0), job.message
    job.tell("step")
    row = pytest.approx(job.header["period"], abs=2e-3)  # of the log; a step of the integration
    await until(lambda: job.samples[-1]["t"] == row and job.state == JobState.PAUSED)
    await until(lambda: job.progress[0] == pytest.approx(job.samples[-1]["t"] / 0.2))
    await until(lambda: job.at(None)[1].startswith(JPEG))
    assert job.samples[-1]["t"] == row  # it stands
    job.tell("speed", factor=1.0)
    job.tell("go")
    assert await job.wait(LONGEST)
    assert job.state == JobState.FINISHED, job.message
    assert {path.name for path in job.folder.iterdir()} == {path.name for path in alone.iterdir()}
    for name in ("log.csv", "scenario.yaml", "robot.yaml"):
        assert (job.folder / name).read_bytes() == (alone / name).read_bytes()
    assert job.result() == json.loads((job.folder / "summary.json").read_text())


def test_rows_are_those_of_the_log(alone):
    done = FinishedRun(alone)
    with np.load(alone / "log.npz") as log:
        assert done.times.tolist() == log["time"].tolist()
        last = done.samples[-1]
        assert last["tensions"] == log["tensions"][-1].tolist()
        assert last["pose"] == log["X_WP"][-1].tolist()
    for name in ("position_error_m", "rotation_error_rad"):
        sample = last[name.rpartition("_")[0]]
        assert sample == pytest.approx(done.summary[f"final_{name}"], rel=1e-12)
    sample, jpeg = done.at(0.1)
    assert sample["t"] == done.times[np.argmin(np.abs(done.times - 0.1))]
    assert jpeg.startswith(JPEG)
    row = plot_row(last)
    assert len(row) == 1 + sum(len(chart.series) for chart in done.charts)
    assert row[1] == pytest.approx(1e3 * last["position_error"])
    assert done.charts[1].limits == load_robot("acrobot_small").tension_limits()


def test_a_folder_without_a_log_is_no_run_and_a_broken_one_is_refused(alone, tmp_path):
    broken = shutil.copytree(alone, tmp_path / "broken")
    (broken / "log.npz").write_bytes(b"PK no archive")
    with pytest.raises(OutputFolderError, match="broken: cannot be read"):
        FinishedRun(broken)


def test_a_run_beside_another_has_numbers_of_both(alone):
    summary = json.loads((alone / "summary.json").read_text())
    other = summary | {"final_position_error_m": summary["final_position_error_m"] + 0.01}
    pairs = {pair.name: pair for pair in run_pairs(summary, other)}
    assert pairs["final position error [m]"].difference == pytest.approx(0.01)
    assert pairs["tension min [N]"].difference == 0.0
    assert pairs["outcome"].one == summary["outcome"]
    assert not any("wall time" in name or "drake" in name for name in pairs)


def in_panel(steps):
    """A test of a user who has opened the run panel; without a scene, which browsers show."""

    async def test(tmp_path, monkeypatch, alone):
        bench = Workbench(
            WorkingFolder(tmp_path), "acrobot_small", "acrobot_pbvs", jobs=JobManager(at_once=1)
        )
        bench.draw = lambda draw, done=None: None
        try:
            async with simulated(lambda: run_panel(bench)) as user:
                await until(lambda: shown(user, "field-duration"))
                await steps(user, bench, tmp_path, monkeypatch, alone)
        finally:
            await bench.jobs.close()

    return test


def says(user, name, words):
    return shown(user, name) and words in field(user, name).text


def press(user, name):
    """Clicks a button once it can be."""
    return until(lambda: shown(user, name) and field(user, name).enabled and _click(user, name))


def _click(user, name):
    user.find(marker=name).click()
    return True


@in_panel
async def test_a_wrong_value_starts_nothing_and_a_run_fails_or_is_found_again(
    user, bench, folder, monkeypatch, alone
):
    fails = "import sys; print('cdpr: no space left on device', file=sys.stderr); sys.exit(2)"
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", fails))
    duration = field(user, "field-duration")
    type_into(user, "field-duration", "-3")
    await until(lambda: duration.props.get("error"))
    assert "duration: found -3; accepted: a number > 0 [s]" in problems(user)
    await press(user, "start")
    await asyncio.sleep(0.3)
    assert bench.jobs.jobs == []
    type_into(user, "field-duration", "0.2")
    await until(lambda: not duration.props.get("error"))
    await press(user, "start")
    await until(lambda: says(user, "run-problem", "no space left on device"))
    assert field(user, "run-state").text == "failed"
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", "import time; time.sleep(3600)"))
    await press(user, "start")  # in the same folder
    await until(lambda: says(user, "run-state", "starting"))
    await user.open("/")  # another tab, or the same one anew
    await until(lambda: says(user, "run-state", "starting"))
    await press(user, "stop")
    await until(lambda: says(user, "run-state", "stopped"))


@in_panel
async def test_a_finished_run_is_looked_at_compared_and_downloaded(
    user, bench, folder, monkeypatch, alone
):
    for name in ("first", "second"):
        shutil.copytree(alone, folder / "runs" / name)
    await until(lambda: "first" in field(user, "run").options)
    field(user, "run").value = "first"
    await until(lambda: says(user, "outcome", "timeout") and shown(user, "cursor"))
    before = field(user, "camera").props["src"]
    assert before.startswith("data:image/jpeg;base64,")
    field(user, "cursor").value = 0.0
    await until(lambda: field(user, "camera").props["src"] != before)
    compare = field(user, "compare")
    assert list(compare.options.values()) == ["none", "second"]
    compare.value = "second"
    field(user, "run").value = "second"  # which is not compared with itself
    await until(lambda: list(compare.options.values()) == ["none", "first"])
    assert compare.value == ""
    compare.value = "first"
    await until(lambda: shown(user, "both-runs"))
    await press(user, "download")
    data = await user.download.next(timeout=LONGEST)
    with zipfile.ZipFile(io.BytesIO(data.content)) as archive:
        assert archive.read("second/log.csv") == (alone / "log.csv").read_bytes()


@in_panel
async def test_buttons_break_and_push_and_the_scenario_keeps_it(
    user, bench, folder, monkeypatch, alone
):
    file = write_scenario(folder, **{"duration: 30.0": "duration: 0.5"})
    await user.open("/")
    await until(lambda: str(file) in field(user, "scenario").options)
    field(user, "scenario").value = str(file)
    duration = "field-duration"
    await until(lambda: shown(user, duration) and field(user, duration).value == "0.5")
    field(user, "paused").value = field(user, "by-hand").value = True
    await press(user, "start")
    await until(lambda: shown(user, "break") and field(user, "break").enabled, LONGEST)
    job = bench.kept(RunBoard).choices()[bench.kept(RunBoard).shown].job
    await until(lambda: field(user, "hand-cable").options)
    field(user, "hand-cable").value = 2
    await press(user, "break")
    await until(lambda: "C3 breaks" in field(user, "hand-done").text)
    await until(lambda: 2 not in field(user, "hand-cable").options)
    field(user, "push-force").value = 0.0
    await press(user, "push")
    await until(lambda: "force: found" in field(user, "hand-done").text)
    field(user, "push-force").value, field(user, "push-direction").value = 4.0, "-y"
    await press(user, "push")
    await until(lambda: "push of 4 N for 0.3 s" in field(user, "hand-done").text)
    field(user, "speed").value = "as fast as possible"
    await press(user, "go-on")
    assert await job.wait(LONGEST)
    scenario = load_scenario(str(job.folder / "scenario.yaml"))
    assert [(event.kind, event.cable) for event in scenario.failures.events] == [
        ("cable_breaks", 2)
    ]
    assert scenario.disturbances.pushes[-1].force.tolist() == [0.0, -4.0, 0.0]
    await until(lambda: not field(user, "break").enabled)
