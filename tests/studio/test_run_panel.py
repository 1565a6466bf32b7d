"""The run panel without a browser: what a person does, and what the page then says."""

import asyncio
import io
import shutil
import sys
import zipfile
from contextlib import suppress

import pytest
from nicegui.testing.user_simulation import user_simulation

from cdpr_drake.studio.panels.run import run_panel
from cdpr_drake.studio.workbench.job import JobState
from cdpr_drake.studio.workbench.job_manager import JobManager
from cdpr_drake.studio.workbench.run_job import RunJob
from cdpr_drake.studio.workbench.session import Workbench
from cdpr_drake.studio.workbench.working_folder import WorkingFolder

LONGEST = 1200.0
"""Nothing here takes as long, unless it hangs [s]."""


@pytest.fixture
def bench(tmp_path):
    jobs = JobManager(at_once=1)
    made = Workbench(WorkingFolder(tmp_path), "acrobot_small", "acrobot_pbvs", jobs=jobs)
    made.draw = lambda draw, done=None: None  # no scene: that is tested in a browser
    yield made
    jobs.close()


def acted(bench, act):
    """Opens the panel as a user does, and lets `act` do something with it."""

    async def session():
        async with user_simulation(root=lambda: run_panel(bench)) as user:
            await user.open("/")
            await until(lambda: one(user, "field-duration"))
            await act(user)

    asyncio.run(session())


async def until(holds):
    """Waits for what the page does by itself."""
    for _ in range(int(LONGEST / 0.05)):
        with suppress(AssertionError):  # of what is not shown yet
            if holds():
                return
        await asyncio.sleep(0.05)
    raise AssertionError("the page did not do it")


def one(user, marker):
    """The element of a name."""
    return next(iter(user.find(marker=marker).elements))


def test_a_wrong_value_is_said_at_its_field_and_nothing_starts(bench):
    async def act(user):
        field = one(user, "field-duration")
        field.value = "-3"
        await until(lambda: field.props.get("error"))
        assert "found -3; accepted: a number > 0 [s]" in field.props["error-message"]
        user.find(marker="start").click()
        await asyncio.sleep(0.3)
        assert bench.jobs.jobs == []
        field.value = "0.2"
        await until(lambda: not field.props.get("error"))

    acted(bench, act)


def test_a_run_that_fails_is_a_message_and_the_next_one_starts(bench, monkeypatch):
    words = "import sys; print('cdpr: no space left on device', file=sys.stderr); sys.exit(2)"
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", words))

    async def act(user):
        for _ in range(2):
            before = len(bench.jobs.jobs)
            user.find(marker="start").click()
            await until(lambda before=before: len(bench.jobs.jobs) > before)
            await until(lambda: bench.jobs.jobs[-1].state == JobState.FAILED)
            await until(lambda: "no space left on device" in one(user, "run-problem").text)
            assert one(user, "run-state").text == "failed"

    acted(bench, act)


def test_a_finished_run_is_looked_at_compared_and_downloaded(bench, alone, tmp_path):
    for name in ("first", "second"):
        shutil.copytree(alone, tmp_path / "runs" / name)

    async def act(user):
        await until(lambda: "folder first" in one(user, "run").options)
        one(user, "run").value = "folder first"
        await until(lambda: one(user, "outcome").text == "timeout")
        slider = one(user, "cursor")
        slider.value = 0.1
        assert one(user, "camera").props["src"].startswith("data:image/jpeg;base64,")
        assert list(one(user, "compare").options) == ["none", "folder second"]
        one(user, "compare").value = "folder second"
        one(user, "run").value = "folder second"  # which is not compared with itself
        await until(lambda: list(one(user, "compare").options) == ["none", "folder first"])
        assert one(user, "compare").value == "none"
        one(user, "compare").value = "folder first"
        one(user, "run").value = "folder first"
        await until(lambda: list(one(user, "compare").options) == ["none", "folder second"])
        user.find(marker="download").click()
        data = await user.download.next(timeout=LONGEST)
        with zipfile.ZipFile(io.BytesIO(data.content)) as archive:
            assert archive.read("first/log.csv") == (alone / "log.csv").read_bytes()

    acted(bench, act)


def test_a_second_tab_and_a_reload_find_the_run(bench, monkeypatch):
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", "import time; time.sleep(3600)"))

    async def act(user):
        user.find(marker="start").click()
        await until(lambda: bench.jobs.jobs)
        await until(lambda: one(user, "run-state").text == "runs")
        await user.open("/")
        await until(lambda: one(user, "run-state").text == "runs")
        user.find(marker="stop").click()
        await until(lambda: one(user, "run-state").text == "stopped")

    acted(bench, act)
