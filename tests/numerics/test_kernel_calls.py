"""Arrays by their addresses, and rows in threads, for kernels."""

import numpy as np
import pytest
from numba import get_num_threads, njit, set_num_threads, types

from cdpr_drake.numerics.kernel_calls import (
    _cube,
    _matrix,
    _vector,
    _whole_numbers,
    array_addresses,
    cube_at,
    integers_at,
    matrix_at,
    over_rows,
    vector_at,
)


@njit
def double_all(table):
    """Doubles arrays 0 to 3 in place; returns the sum of the lengths of their axes."""
    whole, one, two, three = (
        integers_at(table, 0), vector_at(table, 1), matrix_at(table, 2), cube_at(table, 3)
    )  # fmt: skip
    whole *= 2
    one *= 2.0
    two *= 2.0
    three *= 2.0
    return sum(whole.shape) + sum(one.shape) + sum(two.shape) + sum(three.shape)


def test_kernels_find_and_change_the_arrays():
    arrays = [np.arange(3), np.arange(4.0), np.arange(6.0).reshape(2, 3), np.ones((2, 3, 4))]
    doubled = [2 * array for array in arrays]
    assert double_all(array_addresses(arrays)) == 3 + 4 + 5 + 9
    for array, expected in zip(arrays, doubled, strict=True):
        np.testing.assert_array_equal(array, expected)
    # One kernel for all numbers of arrays, where numba would compile one for each that is written.
    for kernel in (_whole_numbers, _vector, _matrix, _cube):
        assert [number for _, number in kernel.signatures] == [types.int64]


@pytest.mark.parametrize(
    "array", [np.ones((4, 4))[:, ::2], np.ones(3, dtype=np.float32), np.ones((1, 1, 1, 1))]
)
def test_arrays_that_no_kernel_could_read_are_refused(array):
    with pytest.raises(ValueError, match="cannot be addressed"):
        array_addresses([array])


def count_up(first, past, seen):
    for k in range(first, past):
        seen[k] += k + 1


@pytest.mark.parametrize("threads", [1, 2, 3, 50, None])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 16, 1001])
def test_every_row_is_done_once(count, threads):
    rows = np.zeros(count)
    over_rows(count_up, count, threads, rows)
    assert np.array_equal(rows, np.arange(1, count + 1))


def test_without_a_number_numba_says_how_many():
    calls, before = [], get_num_threads()
    try:
        set_num_threads(1)
        over_rows(lambda first, past: calls.append((first, past)), 100, None)
    finally:
        set_num_threads(before)
    assert calls == [(0, 100)]


def test_an_error_in_a_thread_is_the_callers():
    def fails(first, past):
        if first > 0:
            raise ValueError("row")

    with pytest.raises(ValueError, match="row"):
        over_rows(fails, 40, 2)
