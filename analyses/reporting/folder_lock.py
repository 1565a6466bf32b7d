"""Who writes a folder is alone there; names that nobody has."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drake.errors import OutputFolderError


def free_folder(base: Path) -> Path:
    """`base`, or the first of base-2, base-3, ... that is not there and that nobody is writing."""
    number, folder = 1, base
    while folder.exists() or _is_locked(folder):
        number += 1
        folder = base.with_name(f"{base.name}-{number}")
    return folder


def _lock_of(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.lock")


def _is_locked(folder: Path) -> bool:
    """Whether a run is writing this folder; a file that a killed one left says nothing."""
    try:
        with _lock_of(folder).open("r+") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False


@contextmanager
def locked(final: Path) -> Iterator[None]:
    """Nobody else writes this folder inside the block; whatever ends this program frees it."""
    lock = _lock_of(final)
    try:
        file = lock.open("w")
    except OSError as problem:
        raise OutputFolderError(f"{final}: cannot be written: {problem.strerror}") from problem
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as problem:
            raise OutputFolderError(
                f"{final}: another run is writing there; name another folder"
            ) from problem
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)
