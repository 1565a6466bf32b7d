"""Pictures that come after the data: each appears whole or not at all, and none spoils another."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drake.analyses.reporting.written_files import whole_file

Pictures = dict[str, Callable[[Path], object]]
"""What writes a file to a path, by the name of the file."""


class NothingToDraw(Exception):
    """There are no data yet for a figure; it is left out, and that is no failure."""


def write_pictures(
    folder: Path,
    pictures: Pictures,
    on_step: Callable[[str], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> dict[str, str]:
    """Writes pictures into an existing folder, one after the other.

    Args:
        folder: Where to.
        pictures: What to write; one that raises NothingToDraw is left out.
        on_step: Called with the name of each file before it is written.
        should_stop: Asked before each; after True no further one is written.

    Returns:
        Of each that could not be written, the name and why, in one line.
    """
    failed: dict[str, str] = {}
    makers = [getattr(write, "__self__", None) for write in pictures.values()]
    with _young_garbage():
        for (name, write), maker, next_one in zip(
            pictures.items(), makers, [*makers, None][1:], strict=True
        ):
            if should_stop is not None and should_stop():
                failed[name] = "not begun, as the program was asked to stop"
                continue
            if on_step is not None:
                on_step(name)
            try:
                with whole_file(folder / name) as part:
                    write(part)
            except NothingToDraw:
                continue
            except Exception as problem:
                failed[name] = (str(problem) or type(problem).__name__).splitlines()[0][:300]
            if maker is None or maker is not next_one:  # else the same figure in another format
                gc.collect(0)  # figures refer to themselves; those of hours hold 100 MB
    return failed


MOST_NEW = 2_000_000
"""Objects that one picture may make before garbage is searched for while it is drawn."""


@contextmanager
def _young_garbage() -> Iterator[None]:
    """Keeps what is made meanwhile among the youngest objects, the only ones then searched.

    A search of all walks each time through Drake, numba and matplotlib, which takes as long as to
    draw a figure. Nor does the collector search while a figure grows.
    """
    _, *others = before = gc.get_threshold()
    gc.set_threshold(MOST_NEW, *others)
    try:
        yield
    finally:
        gc.set_threshold(*before)
