"""A workbench without a page: documents, folder, poses, scene, and the workspace that follows."""

from itertools import product
from unittest.mock import Mock

import numpy as np
import pytest

from cdpr_drake.analyses.tensions import solve_tensions
from cdpr_drake.errors import CdprError, OutputFolderError
from cdpr_drake.models.robot_loader import load_robot, robot_names, robot_text
from cdpr_drake.studio import live_workspace
from cdpr_drake.studio.document import with_value
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.live_workspace import COARSE, FINE, sketch_grid
from cdpr_drake.studio.numbers import robots_side_by_side
from cdpr_drake.studio.pose import answer_html
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions
from cdpr_drake.studio.scene import EXITS, R_EW, SHADER, WORKSPACE, RobotScene, look_at_robot
from cdpr_drake.studio.session import Workbench
from tests.cli.commands import told
from tests.studio.pages import in_scene, settled, until

ROUNDING = 1e-9
"""Of coordinates, there and back [m, deg]."""

APART = 2.0 / 300.0
"""Exit points are at least so far apart, of half a window: about 2 px."""

THERE, FARTHER = np.array([-0.4, -0.5, 1.1]), np.array([-0.3, -0.5, 1.1])
"""Places for the first exit point of acrobot_large [m]."""

SHAPE = {"kind": "mesh", "file": "/usr/share/x.obj"}
OF_A_MESH = with_value(robot_text("planar"), ("platform", "shape"), SHAPE)


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """One whose workspace is not refined."""
    monkeypatch.setattr(live_workspace, "REST", 1e6)
    return Workbench(WorkingFolder(tmp_path))


async def drag(bench, p_W, done=False):
    bench.drag_point("exit", 0, p_W, done=done)
    await settled(bench)


async def test_a_point_is_dragged_and_the_numbers_are_those_of_the_commands(
    bench, tmp_path, capsys
):
    bench.move_to([0.1, -0.05, 0.3, 5.0, -3.0, 10.0])
    await settled(bench)
    start, before = bench.robot.text, bench.answer.tensions
    await drag(bench, FARTHER)
    assert not np.allclose(bench.answer.tensions, before)
    with pytest.raises(CdprError, match=r"found 1000000\.0; accepted: 3 numbers"):
        await drag(bench, np.array([1e6, 0.0, 0.0]), done=True)
    await settled(bench)
    assert bench.robot.text == start
    np.testing.assert_array_equal(bench.answer.tensions, before)
    await drag(bench, THERE, done=True)
    assert bench.robot.value.cables[0].exit_point.tolist() == THERE.tolist()
    await bench.save("mine.yaml", overwrite=False)
    await settled(bench)
    where = tmp_path / "mine.yaml", "--pose=0.1,-0.05,0.3,5,-3,10"
    html = answer_html(bench.answer, bench.command_name)
    answer, sketch = bench.answer, bench.live.sketch
    assert answer.tensions.tolist() == told(capsys, "tension", *where)["tensions_n"]
    assert all(f"</div></td><td>{tension:.2f}</td>" in html for tension in answer.tensions)
    assert "cdpr tension mine.yaml --pose=0.1,-0.05,0.3,5,-3,10 --method=" in html
    static = told(capsys, "static", *where)
    assert answer.rest.tensions.tolist() == static["tensions_n"]
    assert answer.rest.frequencies.tolist() == static["frequencies_hz"]
    options = "--grid", ",".join(map(str, sketch.counts)), "--out", tmp_path / "own"
    computed = told(capsys, "workspace", where[0], *options)["workspaces"]
    assert computed["static"]["corners_m3"] == sketch.volume.value
    assert 0.0 < sketch.volume.share < 1.0


def test_answers_say_why_there_is_none():
    about = RobotQuestions(load_robot("acrobot_large"))
    answer = PoseAnswer(about, about.pose([0.55, 0.55, 1.1, 80.0, 0.0, 0.0]))
    assert answer.status == "infeasible" or answer.why_no_tensions
    assert answer.rest is None
    assert answer.why_no_rest


