"""Kernels over many rows in threads.

A kernel here is compiled with `nogil=True` and takes the first row and the one past the last
before its other arguments. Threads of Python do what numba's own `prange` does, without its second
compilation of everything below the loop, and may be used from several threads at once.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from numba import get_num_threads

SHARES = 8
"""Shares of the rows per thread, so that a thread whose rows are quick takes over others."""


def over_rows(
    kernel: Callable[..., Any], count: int, threads: int | None, *arguments: object
) -> None:
    """Calls `kernel(first, past, *arguments)` until all rows of range(count) are done.

    Args:
        kernel: Compiled with `nogil=True`; what it writes for a row no other row may touch.
        count: Number of rows.
        threads: Number of threads; None: as many as `numba.set_num_threads` allows, by itself all
            cores.
        arguments: Further arguments of the kernel.
    """
    threads = min(get_num_threads() if threads is None else max(threads, 1), count)
    if threads <= 1:
        kernel(0, count, *arguments)
        return
    step = -(-count // (SHARES * threads))
    kernel(0, 0, *arguments)  # compiles in one thread
    with ThreadPoolExecutor(threads) as pool:
        shares = [
            pool.submit(kernel, first, min(first + step, count), *arguments)
            for first in range(0, count, step)
        ]
        try:
            for share in shares:
                share.result()
        finally:
            for share in shares:
                share.cancel()
