"""The picture and the list of rooms say what the code says."""

import runpy
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "docs" / "rooms.py"


def test_the_picture_and_the_list_of_rooms_are_made_from_the_code(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [str(PROGRAM), "--check"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(PROGRAM), run_name="__main__")
    assert (ended.value.code, capsys.readouterr().out) == (0, "")
