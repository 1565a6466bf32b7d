"""What every verb of `import cdpr_drake as cdpr` runs in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cdpr_drake.blas_threads import one_blas_thread
from cdpr_drake.schema.input_files import inputs_read_once


@contextmanager
def verb() -> Iterator[None]:
    """Each file is read once, and linear algebra has one thread: with more, sums have other digits.

    A decorator: `@verb()`.
    """
    with inputs_read_once(), one_blas_thread():
        yield
