"""Thinned curves keep every extreme and gap; spans are those of the rows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import draw_bars, draw_curve
from cdpr_drake.analyses.frame.thinning import by_pieces, extreme_rows, path_rows, spans
from cdpr_drake.palette import nth_look


@given(st.integers(0, 2**32 - 1), st.integers(1, 2000), st.integers(1, 50))
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
        kept = values[rows[(rows >= start) & (rows < start + width)]]
        assert (kept.min(), kept.max()) == (piece.min(), piece.max())


def test_gaps_stay_gaps_and_a_curve_of_gaps_is_one():
    values = np.sin(np.arange(10_000.0))
    values[2000:2003] = np.nan
    rows = extreme_rows(values, 100)
    assert np.any(np.isnan(values[rows]))
    np.testing.assert_array_equal(values[rows][[0, -1]], values[[0, -1]])
    assert np.all(np.isnan(np.full(10_000, np.nan)[extreme_rows(np.full(10_000, np.nan), 100)]))


def test_a_single_needle_in_half_a_million_rows_is_drawn():
    times, values = np.arange(540_000.0), np.zeros(540_000)
    values[123_457] = 7.0
    axes = Figure().subplots()
    draw_curve(axes, times, values, nth_look(0), scale=2.0)
    (line,) = axes.lines
    assert np.max(line.get_ydata()) == 14.0
    assert line.get_xdata()[np.argmax(line.get_ydata())] == 123_457.0
    assert len(line.get_xdata()) < 6000


def test_a_path_keeps_the_extremes_of_each_coordinate():
    points = np.random.default_rng(0).normal(size=(30_000, 3))
    kept = points[path_rows(points, 50)]
    np.testing.assert_array_equal(kept.min(axis=0), points.min(axis=0))
    np.testing.assert_array_equal(kept.max(axis=0), points.max(axis=0))


@pytest.mark.parametrize("count", [0, 1, 49_999, 50_000, 50_001, 120_000])
def test_pieces_are_put_together_as_they_were(count):
    a = np.arange(float(count))
    np.testing.assert_array_equal(by_pieces(lambda x, y: x + y, a, 2.0 * a), 3.0 * a)
    double, half = by_pieces(lambda x: (2.0 * x, x / 2.0), a)
    np.testing.assert_array_equal((double, half), (2.0 * a, a / 2.0))


@pytest.mark.parametrize(
    ("holds", "expected"),
    [
        ([0, 0, 0, 0, 0], []),
        ([1, 1, 1, 1, 1], [(0, 4)]),
        ([0, 1, 1, 0, 0], [(1, 3)]),
        ([1, 0, 1, 0, 1], [(0, 1), (2, 3)]),
        ([0, 0, 0, 1, 0], [(3, 4)]),
        ([0, 0, 0, 0, 1], []),
        ([1], []),
        ([], []),
    ],
)
def test_spans_last_from_a_row_to_the_next(holds, expected):
    times = np.arange(float(len(holds)))
    found = spans(times, np.array(holds, float))
    np.testing.assert_array_equal(found.reshape(-1, 2), np.reshape(expected, (-1, 2)))


@given(st.integers(0, 2**32 - 1), st.integers(2, 300))
def test_spans_last_as_long_as_the_rows_say(seed, count):
    random = np.random.default_rng(seed)
    times, holds = np.cumsum(random.uniform(0.01, 1.0, count)), random.random(count) < 0.5
    whole = np.sum(np.diff(times)[holds[:-1]])
    found = spans(times, holds, bins=10**9)
    assert np.sum(found[:, 1] - found[:, 0]) == pytest.approx(whole)


def test_chatter_gives_few_bars():
    times = np.arange(540_000.0)
    assert len(spans(times, np.arange(540_000) % 2)) == 1
    axes = Figure().subplots()
    draw_bars(axes, times, [("C1", nth_look(0), np.random.default_rng(0).random(540_000) < 0.5)])
    assert len(axes.collections[0].get_paths()) <= 1500
