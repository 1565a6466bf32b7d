"""Every result that a panel shows says when it is about another robot, or pose, than is open."""

import json
import shutil

import pytest

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import write_asked
from cdpr_drake.studio.panel import PANELS
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.runs import RunBoard
from cdpr_drake.studio.verb_panel import view_of
from cdpr_drake.studio.workspace import TAB, _views
from cdpr_drake.studio.yaml_edit import with_value
from tests.studio.pages import field, open_panel, problems, shown, until

ROBOT, OTHER = "acrobot_small", "planar"


async def pose_numbers(user, bench):
    await until(lambda: bench.results.subject("pose-numbers") is not None)


async def workspaces(user, bench):
    await until(lambda: _views[bench].regions is not None)


async def run(user, bench):
    await until(lambda: "first" in field(user, "run").options)
    field(user, "run").value = "first"
    await until(lambda: bench.results.subject("run") is not None)


async def compared(user, bench):
    await until(lambda: "second" in field(user, "compare").options)
    field(user, "compare").value = "second"
    await until(lambda: bench.results.subject("compared") is not None)


async def log(user, bench):
    await until(lambda: bench.results.subject("log") is not None)


async def study(user, bench):
    await until(lambda: bench.results.subject("study") is not None)


async def answer(user, bench):
    await until(lambda: bench.results.subject("answer") is not None)


RESULTS = {
    "robot": {}, "pose": {"pose-numbers": pose_numbers}, "workspace": {"workspaces": workspaces},
    "run": {"run": run, "compared": compared}, "logs": {"log": log}, "studies": {"study": study},
    "commands": {"answer": answer},
}  # fmt: skip
"""How each result of each panel comes to be; a panel that is new has to be here, and be marked."""

OF_POSES, OF_NO_ROBOT = {"pose-numbers"}, {"study"}


def test_all_panels_say_which_results_they_show():
    assert {name: set(panel.results) for name, panel in PANELS.items()} == {
        name: set(results) for name, results in RESULTS.items()
    }


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed, alone, beside):
    """With a workspace, two runs and a log of `ROBOT`, each with what the studio keeps of it."""
    folder = tmp_path_factory.mktemp("work")
    shutil.copytree(computed, folder / "workspaces" / "small")
    for name in ("first", "second"):
        shutil.copytree(alone, folder / "runs" / name)
    shutil.copytree(beside, folder / "logs" / "small")
    about = {"robot": ROBOT, "digest": subject_of(load_robot(ROBOT)).digest}
    for below, results in (("studies", {}), ("commands", {"robot": ROBOT})):
        (folder / below / "small").mkdir(parents=True)
        (folder / below / "small" / "results.json").write_text(json.dumps(results))
    for below in ("workspaces", "logs", "commands"):
        write_asked(folder / below / ".small.asked.json", (), about)
    return folder


def said(user, name):
    return field(user, f"about-{name}").text


@pytest.mark.parametrize(
    ("panel", "name"), [(panel, name) for panel in RESULTS for name in RESULTS[panel]]
)
async def test_a_result_is_marked_when_the_robot_or_the_pose_has_changed(
    user, bench, panel, name, monkeypatch
):
    open_panel(user, panel)
    await RESULTS[panel][name](user, bench)
    if name in OF_NO_ROBOT:
        await until(lambda: "robots of their own" in said(user, name))
        return
    await until(lambda: said(user, name) == "")
    # As while numbers are being computed.
    monkeypatch.setattr(bench, "ask", bench.results.changed.emit)
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
    assert f"of {ROBOT} as it was before" in said(user, name)
    bench.robot.undo()
    assert said(user, name) == ""
    bench.take_opened(bench.files.open(OTHER))
    assert f"of {ROBOT}, not of {OTHER}" in said(user, name)
    bench.robot.undo()
    assert said(user, name) == ""
    bench.move_to([value + 0.01 for value in bench.coordinates])
    assert ("of the pose before" in said(user, name)) == (name in OF_POSES)


