"""The page's panels, by a simulated user: what they show, what they change, what they refuse."""

import re
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from cdpr_drake.formats.robot_exports import export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.page import PREFERS_DARK
from cdpr_drake.studio.settings_form import _with_copy
from tests.models.formats.foreign_files import caspr
from tests.studio.fuzz import fuzz
from tests.studio.pages import field, problems, shown, type_into, until

ROBOT = "acrobot_large"

CASE = "cables-0-exit_point-0"


async def test_a_field_changes_the_robot_and_its_tensions_and_is_undone(user, bench):
    def after(key, shift=False):
        for one in cell._event_listeners.values():
            if one.type == f"keydown.ctrl.{key}":
                one.handler(SimpleNamespace(args={"key": key, "shiftKey": shift}))
        return bench.robot.value.cables[0].exit_point[0]

    before = bench.answer
    type_into(user, f"cell-{CASE}", "-0.37")
    await until(lambda: bench.answer is not before)
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    assert not np.allclose(bench.answer.tensions, before.tensions)
    numbers = field(user, "pose-numbers").content
    assert all(f"<td>{tension:.2f}</td>" in numbers for tension in bench.answer.tensions)
    cell = field(user, f"cell-{CASE}")
    for button, words in (("undo", "-0.47"), ("redo", "-0.37")):
        user.find(marker=button).click()
        await until(lambda words=words: cell.value == words)
    assert [after("z"), after("y"), after("z"), after("z", True)] == [-0.47, -0.37, -0.47, -0.37]
    cell.value = "-0.3"  # typed, not yet taken: the browser's own undo has that
    assert after("z") == -0.37


async def test_edits_that_need_each_other_are_taken_together(user, bench):
    robot, lower = bench.robot, field(user, "cell-tension_bounds-lower")
    type_into(user, "cell-tension_bounds-lower", "70")
    await until(lambda: "accepted: lower < upper" in str(problems(user)))
    type_into(user, "cell-platform-mass", "1.5")
    await until(lambda: robot.value.platform.mass == 1.5)
    assert robot.value.tension_bounds.lower < 70
    assert lower.value == "70"
    type_into(user, "cell-tension_bounds-upper", "80")
    await until(lambda: robot.value.tension_bounds.lower == 70)
    assert "error" not in lower.props


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        (CASE, "abc", "found abc; accepted: 3 numbers >= -10000"),
        (CASE, "", "found nothing; accepted: 3 numbers >= -10000"),
        (CASE, "nan", "found nan; accepted: 3 numbers >= -10000"),
        ("platform-mass", "-1", "platform.mass: found -1; accepted: a number > 0 and"),
        ("name", "../x", "accepted: 1 to 64 letters"),
        ("cables-1-name", "C1", "accepted: each name once"),
        ("platform-center_of_mass", "1, 2", "found [1, 2]; accepted: 3 numbers [m]"),
    ],
)
async def test_a_wrong_value_is_said_beside_its_field(user, bench, name, words, said):
    text = bench.robot.text
    type_into(user, f"cell-{name}", words)
    await until(lambda: any(said in problem for problem in problems(user)))
    assert bench.robot.text == text
    assert "error" in field(user, f"cell-{name}").props


async def test_a_click_before_the_browser_says_that_it_is_dark_makes_the_page_light(user, bench):
    bench.dark = None
    user.javascript_rules[re.compile(re.escape(PREFERS_DARK))] = lambda _: True
    user.find(marker="dark-or-light").click()
    await until(lambda: bench.dark is not None)
    assert bench.dark is False


async def test_wrong_values_and_files_at_random_are_refused_in_words(user, bench):
    found = await fuzz(25, 1, user, bench)
    assert found["refused"] > 12


async def test_sliders_follow_what_is_typed_and_refuse_the_rest(user, bench):
    user.find(marker="tab-pose").click()
    before = bench.answer
    type_into(user, "coordinate-2", "0.4")
    await until(lambda: bench.answer is not before)
    assert bench.answer.X_WP.translation()[2] == 0.4
    assert field(user, "slider-2").value == 0.4
    type_into(user, "coordinate-2", "7")
    assert field(user, "coordinate-2").error == "found '7'; accepted: a number from 0 to 1.2 [m]"
    assert bench.coordinates[2] == 0.4
    answer = bench.answer
    field(user, "method").value = "barycenter"
    await until(lambda: bench.answer is not answer)
    assert bench.answer.method == "barycenter"
    user.find(marker="tab-robot").click()


