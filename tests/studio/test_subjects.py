"""Every result that a panel shows says when it is about another robot, or pose, than is open."""

import json
import shutil

import pytest

from cdpr_drake.analyses.visualization.replay import RecordedScene
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio.boards import write_asked
from cdpr_drake.studio.document import with_value
from cdpr_drake.studio.panel import PANELS
from cdpr_drake.studio.results import Subject, subject_of
from cdpr_drake.studio.runs import RunBoard
from cdpr_drake.studio.workspace import Workspaces
from tests.studio.pages import field, in_scene, open_panel, problems, shown, until

ROBOT, OTHER = "acrobot_small", "planar"

CHOSEN = {"run": ("run", "first"), "compared": ("compare", "second")}
"""Results that are shown once a field has a value."""


@pytest.fixture(scope="module")
def work(tmp_path_factory, computed, alone, beside):
    """With a result of each kind of `ROBOT`, and what the studio keeps of it."""
    folder = tmp_path_factory.mktemp("work")
    for source, place in (
        (computed, "workspaces/small"), (alone, "runs/first"), (alone, "runs/second"),
        (beside, "logs/small"),
    ):  # fmt: skip
        shutil.copytree(source, folder / place)
    for name, results in (("studies", {}), ("commands", {"robot": ROBOT})):
        (folder / name / "small").mkdir(parents=True)
        (folder / name / "small" / "results.json").write_text(json.dumps(results))
    about = {"robot": ROBOT, "digest": subject_of(load_robot(ROBOT)).digest}
    for name in ("workspaces", "logs", "commands"):
        write_asked(folder / name / ".small.asked.json", (), about)
    return folder


async def show(user, bench, panel, name):
    """Opens a panel, and waits for a result there."""
    open_panel(user, panel)
    if name in CHOSEN:
        mark, value = CHOSEN[name]
        await until(lambda: value in field(user, mark).options)
        field(user, mark).value = value
    await until(lambda: bench.results.subject(name) is not None)


def make_heavier(bench):
    bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), 5.25))


async def test_results_are_marked_when_the_robot_or_the_pose_has_changed(user, bench, monkeypatch):
    shows = [(panel, name) for panel in PANELS for name in PANELS[panel].results]
    for panel, name in shows:
        await show(user, bench, panel, name)

    def said():
        return {name: field(user, f"about-{name}").text for _, name in shows if name != "study"}

    assert "robots of their own" in field(user, "about-study").text
    await until(lambda: not any(said().values()))
    # As while numbers are being computed.
    monkeypatch.setattr(bench, "ask", bench.results.changed.emit)
    for change, words in (
        (lambda: make_heavier(bench), f"of {ROBOT} as it was before"),
        (lambda: bench.take_opened(bench.files.open(OTHER)), f"of {ROBOT}, not of {OTHER}"),
    ):
        change()
        assert [name for name, remark in said().items() if words not in remark] == []
        bench.robot.undo()
        assert not any(said().values())
    bench.move_to([value + 0.01 for value in bench.coordinates])
    assert [name for name, remark in said().items() if "of the pose before" in remark] == [
        "pose-numbers"
    ]


async def test_workspaces_leave_the_scene_of_another_robot_and_come_back(user, bench, work):
    await show(user, bench, "workspace", "workspaces")

    async def scene_has(regions):
        await until(lambda: in_scene(bench, "workspaces/all") == regions)

    await scene_has(True)
    make_heavier(bench)
    await scene_has(False)
    field(user, "layer-static").value = True  # what is switched on meanwhile is not there
    await scene_has(False)
    assert "not in the scene" in field(user, "regions-note").text
    bench.robot.undo()
    await scene_has(True)
    bench.draws(Subject("another", "x"))  # a run of another robot
    await scene_has(False)
    bench.draws(None)
    await scene_has(True)
    (work / "workspaces" / ".small.asked.json").unlink()
    await until(lambda: not bench.kept(Workspaces).board.choices()["small"].about)
    (work / "workspaces" / "small" / "results.json").touch()  # read anew
    words = "whether it was as it is now is not known"
    await until(lambda: words in field(user, "about-workspaces").text)


async def test_the_scene_has_a_run_and_its_robot_while_its_panel_is_shown(user, bench, monkeypatch):
    build, built = RecordedScene.__init__, []
    monkeypatch.setattr(RecordedScene, "__init__", lambda *of: (built.append(of), build(*of))[1])
    bench.take_opened(bench.files.open(OTHER))
    await show(user, bench, "run", "run")
    for time in (None, 0.1):
        await until(lambda: bench.drawn is not None)
        assert bench.drawn.robot == ROBOT
        open_panel(user, "robot")
        await until(lambda: bench.drawn is None)
        assert bench.kept(RunBoard).in_scene is None
        if time is not None:
            field(user, "cursor").value = time  # as another tab moves it
        else:
            built.clear()
        open_panel(user, "run")
    await until(lambda: bench.drawn is not None)
    assert built == []  # both were, once
    assert all(in_scene(bench, path) for path in ("visualizer", "cables"))


async def test_a_run_is_of_the_robot_that_is_open_and_of_no_other(user, bench, work):
    open_panel(user, "run")
    board = bench.kept(RunBoard)

    async def says(words, *settings):
        await until(lambda: words in field(user, "run-robot").text)
        await until(lambda: board.draft.settings() == settings)

    async def start_is_refused():
        user.notify.messages.clear()
        await until(lambda: not any("save it" in words for words in problems(user)))
        user.find(marker="start").click()
        await until(lambda: bench.jobs.jobs or any("save it" in words for words in problems(user)))
        assert bench.jobs.jobs == []

    await says(f"Runs {ROBOT}, the robot that is open.")
    assert board.draft.own_robot == ROBOT
    bench.take_opened(bench.files.open("acrobot_large"))
    await says(f"instead of the scenario's {ROBOT}", "robot=acrobot_large")
    assert board.draft.check().robot == "acrobot_large"
    make_heavier(bench)
    await until(lambda: "save it" in field(user, "run-robot").text)
    await start_is_refused()
    await bench.save("mine.yaml", overwrite=False)
    await until(lambda: board.draft.check().robot == str(work / "mine.yaml"))
    user.find(marker="open-own-robot").click()
    await says(f"Runs {ROBOT}, the robot that is open.")
    assert bench.robot.value.name == ROBOT
    make_heavier(bench)
    await start_is_refused()  # its own robot is in no file now


async def test_two_robots_and_two_runs_are_shown_beside_each_other(user, bench):
    field(user, "robot-beside").value = True
    await until(lambda: "acrobot_large" in field(user, "other-robot").options)
    field(user, "other-robot").value = "acrobot_large"
    await until(lambda: "platform mass [kg]" in field(user, "robot-pairs").content)
    assert "5.25" not in field(user, "robot-pairs").content
    make_heavier(bench)
    await until(lambda: "5.25" in field(user, "robot-pairs").content)
    await show(user, bench, "run", "run")
    await show(user, bench, "run", "compared")
    await until(lambda: shown(user, "both-runs"))
    assert "final position error [m]" in field(user, "run-pairs").content


def test_subjects_tell_every_change_of_a_robot():
    robot, other = load_robot(ROBOT), load_robot(ROBOT)
    assert subject_of(robot) == subject_of(other)
    other.cables[3].anchor_point[1] += 1e-12
    assert subject_of(robot).is_another(subject_of(other))
    assert subject_of(robot).differs(subject_of(other)).startswith(f"of {ROBOT} as it was before")
