"""Documents, folder and poses of a workbench, without a page."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product
from unittest.mock import Mock

import numpy as np
import pytest

from cdpr_drake.errors import CdprError, OutputFolderError, RobotFileError
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.studio.document import with_value
from cdpr_drake.studio.files import WorkingFolder
from cdpr_drake.studio.pose import answer_html
from cdpr_drake.studio.pose_answer import PoseAnswer, RobotQuestions
from cdpr_drake.studio.scene import R_EW, look_at_robot
from cdpr_drake.studio.session import Workbench
from tests.cli.commands import told
from tests.studio.pages import settled

ROUNDING = 1e-9
"""Of coordinates, there and back [m, deg]."""

APART = 2.0 / 300.0
"""Exit points are at least so far apart, of half a window: about 2 px."""


@pytest.fixture(scope="module")
def calculator():
    with ThreadPoolExecutor(1) as made:
        yield made


@pytest.fixture
def bench(tmp_path, calculator):
    return Workbench(WorkingFolder(tmp_path), calculator=calculator)


def move(bench, x):
    bench.robot.change(with_value(bench.robot.text, ("cables", 0, "exit_point", 0), x))


def test_changes_are_undone_and_done_again(bench):
    robot, texts = bench.robot, [bench.robot.text]
    for x in (-0.37, -0.3):
        move(bench, x)
        texts.append(robot.text)
    for step, number in ((robot.undo, 1), (robot.undo, 0), (robot.redo, 1)):
        step()
        assert robot.text == texts[number]
        assert (robot.can_undo, robot.can_redo) == (number > 0, True)
    move(bench, -0.2)
    assert not robot.can_redo


async def test_the_numbers_are_those_of_the_commands(bench, tmp_path, capsys):
    move(bench, -0.37)
    await bench.save("mine.yaml", overwrite=False)
    bench.move_to([0.1, -0.05, 0.3, 5.0, -3.0, 10.0])
    await settled(bench)
    where = tmp_path / "mine.yaml", "--pose=0.1,-0.05,0.3,5,-3,10"
    html, tensions = answer_html(bench.answer, bench.command_name), bench.answer.tensions
    assert tensions.tolist() == told(capsys, "tension", *where)["tensions_n"]
    assert all(f"</div></td><td>{tension:.2f}</td>" in html for tension in tensions)
    assert "cdpr tension mine.yaml --pose=0.1,-0.05,0.3,5,-3,10 --method=" in html
    static, rest = told(capsys, "static", *where), bench.answer.rest
    assert rest.tensions.tolist() == static["tensions_n"]
    assert rest.frequencies.tolist() == static["frequencies_hz"]


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


async def test_a_file_is_that_of_a_robot_while_it_has_its_text(bench, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        full = OSError(28, "No space left on device")
        patch.setattr("pathlib.Path.replace", Mock(side_effect=full))
        with pytest.raises(OutputFolderError, match="No space left"):
            await bench.save("a.yaml", overwrite=False)
    assert (bench.file, list(tmp_path.iterdir())) == ("", [])
    await bench.save("a.yaml", overwrite=False)
    assert (bench.file, bench.state) == ("a.yaml", "saved")
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
        ({"a.yaml": b"x: ["}, "YAML"),
        ({"a.yaml": b"!!python/object/apply:os.system ['touch /tmp/x']"}, "mapping"),
        ({"a.csv": b"x"}, "ending"),
        ({"a.xml": b"<a"}, "XML"),
        ({"../a.yaml": b"name: x"}, "missing"),
        ({"a.yaml": b"#" * 300_000}, "bytes"),
        ({"a.xml": b"#" * 5_000_000}, "bytes"),
        ({"m.xml": b"<mujoco><include file='/etc/passwd'/></mujoco>"}, "elsewhere"),
        ({"m.sdf": b"<sdf><include><uri>../../x</uri></include></sdf>"}, "elsewhere"),
    ],
)
def test_wrong_files_are_refused_in_words(bench, files, words):
    with pytest.raises(CdprError, match=words):
        bench.files.upload(files)


def test_a_mesh_elsewhere_is_refused(bench):
    shape = {"kind": "mesh", "file": "/usr/share/x.obj"}
    with pytest.raises(RobotFileError, match="outside of the working folder"):
        bench.robot.change(with_value(bench.robot.text, ("platform", "shape"), shape))