@pytest.mark.parametrize("name", robot_names())
def test_coordinates_of_every_robot_go_there_and_back(name):
    about = RobotQuestions(load_robot(name))
    home = about.robot.home.transform()
    values = about.coordinates(home)
    assert len(about.axes) == len(values) >= about.robot.motion_type().freedom
    assert all(axis.lower <= v <= axis.upper for axis, v in zip(about.axes, values, strict=True))
    assert about.pose(values).IsNearlyEqualTo(home, ROUNDING)
    moved = [value + 0.1 for value in values]
    np.testing.assert_allclose(about.coordinates(about.pose(moved)), moved, atol=ROUNDING)


@pytest.mark.parametrize("name", robot_names())
def test_the_scene_shows_all_of_a_robot_whatever_its_size(name):
    robot, meshcat = load_robot(name), Mock()
    look_at_robot(meshcat, robot)
    p_WE, _ = meshcat.SetCameraPose.call_args.args
    lens = dict(call.args[1:] for call in meshcat.SetProperty.call_args_list)
    exits = np.unique(robot.cable_set().p_WA.T, axis=0)
    frame = np.array(list(product(*zip(robot.frame.lower, robot.frame.upper, strict=True))))
    p = (np.concatenate([exits, frame]) - p_WE) @ R_EW.T
    window = -p[:, :2] / p[:, 2:] / np.tan(np.radians(lens["fov"] / 2.0))
    sizes = np.max(np.abs(window), axis=0) / (1.25, 1.0)  # the window is wider than high
    assert 0.85 < np.max(sizes) < 0.95
    assert lens["near"] < np.min(-p[:, 2]) < np.max(-p[:, 2]) < lens["far"]
    apart = np.linalg.norm(window[: len(exits), np.newaxis] - window[: len(exits)], axis=2)
    assert np.min(apart + 10.0 * np.eye(len(exits))) > APART


def test_of_two_robots_only_fields_that_differ_are_there_with_axes_units_and_differences():
    one, other = load_robot("acrobot_small"), load_robot("acrobot_small")
    assert [pair.difference for pair in robots_side_by_side(one, other)] == 6 * [0.0]
    other.cables[2].exit_point[1] += 0.02
    other.platform.mass *= 2.0
    pairs = robots_side_by_side(one, other)
    at_home = {pair.name: pair.one for pair in pairs if pair.name.startswith("at home: ")}
    tensions = solve_tensions(one, one.home.transform()).tensions
    assert at_home["at home: largest tension [N]"] == max(tensions)
    differences = {pair.name: pair.difference for pair in pairs if pair.name not in at_home}
    assert differences == pytest.approx(
        {"cables 3 exit point y [m]": 0.02, "platform mass [kg]": one.platform.mass}
    )


async def test_a_file_is_that_of_a_robot_while_it_has_its_text(bench, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        full = OSError(28, "No space left on device")
        patch.setattr("pathlib.Path.replace", Mock(side_effect=full))
        with pytest.raises(OutputFolderError, match="No space left"):
            await bench.save("a.yaml", overwrite=False)
    assert (bench.file, list(tmp_path.iterdir())) == ("", [])
    await bench.save("a.yaml", overwrite=False)
    bench.take_opened(bench.files.open("planar"))
    assert not bench.file
    bench.take_opened(bench.files.open("a.yaml"))
    assert (bench.file, bench.robot.text) == ("a.yaml", (tmp_path / "a.yaml").read_text())
    bench.robot.undo()  # the planar robot, whose file this is not
    assert not bench.file
    bench.take_opened(bench.files.upload({"a.yaml": (tmp_path / "a.yaml").read_bytes()}))
    assert not bench.file  # what was uploaded is not what the folder has


@pytest.mark.parametrize(
    "name", ["../out.yaml", "/tmp/out.yaml", "link/out.yaml", "", "a\0b.yaml", "a/../../b.yaml"]
)
async def test_nothing_leads_out_of_the_folder(bench, tmp_path, name):
    (tmp_path / "link").symlink_to("/tmp")
    with pytest.raises(CdprError):
        await bench.save(name, True)
    with pytest.raises(CdprError):
        bench.files.open(name)


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, "found 0 files"),
        ({"a.txt": b"x"}, "ending"),
        ({"a.yaml": b"\xff\xfe"}, "cannot be read"),
        ({"a.yaml": b"!!python/object/apply:os.system ['touch /tmp/x']"}, "mapping"),
        ({"a.csv": b"x"}, "ending"),
        ({"../a.yaml": b"name: x"}, "missing"),
        ({".a.yaml": b"name: x"}, "the name of a file"),
        ({"a\0.yaml": b"name: x"}, "the name of a file"),
        ({"a.yaml": b"#" * 300_000}, "bytes"),
        ({"a.xml": b"#" * 5_000_000}, "bytes"),
        ({"a.yaml": OF_A_MESH.encode()}, "outside of the working folder"),
        ({"m.xml": b"<mujoco><include file='/etc/passwd'/></mujoco>"}, "elsewhere"),
        ({"m.sdf": b"<sdf><include><uri>../../x</uri></include></sdf>"}, "elsewhere"),
    ],
)
def test_wrong_files_are_refused_in_words(bench, files, words):
    with pytest.raises(CdprError, match=words):
        bench.files.upload(files)


