"""The static workspace that follows a robot while it is changed, and points that are dragged."""

import threading
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest
from nicegui import ElementFilter

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio import live_workspace
from cdpr_drake.studio import session as sessions
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.live_workspace import COARSE, FINE, sketch_grid, sketch_workspace
from cdpr_drake.studio.scene import EXITS, SHADER, WORKSPACE, RobotScene
from cdpr_drake.studio.session import POSE_NUMBERS, Workbench
from tests.cli.commands import told
from tests.studio.pages import field, settled, type_into, until

ROBOT = "acrobot_large"

THERE, FARTHER = np.array([-0.4, -0.5, 1.1]), np.array([-0.3, -0.5, 1.1])
"""Places for the first exit point of acrobot_large [m]."""


@pytest.fixture(scope="module")
def calculator():
    with ThreadPoolExecutor(1) as made:
        yield made


@pytest.fixture
def alone(tmp_path, calculator, monkeypatch):
    """A workbench without a page, whose workspace is not refined."""
    monkeypatch.setattr(live_workspace, "REST", 1e6)
    return Workbench(WorkingFolder(tmp_path), calculator=calculator)


def in_scene(bench, *paths):
    def has(scene):
        return [scene.meshcat.HasPath(path) for path in paths or [WORKSPACE]]

    return bench.calculator.submit(lambda: has(bench.scene())).result()


async def drag(bench, p_W, done=False):
    bench.drag_point("exit", 0, p_W, done=done)
    await settled(bench)


async def open_robot(bench, name):
    bench.take_opened(bench.files.open(name))
    await settled(bench)


async def test_a_point_is_dragged_and_the_workspace_is_what_the_command_computes(
    alone, tmp_path, capsys
):
    start = alone.robot.text
    alone.ask()
    await settled(alone)
    before = alone.answer.tensions
    await drag(alone, FARTHER)
    assert not np.allclose(alone.answer.tensions, before)
    with pytest.raises(CdprError, match=r"found 1000000\.0; accepted: 3 numbers"):
        await drag(alone, np.array([1e6, 0.0, 0.0]), done=True)
    await settled(alone)
    assert alone.robot.text == start
    np.testing.assert_array_equal(alone.answer.tensions, before)
    await drag(alone, THERE, done=True)
    assert alone.robot.value.cables[0].exit_point.tolist() == THERE.tolist()
    await alone.save("moved.yaml", overwrite=False)
    sketch = alone.live.sketch
    options = "--grid", ",".join(map(str, sketch.counts)), "--out", tmp_path / "own"
    computed = told(capsys, "workspace", tmp_path / "moved.yaml", *options)["workspaces"]
    assert computed["static"]["corners_m3"] == sketch.volume.value
    assert 0.0 < sketch.volume.share < 1.0


@pytest.mark.parametrize("name", ["acrobot_large", "planar", "caroca"])
@pytest.mark.parametrize("poses", [COARSE, FINE])
def test_grids_have_about_the_poses_that_are_wanted(name, poses):
    grid = sketch_grid(load_robot(name), poses)
    assert abs(grid.size / poses - 1.0) < 0.35  # counts of three axes are whole
    steps = grid.steps[grid.steps > 0.0]
    assert np.ptp(steps) < 0.2 * np.max(steps)


async def test_it_is_drawn_when_a_point_moves_and_not_before(alone, monkeypatch):
    live = alone.live
    alone.ask()
    await settled(alone)
    assert in_scene(alone, WORKSPACE, SHADER) == [False, True]  # which stays compiled
    await drag(alone, THERE)
    coarse = live.sketch
    assert (in_scene(alone), coarse.poses) == ([True], COARSE)
    with monkeypatch.context() as patch:
        patch.setattr(live_workspace, "REST", 0.0)
        await drag(alone, FARTHER)
        await until(lambda: live.sketch.poses == FINE)
    assert live.sketch.volume != coarse.volume
    assert np.prod(live.sketch.counts) > 10 * np.prod(coarse.counts)
    alone.move_to(alone.coordinates)
    await settled(alone)
    assert live.sketch.poses == FINE  # no robot has changed
    await drag(alone, THERE)
    assert (live.sketch.poses, live.sketch.volume) == (COARSE, coarse.volume)
    live.want(False)
    await drag(alone, FARTHER)
    assert in_scene(alone) == [False]
    live.want(True)
    assert in_scene(alone) == [True]


