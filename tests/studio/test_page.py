"""The page, by a simulated user: how it comes, what it shows, what it changes, what it refuses."""

import re
import subprocess
import sys
import threading
from functools import partial
from unittest.mock import Mock

import numpy as np
import pytest
from nicegui import ElementFilter
from nicegui.elements.keyboard import Keyboard

from cdpr_drake.errors import CdprError
from cdpr_drake.formats.robot_exports import export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio import live_workspace
from cdpr_drake.studio import session as sessions
from cdpr_drake.studio.jobs import Job
from cdpr_drake.studio.live_workspace import COARSE, FINE, sketch_workspace
from cdpr_drake.studio.page import PREFERS_DARK
from cdpr_drake.studio.panel import PANELS, Panel
from cdpr_drake.studio.session import POSE_NUMBERS
from cdpr_drake.studio.settings_form import _with_copy
from tests.models.formats.foreign_files import caspr
from tests.studio.fuzz import fuzz
from tests.studio.pages import another_tab, do, field, problems, put, shown, until

ROBOT = "acrobot_large"

PLACE, CELL = ("cables", 0, "exit_point", 0), "cell-cables-0-exit_point-0"

LATER = {
    "matplotlib", "cv2", "scipy.optimize", "scipy.spatial", "pydrake.systems.analysis",
    "cdpr_drake.studio.verb_panel", "cdpr_drake.analyses.visualization",
    "cdpr_drake.studio.workspace", "cdpr_drake.studio.run",
    "cdpr_drake.studio.scene", "cdpr_drake.analyses.tensions",
}  # fmt: skip
"""What the page with its first panel needs none of, and takes long to import."""


@pytest.fixture(scope="module", autouse=True)
def _one_panel_is_broken():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PANELS, "logs", Panel("Logs", "timeline", "no_such:none"))
        yield


def test_what_takes_long_is_not_imported_before_the_page():
    page = "import sys, cdpr_drake.studio.server, cdpr_drake.studio.robot; print(*sys.modules)"
    imported = subprocess.check_output([sys.executable, "-c", page], text=True).split()
    assert LATER.intersection(imported) == set()


async def test_a_panel_that_cannot_be_loaded_says_so_and_the_others_come(held):
    elements = ("undo", "coordinate-2", "start-workspaces", "start", "log", "studies-results",
                "start-commands")  # fmt: skip
    with held.user:
        there = [bool(list(ElementFilter(marker=name))) for name in elements]
    assert there == [name != "logs" for name in PANELS]
    assert any("no_such" in words for words in held.user.notify.messages)


async def test_a_field_changes_the_robot_and_its_tensions_and_keys_take_it_back(user, bench):
    before, cell, redo = bench.answer, field(user, CELL), field(user, "redo")
    await do(user, f"{CELL}=-0.37")
    await until(lambda: bench.answer is not before)
    assert not np.allclose(bench.answer.tensions, before.tensions)
    numbers = field(user, "pose-numbers").content
    assert all(f"<td>{tension:.2f}</td>" in numbers for tension in bench.answer.tensions)
    in_field, elsewhere = user.find(marker=CELL), user.find(kind=Keyboard)
    pressed = {"action": "keydown", "code": "KeyX", "location": 0, "repeat": False,
               "altKey": False, "ctrlKey": True, "metaKey": False}  # fmt: skip
    for place, event in (in_field, "keydown.ctrl.{}"), (elsewhere, "key"):
        for key, x in ("z", -0.47), ("y", -0.37), ("z", -0.47), ("Z", -0.37):
            args = pressed | {"key": key, "shiftKey": key == "Z"}
            place.trigger(event.format(key.lower()), args)
            assert bench.robot.value.cables[0].exit_point[0] == x
            assert (cell.value, redo.enabled) == (str(x), x == -0.47)
    cell.value = "-0.3"  # typed, not yet taken: the browser's own undo has that
    in_field.trigger("keydown.ctrl.z", pressed | {"key": "z", "shiftKey": False})
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    await do(user, "undo", f"{CELL}=-0.2")
    await until(lambda: bench.robot.value.cables[0].exit_point[0] == -0.2)
    assert not redo.enabled


