"""The page's panels, by a simulated user: what they show, what they change, what they refuse."""

import asyncio

import numpy as np

from cdpr_drake.studio.sessions import MOST_SESSIONS, Sessions
from tests.studio.fuzz import fuzz
from tests.studio.pages import field, opened_page, problems, type_into, until

CASE = "cables-0-exit_point-0"


def in_page(folder, steps, robot="acrobot_large"):
    """Runs steps in a page."""

    async def run():
        async with opened_page(folder, robot) as (user, bench, client):
            await until(lambda: bench.answer is not None)
            return await steps(user, bench, client)

    return asyncio.run(run())


def test_a_field_changes_the_robot_and_its_tensions(tmp_path):
    async def steps(user, bench, _):
        before = bench.answer
        type_into(user, f"cell-{CASE}", "-0.37")
        await until(lambda: bench.answer is not before)
        assert bench.robot.value.cables[0].exit_point[0] == -0.37
        assert not np.allclose(bench.answer.tensions, before.tensions)
        shown = field(user, "pose-numbers").content
        assert all(f"<td>{tension:.2f}</td>" in shown for tension in bench.answer.tensions)
        user.find(marker="undo").click()
        await until(lambda: field(user, f"cell-{CASE}").value == "-0.47")
        user.find(marker="redo").click()
        await until(lambda: field(user, f"cell-{CASE}").value == "-0.37")

    in_page(tmp_path, steps)


WRONG = [
    (CASE, "abc", "found abc; accepted: 3 numbers [m]"),
    (CASE, "", "found nothing; accepted: 3 numbers [m]"),
    (CASE, "nan", "accepted: 3 numbers [m]"),
    ("platform-mass", "-1", "platform.mass: found -1; accepted: a number > 0 [kg]"),
    ("tension_bounds-lower", "70", "accepted: lower < upper"),
    ("name", "../x", "accepted: 1 to 64 letters"),
    ("cables-1-name", "C1", "accepted: each name once"),
    ("platform-center_of_mass", "1, 2", "found [1, 2]; accepted: 3 numbers [m]"),
]
"""Field, words, and what is said."""


def test_wrong_values_are_said_beside_the_field(tmp_path):
    async def steps(user, bench, _):
        text = bench.robot.text
        for name, words, said in WRONG:
            type_into(user, f"cell-{name}", words)
            assert any(said in problem for problem in problems(user)), problems(user)
            assert bench.robot.text == text
            element = field(user, f"cell-{name}")
            assert "error" in element.props

    in_page(tmp_path, steps)


def test_wrong_values_and_files_at_random_are_refused_in_words(tmp_path):
    found = asyncio.run(fuzz(60, 1, tmp_path))
    assert found["refused"] > 30


def test_sliders_follow_what_is_typed_and_refuse_the_rest(tmp_path):
    async def steps(user, bench, _):
        user.find(marker="tab-pose").click()
        before = bench.answer
        type_into(user, "coordinate-2", "0.4")
        await until(lambda: bench.answer is not before)
        assert bench.answer.X_WP.translation()[2] == 0.4
        assert field(user, "slider-2").value == 0.4
        type_into(user, "coordinate-2", "7")
        assert field(user, "coordinate-2").error == (
            "found '7'; accepted: a number from 0 to 1.2 [m]"
        )
        assert bench.coordinates[2] == 0.4
        answer = bench.answer
        field(user, "method").value = "barycenter"
        await until(lambda: bench.answer is not answer)
        assert bench.answer.method == "barycenter"

    in_page(tmp_path, steps)


def test_a_robot_is_opened_saved_and_opened_again(tmp_path):
    async def steps(user, bench, _):
        user.find(marker="save").click()
        type_into(user, "save-name", "mine.yaml")
        await until(lambda: bench.file == "mine.yaml")
        text = bench.robot.text
        type_into(user, f"cell-{CASE}", "-0.37")
        user.find(marker="save").click()
        await until(lambda: bench.is_saved)
        assert (tmp_path / "mine.yaml").read_text() == bench.robot.text != text
        user.find(marker="open").click()
        field(user, "open-robot").value = "planar"
        await until(lambda: bench.robot.value.name == "planar")
        assert len(user.find(marker="slider-2").elements) == 1
        await user.should_not_see(marker="slider-3")
        user.find(marker="save-as").click()
        type_into(user, "save-name", "mine.yaml")
        await user.should_see("mine.yaml: is there already; replace it, or rename", retries=3000)

    in_page(tmp_path, steps)


def test_cables_come_and_go(tmp_path):
    async def steps(user, bench, _):
        user.find("Add cable").click()
        for name, words in (
            ("name", "C9"), ("exit_point", "0, 0, 1.165"), ("anchor_point", "0 0 0.07")
        ):  # fmt: skip
            field(user, f"add-{name}").value = words
        user.find(marker="add").click()
        await until(lambda: len(bench.robot.value.cables) == 9)
        await user.should_see(marker="cell-cables-8-name", retries=3000)
        bench.robot.undo()
        await until(lambda: len(bench.robot.value.cables) == 8)
        await user.should_not_see(marker="cell-cables-8-name")

    in_page(tmp_path, steps)


def test_a_second_tab_shows_the_same(tmp_path):
    async def steps(user, bench, first):
        second = await user.open("/")
        assert second is not first
        type_into(user, f"cell-{CASE}", "-0.37")
        assert len(bench.robot.changed) > 1
        bench.robot.undo()
        assert field(user, f"cell-{CASE}").value == "-0.47"
        second.delete()
        bench.robot.redo()
        assert bench.robot.value.cables[0].exit_point[0] == -0.37

    in_page(tmp_path, steps)


def test_sessions_that_nobody_looks_at_make_room():
    made = []

    def make():
        made.append(object())
        return made[-1]

    sessions = Sessions(make)
    first = sessions.open_page("0")
    for number in range(1, MOST_SESSIONS + 5):
        sessions.open_page(str(number))
        sessions.close_page(str(number))
    assert sessions.open_page("0") is first
    assert len(sessions.benches()) == MOST_SESSIONS
