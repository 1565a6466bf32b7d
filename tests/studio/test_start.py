"""The studio's page goes out before most of the package is imported; the rest comes behind it."""

import subprocess
import sys
from types import SimpleNamespace
from urllib.request import HTTPCookieProcessor, build_opener

from nicegui import ElementFilter
from nicegui.elements.keyboard import Keyboard

from cdpr_drake.studio.jobs import Job
from cdpr_drake.studio.panel import PANELS, Panel
from cdpr_drake.studio.yaml_edit import with_value
from tests.studio.pages import open_panel, opened_page, shown, until

LATER = (
    "matplotlib", "cv2", "scipy.optimize", "scipy.spatial", "pydrake.systems.analysis",
    "cdpr_drake.studio.verb_panel", "cdpr_drake.analyses.visualization",
    "cdpr_drake.studio.workspace", "cdpr_drake.studio.run",
    "cdpr_drake.studio.scene", "cdpr_drake.analyses.tensions",
)  # fmt: skip
"""What the page with its first panel needs none of, and takes long to import."""

ONE_OF_EACH = (
    "undo",
    "coordinate-2",
    "start-workspaces",
    "start",
    "log",
    "studies-results",
    "start-commands",
)
"""Marks of an element of each panel."""

IMPORTED = """
import sys
import cdpr_drake.studio.server
from cdpr_drake.studio.panel import PANELS
PANELS["robot"].load()
print(*sorted(sys.modules))
"""


def test_what_takes_long_is_not_imported_before_the_page():
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED], capture_output=True, text=True, check=True
    )
    imported = set(done.stdout.split())
    assert "nicegui" in imported
    assert imported.intersection(LATER) == set()


def test_the_page_has_the_panel_that_is_shown_and_no_other(studio):
    client = build_opener(HTTPCookieProcessor())
    client.open(studio[1]).close()
    with client.open(studio[1].partition("?")[0]) as answer:
        page = answer.read().decode()
    assert "exit point" in page
    waiting = [panel.title for panel in PANELS.values() if f"{panel.title}: loading" in page]
    assert waiting == ["Pose", "Workspace", "Run", "Logs", "Studies", "Commands"]


async def test_a_panel_that_cannot_be_loaded_says_so_and_the_others_come(tmp_path, monkeypatch):
    broken = Panel("Pose", "open_with", "no_such:none")
    monkeypatch.setitem(PANELS, "pose", broken)
    async with opened_page(tmp_path) as (user, _, _):
        with user:
            there = [bool(list(ElementFilter(marker=name))) for name in ONE_OF_EACH]
        said = list(user.notify.messages)
    assert dict(zip(PANELS, there, strict=True)) == {name: name != "pose" for name in PANELS}
    assert any("no_such" in words for words in said), said


async def test_a_sign_says_that_a_job_works(tmp_path):
    async with opened_page(tmp_path) as (user, bench, _):
        assert not shown(user, "job-at-work")
        job = Job(["import time; time.sleep(3600)"], tmp_path)
        job.program = (sys.executable, "-c")
        bench.jobs.submit(job)
        await until(lambda: shown(user, "job-at-work"))
        await bench.jobs.close()
        await until(lambda: not shown(user, "job-at-work"))


async def test_keys_undo_and_redo_in_every_tab(tmp_path):
    async with opened_page(tmp_path) as (user, bench, _):
        mass = bench.robot.value.platform.mass
        bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 2.0 * mass))
        open_panel(user, "pose")
        for key, shift, factor in ("z", 0, 1.0), ("y", 0, 2.0), ("z", 0, 1.0), ("Z", 1, 2.0):
            pressed = {"action": "keydown", "key": key, "code": "KeyX", "location": 0,
                       "repeat": False, "altKey": False, "ctrlKey": True, "metaKey": False,
                       "shiftKey": bool(shift)}  # fmt: skip
            with user:
                (keyboard,) = ElementFilter(kind=Keyboard)
            keyboard._handle_key(SimpleNamespace(sender=keyboard, client=user.client, args=pressed))
            assert bench.robot.value.platform.mass == factor * mass, (key, shift)
