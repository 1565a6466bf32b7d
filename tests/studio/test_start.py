"""The studio's page goes out before most of the package is imported; the rest comes behind it."""

import subprocess
import sys
from types import SimpleNamespace

import httpx
import pytest
from nicegui import ElementFilter
from nicegui.elements.keyboard import Keyboard

from cdpr_drake.studio.document import with_value
from cdpr_drake.studio.jobs import Job
from cdpr_drake.studio.panel import PANELS, Panel
from tests.studio.pages import open_panel, shown, until

ROBOT = "acrobot_large"

LATER = (
    "matplotlib", "cv2", "scipy.optimize", "scipy.spatial", "pydrake.systems.analysis",
    "cdpr_drake.studio.verb_panel", "cdpr_drake.analyses.visualization",
    "cdpr_drake.studio.workspace", "cdpr_drake.studio.run",
    "cdpr_drake.studio.scene", "cdpr_drake.analyses.tensions",
)  # fmt: skip
"""What the page with its first panel needs none of, and takes long to import."""

IMPORTED = """
import sys
import cdpr_drake.studio.server
from cdpr_drake.studio.panel import PANELS
PANELS["robot"].load()
print(*sys.modules)
"""


def test_what_takes_long_is_not_imported_before_the_page():
    imported = subprocess.check_output([sys.executable, "-c", IMPORTED], text=True).split()
    assert "nicegui" in imported
    assert set(imported).intersection(LATER) == set()


def test_the_page_has_the_panel_that_is_shown_and_no_other(studio):
    with httpx.Client(timeout=600.0) as client:
        client.get(studio[1])  # it gives the cookie
        page = client.get(studio[1].partition("?")[0]).text
    assert "exit point" in page
    waiting = [panel.title for panel in PANELS.values() if f"{panel.title}: loading" in page]
    assert waiting == ["Pose", "Workspace", "Run", "Logs", "Studies", "Commands"]


@pytest.fixture(scope="module", autouse=True)
def _one_panel_is_broken():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PANELS, "pose", Panel("Pose", "open_with", "no_such:none"))
        yield


async def test_a_panel_that_cannot_be_loaded_says_so_and_the_others_come(held):
    elements = ("undo", "coordinate-2", "start-workspaces", "start", "log", "studies-results",
                "start-commands")  # fmt: skip
    with held.user:
        there = [bool(list(ElementFilter(marker=name))) for name in elements]
    assert there == [name != "pose" for name in PANELS]
    assert any("no_such" in words for words in held.user.notify.messages)


async def test_a_sign_says_that_a_job_works(user, bench, tmp_path):
    assert not shown(user, "job-at-work")
    job = Job(["import time; time.sleep(3600)"], tmp_path)
    job.program = (sys.executable, "-c")
    bench.jobs.submit(job)
    await until(lambda: shown(user, "job-at-work"))
    await bench.jobs.close()
    await until(lambda: not shown(user, "job-at-work"))


async def test_keys_undo_and_redo_in_every_tab(user, bench):
    mass = bench.robot.value.platform.mass
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 2.0 * mass))
    open_panel(user, "logs")
    with user:
        (keyboard,) = ElementFilter(kind=Keyboard)
    for key, factor in ("z", 1.0), ("y", 2.0), ("z", 1.0), ("Z", 2.0):
        pressed = {"action": "keydown", "key": key, "code": "KeyX", "location": 0,
                   "repeat": False, "altKey": False, "ctrlKey": True, "metaKey": False,
                   "shiftKey": key == "Z"}  # fmt: skip
        keyboard._handle_key(SimpleNamespace(sender=keyboard, client=user.client, args=pressed))
        assert bench.robot.value.platform.mass == factor * mass, key
