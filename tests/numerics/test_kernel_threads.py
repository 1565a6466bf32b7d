"""Kernels in threads: every row once, whatever the number of threads; errors and copies."""

import numpy as np
import pytest
from numba import get_num_threads, njit, set_num_threads

from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.numerics.linear_algebra_kernel import copy_matrix, copy_vector


@njit(nogil=True)
def count_up(first, past, seen):
    for k in range(first, past):
        seen[k] += k + 1


@pytest.mark.parametrize("threads", [1, 2, 3, 50, None])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 16, 1001])
def test_every_row_is_done_once(count, threads):
    seen = np.zeros(count)
    over_rows(count_up, count, threads, seen)
    assert np.array_equal(seen, np.arange(1, count + 1))


def test_without_a_number_numba_says_how_many():
    calls = []
    before = get_num_threads()
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


def test_copies():
    a = np.arange(12.0).reshape(3, 4)
    out = np.zeros((4, 4))
    copy_matrix(a, out[1:])
    assert np.array_equal(out[1:], a)
    assert not np.any(out[0])
    copy_vector(a[2], out[:, 0])
    assert np.array_equal(out[:, 0], a[2])
