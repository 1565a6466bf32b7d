"""Pictures that come after the data: each appears whole or not at all, and none spoils another."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

Pictures = dict[str, Callable[[Path], object]]
"""What writes a file to a path, by the name of the file."""


def write_pictures(
    folder: Path,
    pictures: Pictures,
    on_step: Callable[[str], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> dict[str, str]:
    """Writes pictures into an existing folder, one after the other.

    Args:
        folder: Where to.
        pictures: What to write.
        on_step: Called with the name of each file before it is written.
        should_stop: Asked before each; after True no further one is written.

    Returns:
        Of each that could not be written, the name and why, in one line.
    """
    failed = {}
    with _only_what_is_new():
        for name, write in pictures.items():
            if should_stop is not None and should_stop():
                failed[name] = "not begun, as the program was asked to stop"
                continue
            if on_step is not None:
                on_step(name)
            part = folder / f".part-{name}"  # with the ending that tells the kind of picture
            try:
                write(part)
                part.rename(folder / name)
            except Exception as problem:
                failed[name] = (str(problem) or type(problem).__name__).splitlines()[0][:300]
                part.unlink(missing_ok=True)
            gc.collect()  # figures refer to themselves, and those of hours hold a hundred megabytes
    return failed


@contextmanager
def _only_what_is_new() -> Iterator[None]:
    """Lets the collector of garbage search only what is made meanwhile.

    Else it walks each time through all of Drake, numba and matplotlib, which takes longer than to
    draw a figure.
    """
    if gc.get_freeze_count():  # somebody else's, who would lose it
        yield
        return
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
