"""The page's panels, by a simulated user: what they show, what they change, what they refuse."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from cdpr_drake.formats.robot_exports import export_omissions, omission_words
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.page import PREFERS_DARK
from cdpr_drake.studio.yaml_edit import with_value
from tests.models.formats.foreign_files import caspr
from tests.studio.fuzz import fuzz
from tests.studio.pages import field, problems, shown, type_into, until

ROBOT = "acrobot_large"

CASE = "cables-0-exit_point-0"


def subject(user):
    return tuple(field(user, f"subject-{name}").text for name in ("name", "state", "fingerprint"))


async def test_a_field_changes_the_robot_and_its_tensions(user, bench):
    before = bench.answer
    type_into(user, f"cell-{CASE}", "-0.37")
    await until(lambda: bench.answer is not before)
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    assert not np.allclose(bench.answer.tensions, before.tensions)
    numbers = field(user, "pose-numbers").content
    assert all(f"<td>{tension:.2f}</td>" in numbers for tension in bench.answer.tensions)
    user.find(marker="undo").click()
    await until(lambda: field(user, f"cell-{CASE}").value == "-0.47")
    user.find(marker="redo").click()
    await until(lambda: field(user, f"cell-{CASE}").value == "-0.37")


@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        (CASE, "abc", "found abc; accepted: 3 numbers >= -10000"),
        (CASE, "", "found nothing; accepted: 3 numbers >= -10000"),
        (CASE, "nan", "found nan; accepted: 3 numbers >= -10000"),
        ("platform-mass", "-1", "platform.mass: found -1; accepted: a number > 0 and"),
        ("tension_bounds-lower", "70", "accepted: lower < upper"),
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
    for name, words in (
        ("name", "C9"), ("exit_point", "0, 0, 1.165"), ("anchor_point", "0 0 0.07")
    ):  # fmt: skip
        field(user, f"add-{name}").value = words
    user.find(marker="do").click()
    await until(lambda: len(bench.robot.value.cables) == 9)
    await user.should_see(marker="cell-cables-8-name", retries=3000)
    bench.robot.undo()
    await until(lambda: len(bench.robot.value.cables) == 8)
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


async def test_undo_and_redo_by_keys_in_a_field(user, bench):
    type_into(user, f"cell-{CASE}", "-0.37")
    await until(lambda: bench.robot.value.cables[0].exit_point[0] == -0.37)
    cell = field(user, f"cell-{CASE}")

    def after(key, shift=False):
        for one in cell._event_listeners.values():
            if one.type == f"keydown.ctrl.{key}":
                one.handler(SimpleNamespace(args={"key": key, "shiftKey": shift}))
        return bench.robot.value.cables[0].exit_point[0]

    assert after("z") == -0.47
    assert after("y") == -0.37
    assert after("z") == -0.47
    assert after("z", shift=True) == -0.37
    cell.value = "-0.3"  # typed, not yet taken: the browser's own undo has that
    assert after("z") == -0.37


async def test_name_state_and_fingerprint_follow_the_robot(user, bench):
    name, state, first = subject(user)
    assert (name, state) == (ROBOT, "of the package")
    assert first == bench.subject.digest[:8]
    heavier = with_value(bench.robot.text, ("platform", "mass"), 5.25)
    bench.robot.change(heavier)
    assert subject(user)[1] == "not saved"
    assert subject(user)[2] not in ("", first)
    bench.save("heavier.yaml", overwrite=False)
    assert subject(user)[1] == "saved"
    bench.robot.change(with_value(heavier, ("platform", "mass"), 5.5))
    assert subject(user)[1] == "edited, not saved"
    bench.robot.undo()
    assert subject(user)[1] == "saved"
    bench.take_opened(bench.files.open("planar"))
    assert subject(user)[:2] == ("planar", "of the package")


async def test_what_an_import_assumed_stays_as_a_card_until_it_is_seen(user, bench, tmp_path):
    caspr(tmp_path)
    assert not shown(user, "assumed")
    opened = bench.files.upload({path.name: path.read_bytes() for path in tmp_path.glob("*.xml")})
    bench.take_opened(opened)
    assert any(line.startswith("assumed ") for line in opened.notes)
    assert shown(user, "assumed")
    assert bench.assumed == opened.notes
    bench.save("toy.yaml", overwrite=False)
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


async def test_a_robot_is_opened_saved_and_opened_again(user, bench, work):
    user.find(marker="save").click()
    await until(lambda: shown(user, "save-name"))
    type_into(user, "save-name", "mine.yaml")
    await until(lambda: bench.file == "mine.yaml")
    text = bench.robot.text
    type_into(user, f"cell-{CASE}", "-0.37")
    user.find(marker="save").click()
    await until(lambda: bench.robot.text != text and bench.state == "saved")
    assert (work / "mine.yaml").read_text() == bench.robot.text != text
    user.find(marker="open").click()
    await until(lambda: shown(user, "open-robot"))
    field(user, "open-robot").value = "planar"
    await until(lambda: bench.robot.value.name == "planar")
    assert len(user.find(marker="slider-2").elements) == 1
    await user.should_not_see(marker="slider-3")
    user.find(marker="save-as").click()
    await until(lambda: shown(user, "save-name"))
    type_into(user, "save-name", "mine.yaml")
    await user.should_see("mine.yaml: is there already; replace it, or rename", retries=3000)
