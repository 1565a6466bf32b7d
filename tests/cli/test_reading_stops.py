"""Commands refuse in one line what would stop a reader, and escape names that steer terminals."""

import os
import shutil

import pytest
from rich.table import Table

from cdpr_drake.cli.terminal import message_console, wide_console
from cdpr_drake.errors import RobotFileError, plain_words
from cdpr_drake.formats.grab import read_grab
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.systems.scenarios.files import resolve_robot_path
from tests.cli.commands import refuse, run
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


@pytest.mark.parametrize(
    ("command", "name"),
    [*(("check", name) for name in sorted(FILES)), ("import", "long.json"), ("import", "bomb.yaml"),
     ("import", "entities.urdf"), ("tension", "belts.yaml"), ("tension", "flat.urdf")],
)  # fmt: skip
def test_commands_say_a_line(command, name, here, capsys):
    text, words = FILES[name]
    (here / name).write_text(text)
    code, out, err = run(capsys, command, name)
    said = out + err
    assert code == 2
    assert any(each in said for each in words.split("|"))
    assert all(name in line for line in said.strip().split("\n"))
    assert os.listdir(here) == [name]


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


@pytest.mark.parametrize("command", ["check", "import", "import-log", "tension", "simulate"])
def test_pipes_are_not_waited_for(command, here, capsys):
    for name in ("pipe.yaml", "pipe.csv", "pipe.urdf", "pipe.mat", "pipe"):
        os.mkfifo(name)
        code, out, err = run(capsys, command, name)
        assert (code, name in out + err) == (2, True), name


@pytest.mark.parametrize(
    "words",
    ["check /dev/zero", "import-log /dev/zero", "calibrate planar /dev/zero",
     "import-log x --mapping /dev/zero"],
)  # fmt: skip
def test_devices_are_not_read_to_their_end(words, capsys):
    code, out, err = run(capsys, *words.split())
    assert code == 2
    assert "/dev/zero" in out + err


@pytest.mark.parametrize("command", ["calibrate", "identify"])
def test_measurements_that_have_no_square_are_a_line(command, here, capsys):
    names = [f"C{k}_length_m" for k in range(1, 9)] + ["x_m", "y_m", "z_m"]
    rows = [[str(0.1 * t), *["1.0"] * 7, "1e300", *["0.1"] * 3] for t in range(5)]
    text = "\n".join(",".join(row) for row in [["time_s", *names], *rows])
    (here / "log.csv").write_text(text + "\n")
    said = refuse(capsys, command, "acrobot_small", "log.csv")
    assert said.startswith("cdpr: log.csv:2: C8_length_m: found '1e300'; accepted: a number up to")


NASTY = "\x1b[31mred\x9b2J\u202e\x07"


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["check", f"{NASTY}.yaml"], 0),
        (["check", f"no{NASTY}.yaml"], 2),
        (["check", NASTY], 2),
        (["tension", f"{NASTY}.yaml", "--pose", "0,0,9"], 2),
        (["tension", f"{NASTY}.yaml", "--pose", "0,0,0.2", "--plot", f"{NASTY}.png"], 0),
        (["import", f"{NASTY}.yaml"], 2),
        (["export", f"{NASTY}.yaml", "--format", "urdf", "--out", NASTY], 0),
        (["simulate", NASTY], 2),
        (["simulate", "acrobot_pbvs", "--set", f"{NASTY}=1"], 2),
        (["new", "robot", "--out", NASTY], None),
        ([NASTY], 2),
    ],
)
def test_commands_escape_names(words, code, here, capsys):
    shutil.copy(robot_file("acrobot_small"), here / f"{NASTY}.yaml")
    found, out, err = run(capsys, *words)
    assert code is None or found == code
    assert out + err == plain_words(out + err)
    assert "\x1b" not in out + err
    assert (out + err).strip()


def test_tables_and_messages_escape_names(capsys):
    table = Table(NASTY)
    table.add_row(NASTY)
    wide_console().print(table, f"results: {NASTY}")
    message_console().print(f"cdpr: {NASTY}")
    out, err = printed(capsys)
    assert "\x1b" not in out + err
    assert out.count(r"\x1b[31mred\x9b2J\u202e\x07") == 3
    assert r"\x1b[31mred" in err


@pytest.mark.parametrize("words", ["caf\u00e9 \u2212 1\u202f000\u00a0\u00b5m", "two\nlines\t1", ""])
def test_plain_words_stay(words):
    assert plain_words(words) == words
