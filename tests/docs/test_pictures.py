"""The site's gallery, the sheet of all figures, and equations in a font of its own."""

import html
import shlex
import shutil

import pytest
from PIL import Image

from cdpr_drake.cli.call import parsed
from cdpr_drake.cli.commands import COMMANDS
from docs import contact_sheet, gallery
from tests.chromium import cleared, wait_for
from tests.docs.test_pages import DOCS
from tests.messages import printed


def test_the_gallery_s_page_and_pictures_agree():
    assert list(gallery.found_problems()) == []


def test_what_is_missing_or_too_much_in_the_gallery_is_said(tmp_path, monkeypatch):
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
def test_a_command_of_the_gallery_parses(item):
    program, *words = shlex.split(item.command)
    assert program == "cdpr"
    if words[0] in COMMANDS:
        assert parsed(words)


def test_an_animation_keeps_its_frames_and_a_large_one_is_refused(tmp_path, monkeypatch):
    images = [Image.new("RGB", (64, 48), color) for color in ("red", "blue", "white")]
    gallery.write(images, tmp_path / "a.webp")
    with Image.open(tmp_path / "a.webp") as kept:
        assert (kept.n_frames, kept.size) == (3, (64, 48))
    monkeypatch.setattr(gallery, "LARGEST", 10)
    with pytest.raises(ValueError, match="accepted: up to 10"):
        gallery.write(images, tmp_path / "b.webp")
    assert not (tmp_path / "b.webp").exists()


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


TALL = "<mfrac><mfrac><mi>l</mi><mi>t</mi></mfrac><mi>T</mi></mfrac>"
HEIGHT = "(e => e.getBoundingClientRect().height)(document.querySelector('{}'))"


@pytest.mark.parametrize("pair", ["()", "[]", "||"])
def test_brackets_of_equations_are_as_high_as_what_they_hold(started_browser, tmp_path, pair):
    """Whatever fonts a machine has."""
    shutil.copytree(DOCS / "fonts", tmp_path / "fonts")
    fences = [f'<mo stretchy="true" fence="true">{sign}</mo>' for sign in pair]
    (tmp_path / "page.html").write_text(
        f'<meta charset="utf-8"><style>{(DOCS / "style.css").read_text()}</style>'
        f'<math display="block"><mrow>{TALL.join(fences)}</mrow></math>'
    )
    with cleared(started_browser) as page:
        page.get((tmp_path / "page.html").as_uri())
        wait_for(page, "document.fonts.status === 'loaded'")
        held = wait_for(page, HEIGHT.format("mfrac"))
        assert wait_for(page, HEIGHT.format("mo")) >= held
