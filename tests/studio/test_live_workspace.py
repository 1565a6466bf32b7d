"""The static workspace that follows a robot while it is changed, and points that are dragged."""

import json
import threading

import numpy as np
import pytest
from nicegui import ElementFilter

from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.studio import live_workspace
from cdpr_drake.studio import session as sessions
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.live_workspace import COARSE, FINE, sketch_grid, sketch_workspace
from cdpr_drake.studio.scene import SHADER, WORKSPACE, RobotScene
from cdpr_drake.studio.session import POSE_NUMBERS, Workbench
from tests.studio.pages import field, settled, type_into, until

ROBOT = "acrobot_large"

THERE, FARTHER = np.array([-0.4, -0.5, 1.1]), np.array([-0.3, -0.5, 1.1])
"""Places for the first exit point of acrobot_large [m]."""

SHARE_OF_COUNT = 0.35
"""By which a grid may have more or fewer poses than it shall: counts of three axes are whole."""


@pytest.fixture(scope="module")
def calculator():
    made = sessions.Calculator()
    yield made
    made.close()


@pytest.fixture
def alone(tmp_path, calculator, monkeypatch):
    """A workbench without a page, whose workspace is refined when it is asked for."""
    monkeypatch.setattr(live_workspace, "REST", 1e6)
    return Workbench(WorkingFolder(tmp_path), calculator=calculator)


def in_scene(bench, path=WORKSPACE):
    return bench.calculator.submit(lambda: bench.scene().meshcat.HasPath(path)).result()


async def drag(bench, p_W, done=False):
    bench.drag_point("exit", 0, p_W, done=done)
    await settled(bench)


async def test_a_sketch_is_what_the_command_computes(alone, tmp_path, capsys):
    await drag(alone, THERE, done=True)
    alone.save("moved.yaml", overwrite=False)
    sketch = alone.live.sketch
    grid = ",".join(str(count) for count in sketch.counts)
    with pytest.raises(SystemExit):
        main(["workspace", str(tmp_path / "moved.yaml"), "--grid", grid, "--json",
              "--out", str(tmp_path / "own")])  # fmt: skip
    told = json.loads(capsys.readouterr().out)["workspaces"]["static"]
    assert told["corners_m3"] == sketch.volume.value
    assert 0.0 < sketch.volume.share < 1.0


@pytest.mark.parametrize("name", ["acrobot_large", "planar", "caroca"])
@pytest.mark.parametrize("poses", [COARSE, FINE])
def test_grids_have_about_the_poses_that_are_wanted(name, poses):
    grid = sketch_grid(load_robot(name), poses)
    assert abs(grid.size / poses - 1.0) < SHARE_OF_COUNT
    steps = grid.steps[grid.steps > 0.0]
    assert np.ptp(steps) < 0.2 * np.max(steps)


async def test_it_is_drawn_when_a_point_moves_and_not_before(alone):
    assert not in_scene(alone)
    await drag(alone, THERE)
    assert in_scene(alone)
    coarse = alone.live.sketch
    assert not alone.live.is_fine
    await drag(alone, FARTHER)
    assert alone.live.sketch.volume != coarse.volume
    await alone.live.refine()
    assert alone.live.is_fine
    assert np.prod(alone.live.sketch.counts) > 10 * np.prod(coarse.counts)
    alone.move_to(alone.coordinates)
    await settled(alone)
    assert alone.live.is_fine  # no robot has changed
    await drag(alone, THERE)
    assert not alone.live.is_fine
    assert alone.live.sketch.volume == coarse.volume
    alone.live.want(False)
    await drag(alone, FARTHER)
    assert not in_scene(alone)
    assert in_scene(alone, SHADER)  # which stays compiled
    alone.live.want(True)
    assert in_scene(alone)


async def test_a_changed_value_has_it_follow_and_another_robot_takes_it_away(alone):
    await drag(alone, THERE, done=True)
    assert alone.live.sketch.volume == sketch_workspace(alone.robot.value, COARSE).volume
    alone.calculator.submit(lambda: alone.scene().meshcat.Delete(WORKSPACE)).result()
    alone.draw(lambda scene: scene.redraw())  # as after others have drawn into the scene
    alone.ask()
    await settled(alone)
    assert in_scene(alone)
    alone.open("acrobot_small")
    await settled(alone)
    assert not in_scene(alone)
    assert alone.live.sketch is None


async def test_a_robot_without_a_static_workspace_says_why(alone):
    alone.open("grab_four")
    await drag(alone, alone.robot.value.cable_set().p_WA[:, 0] + 0.01)
    assert "degrees of freedom" in alone.live.problem
    assert not in_scene(alone)


async def test_of_many_robots_the_newest_is_computed_and_the_rest_dropped(held, user, monkeypatch):
    computed, bench = [], held.bench

    def counted(robot, poses):
        computed.append((poses, robot.cables[0].exit_point[0]))
        return sketch_workspace(robot, poses)

    monkeypatch.setattr(live_workspace, "sketch_workspace", counted)
    monkeypatch.setattr(live_workspace, "REST", 0.05)
    places = np.linspace(-0.45, -0.3, 31)
    for x in places:
        bench.drag_point("exit", 0, np.array([x, -0.5, 1.1]), done=False)
    await until(lambda: bench.live.is_fine)
    coarse = [x for poses, x in computed if poses == COARSE]
    assert len(coarse) < 4
    assert coarse[-1] == pytest.approx(places[-1])
    assert computed[-1] == (FINE, coarse[-1])
    words = field(user, "live-size").text
    assert "refined" in words
    assert "% of the grid's box" in words
    assert "limits 0 to 60 N" in field(user, "live-tensions").text
    type_into(user, "cell-cables-0-exit_point-0", "-0.35")
    await until(lambda: computed[-1][1] == pytest.approx(-0.35))
    await until(lambda: "refined" in field(user, "live-size").text)


async def test_the_scene_comes_before_the_page(alone, monkeypatch):
    order, show_workspace = [], RobotScene.show_workspace

    def shown(scene, solid):
        show_workspace(scene, solid)
        order.append("scene")

    monkeypatch.setattr(RobotScene, "show_workspace", shown)
    alone.answered.subscribe(lambda: order.append("numbers"))
    alone.live.changed.subscribe(lambda: order.append("size"))
    await drag(alone, THERE)
    assert order == ["scene", "size", "numbers"]


@pytest.mark.parametrize(("late", "p_W"), [(0.01, THERE), (1e3, FARTHER)])
async def test_the_page_is_busy_at_once_and_calls_numbers_old_only_when_they_are_late(
    held, user, monkeypatch, late, p_W
):
    monkeypatch.setattr(sessions, "LATE", late)
    bench, said, held_up = held.bench, [], threading.Event()
    bench.results.changed.subscribe(lambda: said.append(bench.results.differs(POSE_NUMBERS)))
    bench.calculator.submit(held_up.wait)  # as while a kernel is compiled
    before = bench.answer
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
