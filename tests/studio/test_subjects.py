"""Every result that a panel shows says when it is about another robot, or pose, than is open."""

import asyncio
import json
import shutil
from contextlib import asynccontextmanager

import pytest

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.panels.run import _boards, _scenes
from cdpr_drake.studio.panels.table import PANELS
from cdpr_drake.studio.panels.workspace import _views
from cdpr_drake.studio.workbench.result_subject import Subject, subject_of
from cdpr_drake.studio.workbench.yaml_edit import with_value
from tests.studio.pages import field, opened_page, problems, until

ROBOT, OTHER = "acrobot_small", "planar"


async def pose_numbers(user, bench, folder):
    await until(lambda: bench.results.subject("pose-numbers") is not None)


async def workspaces(user, bench, folder):
    await until(lambda: _views[bench].regions is not None)


async def run(user, bench, folder):
    await until(lambda: "folder first" in field(user, "run").options)
    field(user, "run").value = "folder first"
    await until(lambda: bench.results.subject("run") is not None)


async def compared(user, bench, folder):
    await until(lambda: "folder second" in field(user, "compare").options)
    field(user, "compare").value = "folder second"
    await until(lambda: bench.results.subject("compared") is not None)


async def log(user, bench, folder):
    await until(lambda: bench.results.subject("log") is not None)


async def study(user, bench, folder):
    pass


RESULTS = {
    "robot": {}, "pose": {"pose-numbers": pose_numbers}, "workspace": {"workspaces": workspaces},
    "run": {"run": run, "compared": compared}, "logs": {"log": log}, "studies": {"study": study},
}  # fmt: skip
"""How each result of each panel comes to be; a panel that is new has to be here, and be marked."""

OF_POSES, OF_NO_ROBOT = {"pose-numbers"}, {"study"}


def test_all_panels_say_which_results_they_show():
    assert {name: set(panel.results) for name, panel in PANELS.items()} == {
        name: set(results) for name, results in RESULTS.items()
    }


@pytest.fixture
def folder(tmp_path, computed, alone, beside):
    """With a workspace and two runs of `ROBOT`, each with what the studio keeps of it."""
    shutil.copytree(computed, tmp_path / "workspaces" / "small")
    for name in ("first", "second"):
        shutil.copytree(alone, tmp_path / "runs" / name)
    shutil.copytree(beside, tmp_path / "logs" / "small")
    return tmp_path


def said(user, name):
    return field(user, f"about-{name}").text


def open_panel(user, name):
    (tabs,) = {element.parent_slot.parent for element in user.find(marker=f"tab-{name}").elements}
    tabs.value = name


@asynccontextmanager
async def opened(folder):
    about = {"robot": ROBOT, "digest": subject_of(load_robot(ROBOT)).digest}
    for below in ("workspaces", "logs"):
        (folder / below / ".small.about.json").write_text(json.dumps(about))
    async with opened_page(folder, ROBOT) as (user, bench, _):
        assert bench.subject.digest == about["digest"]
        yield user, bench


@pytest.mark.parametrize(
    ("panel", "name"), [(panel, name) for panel in RESULTS for name in RESULTS[panel]]
)
def test_a_result_is_marked_when_the_robot_or_the_pose_has_changed(folder, panel, name):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, panel)
            await RESULTS[panel][name](user, bench, folder)
            if name in OF_NO_ROBOT:
                await until(lambda: "robots of their own" in said(user, name))
                return
            await until(lambda: said(user, name) == "")
            bench.ask = bench.results.changed.emit  # as while numbers are being computed
            heavier = with_value(bench.robot.text, ("platform", "mass"), 5.25)
            bench.robot.change(heavier)
            assert f"of {ROBOT} as it was before" in said(user, name)
            bench.robot.undo()
            assert said(user, name) == ""
            bench.open(OTHER)
            assert f"of {ROBOT}, not of {OTHER}" in said(user, name)
            bench.robot.undo()
            assert said(user, name) == ""
            bench.move_to([value + 0.01 for value in bench.coordinates])
            assert ("of the pose before" in said(user, name)) == (name in OF_POSES)

    asyncio.run(look())


