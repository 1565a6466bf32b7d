"""The contact sheet shows every figure below a folder, and names commands that failed."""

import html

import pytest
from PIL import Image

from docs import contact_sheet
from tests.messages import printed


def draw(path, colour):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (40, 20), colour).save(path)


def test_every_figure_stands_in_colour_and_in_grey(tmp_path, capsys):
    draw(tmp_path / "one" / "a.png", "red")
    draw(tmp_path / "two" / "deep" / "b.png", "blue")
    for _ in range(2):  # the second time, its own sheets are no figures
        assert contact_sheet.main([str(tmp_path), "--no-run"]) == 0
        assert "2 figures" in capsys.readouterr().out
    words = (tmp_path / "contact_sheet.html").read_text()
    assert words.count("<img") == 4
    assert "one/a.png" in words
    assert "two/deep/b.png" in words
    colour, grey = contact_sheet.in_both(tmp_path / "one" / "a.png")
    assert colour.getpixel((5, 5)) == (255, 0, 0)
    assert len(set(grey.getpixel((5, 5)))) == 1
    assert grey.size == colour.size == (contact_sheet.WIDTH, contact_sheet.WIDTH // 2)


def test_a_folder_without_figures_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        contact_sheet.main([str(tmp_path), "--no-run"])
    assert "found no figures" in printed(capsys).err


def test_a_command_that_fails_is_named_and_the_others_are_shown(tmp_path, monkeypatch, capsys):
    commands = ("cdpr tension nobody --plot none.png", "cdpr tension planar --plot there.png")
    draw(tmp_path / "there.png", "red")  # its result is there: it is not run again
    monkeypatch.setattr(contact_sheet, "COMMANDS", commands)
    assert contact_sheet.main([str(tmp_path)]) == 1
    words = html.unescape((tmp_path / "contact_sheet.html").read_text())
    assert "robot 'nobody' is unknown" in words
    assert "1 figures" in capsys.readouterr().out
