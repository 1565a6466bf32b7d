"""Documents, folder and poses of a workbench, without a page."""

import json

import numpy as np
import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, OutputFolderError, RobotFileError
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_names
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.pose_answer import RobotQuestions, axis_values, pose_at, pose_axes
from cdpr_drake.studio.scene import EXITS
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.yaml_edit import with_value
from tests.models.formats.foreign_files import caspr

ROUNDING = 1e-9
"""Of coordinates, there and back [m, deg]."""


@pytest.fixture
def bench(tmp_path):
    made = Workbench(WorkingFolder(tmp_path))
    yield made
    made.calculator.close()


def moved(bench, x):
    return with_value(bench.robot.text, ("cables", 0, "exit_point", 0), x)


def test_changes_are_undone_and_done_again(bench):
    start = bench.robot.text
    bench.robot.change(moved(bench, -0.37))
    bench.robot.change(moved(bench, -0.3))
    assert bench.robot.value.cables[0].exit_point[0] == -0.3
    bench.robot.undo()
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    bench.robot.undo()
    assert bench.robot.text == start
    assert not bench.robot.can_undo
    bench.robot.redo()
    assert bench.robot.value.cables[0].exit_point[0] == -0.37
    bench.robot.change(moved(bench, -0.2))
    assert not bench.robot.can_redo


def test_a_wrong_value_changes_nothing(bench):
    before = bench.robot.text, bench.robot.value
    with pytest.raises(RobotFileError) as found:
        bench.robot.change(with_value(bench.robot.text, ("platform", "mass"), -1.0))
    assert (bench.robot.text, bench.robot.value) == before
    assert bench.robot.words(found.value) == [
        "platform.mass: found -1.0; accepted: a number > 0 and <= 1e+07 [kg]"
    ]
    assert not bench.robot.can_undo


def test_the_numbers_are_those_of_the_commands(bench, tmp_path, capsys):
    bench.robot.change(moved(bench, -0.37))
    bench.save("mine.yaml", overwrite=False)
    bench.move_to([0.1, -0.05, 0.3, 5.0, -3.0, 10.0])
    file, answer = str(tmp_path / "mine.yaml"), bench.answer
    pose = "--pose=0.1,-0.05,0.3,5,-3,10"
    main_json = []
    for arguments in (["tension", file, pose, "--json"], ["static", file, pose, "--json"]):
        with pytest.raises(SystemExit):
            main(arguments)
        main_json.append(json.loads(capsys.readouterr().out))
    tension, static = main_json
    assert answer.tensions.tolist() == tension["tensions_n"]
    assert answer.rest.tensions.tolist() == static["tensions_n"]
    assert answer.rest.frequencies.tolist() == static["frequencies_hz"]


def test_answers_say_why_there_is_none():
    robot = load_robot("acrobot_large")
    answer = RobotQuestions(robot).at(pose_at(robot, [0.55, 0.55, 1.1, 80.0, 0.0, 0.0]))
    assert answer.status == "infeasible" or answer.why_no_tensions
    assert answer.rest is None
    assert answer.why_no_rest


@pytest.mark.parametrize("name", robot_names())
def test_coordinates_of_every_robot_go_there_and_back(name):
    robot = load_robot(name)
    axes, values = pose_axes(robot), axis_values(robot, robot.home.transform())
    assert len(axes) == len(values)
    assert len(axes) >= robot.motion_type().freedom
    assert all(axis.lower <= v <= axis.upper for axis, v in zip(axes, values, strict=True))
    X_WP = pose_at(robot, values)
    assert X_WP.IsNearlyEqualTo(robot.home.transform(), 1e-9)
    np.testing.assert_allclose(axis_values(robot, X_WP), values, atol=ROUNDING)


def test_the_scene_follows_the_robot(bench):
    def has(path):
        return bench.calculator.submit(lambda: bench.scene().meshcat.HasPath(path)).result()

    bench.ask()
    assert has(f"{EXITS}/7")
    bench.open("planar")
    assert has(f"{EXITS}/2")
    assert not has(f"{EXITS}/7")


def test_points_are_dragged(bench):
    start = bench.robot.text
    bench.ask()
    before = bench.answer.tensions.copy()
    assert bench.drag_point("exit", 0, np.array([-0.4, -0.5, 1.1]), done=False) == ""
    assert bench.robot.text == start
    assert not np.allclose(bench.answer.tensions, before)
    assert bench.drag_point("exit", 0, np.array([-0.37, -0.525, 1.165]), done=True) == ""
    assert bench.robot.value.cables[0].exit_point.tolist() == [-0.37, -0.525, 1.165]
    bench.robot.undo()
    assert bench.robot.text == start
    words = bench.drag_point("exit", 0, np.array([1e6, 0.0, 0.0]), done=True)
    assert "found 1000000.0; accepted: 3 numbers" in words
    assert bench.robot.text == start
    np.testing.assert_array_equal(bench.answer.tensions, before)


def test_files_of_the_folder_are_saved_and_opened(bench, tmp_path):
    assert not bench.file
    bench.save("a.yaml", overwrite=False)
    assert bench.file == "a.yaml"
    assert bench.is_saved
    with pytest.raises(OutputFolderError, match="is there already"):
        Workbench(WorkingFolder(tmp_path)).save("a.yaml", overwrite=False)
    text = (tmp_path / "a.yaml").read_text()
    bench.robot.change(moved(bench, -0.37))
    assert not bench.is_saved
    bench.robot.undo()
    assert bench.is_saved
    bench.open("planar")
    assert not bench.file
    bench.open("a.yaml")
    assert bench.robot.text == text
    bench.robot.undo()  # the planar robot, whose file this is not
    assert not bench.file


@pytest.mark.parametrize(
    "name", ["../out.yaml", "/tmp/out.yaml", "link/out.yaml", "", "a\0b.yaml", "a/../../b.yaml"]
)
def test_nothing_leads_out_of_the_folder(bench, tmp_path, name):
    (tmp_path / "link").symlink_to("/tmp")
    for action in (lambda: bench.save(name, True), lambda: bench.open(name)):
        with pytest.raises(CdprError):
            action()


def test_a_full_disk_is_said_and_leaves_nothing(bench, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    with pytest.raises(OutputFolderError, match="No space left"):
        bench.save("a.yaml", overwrite=False)
    assert not list(tmp_path.iterdir())
    assert not bench.file


def test_foreign_files_are_uploaded(bench, tmp_path):
    bodies = caspr(tmp_path)
    files = {path.name: path.read_bytes() for path in tmp_path.glob("*.xml")}
    opened = bench.upload(files)
    assert bodies.name in files
    assert "CASPR" in opened.notes[0]
    assert bench.robot.value.name == "toy"
    assert len(bench.robot.value.cables) == 8
    assert not bench.file
    assert parse_robot(bench.robot.text, tmp_path / "toy.yaml").name == "toy"


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
        (
            {"m.sdf": b"<sdf><model><include><uri>../../x</uri></include></model></sdf>"},
            "elsewhere",
        ),
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
