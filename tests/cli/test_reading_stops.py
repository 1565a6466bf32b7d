"""Commands refuse in one line what would stop a reader, or the program."""

import os

import pytest

from cdpr_drake.analyses.logs.log_request import LogRequest
from cdpr_drake.analyses.logs.motive import read_motive
from cdpr_drake.cli import main
from cdpr_drake.errors import LogFileError, RobotFileError
from cdpr_drake.models.formats.grab import read_grab
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.scenarios.files import resolve_robot_path
from tests.analyses.logs import recorders
from tests.messages import printed
from tests.models.test_drake_parsing import urdf
from tests.schema.test_hostile_text import BOMB, LONG

FILES = {
    "bomb.yaml": (BOMB + "points: *a9\nplatform: *a9\n", "more than 100,000 keys"),
    "belts.yaml": (BOMB + "kinematics: *a9\n", "more than 100,000 keys"),
    "long.json": (f'{{"a": {LONG}}}', "more than 300 digits"),
    "deep.json": ("[" * 5000, "nested more than 100 deep"),
    "flat.urdf": (urdf('<box size="0 0 0"/>'), "Drake cannot read it"),
    "name.urdf": (
        urdf('<box size="1 1 1"/>').replace('"two"', f'"{"n" * 300}"'),
        "1 to 64 letters",
    ),
    "entities.urdf": (
        "<!DOCTYPE z [<!ENTITY a0 'lol'>"
        + "".join(f"<!ENTITY a{k} '{f'&a{k - 1};' * 10}'>" for k in range(1, 10))
        + "]><robot><link>&a9;</link></robot>",
        "not well-formed XML|cannot read",
    ),
}


@pytest.mark.parametrize("name", sorted(FILES))
@pytest.mark.parametrize("command", ["check", "import", "tension"])
def test_commands_say_a_line(command, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    content, words = FILES[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(SystemExit) as end:
        main([command, name])
    out, err = printed(capsys)
    assert end.value.code == 2
    said = out + err
    assert any(each in said for each in words.split("|"))
    assert all(name in line for line in said.strip().split("\n"))
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("lost", ["Position,Position,Position", "X,Y,Z,W", "Rotation,"])
def test_a_motive_log_without_a_column_names_it(lost, tmp_path):
    text = recorders.motive(40, units="Meters")
    assert lost in text
    file = tmp_path / "take.csv"
    other = lost.replace("X", "W").replace("Pos", "Dis").replace("Rot", "Mot")
    file.write_text(text.replace(lost, other, 1))
    with pytest.raises(LogFileError, match="accepted"):
        read_motive(file, LogRequest())


def test_names_that_no_system_takes_are_unknown(tmp_path):
    for name in ("n" * 300, "n" * 300 + ".yaml", "a\0b.yaml", f"{'n' * 300}/robot.yaml"):
        with pytest.raises(RobotFileError):
            load_robot(name)
        assert resolve_robot_path(tmp_path / "scenario.yaml", name)


def test_numbers_without_sense_are_refused_before_they_are_squared(tmp_path):
    file = tmp_path / "robot.json"
    file.write_text('{"platform": {"mass": 1e300}, "actuators": []}')
    with pytest.raises(RobotFileError):
        read_grab(file)


@pytest.mark.parametrize(
    "words",
    [
        ["plan", "acrobot_large", "--path", "long.csv"],
        ["calibrate", "acrobot_small", "long.csv"],
        ["import-log", "long.csv", "--log-format", "csv"],
        ["import", "long.csv"],
    ],
    ids=["plan", "calibrate", "import-log", "import"],
)
def test_cells_that_are_too_long_are_a_line(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "long.csv").write_text("time_s,C1_length_m,x_m\n0,1," + "9" * 200_000 + "\n")
    with pytest.raises(SystemExit) as end:
        main(words)
    out, err = printed(capsys)
    assert end.value.code == 2
    assert "Traceback" not in out + err
    assert "long.csv" in err
    assert len(err.strip().split("\n")) == 1


@pytest.mark.parametrize("name", ["pipe.yaml", "pipe.csv", "pipe.urdf", "pipe.mat", "pipe"])
@pytest.mark.parametrize("command", ["check", "import", "import-log", "tension", "simulate"])
def test_pipes_are_not_waited_for(command, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    os.mkfifo(name)
    with pytest.raises(SystemExit) as end:
        main([command, name])
    out, err = printed(capsys)
    assert end.value.code == 2
    assert name in out + err


def test_devices_are_not_read_to_their_end(monkeypatch, capsys):
    for words in (["check", "/dev/zero"], ["import-log", "/dev/zero"], ["calibrate", "planar",
                  "/dev/zero"], ["import-log", "x", "--mapping", "/dev/zero"]):  # fmt: skip
        with pytest.raises(SystemExit) as end:
            main(words)
        assert end.value.code == 2
    assert "/dev/zero" in printed(capsys).err


@pytest.mark.parametrize("command", ["calibrate", "identify"])
def test_measurements_that_have_no_square_are_a_line(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = [f"C{k}_length_m" for k in range(1, 9)] + ["x_m", "y_m", "z_m"]
    rows = [[str(0.1 * t), *["1.0"] * 7, "1e300", *["0.1"] * 3] for t in range(5)]
    text = "\n".join(",".join(row) for row in [["time_s", *names], *rows])
    (tmp_path / "log.csv").write_text(text + "\n")
    with pytest.raises(SystemExit) as end:
        main([command, "acrobot_small", "log.csv"])
    err = printed(capsys).err
    assert end.value.code == 2
    assert err.startswith("cdpr: log.csv:2: C8_length_m: found 1e300; accepted: a number up to")
    assert err.count("\n") == 1