def test_workspaces_leave_the_scene_of_another_robot_and_come_back(folder):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, "workspace")
            await workspaces(user, bench, folder)

            def in_scene():
                bench.calculator.submit(lambda: None).result(60.0)
                return bench.calculator.submit(
                    lambda: bench.scene().meshcat.HasPath("workspaces/all")
                ).result(60.0)

            assert in_scene()
            bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
            assert not in_scene()
            field(user, "layer-static").value = True  # what is switched on meanwhile is not there
            assert not in_scene()
            assert "not in the scene" in field(user, "regions-note").text
            bench.robot.undo()
            assert in_scene()
            bench.draws(Subject("another", "x"))  # a run of another robot
            assert not in_scene()
            bench.draws(None)
            assert in_scene()
            (folder / "workspaces" / ".small.about.json").unlink()
            _views[bench].take(None)
            await workspaces(user, bench, folder)
            await until(lambda: "whether it was as it is now is not known" in
                        said(user, "workspaces"))  # fmt: skip

    asyncio.run(look())


def test_the_scene_tells_which_robot_a_run_draws(folder):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, "run")
            bench.open(OTHER)
            await run(user, bench, folder)
            await until(lambda: bench.drawn is not None)
            assert bench.drawn.robot == ROBOT
            open_panel(user, "robot")
            await until(lambda: bench.drawn is None)
            assert _scenes[bench]._scene is None

    asyncio.run(look())


def test_a_run_comes_back_into_the_scene_with_its_panel(folder):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, "run")
            await run(user, bench, folder)
            await until(lambda: bench.drawn is not None)
            open_panel(user, "robot")
            await until(lambda: bench.drawn is None)
            open_panel(user, "run")
            await until(lambda: bench.drawn is not None)
            open_panel(user, "robot")
            await until(lambda: bench.drawn is None)
            field(user, "cursor").value = 0.1  # as another tab moves it
            open_panel(user, "run")
            await until(lambda: bench.drawn is not None)

    asyncio.run(look())


def test_a_run_is_of_the_robot_that_is_open(folder):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, "run")
            board = _boards[bench]
            await until(lambda: board.draft is not None)
            assert board.draft.own_robot == ROBOT
            assert board.draft.settings() == ()
            says = lambda words: words in field(user, "run-robot").text  # noqa: E731
            await until(lambda: says(f"Runs {ROBOT}, the robot that is open."))
            bench.open("acrobot_large")
            await until(lambda: board.draft.settings() == ('robot="acrobot_large"',))
            assert board.draft.check().robot == "acrobot_large"
            await until(lambda: says(f"in the place of the scenario's {ROBOT}"))
            bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
            await until(lambda: says("save it"))
            user.find(marker="start").click()
            await until(lambda: any("save it" in words for words in problems(user)))
            assert bench.jobs.jobs == []
            bench.save("mine.yaml", overwrite=False)
            await until(lambda: board.draft.check().robot == str(folder / "mine.yaml"))
            user.find(marker="open-own-robot").click()
            await until(lambda: board.draft.settings() == ())
            assert bench.robot.value.name == ROBOT

    asyncio.run(look())


def test_a_robot_that_is_in_no_file_is_not_replaced_by_that_of_the_scenario(folder):
    async def look():
        async with opened(folder) as (user, bench):
            open_panel(user, "run")
            await until(lambda: _boards[bench].draft is not None)
            bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
            user.find(marker="start").click()
            await until(lambda: bench.jobs.jobs or any("save it" in x for x in problems(user)))
            assert bench.jobs.jobs == []

    asyncio.run(look())


def test_subjects_tell_every_change_of_a_robot(folder):
    robot, other = load_robot(ROBOT), load_robot(ROBOT)
    assert subject_of(robot) == subject_of(other)
    other.cables[3].anchor_point[1] += 1e-12
    assert subject_of(robot).is_another(subject_of(other))
    assert subject_of(robot).differs(subject_of(other)).startswith(f"of {ROBOT} as it was before")
