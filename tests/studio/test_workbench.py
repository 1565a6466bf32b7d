"""Documents, folder and poses of a workbench, without a page."""

import json
from itertools import product

import numpy as np
import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, OutputFolderError, RobotFileError
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_names
from cdpr_drake.studio.calculator import Calculator
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.pose import answer_html
from cdpr_drake.studio.pose_answer import PoseCoordinates, RobotQuestions
from cdpr_drake.studio.scene import EXITS, R_EW, look_at_robot
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.yaml_edit import with_value
from tests.models.formats.foreign_files import caspr
from tests.studio.pages import settled

ROUNDING = 1e-9
"""Of coordinates, there and back [m, deg]."""

APART = 2.0 / 300.0
"""Exit points are at least so far apart, of half a window: about 2 px."""


@pytest.fixture(scope="module")
def calculator():
    made = Calculator()
    yield made
    made.close()


@pytest.fixture
def bench(tmp_path, calculator):
    return Workbench(WorkingFolder(tmp_path), calculator=calculator)


def move(bench, x):
    bench.robot.change(with_value(bench.robot.text, ("cables", 0, "exit_point", 0), x))


def place(bench):
    return bench.robot.value.cables[0].exit_point[0]


def test_changes_are_undone_and_done_again_and_wrong_ones_change_nothing(bench):
    start = bench.robot.text
    move(bench, -0.37)
    move(bench, -0.3)
    bench.robot.undo()
    assert place(bench) == -0.37
    bench.robot.undo()
    assert bench.robot.text == start
    assert not bench.robot.can_undo
    bench.robot.redo()
    assert place(bench) == -0.37
    move(bench, -0.2)
    assert not bench.robot.can_redo
    before = bench.robot.text, bench.robot.value
    with pytest.raises(RobotFileError) as refusal:
        bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), -1.0))
    assert (bench.robot.text, bench.robot.value) == before
    assert bench.robot.words(refusal.value) == [
        "platform.mass: found -1.0; accepted: a number > 0 and <= 1e+07 [kg]"
    ]


async def test_the_numbers_are_those_of_the_commands(bench, tmp_path, capsys):
    move(bench, -0.37)
    bench.save("mine.yaml", overwrite=False)
    bench.move_to([0.1, -0.05, 0.3, 5.0, -3.0, 10.0])
    await settled(bench)
    answers = {}
    for command in ("tension", "static"):
        with pytest.raises(SystemExit):
            main([command, str(tmp_path / "mine.yaml"), "--pose=0.1,-0.05,0.3,5,-3,10", "--json"])
        answers[command] = json.loads(capsys.readouterr().out)
    assert bench.answer.tensions.tolist() == answers["tension"]["tensions_n"]
    html = answer_html(bench.answer, bench.command_name)
    assert all(f"</div></td><td>{tension:.2f}</td>" in html for tension in bench.answer.tensions)
    assert "cdpr tension mine.yaml --pose=0.1,-0.05,0.3,5,-3,10 --method=" in html
    assert bench.answer.rest.tensions.tolist() == answers["static"]["tensions_n"]
    assert bench.answer.rest.frequencies.tolist() == answers["static"]["frequencies_hz"]


def test_answers_say_why_there_is_none():
    robot = load_robot("acrobot_large")
    far = PoseCoordinates(robot).pose([0.55, 0.55, 1.1, 80.0, 0.0, 0.0])
    answer = RobotQuestions(robot).at(far)
    assert answer.status == "infeasible" or answer.why_no_tensions
    assert answer.rest is None
    assert answer.why_no_rest


@pytest.mark.parametrize("name", robot_names())
def test_coordinates_of_every_robot_go_there_and_back(name):
    robot = load_robot(name)
    coordinates, home = PoseCoordinates(robot), robot.home.transform()
    axes, values = coordinates.axes, coordinates.values(home)
    assert len(axes) == len(values) >= robot.motion_type().freedom
    assert all(axis.lower <= v <= axis.upper for axis, v in zip(axes, values, strict=True))
    assert coordinates.pose(values).IsNearlyEqualTo(home, ROUNDING)
    moved = [value + 0.1 for value in values]
    np.testing.assert_allclose(coordinates.values(coordinates.pose(moved)), moved, atol=ROUNDING)


class Eye:
    """In place of Meshcat: where it is told to look from."""

    def SetCameraPose(self, p_WE, p_WT):
        self.p_WE, self.p_WT = p_WE, p_WT

    def SetProperty(self, path, name, value):
        setattr(self, name, value)


