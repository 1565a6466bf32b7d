"""The run panel without a browser: what a person does, and what the page then says."""

import asyncio
import io
import shutil
import sys
import zipfile
from contextlib import asynccontextmanager

from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.jobs import JobManager
from cdpr_drake.studio.run import run_panel
from cdpr_drake.studio.run_job import RunJob
from cdpr_drake.studio.session import Workbench
from tests.studio.pages import field, problems, shown, simulated, until


@asynccontextmanager
async def opened_panel(folder):
    """A user who has opened the panel, and the workbench of it."""
    jobs = JobManager(at_once=1)
    bench = Workbench(WorkingFolder(folder), "acrobot_small", "acrobot_pbvs", jobs=jobs)
    bench.draw = lambda draw, done=None: None  # no scene: that is tested in a browser
    try:
        async with simulated(lambda: run_panel(bench)) as user:
            await until(lambda: shown(user, "field-duration"))
            yield user, bench
    finally:
        await jobs.close()


def says(user, name, words):
    return shown(user, name) and words in field(user, name).text


async def test_a_wrong_value_starts_nothing_and_a_run_fails_or_is_found_again(
    tmp_path, monkeypatch
):
    words = "import sys; print('cdpr: no space left on device', file=sys.stderr); sys.exit(2)"
    monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", words))
    async with opened_panel(tmp_path) as (user, bench):
        duration = field(user, "field-duration")
        duration.value = "-3"
        user.find(marker="field-duration").trigger("blur")
        await until(lambda: duration.props.get("error"))
        assert "duration: found -3; accepted: a number > 0 [s]" in problems(user)
        user.find(marker="start").click()
        await asyncio.sleep(0.3)
        assert bench.jobs.jobs == []
        duration.value = "0.2"
        user.find(marker="field-duration").trigger("blur")
        await until(lambda: not duration.props.get("error"))
        user.find(marker="start").click()
        await until(lambda: says(user, "run-problem", "no space left on device"))
        assert field(user, "run-state").text == "failed"
        words = "import time; time.sleep(3600)"
        monkeypatch.setattr(RunJob, "program", (sys.executable, "-c", words))
        user.find(marker="start").click()
        await until(lambda: says(user, "run-state", "starting"))
        await user.open("/")  # another tab, or the same one anew
        await until(lambda: says(user, "run-state", "starting"))
        user.find(marker="stop").click()
        await until(lambda: says(user, "run-state", "stopped"))


async def test_a_finished_run_is_looked_at_compared_and_downloaded(alone, tmp_path):
    for name in ("first", "second"):
        shutil.copytree(alone, tmp_path / "runs" / name)
    async with opened_panel(tmp_path) as (user, _):
        await until(lambda: "first" in field(user, "run").options)
        field(user, "run").value = "first"
        await until(lambda: says(user, "outcome", "timeout"))
        field(user, "cursor").value = 0.1
        assert field(user, "camera").props["src"].startswith("data:image/jpeg;base64,")
        compare = field(user, "compare")
        assert list(compare.options) == ["none", "second"]
        compare.value = "second"
        field(user, "run").value = "second"  # which is not compared with itself
        await until(lambda: list(field(user, "compare").options) == ["none", "first"])
        assert field(user, "compare").value == "none"
        field(user, "compare").value = "first"
        field(user, "run").value = "first"
        await until(lambda: list(field(user, "compare").options) == ["none", "second"])
        user.find(marker="download").click()
        data = await user.download.next(timeout=1200.0)
        with zipfile.ZipFile(io.BytesIO(data.content)) as archive:
            assert archive.read("first/log.csv") == (alone / "log.csv").read_bytes()