async def test_edits_that_need_each_other_are_taken_together(user, bench):
    robot, lower = bench.robot, field(user, "cell-tension_bounds-lower")
    await do(user, "cell-tension_bounds-lower=70")
    await until(lambda: "accepted: lower < upper" in str(problems(user)))
    await do(user, "cell-platform-mass=1.5")
    await until(lambda: robot.value.platform.mass == 1.5)
    assert robot.value.tension_bounds.lower < 70
    assert lower.value == "70"
    await do(user, "cell-tension_bounds-upper=80")
    await until(lambda: robot.value.tension_bounds.lower == 70)
    assert "error" not in lower.props


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (f"{CELL}=abc", "found abc; accepted: 3 numbers >= -10000"),
        (f"{CELL}=", "found nothing; accepted: 3 numbers >= -10000"),
        (f"{CELL}=nan", "found nan; accepted: 3 numbers >= -10000"),
        ("cell-platform-mass=-1", "platform.mass: found -1; accepted: a number > 0 and"),
        ("cell-name=../x", "accepted: 1 to 64 letters"),
        ("cell-cables-1-name=C1", "accepted: each name once"),
        ("cell-platform-center_of_mass=1, 2", "found [1, 2]; accepted: 3 numbers [m]"),
        ("coordinate-2=7", "found '7'; accepted: a number from 0 to 1.2 [m]"),
    ],
)
async def test_a_wrong_value_is_said_beside_its_field(user, bench, typed, said):
    before = bench.robot.text, bench.coordinates
    await do(user, typed)
    cell = field(user, typed.partition("=")[0])
    await until(lambda: said in f"{problems(user)} {cell.error}")
    assert (bench.robot.text, bench.coordinates) == before
    assert "error" in cell.props


async def test_sliders_fields_and_numbers_follow_each_other(user, bench):
    await do(user, "coordinate-2=0.4", "slider-2: 0.4", "method=barycenter")
    await do(user, "pose-numbers: by barycenter")
    assert bench.answer.X_WP.translation()[2] == 0.4
    bench.move_to([0.1, *bench.coordinates[1:]])
    await do(user, "slider-0: 0.1", "coordinate-0: 0.1")


async def test_wrong_values_at_random_are_refused_in_words(user, bench):
    found = await fuzz(25, 1, user, bench)
    assert found["refused"] > 12


async def test_what_a_handler_raises_is_said_and_a_mistake_is_logged(
    user, bench, monkeypatch, caplog
):
    raised = [CdprError("refused"), ValueError("odd")]
    monkeypatch.setattr(bench, "go_home", Mock(side_effect=raised))
    await do(user, "home", "home")
    await until(lambda: user.notify.messages == ["refused", "ValueError: odd"])
    assert [record.msg for record in caplog.records] == raised[1:]


async def test_a_click_before_the_browser_says_that_it_is_dark_makes_the_page_light(user, bench):
    bench.dark = None
    user.javascript_rules[re.compile(re.escape(PREFERS_DARK))] = lambda _: True
    await do(user, "dark-or-light")
    await until(lambda: bench.dark is not None)
    assert bench.dark is False


async def test_a_sign_says_that_a_job_works(user, bench, tmp_path):
    assert not shown(user, "job-at-work")
    job = Job(["import time; time.sleep(3600)"], tmp_path)
    job.program = (sys.executable, "-c")
    bench.jobs.submit(job)
    await until(lambda: shown(user, "job-at-work"))
    await bench.jobs.close()
    await until(lambda: not shown(user, "job-at-work"))


@pytest.mark.parametrize(("late", "x"), [(0.01, -0.4), (1e3, -0.3)])
async def test_the_page_is_busy_at_once_and_calls_numbers_old_only_when_they_are_late(
    user, bench, monkeypatch, late, x
):
    monkeypatch.setattr(sessions, "LATE", late)
    said, held_up = [], threading.Event()
    bench.results.changed.subscribe(lambda: said.append(bench.results.differs(POSE_NUMBERS)))
    bench.calculator.submit(held_up.wait)  # as while a kernel is compiled
    with user:
        signs = list(ElementFilter(marker="busy"))
    try:
        bench.drag_point("exit", 0, np.array([x, -0.5, 1.1]), done=False)
        assert not any(sign.visible for sign in signs)  # it would flicker in the hand
        bench.move_to(bench.coordinates)
        assert [sign.visible for sign in signs] == [True, True]
        if late < 1.0:
            await until(lambda: any("before" in words for words in said))
    finally:
        held_up.set()
    await until(lambda: not any(sign.visible for sign in signs))
    assert not bench.results.differs(POSE_NUMBERS)
    assert any(said) == (late < 1.0)


