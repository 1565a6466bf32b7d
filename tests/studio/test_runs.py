"""Runs, live and finished: their samples, and what a person does in the run panel."""

import asyncio
import io
import json
import shutil
import sys
import zipfile
from contextlib import asynccontextmanager

import numpy as np
import pytest

from cdpr_drake.analyses.runs.steering import Message
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio import runs
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.plots import plot_row
from cdpr_drake.studio.run import run_pairs, run_panel
from cdpr_drake.studio.runs import FinishedRun, RunJob
from cdpr_drake.studio.session import Workbench
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.studio.conftest import RUN_SETTINGS
from tests.studio.pages import LONGEST, field, problems, shown, simulated, type_into, until
from tests.studio.run_page import write_scenario

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
    await until(lambda: (job.samples and job.state == "paused") or job.state.is_over, LONGEST)
    assert (job.state, job.samples[-1]["t"]) == ("paused", 0.0), job.message
    job.tell("step")
    row = pytest.approx(job.header["period"], abs=2e-3)  # of the log; a step of the integration
    await until(lambda: job.samples[-1]["t"] == row and job.state == "paused")
    await until(lambda: job.progress[0] == pytest.approx(job.samples[-1]["t"] / 0.2))
    await until(lambda: job.at(None)[1].startswith(JPEG))
    assert job.samples[-1]["t"] == row  # it stands
    job.tell("speed", factor=1.0)
    job.tell("go")
    assert await job.wait(LONGEST)
    assert job.state == "finished", job.message
    assert {path.name for path in job.folder.iterdir()} == {path.name for path in alone.iterdir()}
    for name in ("log.csv", "scenario.yaml", "robot.yaml"):
        assert (job.folder / name).read_bytes() == (alone / name).read_bytes()
    assert job.result() == json.loads((job.folder / "summary.json").read_text())


def test_rows_are_those_of_the_log_and_a_broken_one_is_refused(alone, tmp_path):
    done = FinishedRun(alone)
    last, row = done.samples[-1], plot_row(done.samples[-1])
    with np.load(alone / "log.npz") as log:
        assert done.times.tolist() == log["time"].tolist()
        assert last["tensions"] == log["tensions"][-1].tolist()
        assert last["pose"] == log["X_WP"][-1].tolist()
    for name in ("position_error", "rotation_error"):
        unit = "m" if name.startswith("p") else "rad"
        assert last[name] == pytest.approx(done.summary[f"final_{name}_{unit}"], rel=1e-12)
    sample, jpeg = done.at(0.1)
    assert sample["t"] == done.times[np.argmin(np.abs(done.times - 0.1))]
    assert jpeg.startswith(JPEG)
    assert len(row) == 1 + sum(len(chart.series) for chart in done.charts)
    assert row[1] == pytest.approx(1e3 * last["position_error"])
    assert done.charts[1].limits == load_robot("acrobot_small").tension_limits()
    broken = shutil.copytree(alone, tmp_path / "broken")
    (broken / "log.npz").write_bytes(b"PK no archive")
    with pytest.raises(OutputFolderError, match="broken: cannot be read"):
        FinishedRun(broken)


def test_a_run_beside_another_has_numbers_of_both(alone):
    summary = FinishedRun(alone).summary
    other = summary | {"final_position_error_m": summary["final_position_error_m"] + 0.01}
    pairs = {pair.name: pair for pair in run_pairs(summary, other)}
    assert pairs["final position error [m]"].difference == pytest.approx(0.01)
    assert pairs["tension min [N]"].difference == 0.0
    assert pairs["outcome"].one == summary["outcome"]
    assert not any("wall time" in name or "drake" in name for name in pairs)


@asynccontextmanager
async def panel(folder, drawn=None):
    """A user who has opened the run panel alone, without a scene, and the jobs."""

    def draw(work, done=None):
        if drawn is not None and done is not None:
            drawn.append(work)
            future = asyncio.get_running_loop().create_future()
            future.set_result(None)
            done(future)

    jobs = JobManager(at_once=1)
    bench = Workbench(WorkingFolder(folder), "acrobot_small", "acrobot_pbvs", jobs=jobs)
    bench.draw = draw
    try:
        async with simulated(lambda: run_panel(bench)) as user:
            await until(lambda: shown(user, "field-duration"))
            yield user, jobs
    finally:
        await jobs.close()


def says(user, name, words):
    return until(lambda: shown(user, name) and words in field(user, name).text, LONGEST)


async def press(user, name):
    """Clicks a button once it can be."""
    await until(lambda: shown(user, name) and field(user, name).enabled, LONGEST)
    user.find(marker=name).click()


