"""The gallery's page is what its script writes, and each command of it parses."""

import shlex

import pytest
import typer
from PIL import Image

from cdpr_drake.cli.app import make_app
from docs import gallery


def test_page_and_pictures_agree():
    assert list(gallery.found_problems()) == []


def test_what_is_missing_or_too_much_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(gallery, "PICTURES", tmp_path)
    (tmp_path / "other.webp").write_bytes(b"")
    for item in gallery.ITEMS[1:]:
        gallery.picture(item).write_bytes(b"")
    gallery.picture(gallery.ITEMS[1]).write_bytes(bytes(gallery.LARGEST + 1))
    said = "\n".join(gallery.found_problems())
    assert "other.webp: found a picture of no item" in said
    assert f"{gallery.ITEMS[0].name}.webp: is not there" in said
    assert f"accepted: up to {gallery.LARGEST}" in said


@pytest.mark.parametrize("item", gallery.ITEMS, ids=lambda item: item.name)
def test_its_command_parses(item):
    program, name, *arguments = shlex.split(item.command)
    assert program == "cdpr"
    command = typer.main.get_command(make_app([name])).commands[name]
    command.make_context(name, arguments)


def test_an_animation_keeps_its_frames_and_a_large_one_is_refused(tmp_path, monkeypatch):
    images = [Image.new("RGB", (64, 48), color) for color in ("red", "blue", "white")]
    gallery.write(images, tmp_path / "a.webp")
    with Image.open(tmp_path / "a.webp") as kept:
        assert (kept.n_frames, kept.size) == (3, (64, 48))
    monkeypatch.setattr(gallery, "LARGEST", 10)
    with pytest.raises(ValueError, match="accepted: up to 10"):
        gallery.write(images, tmp_path / "b.webp")
    assert not (tmp_path / "b.webp").exists()
