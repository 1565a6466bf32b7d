"""What tests of the studio share."""

import asyncio
import gc
import inspect
import os
import sys
from types import SimpleNamespace

import pytest

from cdpr_drake.analyses.logs.replay import replay_log
from tests.cli.commands import ended
from tests.studio.pages import opened_page, until
from tests.studio.served import served

RUN_SETTINGS = ("camera.kind=projected", "duration=0.2")
RUN = ("simulate", "acrobot_pbvs", *(f"--set={item}" for item in RUN_SETTINGS))
"""A short run and its settings."""


@pytest.fixture(scope="module", autouse=True)
def _not_searched_for_garbage():
    """What is there before: NiceGUI's tests have all else searched before and after each page."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Folder that the command writes for a short run that nobody looks at."""
    folder = tmp_path_factory.mktemp("alone") / "runs" / "short"
    assert ended(*RUN, f"--out={folder}") == 0
    return folder


@pytest.fixture(scope="session")
def computed(tmp_path_factory):
    """A workspace of two kinds and a measure, as the command leaves it."""
    folder = tmp_path_factory.mktemp("work") / "workspaces" / "small"
    options = "--kind=static,wrench-feasible", "--force=1", "--measure=capacity-margin"
    ended("workspace", "acrobot_small", "--grid=5,5,5", *options, f"--out={folder}")
    return folder


@pytest.fixture(scope="session")
def beside(alone, tmp_path_factory):
    """The log of that run beside the model, as the command leaves it."""
    folder = tmp_path_factory.mktemp("work") / "logs" / "small"
    replay_log(alone / "log.csv", robot="acrobot_small", out=folder)
    return folder


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """Working folder of the page that a module's tests share."""
    return tmp_path_factory.mktemp("work")


@pytest.fixture(scope="module")
def held(request, work):
    """That page, of the module's `ROBOT`: who has opened it, its workbench, and what runs tests."""
    with asyncio.Runner() as runner:
        page = opened_page(work, request.module.ROBOT)
        user, bench, _ = runner.run(page.__aenter__())
        yield SimpleNamespace(user=user, bench=bench, run=runner.run)
        runner.run(page.__aexit__(None, None, None))


@pytest.fixture
def user(request, held):
    """Who has opened it, and is told nothing yet; the robot is as it was in the beginning."""

    async def begin():
        held.user.notify.messages.clear()
        held.bench.take_opened(held.bench.files.open(request.module.ROBOT))
        await until(lambda: held.bench.answer is not None and not held.bench.is_computing)

    held.run(begin())
    return held.user


@pytest.fixture
def bench(held, user):
    """Its workbench."""
    return held.bench


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """A test that is a coroutine runs in the page that is held, or in a loop of its own."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    fixtures = pyfuncitem.funcargs
    run = fixtures["held"].run if "held" in fixtures else asyncio.run
    run(pyfuncitem.obj(**{name: fixtures[name] for name in pyfuncitem._fixtureinfo.argnames}))
    return True


@pytest.fixture(scope="package")
def studio(tmp_path_factory):
    """Working folder and address of one studio for several browser sessions."""
    folder = tmp_path_factory.mktemp("work")
    with served(folder) as (address, _):
        yield folder, address


READ_IN_LOOP: list[str] = []
"""Files that the package read in the thread of an event loop, and from where."""

DATA = (".yaml", ".yml", ".json", ".csv", ".npz", ".html", ".png", ".svg", ".xml", ".css")
"""Endings of what is read, not imported."""

HANDLERS = tuple(f"/studio/{name}" for name in ("robot.py", "settings_form", "page",
                "run.py", "logs", "verb_panel", "views", "plots"))  # fmt: skip
"""What calls for reading in a page; a test may read what it likes."""


def _watch(event, arguments):
    if event != "open" or asyncio._get_running_loop() is None:
        return
    path, _, flags = arguments
    name = os.fsdecode(path) if isinstance(path, str | bytes) else ""
    if not name.endswith(DATA) or "site-packages" in name or flags & (os.O_WRONLY | os.O_RDWR):
        return
    frame = sys._getframe(1)
    while frame is not None and "/tests/" not in frame.f_code.co_filename:
        if any(part in frame.f_code.co_filename for part in HANDLERS):
            READ_IN_LOOP.append(f"{name} in {frame.f_code.co_filename}:{frame.f_lineno}")
        frame = frame.f_back


sys.addaudithook(_watch)


@pytest.fixture(autouse=True)
def _no_file_is_read_in_the_event_loop():
    READ_IN_LOOP.clear()
    yield
    assert READ_IN_LOOP == []
