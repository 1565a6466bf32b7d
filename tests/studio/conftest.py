"""What tests of the studio share."""

import asyncio
import gc
import inspect
import os
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from cdpr_drake.analyses.logs.replay import replay_log
from cdpr_drake.cli.app import main
from tests.studio.pages import HeldPage
from tests.studio.served import served

ROOT = Path(__file__).parents[2]

RUN_SETTINGS = ("camera.kind=projected", "duration=0.2")
"""Of a short run of acrobot_pbvs."""


@pytest.fixture(scope="module", autouse=True)
def _not_searched_for_garbage():
    """What is there before: NiceGUI's tests have all else searched before and after each page."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Folder that the command writes for a short run that nobody looks at."""
    folder = tmp_path_factory.mktemp("alone") / "runs" / "short"
    options = [f"--set={item}" for item in RUN_SETTINGS]
    with pytest.raises(SystemExit) as end:
        main(["simulate", "acrobot_pbvs", *options, f"--out={folder}", "--json"])
    assert end.value.code == 0
    return folder


@pytest.fixture(scope="session")
def computed(tmp_path_factory):
    """A workspace of two kinds and a measure, as the command leaves it."""
    folder = tmp_path_factory.mktemp("work") / "workspaces" / "small"
    printed = StringIO()
    with redirect_stdout(printed), pytest.raises(SystemExit):
        main(["workspace", "acrobot_small", "--grid", "5,5,5", "--kind", "static,wrench-feasible",
              "--force", "1", "--measure", "capacity-margin", "--out", str(folder)])  # fmt: skip
    (folder / "printed.txt").write_text(printed.getvalue())
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
    """That page, of the module's `ROBOT`."""
    page = HeldPage(work, request.module.ROBOT)
    yield page
    page.close()


@pytest.fixture
def user(held):
    """Who has opened it, and is told nothing yet."""
    held.run(held.begin())
    return held.user


@pytest.fixture
def bench(held, user):
    """Its workbench, with the robot as it was in the beginning."""
    return held.bench


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """A test that is a coroutine runs in the page that is held, or in a loop of its own."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    given = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    run = asyncio.run
    if "held" in pyfuncitem.fixturenames:
        run = pyfuncitem._request.getfixturevalue("held").run
    run(pyfuncitem.obj(**given))
    return True


@pytest.fixture(scope="package")
def studio(tmp_path_factory):
    """Working folder and address of one studio for several browser sessions."""
    folder = tmp_path_factory.mktemp("work")
    with served(folder) as (address, _):
        yield folder, address


READ_IN_LOOP: list[str] = []
"""Files that the package read in the thread of an event loop, and from where."""


HANDLERS = tuple(f"/studio/{name}" for name in ("robot.py", "settings_form", "page",
                "run.py", "logs", "verb_panel", "views", "plots"))  # fmt: skip
"""What calls for reading in a page; a test may read what it likes."""


def _watch(event, arguments):
    if event != "open" or asyncio._get_running_loop() is None:
        return
    path, _, flags = arguments
    if not isinstance(path, str | bytes) or (flags & (os.O_WRONLY | os.O_RDWR)):
        return
    name = os.fsdecode(path)
    if (
        name.endswith((".py", ".pyc", ".so", ".js"))
        or name == sys.argv[0]  # where warnings look for lines
        or "site-packages" in name
        or name.startswith(sys.base_prefix)
    ):  # modules, at their import
        return
    frame = sys._getframe(1)
    while frame is not None and not frame.f_code.co_filename.startswith(str(ROOT)):
        frame = frame.f_back
    while frame is not None and "/tests/" not in frame.f_code.co_filename:
        if any(part in frame.f_code.co_filename for part in HANDLERS):
            READ_IN_LOOP.append(f"{name} in {frame.f_code.co_filename}:{frame.f_lineno}")
            return
        frame = frame.f_back


sys.addaudithook(_watch)


@pytest.fixture(autouse=True)
def _no_file_is_read_in_the_event_loop():
    del READ_IN_LOOP[:]
    yield
    assert sorted(set(READ_IN_LOOP)) == []
