"""Lanes: each is rounded as a float is, loads and stores stay within arrays, sums keep an order."""

import numpy as np
import pytest
from numba import TypingError, njit

from cdpr_drake.numerics.lanes import (
    COUNT,
    lane_of,
    less_sums,
    load_lanes,
    no_lanes,
    positive_where,
    root_of,
    store_lanes,
    within,
)

SIZES = (1, 5, 8, 11, 16)


@njit
def _mixed(a, b, c, out):
    for i in range(0, a.shape[0], COUNT):
        x, y = load_lanes(a, i), load_lanes(b, i)
        store_lanes(out, i, (2.0 * x - y / c) * (x + 0.1) / y + root_of(y * y + x * x) - 3.0)


@njit
def _chosen(a, b, out):
    for i in range(0, a.shape[0], COUNT):
        store_lanes(out, i, positive_where(load_lanes(a, i), load_lanes(b, i)))


@njit
def _clipped(a, limit, out):
    for i in range(0, a.shape[0], COUNT):
        store_lanes(out, i, within(load_lanes(a, i), limit))


@njit
def _totals(terms, out):
    sums, m = no_lanes(), terms.shape[1]
    for i in range(0, m, COUNT):
        each = (
            load_lanes(terms[0], i), load_lanes(terms[1], i), load_lanes(terms[2], i),
            load_lanes(terms[3], i), load_lanes(terms[4], i), load_lanes(terms[5], i),
        )  # fmt: skip
        sums = less_sums(sums, each, m - i)
    for k in range(6):
        out[k] = lane_of(sums, k)


def guarded(m):
    """An array of m numbers in a larger one, whose others must stay as they are."""
    room = np.full(m + 2 * COUNT, 7.0)
    return room, room[COUNT : COUNT + m]


@pytest.mark.parametrize("m", SIZES)
def test_arithmetic_has_the_bits_of_floats_and_stays_within_its_array(m):
    rng = np.random.default_rng(m)
    a, b, c = rng.normal(size=m), rng.normal(size=m), rng.normal()
    room, out = guarded(m)
    _mixed(a, b, c, out)
    wanted = (2.0 * a - b / c) * (a + 0.1) / b + np.sqrt(b * b + a * a) - 3.0
    np.testing.assert_array_equal(out, wanted)
    assert (room[:COUNT] == 7.0).all()
    assert (room[COUNT + m :] == 7.0).all()


def test_what_is_beyond_the_end_of_an_array_is_not_read():
    room = np.full(3 * COUNT, np.nan)
    room[:3] = 1.0, 2.0, 3.0
    out = np.zeros(6)
    _totals(np.vstack([room[:3]] * 6), out)
    np.testing.assert_array_equal(out, -6.0)


def test_what_does_not_pull_is_zero_and_nan_stays():
    conditions = np.array([1.0, 1.0, 0.0, -1.0, np.nan, 1.0, 1.0])
    values = np.array([2.0, -2.0, 2.0, 2.0, 2.0, np.nan, 0.0])
    out = np.empty(7)
    _chosen(conditions, values, out)
    np.testing.assert_array_equal(out, [2.0, 0.0, 0.0, 0.0, 0.0, np.nan, 0.0])


def test_clipping_is_that_of_python_and_nan_stays():
    values = np.array([-3.0, -1.0, 0.5, 1.0, 4.0, np.nan, np.inf, -np.inf, -0.5])
    out = np.empty(9)
    _clipped(values, 1.0, out)
    np.testing.assert_array_equal(out, [-1.0, -1.0, 0.5, 1.0, 1.0, np.nan, 1.0, -1.0, -0.5])


@pytest.mark.parametrize("m", SIZES)
def test_totals_are_rounded_as_in_a_loop(m):
    terms = np.random.default_rng(m).normal(size=(6, m)) * 10.0 ** np.arange(m)
    out, wanted = np.empty(6), np.zeros(6)
    _totals(terms, out)
    for j in range(m):
        wanted -= terms[:, j]
    np.testing.assert_array_equal(out, wanted)


def test_floats_are_no_lanes():
    with pytest.raises(TypingError):
        njit(lambda x: root_of(x))(2.0)
    with pytest.raises(TypingError):
        njit(lambda x: lane_of(load_lanes(x, 0), 0))(np.zeros((3, 3)))
