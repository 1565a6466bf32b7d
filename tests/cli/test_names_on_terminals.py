"""Names of files that would control a terminal are printed escaped, wherever they are said."""

import shutil

import pytest
from rich.table import Table

from cdpr_drake.cli import main
from cdpr_drake.cli.terminal import message_console, wide_console
from cdpr_drake.errors import plain_words
from cdpr_drake.models.robot_loader import robot_file
from tests.messages import printed

NASTY = "\x1b[31mred\x9b2J\u202e\x07"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(robot_file("acrobot_small"), tmp_path / f"{NASTY}.yaml")
    return tmp_path


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
def test_commands_escape_them(words, code, here, capsys):
    with pytest.raises(SystemExit) as end:
        main(words)
    assert code is None or end.value.code == code
    out, err = printed(capsys)
    assert out + err == plain_words(out + err)
    assert "\x1b" not in out + err
    assert (out + err).strip()


def test_tables_and_messages_escape_them(capsys):
    table = Table(NASTY)
    table.add_row(NASTY)
    wide_console().print(table, f"results: {NASTY}")
    message_console().print(f"cdpr: {NASTY}")
    out, err = printed(capsys)
    assert "\x1b" not in out + err
    assert out.count(r"\x1b[31mred\x9b2J\u202e\x07") == 3
    assert r"\x1b[31mred" in err


def test_plain_words_stay():
    for words in ("caf\u00e9 \u2212 1\u202f000\u00a0\u00b5m", "two\nlines\t1", ""):
        assert plain_words(words) == words