async def test_workspaces_leave_the_scene_of_another_robot_and_come_back(user, bench, work):
    open_panel(user, "workspace")
    await workspaces(user, bench)

    def in_scene():
        bench.calculator.submit(lambda: None).result(60.0)
        return bench.calculator.submit(
            lambda: bench.scene().meshcat.HasPath("workspaces/all")
        ).result(60.0)

    await until(in_scene)
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
    await until(lambda: not in_scene())
    field(user, "layer-static").value = True  # what is switched on meanwhile is not there
    await until(lambda: not in_scene())
    assert "not in the scene" in field(user, "regions-note").text
    bench.robot.undo()
    await until(in_scene)
    bench.draws(Subject("another", "x"))  # a run of another robot
    await until(lambda: not in_scene())
    bench.draws(None)
    await until(in_scene)
    (work / "workspaces" / ".small.asked.json").unlink()
    await until(lambda: not view_of(bench, TAB).board.choices()["small"].about)
    (work / "workspaces" / "small" / "results.json").touch()  # read anew
    await until(lambda: "whether it was as it is now is not known" in said(user, "workspaces"))


async def test_the_scene_has_a_run_and_its_robot_while_its_panel_is_shown(user, bench):
    open_panel(user, "run")
    bench.take_opened(bench.files.open(OTHER))
    await run(user, bench)
    for _ in range(2):
        await until(lambda: bench.drawn is not None)
        assert bench.drawn.robot == ROBOT
        open_panel(user, "robot")
        await until(lambda: bench.drawn is None)
        assert bench.kept(RunBoard).in_scene is None
        open_panel(user, "run")
    await until(lambda: bench.drawn is not None)
    open_panel(user, "robot")
    await until(lambda: bench.drawn is None)
    field(user, "cursor").value = 0.1  # as another tab moves it
    open_panel(user, "run")
    await until(lambda: bench.drawn is not None)


async def test_a_run_is_of_the_robot_that_is_open_and_of_no_other(user, bench, work):
    open_panel(user, "run")
    board = bench.kept(RunBoard)
    await until(lambda: board.draft is not None)
    assert board.draft.own_robot == ROBOT
    await until(lambda: board.draft.settings() == ())
    says = lambda words: words in field(user, "run-robot").text  # noqa: E731
    await until(lambda: says(f"Runs {ROBOT}, the robot that is open."))
    bench.take_opened(bench.files.open("acrobot_large"))
    await until(lambda: board.draft.settings() == ("robot=acrobot_large",))
    assert board.draft.check().robot == "acrobot_large"
    await until(lambda: says(f"instead of the scenario's {ROBOT}"))
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
    await until(lambda: says("save it"))
    user.find(marker="start").click()
    await until(lambda: bench.jobs.jobs or any("save it" in words for words in problems(user)))
    assert bench.jobs.jobs == []
    bench.save("mine.yaml", overwrite=False)
    await until(lambda: board.draft.check().robot == str(work / "mine.yaml"))
    user.find(marker="open-own-robot").click()
    await until(lambda: board.draft.settings() == ())
    assert bench.robot.value.name == ROBOT
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
    user.notify.messages.clear()
    await until(lambda: not any("save it" in words for words in problems(user)))
    # Its own robot, which is in no file now, is not run either.
    user.find(marker="start").click()
    await until(lambda: bench.jobs.jobs or any("save it" in words for words in problems(user)))
    assert bench.jobs.jobs == []


async def test_two_robots_and_two_runs_are_shown_beside_each_other(user, bench):
    field(user, "robot-beside").value = True
    await until(lambda: "acrobot_large" in field(user, "other-robot").options)
    field(user, "other-robot").value = "acrobot_large"
    await until(lambda: "platform mass [kg]" in field(user, "robot-pairs").content)
    before = field(user, "robot-pairs").content
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))
    await until(lambda: field(user, "robot-pairs").content != before)
    assert "5.25" in field(user, "robot-pairs").content
    open_panel(user, "run")
    await run(user, bench)
    await compared(user, bench)
    await until(lambda: shown(user, "both-runs"))
    assert "final position error [m]" in field(user, "run-pairs").content


def test_subjects_tell_every_change_of_a_robot():
    robot, other = load_robot(ROBOT), load_robot(ROBOT)
    assert subject_of(robot) == subject_of(other)
    other.cables[3].anchor_point[1] += 1e-12
    assert subject_of(robot).is_another(subject_of(other))
    assert subject_of(robot).differs(subject_of(other)).startswith(f"of {ROBOT} as it was before")
