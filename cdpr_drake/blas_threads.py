"""One thread for linear algebra, whose sums depend on how many threads share them.

Commands and processes that the package starts have `ONE_THREAD` in their environment before NumPy
is loaded. In a process of somebody else's, `one_blas_thread` holds it for the time of a call.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any

ONE_THREAD: Mapping[str, str] = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "BLIS_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}
"""What libraries of linear algebra read when they are loaded."""


_begun_with_one = False
"""True in a process that has had one thread since before NumPy was loaded."""


def begin_with_one_thread() -> None:
    """Gives this process and its children one thread, before NumPy is loaded."""
    global _begun_with_one
    os.environ.update(ONE_THREAD)
    _begun_with_one = "numpy" not in sys.modules


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Linear algebra of this process in one thread; what was set before holds again afterwards.

    Also a decorator: `@one_blas_thread()`. It imports SciPy, except in a process that began with
    one thread.

    Source: threadpoolctl.
    """
    if _begun_with_one:
        yield
        return
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@contextmanager
def started_with_one_thread() -> Iterator[None]:
    """Processes that are started meanwhile have `ONE_THREAD`; the environment comes back."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@cache
def _libraries() -> Any:
    """Those of NumPy and of SciPy, which has one of its own, loaded as the user set them."""
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
