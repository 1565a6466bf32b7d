"""Figures as files: every format, the same bytes every day, fonts that are embedded."""

import re
import xml.etree.ElementTree as ElementTree

import matplotlib as mpl
import numpy as np
import pytest

from cdpr_drake.analyses.frame.figures import figure_writers, new_figure, save_figure, write_figures
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw

FORMATS = ("png", "pdf", "svg")


def draw():
    figure, axes = new_figure(1, 2, (6.0, 3.0), "Some words")
    for one in axes:
        one.plot(np.arange(5.0), label="a curve")
        one.set(xlabel="time [s]", ylabel="tension [N]")
        one.legend()
    return figure


def nothing():
    """What draws a figure for which there is no data yet."""
    raise NothingToDraw


def write(folder, formats):
    folder.mkdir()
    writers = figure_writers({"some": draw}, formats)
    for name, writer in writers.items():
        writer(folder / name)
    return {name: (folder / name).read_bytes() for name in writers}


def test_each_format_is_the_same_bytes_alone_and_with_the_others(tmp_path, monkeypatch):
    together = write(tmp_path / "a", FORMATS)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")  # another day
    for ending in reversed(FORMATS):
        alone = write(tmp_path / ending, (ending,))
        assert alone[f"some.{ending}"] == together[f"some.{ending}"]
    folder = tmp_path / "saved"
    folder.mkdir()
    assert not write_figures(folder, {"some": draw}, FORMATS)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == together


def test_a_file_that_cannot_be_written_leaves_the_older_one(tmp_path, monkeypatch):
    path = tmp_path / "some.png"
    write_figures(tmp_path, {"some": draw, "none": nothing})
    older, figure = path.read_bytes(), draw()

    def full(part, **_):
        part.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", full)
    failed = write_figures(tmp_path, {"some": lambda: figure, "none": nothing})
    assert failed == {"some.png": "[Errno 28] No space left on device"}
    with pytest.raises(OSError, match="No space"):
        save_figure(figure, path)
    assert [one.name for one in tmp_path.iterdir()] == ["some.png"]
    assert path.read_bytes() == older


def test_a_file_without_an_ending_is_a_png(tmp_path):
    assert save_figure(draw(), tmp_path / "some") == tmp_path / "some.png"
    assert [one.name for one in tmp_path.iterdir()] == ["some.png"]


def test_a_figure_is_drawn_once_for_all_its_files(tmp_path):
    drawn = []

    def counted():
        drawn.append(1)
        return draw()

    for name, writer in figure_writers({"some": counted}, FORMATS).items():
        writer(tmp_path / name)
    assert len(drawn) == 1


@pytest.mark.parametrize("layout", ["figure.autolayout", "figure.constrained_layout.use"])
def test_a_file_needs_one_drawing_whatever_layout_the_user_prefers(tmp_path, monkeypatch, layout):
    drawn, figure = [], draw()
    really = figure.draw

    def counted(renderer):
        drawn.append(1)
        return really(renderer)

    monkeypatch.setattr(figure, "draw", counted)
    with mpl.rc_context({layout: True}):
        assert not write_figures(tmp_path, {"some": lambda: figure})
        assert figure.get_layout_engine() is None
    assert len(drawn) == 1


def test_a_pdf_has_no_date_and_truetype_fonts(tmp_path):
    page = write(tmp_path / "a", ("pdf",))["some.pdf"]
    assert page.startswith(b"%PDF")
    assert b"CreationDate" not in page
    # Type 42 is written as a composite font with its TrueType file; type 3 would be drawn glyphs.
    assert b"/FontFile2" in page
    assert b"/Type3" not in page


def test_an_svg_has_no_date_and_needs_no_font(tmp_path):
    page = write(tmp_path / "a", ("svg",))["some.svg"].decode()
    assert ElementTree.fromstring(page).tag.endswith("svg")
    assert not re.search(r"<dc:date>|<text|font-face", page)


def test_titles_are_broken_where_the_figure_ends():
    figure, _ = new_figure(1, 1, (4.0, 3.0), "short\n" + "many words " * 10)
    lines = figure.get_suptitle().split("\n")
    assert lines[0] == "short"
    assert max(map(len, lines)) <= 36


@pytest.mark.parametrize("ending", FORMATS)
def test_a_figure_without_layout_is_written_too(tmp_path, ending):
    figure = draw()
    figure.set_layout_engine("none")
    assert not write_figures(tmp_path, {"plain": lambda: figure}, (ending,))
    assert [file.name for file in tmp_path.iterdir()] == [f"plain.{ending}"]


def test_a_figure_can_be_shown_again_with_more_in_it():
    figure = draw()
    engine = figure.get_layout_engine()
    first = figure._repr_png_()
    assert figure._repr_png_() == first
    assert figure.get_layout_engine() is engine
    figure.axes[0].set_ylabel("many\nlines\nof words")
    assert figure._repr_png_() != first


def test_curves_without_a_look_of_their_own_can_be_told_apart_without_colours():
    """The first and the fifth were both solid and blue."""
    _, axes = new_figure(1, 1, (6.0, 3.0), "Some words")
    curves = [axes.plot([0.0, 1.0])[0] for _ in range(8)]
    assert len({line.get_color() for line in curves}) == 8
    assert len({str(line._unscaled_dash_pattern) for line in curves}) == 8