@pytest.mark.parametrize("name", ["acrobot_large", "planar", "caroca"])
@pytest.mark.parametrize("poses", [COARSE, FINE])
def test_grids_have_about_the_poses_that_are_wanted(name, poses):
    grid = sketch_grid(load_robot(name), poses)
    assert abs(grid.size / poses - 1.0) < 0.35  # counts of three axes are whole
    steps = grid.steps[grid.steps > 0.0]
    assert np.ptp(steps) < 0.2 * np.max(steps)


async def test_a_workspace_is_drawn_when_a_point_moves_and_not_before(bench, monkeypatch):
    live, order = bench.live, []
    bench.ask()
    await settled(bench)
    # The shader's triangle, so that it stays compiled.
    assert [in_scene(bench, path) for path in (WORKSPACE, SHADER)] == [False, True]
    await drag(bench, THERE)
    coarse = live.sketch
    assert (in_scene(bench, WORKSPACE), coarse.poses) == (True, COARSE)
    with monkeypatch.context() as patch:
        patch.setattr(live_workspace, "REST", 0.0)
        await drag(bench, FARTHER)
        await until(lambda: live.sketch.poses == FINE)
    assert live.sketch.volume != coarse.volume
    assert np.prod(live.sketch.counts) > 10 * np.prod(coarse.counts)
    bench.move_to(bench.coordinates)
    await settled(bench)
    assert live.sketch.poses == FINE  # no robot has changed
    await drag(bench, THERE)
    assert (live.sketch.poses, live.sketch.volume) == (COARSE, coarse.volume)
    live.want(False)
    await drag(bench, FARTHER)
    assert not in_scene(bench, WORKSPACE)
    live.want(True)
    assert in_scene(bench, WORKSPACE)
    await until(lambda: live.sketch is not None)
    monkeypatch.setattr(RobotScene, "show_workspace", lambda *_: order.append("scene"))
    bench.answered.subscribe(lambda: order.append("numbers"))
    live.changed.subscribe(lambda: order.append("size"))
    await drag(bench, THERE)
    assert order == ["scene", "size", "numbers"]


async def test_the_scene_follows_the_robot_and_has_no_workspace_of_another_one(bench):
    await drag(bench, THERE, done=True)
    bench.draw(lambda scene: (scene.meshcat.Delete(WORKSPACE), scene.redraw()))  # as others do
    bench.ask()
    await settled(bench)
    assert all(in_scene(bench, path) for path in (WORKSPACE, f"{EXITS}/7"))
    bench.take_opened(bench.files.open("planar"))
    await settled(bench)
    there = [in_scene(bench, path) for path in (WORKSPACE, f"{EXITS}/2", f"{EXITS}/7")]
    assert there == [False, True, False]
    assert bench.live.sketch is None
    bench.take_opened(bench.files.open("grab_four"))
    await settled(bench)
    await drag(bench, bench.robot.value.cable_set().p_WA[:, 0] + 0.01)
    assert "degrees of freedom" in bench.live.sketch.problem
    assert not in_scene(bench, WORKSPACE)