async def test_tabs_that_show_the_same_run_do_not_draw_it_in_turns(tmp_path, alone):
    shutil.copytree(alone, tmp_path / "runs" / "first")
    drawn = []
    async with panel(tmp_path, drawn) as (user, _):
        await until(lambda: field(user, "run").options)
        field(user, "run").value = "first"
        await until(lambda: drawn)
        await user.open("/")
        await says(user, "outcome", "timeout")
        await asyncio.sleep(1.0)
        assert len(drawn) == 1


async def test_a_wrong_value_starts_nothing_and_a_run_fails_or_is_found_again(
    tmp_path, monkeypatch
):
    fails = "import sys; print('cdpr: no space left on device', file=sys.stderr); sys.exit(2)"
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", fails))
    async with panel(tmp_path) as (user, jobs):
        duration = field(user, "field-duration")
        type_into(user, "field-duration", "-3")
        await until(lambda: duration.props.get("error"))
        assert "duration: found -3; accepted: a number > 0 [s]" in problems(user)
        await press(user, "start")
        await asyncio.sleep(0.3)
        assert jobs.jobs == []
        type_into(user, "field-duration", "0.2")
        await until(lambda: not duration.props.get("error"))
        await press(user, "start")
        await says(user, "run-problem", "no space left on device")
        await says(user, "run-state", "failed")
        sleeps = (sys.executable, "-c", "import time; time.sleep(3600)")
        monkeypatch.setattr(RunJob, "program", sleeps)
        await press(user, "start")  # in the same folder
        await says(user, "run-state", "starting")
        await user.open("/")  # another tab, or the same one anew
        await says(user, "run-state", "starting")
        await press(user, "stop")
        await says(user, "run-state", "stopped")


async def test_a_finished_run_is_looked_at_compared_and_downloaded(tmp_path, alone):
    for name in ("first", "second", "broken"):
        shutil.copytree(alone, tmp_path / "runs" / name)
    (tmp_path / "runs" / "broken" / "log.npz").write_bytes(b"PK no archive")
    async with panel(tmp_path) as (user, _):
        run, compare = field(user, "run"), field(user, "compare")
        await until(lambda: "broken" in run.options)
        run.value = "broken"
        await says(user, "run-state", "unreadable")
        run.value = "first"
        await says(user, "outcome", "timeout")
        await until(lambda: shown(user, "cursor") and shown(user, "camera"))
        camera = field(user, "camera")
        before = camera.props["src"]
        assert before.startswith("data:image/jpeg;base64,")
        field(user, "cursor").value = 0.0
        await until(lambda: camera.props["src"] != before)
        assert sorted(compare.options.values()) == ["broken", "none", "second"]
        compare.value = "second"
        run.value = "second"  # which is not compared with itself
        await until(lambda: "first" in compare.options)
        assert compare.value == ""
        compare.value = "first"
        await until(lambda: shown(user, "both-runs"))
        await user.open("/")  # anew
        await until(lambda: shown(user, "both-runs"))
        await press(user, "download")
        data = await user.download.next(timeout=LONGEST)
    with zipfile.ZipFile(io.BytesIO(data.content)) as archive:
        assert archive.read("second/log.csv") == (alone / "log.csv").read_bytes()


async def test_buttons_break_and_push_and_the_scenario_keeps_it(tmp_path):
    file = str(write_scenario(tmp_path, **{"duration: 30.0": "duration: 0.5"}))
    async with panel(tmp_path) as (user, jobs):
        field(user, "scenario").value = file
        duration = "field-duration"
        await until(lambda: shown(user, duration) and field(user, duration).value == "0.5")
        field(user, "paused").value = field(user, "by-hand").value = True
        await press(user, "start")
        await until(lambda: shown(user, "hand-cable") and field(user, "hand-cable").options)
        field(user, "hand-cable").value = 2
        await press(user, "break")
        await says(user, "hand-done", "C3 breaks")
        await until(lambda: 2 not in field(user, "hand-cable").options)
        field(user, "push-force").value = 0.0
        await press(user, "push")
        await says(user, "hand-done", "force: found")
        field(user, "push-force").value, field(user, "push-direction").value = 4.0, "-y"
        await press(user, "push")
        await says(user, "hand-done", "push of 4 N for 0.3 s")
        field(user, "speed").value = "as fast as possible"
        await press(user, "go-on")
        (job,) = jobs.jobs
        assert await job.wait(LONGEST)
        await until(lambda: not field(user, "break").enabled)
    scenario = load_scenario(str(job.folder / "scenario.yaml"))
    (event,) = scenario.failures.events
    assert (event.kind, event.cable) == ("cable_breaks", 2)
    assert scenario.disturbances.pushes[-1].force.tolist() == [0.0, -4.0, 0.0]
