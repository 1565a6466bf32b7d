"""Figures: thinned curves keep every extreme, files have the same bytes every day."""

import re
import subprocess
import sys
import weakref
import xml.etree.ElementTree as ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    bars,
    curves,
    draw_bars,
    draw_curve,
    figure_writers,
    new_figure,
    panels,
    plane,
    save_figure,
    write_figures,
)
from cdpr_drake.analyses.frame.thinning import by_pieces, extreme_rows, path_rows, spans
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw, write_pictures
from cdpr_drake.palette import nth_look

FORMATS = ("png", "pdf", "svg")
SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS, st.integers(1, 2000), st.integers(1, 50))
def test_no_extreme_of_any_piece_is_lost(seed, count, bins):
    values = np.random.default_rng(seed).normal(size=count)
    rows = extreme_rows(values, bins)
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, count - 1)
    if count <= 4 * bins:
        assert len(rows) == count
        return
    assert len(rows) <= 2 * bins + 2
    width = -(-count // bins)
    for start in range(0, count, width):
        piece = values[start : start + width]
        shown = values[rows[(rows >= start) & (rows < start + width)]]
        assert (shown.min(), shown.max()) == (piece.min(), piece.max())


def test_gaps_stay_gaps_and_a_curve_of_gaps_is_one():
    values, gaps = np.sin(np.arange(10_000.0)), np.full(10_000, np.nan)
    values[2000:2003] = np.nan
    rows = extreme_rows(values, 100)
    assert np.any(np.isnan(values[rows]))
    np.testing.assert_array_equal(values[rows][[0, -1]], values[[0, -1]])
    assert np.all(np.isnan(gaps[extreme_rows(gaps, 100)]))


def test_a_path_keeps_the_extremes_of_each_coordinate():
    points = np.random.default_rng(0).normal(size=(30_000, 3))
    shown = points[path_rows(points, 50)]
    np.testing.assert_array_equal(shown.min(axis=0), points.min(axis=0))
    np.testing.assert_array_equal(shown.max(axis=0), points.max(axis=0))


@pytest.mark.parametrize("count", [0, 1, 49_999, 50_000, 50_001, 120_000])
def test_pieces_are_put_together_as_they_were(count):
    a = np.arange(float(count))
    np.testing.assert_array_equal(by_pieces(lambda x, y: x + y, a, 2.0 * a), 3.0 * a)
    double, half = by_pieces(lambda x: (2.0 * x, x / 2.0), a)
    np.testing.assert_array_equal((double, half), (2.0 * a, a / 2.0))


@pytest.mark.parametrize(
    ("holds", "expected"),
    [
        ([0, 0, 0, 0, 0], []), ([1, 1, 1, 1, 1], [(0, 4)]), ([0, 1, 1, 0, 0], [(1, 3)]),
        ([1, 0, 1, 0, 1], [(0, 1), (2, 3)]), ([0, 0, 0, 1, 0], [(3, 4)]), ([0, 0, 0, 0, 1], []),
        ([1], []), ([], []),
    ],
)  # fmt: skip
def test_spans_last_from_a_row_to_the_next(holds, expected):
    result = spans(np.arange(float(len(holds))), np.array(holds, float))
    np.testing.assert_array_equal(result.reshape(-1, 2), np.reshape(expected, (-1, 2)))


@given(SEEDS, st.integers(2, 300))
def test_spans_last_as_long_as_the_rows_say(seed, count):
    random = np.random.default_rng(seed)
    times, holds = np.cumsum(random.uniform(0.01, 1.0, count)), random.random(count) < 0.5
    result = spans(times, holds, bins=10**9)
    expected = np.sum(np.diff(times)[holds[:-1]])
    assert np.sum(result[:, 1] - result[:, 0]) == pytest.approx(expected)


def test_chatter_gives_few_bars():
    times = np.arange(540_000.0)
    assert len(spans(times, np.arange(540_000) % 2)) == 1
    axes = Figure().subplots()
    draw_bars(axes, times, [("C1", nth_look(0), np.random.default_rng(0).random(540_000) < 0.5)])
    assert len(axes.collections[0].get_paths()) <= 1500


def test_a_single_needle_in_half_a_million_rows_is_drawn():
    times, values = np.arange(540_000.0), np.zeros(540_000)
    values[123_457] = 7.0
    axes = Figure().subplots()
    draw_curve(axes, times, values, nth_look(0), scale=2.0)
    (line,) = axes.lines
    assert np.max(line.get_ydata()) == 14.0
    assert line.get_xdata()[np.argmax(line.get_ydata())] == 123_457.0
    assert len(line.get_xdata()) < 6000


def test_columns_are_drawn_in_the_looks_of_their_numbers():
    axes, times = Figure().subplots(), np.arange(100.0)
    curves(axes, times, np.outer(times, [1.0, 2.0]), ("a", "b"), numbers=(3, 5), scale=10.0)
    for line, name, number, slope in zip(axes.lines, "ab", (3, 5), (10.0, 20.0), strict=True):
        look = nth_look(number)
        drawn = (line.get_label(), line.get_color(), line.get_marker())
        assert drawn == (name, look.color, look.marker)
        np.testing.assert_array_equal(line.get_ydata(), slope * times)
    first, second = (set(line.get_markevery()) for line in axes.lines)
    assert not first & second  # symbols of curves on each other are apart


def test_bars_of_a_name_stand_beside_each_other():
    axes = Figure().subplots()
    bars(axes, ("C1", "C2"), {"a": [1.0, 2.0], "b": [3.0, np.nan]})
    places = [bar.get_x() + bar.get_width() / 2.0 for bar in axes.patches]
    np.testing.assert_allclose(places, [-0.2, 0.8, 0.2, 1.2])
    assert [label.get_text() for label in axes.get_xticklabels()] == ["C1", "C2"]
    assert len({bar.get_hatch() for bar in axes.patches}) == 2


def test_a_plane_leaves_what_is_not_finite_empty():
    axes = Figure().subplots()
    plane(axes, np.array([[1.0, np.inf], [np.nan, 4.0]]), "distance [m]")
    image, scale = axes.images[0], axes.figure.axes[1]
    assert image.get_array().mask.tolist() == [[False, True], [True, False]]
    assert (image.get_clim(), scale.get_ylabel()) == ((1.0, 4.0), "distance [m]")


@pytest.mark.parametrize(("count", "rows", "columns"), [(0, 1, 1), (2, 1, 2), (4, 2, 3)])
def test_panels_are_as_many_as_are_needed(count, rows, columns):
    figure, axes = panels(count, 3, (6.0, 4.0), "Some words")
    assert len(axes) == len(figure.axes) == max(count, 1)
    assert axes[0].get_gridspec().get_geometry() == (rows, columns)


def draw():
    figure, axes = new_figure(1, 2, (6.0, 3.0), "Some words")
    for panel in axes:
        panel.plot(np.arange(5.0), label="a curve")
        panel.set(xlabel="time [s]", ylabel="tension [N]")
        panel.legend()
    return figure


def nothing():
    raise NothingToDraw


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_each_format_is_the_same_bytes_alone_and_with_the_others(tmp_path, monkeypatch):
    drawn, together = [], tmp_path / "together"
    together.mkdir()
    assert not write_figures(together, {"it": lambda: drawn.append(1) or draw()}, FORMATS)
    assert len(drawn) == 1  # for all files
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")  # another day
    for ending in reversed(FORMATS):
        (path,) = [write(tmp_path / name)
                   for name, write in figure_writers({"it": draw}, (ending,)).items()]  # fmt: skip
        assert path.read_bytes() == (together / path.name).read_bytes()
    page, image = ((together / f"it.{ending}").read_bytes() for ending in ("pdf", "svg"))
    assert page.startswith(b"%PDF")
    assert b"CreationDate" not in page
    # Type 42 is written as a composite font with its TrueType file; type 3 would be drawn glyphs.
    assert b"/FontFile2" in page
    assert b"/Type3" not in page
    assert ElementTree.fromstring(image.decode()).tag.endswith("svg")
    assert not re.search(r"<dc:date>|<text|font-face", image.decode())


def test_a_file_that_cannot_be_written_leaves_the_older_one(tmp_path, monkeypatch):
    path = tmp_path / "it.png"
    write_figures(tmp_path, {"it": draw, "none": nothing})
    older, figure = path.read_bytes(), draw()

    def full(part, **_):
        part.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", full)
    failed = write_figures(tmp_path, {"it": lambda: figure, "none": nothing})
    assert failed == {"it.png": "[Errno 28] No space left on device"}
    with pytest.raises(OSError, match="No space"):
        save_figure(figure, path)
    assert names(tmp_path) == ["it.png"]
    assert path.read_bytes() == older


def test_a_file_without_an_ending_is_a_png(tmp_path):
    assert save_figure(draw(), tmp_path / "it") == tmp_path / "it.png"
    assert names(tmp_path) == ["it.png"]


def test_a_figure_in_several_formats_is_gone_after_the_last(tmp_path):
    alive = []

    def short():
        figure = new_figure(1, 1, (2.0, 2.0), "x")[0]
        alive.append(weakref.ref(figure))
        return figure

    writers = figure_writers({"one": short}, ("svg", "pdf"))
    last = {"two.txt": lambda path: path.write_text(str(alive[0]()))}
    assert write_pictures(tmp_path, {**writers, **last}) == {}
    assert (tmp_path / "two.txt").read_text() == "None"


@pytest.mark.parametrize("layout", ["figure.autolayout", "figure.constrained_layout.use"])
@pytest.mark.parametrize("engine", ["constrained", "none"])
def test_a_file_needs_one_drawing_whatever_layout_there_is(tmp_path, monkeypatch, layout, engine):
    drawn, figure = [], draw()
    figure.set_layout_engine(engine)
    really = figure.draw

    def counted(renderer):
        drawn.append(1)
        return really(renderer)

    monkeypatch.setattr(figure, "draw", counted)
    with mpl.rc_context({layout: True}):
        assert not write_figures(tmp_path, {"it": lambda: figure})
        assert figure.get_layout_engine() is None
    assert (len(drawn), names(tmp_path)) == (1, ["it.png"])


def test_titles_are_broken_where_the_figure_ends():
    lines = new_figure(1, 1, (4.0, 3.0), "short\n" + "words " * 20)[0].get_suptitle().split("\n")
    assert lines[0] == "short"
    assert max(map(len, lines)) <= 36


def test_a_figure_can_be_shown_again_with_more_in_it():
    figure = draw()
    engine, first = figure.get_layout_engine(), figure._repr_png_()
    assert figure._repr_png_() == first
    assert figure.get_layout_engine() is engine
    figure.axes[0].set_ylabel("many\nlines\nof words")
    assert figure._repr_png_() != first


def test_curves_without_a_look_can_be_told_apart_without_colours():
    """The first and the fifth were both solid and blue."""
    axes = new_figure(1, 1, (6.0, 3.0), "Some words")[1]
    lines = [axes.plot([0.0, 1.0])[0] for _ in range(8)]
    assert len({line.get_color() for line in lines}) == 8
    assert len({str(line._unscaled_dash_pattern) for line in lines}) == 8


IMPORTS = """
import sys
from importlib import import_module
from cdpr_drake.cli.commands import COMMANDS
modules = {command.verb.partition(":")[0] for command in COMMANDS.values()}
planning = {"cdpr_drake.analyses.planning.free_plan", "cdpr_drake.proofs.proven_plan"}
for module in sorted(modules | planning):
    if not any(part in module for part in (".cli.", ".runs.", ".sections.", "campaign")):
        import_module(module)
        assert "matplotlib" not in sys.modules, module
"""


def test_verbs_are_imported_without_matplotlib():
    """It takes half a second, which a verb that draws nothing needs not.

    Runs draw all figures, and campaigns are runs.
    """
    subprocess.run([sys.executable, "-c", IMPORTS], check=True)