async def test_of_many_robots_the_newest_is_computed_and_the_rest_dropped(user, bench, monkeypatch):
    computed = []

    def counted(robot, poses):
        computed.append((poses, robot.cables[0].exit_point[0]))
        return sketch_workspace(robot, poses)

    monkeypatch.setattr(live_workspace, "sketch_workspace", counted)
    monkeypatch.setattr(live_workspace, "REST", 0.05)
    for x in np.linspace(-0.45, -0.3, 31):
        bench.drag_point("exit", 0, np.array([x, -0.5, 1.1]), done=False)
    x = pytest.approx(-0.3)
    await until(lambda: (FINE, x) in computed)
    assert computed[-2:] == [(COARSE, x), (FINE, x)]
    assert len(computed) < 5
    await do(user, "live-size: refined", "live-size: % of the grid's box")
    await do(user, "live-tensions: limits 0 to 60 N")


async def test_cables_come_and_go(user, bench):
    user.find("Add cable").click()
    await do(user, "add-name=C9", "add-exit_point=0, 0, 1.165", "add-anchor_point=0 0 0.07", "do")
    await do(user, "cell-cables-8-name: C9")
    await bench.robot.edit(partial(_with_copy, PLACE[:2]))  # as the button beside it does
    await do(user, "cell-cables-9-name: C1_10")
    bench.robot.undo()
    bench.robot.undo()
    assert not shown(user, "cell-cables-8-name")


async def test_a_second_tab_shows_the_same_until_it_is_closed(user, bench):
    async with another_tab(user):
        listeners = len(bench.robot.changed.callbacks)
        put(bench.robot, PLACE, -0.37)
        assert field(user, CELL).value == "-0.37"
    assert len(bench.robot.changed.callbacks) < listeners
    assert field(user, CELL).value == "-0.37"


async def test_what_an_import_assumed_stays_as_a_card_until_it_is_seen(user, bench, tmp_path):
    caspr(tmp_path)
    opened = bench.files.upload({path.name: path.read_bytes() for path in tmp_path.glob("*.xml")})
    bench.take_opened(opened)
    assert (bench.robot.value.name, bench.file) == ("toy", "")
    assert any(line.startswith("assumed ") for line in opened.notes)
    await bench.save("toy.yaml", overwrite=False)
    assert bench.assumed == opened.notes
    bench.take_opened(bench.files.open("planar"))
    assert not shown(user, "assumed")
    bench.robot.undo()
    await do(user, "assumed-seen")
    await until(lambda: not shown(user, "assumed"))


async def test_what_an_export_could_not_hold_is_said_over_the_page(user):
    await do(user, "export", "export-format=sdf", "do")
    lost = omission_words(export_omissions(load_robot(ROBOT), "sdf"))
    await until(lambda: "\n".join(lost) in user.notify.messages)


async def test_a_robot_is_saved_and_another_opened_and_the_page_says_which(user, bench, work):
    def words():
        return [field(user, f"subject-{word}").text for word in ("name", "state", "fingerprint")]

    async def leads_to(name, state, *steps):
        await do(user, *steps)
        await until(lambda: words() == [name, state, bench.subject.digest[:8]])

    await leads_to(ROBOT, "of the package")
    await leads_to(ROBOT, "not saved", f"{CELL}=-0.37")
    await leads_to(ROBOT, "saved", "save", "save-name=mine.yaml")
    text = bench.robot.text
    await leads_to(ROBOT, "edited, not saved", f"{CELL}=-0.3")
    await leads_to(ROBOT, "saved", "undo")
    await leads_to(ROBOT, "edited, not saved", "redo")
    await leads_to(ROBOT, "saved", "save")
    assert (work / "mine.yaml").read_text() == bench.robot.text != text
    await leads_to("planar", "of the package", "open", "open-robot=planar")
    await until(lambda: shown(user, "slider-2") and not shown(user, "slider-3"))
    await do(user, "save-as", "save-name=mine.yaml")
    await until(lambda: "mine.yaml: is there already; replace it, or rename" in str(problems(user)))