@pytest.mark.parametrize("name", robot_names())
def test_the_scene_shows_all_of_a_robot_whatever_its_size(name):
    robot, eye = load_robot(name), Eye()
    look_at_robot(eye, robot)
    exits = np.unique(robot.cable_set().p_WA.T, axis=0)
    frame = np.array(list(product(*zip(robot.frame.lower, robot.frame.upper, strict=True))))
    p = (np.concatenate([exits, frame]) - eye.p_WE) @ R_EW.T
    seen = -p[:, :2] / p[:, 2:] / np.tan(np.radians(eye.fov / 2.0))
    sizes = np.max(np.abs(seen), axis=0) / (1.25, 1.0)  # the window is wider than high
    assert 0.85 < np.max(sizes) < 0.95
    assert eye.near < np.min(-p[:, 2]) < np.max(-p[:, 2]) < eye.far
    apart = np.linalg.norm(seen[: len(exits), np.newaxis] - seen[: len(exits)], axis=2)
    assert np.min(apart + 10.0 * np.eye(len(exits))) > APART


async def test_the_scene_follows_the_robot(bench):
    def has(path):
        return bench.calculator.submit(lambda: bench.scene().meshcat.HasPath(path)).result()

    bench.ask()
    await settled(bench)
    assert has(f"{EXITS}/7")
    bench.open("planar")
    await settled(bench)
    assert has(f"{EXITS}/2")
    assert not has(f"{EXITS}/7")


async def test_points_are_dragged(bench):
    start = bench.robot.text
    bench.ask()
    await settled(bench)
    before = bench.answer.tensions.copy()
    assert bench.drag_point("exit", 0, np.array([-0.4, -0.5, 1.1]), done=False) == ""
    assert bench.robot.text == start
    await settled(bench)
    assert not np.allclose(bench.answer.tensions, before)
    assert bench.drag_point("exit", 0, np.array([-0.37, -0.525, 1.165]), done=True) == ""
    assert bench.robot.value.cables[0].exit_point.tolist() == [-0.37, -0.525, 1.165]
    bench.robot.undo()
    words = bench.drag_point("exit", 0, np.array([1e6, 0.0, 0.0]), done=True)
    assert "found 1000000.0; accepted: 3 numbers" in words
    assert bench.robot.text == start
    await settled(bench)
    np.testing.assert_array_equal(bench.answer.tensions, before)


def test_files_of_the_folder_are_saved_and_opened(bench, tmp_path, monkeypatch):
    assert not bench.file
    with monkeypatch.context() as patch:
        patch.setattr("pathlib.Path.replace", full_disk)
        with pytest.raises(OutputFolderError, match="No space left"):
            bench.save("a.yaml", overwrite=False)
    assert not list(tmp_path.iterdir())
    bench.save("a.yaml", overwrite=False)
    assert (bench.file, bench.is_saved) == ("a.yaml", True)
    with pytest.raises(OutputFolderError, match="is there already"):
        Workbench(WorkingFolder(tmp_path)).save("a.yaml", overwrite=False)
    text = (tmp_path / "a.yaml").read_text()
    move(bench, -0.37)
    assert not bench.is_saved
    bench.robot.undo()
    assert bench.is_saved
    bench.open("planar")
    assert not bench.file
    bench.open("a.yaml")
    assert bench.robot.text == text
    bench.robot.undo()  # the planar robot, whose file this is not
    assert not bench.file
    bench.upload({"a.yaml": text.encode()})
    assert not bench.file  # what was uploaded is not what the folder has


def full_disk(*_):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    "name", ["../out.yaml", "/tmp/out.yaml", "link/out.yaml", "", "a\0b.yaml", "a/../../b.yaml"]
)
def test_nothing_leads_out_of_the_folder(bench, tmp_path, name):
    (tmp_path / "link").symlink_to("/tmp")
    for action in (lambda: bench.save(name, True), lambda: bench.open(name)):
        with pytest.raises(CdprError):
            action()


def test_foreign_files_are_uploaded(bench, tmp_path):
    caspr(tmp_path)
    opened = bench.upload({path.name: path.read_bytes() for path in tmp_path.glob("*.xml")})
    assert "CASPR" in opened.notes[0]
    assert (bench.robot.value.name, len(bench.robot.value.cables)) == ("toy", 8)
    assert not bench.file
    assert parse_robot(bench.robot.text, tmp_path / "toy.yaml").name == "toy"


SDF = b"<sdf><model><include><uri>../../x</uri></include></model></sdf>"


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
        ({"m.sdf": SDF}, "elsewhere"),
    ],
)
def test_wrong_files_are_refused_in_words(bench, files, words):
    before = bench.robot.text
    with pytest.raises(CdprError, match=words):
        bench.upload(files)
    assert bench.robot.text == before


def test_a_mesh_elsewhere_is_refused(bench):
    shape = {"kind": "mesh", "file": "/usr/share/x.obj"}
    with pytest.raises(RobotFileError, match="outside of the working folder"):
        bench.robot.change(with_value(bench.robot.text, ("platform", "shape"), shape))