async def test_the_scene_follows_the_robot_and_has_no_workspace_of_another_one(alone):
    await drag(alone, THERE, done=True)
    alone.calculator.submit(lambda: alone.scene().meshcat.Delete(WORKSPACE)).result()
    alone.draw(lambda scene: scene.redraw())  # as after others have drawn into the scene
    alone.ask()
    await settled(alone)
    assert in_scene(alone, WORKSPACE, f"{EXITS}/7") == [True, True]
    await open_robot(alone, "planar")
    assert in_scene(alone, WORKSPACE, f"{EXITS}/2", f"{EXITS}/7") == [False, True, False]
    assert alone.live.sketch is None
    await open_robot(alone, "grab_four")
    await drag(alone, alone.robot.value.cable_set().p_WA[:, 0] + 0.01)
    assert "degrees of freedom" in alone.live.sketch.problem
    assert in_scene(alone) == [False]


async def test_of_many_robots_the_newest_is_computed_and_the_rest_dropped(user, bench, monkeypatch):
    computed = []

    def counted(robot, poses):
        computed.append((poses, robot.cables[0].exit_point[0]))
        return sketch_workspace(robot, poses)

    monkeypatch.setattr(live_workspace, "sketch_workspace", counted)
    monkeypatch.setattr(live_workspace, "REST", 0.05)
    for x in np.linspace(-0.45, -0.3, 31):
        bench.drag_point("exit", 0, np.array([x, -0.5, 1.1]), done=False)
    await until(lambda: "refined" in field(user, "live-size").text)
    coarse = [x for poses, x in computed if poses == COARSE]
    assert len(coarse) < 4
    assert coarse[-1] == pytest.approx(-0.3)
    assert computed[-1] == (FINE, coarse[-1])
    assert "% of the grid's box" in field(user, "live-size").text
    assert "limits 0 to 60 N" in field(user, "live-tensions").text
    type_into(user, "cell-cables-0-exit_point-0", "-0.35")
    await until(lambda: computed[-1] == (FINE, pytest.approx(-0.35)))
    await until(lambda: "refined" in field(user, "live-size").text)


async def test_the_scene_comes_before_the_page(alone, monkeypatch):
    order = []
    monkeypatch.setattr(RobotScene, "show_workspace", lambda *_: order.append("scene"))
    alone.answered.subscribe(lambda: order.append("numbers"))
    alone.live.changed.subscribe(lambda: order.append("size"))
    await drag(alone, THERE)
    assert order == ["scene", "size", "numbers"]


@pytest.mark.parametrize(("late", "p_W"), [(0.01, THERE), (1e3, FARTHER)])
async def test_the_page_is_busy_at_once_and_calls_numbers_old_only_when_they_are_late(
    user, bench, monkeypatch, late, p_W
):
    monkeypatch.setattr(sessions, "LATE", late)
    said, held_up, before = [], threading.Event(), bench.answer
    bench.results.changed.subscribe(lambda: said.append(bench.results.differs(POSE_NUMBERS)))
    bench.calculator.submit(held_up.wait)  # as while a kernel is compiled
    with user:
        signs = list(ElementFilter(marker="busy"))
    try:
        bench.drag_point("exit", 0, p_W, done=False)
        assert not any(sign.visible for sign in signs)  # it would flicker in the hand
        bench.move_to(bench.coordinates)
        assert [sign.visible for sign in signs] == [True, True]
        if late < 1.0:
            await until(lambda: any("before" in words for words in said))
    finally:
        held_up.set()
    await until(lambda: bench.answer is not before and not bench.is_computing)
    assert not any(sign.visible for sign in signs)
    assert not bench.results.differs(POSE_NUMBERS)
    assert any(said) == (late < 1.0)


async def test_what_a_handler_raises_is_said_and_a_mistake_is_logged(
    user, bench, monkeypatch, caplog
):
    problems = [CdprError("refused"), ValueError("odd")]
    monkeypatch.setattr(bench, "go_home", Mock(side_effect=problems))
    for number in (1, 2):
        user.find(marker="home").click()
        await until(lambda number=number: len(user.notify.messages) == number)
    assert user.notify.messages == ["refused", "ValueError: odd"]
    assert [record.msg for record in caplog.records] == problems[1:]


async def test_sliders_and_their_fields_follow_the_pose(user, bench):
    bench.move_to([0.1, *bench.coordinates[1:]])
    await until(lambda: field(user, "slider-0").value == 0.1)
    assert field(user, "coordinate-0").value == "0.1"