async def test_cables_come_and_go(user, bench):
    user.find("Add cable").click()
    cable = {"name": "C9", "exit_point": "0, 0, 1.165", "anchor_point": "0 0 0.07"}
    for name, words in cable.items():
        field(user, f"add-{name}").value = words
    user.find(marker="do").click()
    await user.should_see(marker="cell-cables-8-name", retries=3000)
    await bench.robot.edit(partial(_with_copy, ("cables", 0)))  # as the button beside it does
    assert len(bench.robot.value.cables) == 10
    await user.should_see(marker="cell-cables-9-name", retries=3000)
    bench.robot.undo()
    bench.robot.undo()
    await user.should_not_see(marker="cell-cables-8-name")


async def test_a_second_tab_shows_the_same(user, bench):
    first = user.client
    second = await user.open("/")
    assert second is not first
    before = len(bench.robot.changed.callbacks)
    type_into(user, f"cell-{CASE}", "-0.37")
    await until(lambda: bench.robot.value.cables[0].exit_point[0] == -0.37)
    bench.robot.undo()
    assert field(user, f"cell-{CASE}").value == "-0.47"
    second.delete()
    user.client = first
    assert len(bench.robot.changed.callbacks) < before
    bench.robot.redo()
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    assert field(user, f"cell-{CASE}").value == "-0.37"


async def test_what_an_import_assumed_stays_as_a_card_until_it_is_seen(user, bench, tmp_path):
    caspr(tmp_path)
    assert not shown(user, "assumed")
    opened = bench.files.upload({path.name: path.read_bytes() for path in tmp_path.glob("*.xml")})
    bench.take_opened(opened)
    robot = bench.robot.value
    assert (robot.name, len(robot.cables), bench.file) == ("toy", 8, "")
    assert "CASPR" in opened.notes[0]
    assert any(line.startswith("assumed ") for line in opened.notes)
    assert shown(user, "assumed")
    assert bench.assumed == opened.notes
    await bench.save("toy.yaml", overwrite=False)
    assert bench.assumed == opened.notes
    bench.take_opened(bench.files.open("planar"))
    assert not shown(user, "assumed")
    bench.robot.undo()
    assert shown(user, "assumed")
    user.find(marker="assumed-seen").click()
    await until(lambda: not shown(user, "assumed"))


async def test_what_an_export_could_not_hold_is_said_over_the_page(user):
    user.find(marker="export").click()
    await until(lambda: shown(user, "do"))
    field(user, "export-format").value = "sdf"
    user.find(marker="do").click()
    await until(lambda: user.notify.messages, 60.0)
    lost = export_omissions(load_robot(ROBOT), "sdf")
    assert "cable.youngs_modulus" in lost
    assert "\n".join(omission_words(lost)) in user.notify.messages


async def test_a_robot_is_saved_and_another_opened_and_the_page_says_which(user, bench, work):
    def is_called(name, state):
        words = [field(user, f"subject-{word}").text for word in ("name", "state", "fingerprint")]
        return words == [name, state, bench.subject.digest[:8]]

    async def save_as(name, button):
        user.find(marker=button).click()
        await until(lambda: shown(user, "save-name"))
        type_into(user, "save-name", name)

    assert is_called(ROBOT, "of the package")
    type_into(user, f"cell-{CASE}", "-0.37")
    await until(lambda: is_called(ROBOT, "not saved"))
    await save_as("mine.yaml", "save")
    await until(lambda: is_called(ROBOT, "saved"))
    text = bench.robot.text
    type_into(user, f"cell-{CASE}", "-0.3")
    await until(lambda: is_called(ROBOT, "edited, not saved"))
    bench.robot.undo()
    assert is_called(ROBOT, "saved")
    bench.robot.redo()
    user.find(marker="save").click()
    await until(lambda: is_called(ROBOT, "saved"))
    assert (work / "mine.yaml").read_text() == bench.robot.text != text
    user.find(marker="open").click()
    await until(lambda: shown(user, "open-robot"))
    field(user, "open-robot").value = "planar"
    await until(lambda: is_called("planar", "of the package"))
    await user.should_see(marker="slider-2")
    await user.should_not_see(marker="slider-3")
    await save_as("mine.yaml", "save-as")
    await user.should_see("mine.yaml: is there already; replace it, or rename", retries=3000)
