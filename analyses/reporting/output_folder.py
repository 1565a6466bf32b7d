"""A results folder that appears whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdpr_drake.errors import OutputFolderError


def free_folder(base: Path) -> Path:
    """`base`, or the first of base-2, base-3, ... that does not exist."""
    number, folder = 1, base
    while folder.exists():
        number += 1
        folder = base.with_name(f"{base.name}-{number}")
    return folder


@contextmanager
def results_folder(folder: Path, overwrite: bool = False) -> Iterator[Path]:
    """A fresh folder to write to, which becomes `folder` when the block ends without an error.

    Entering it before a long computation finds out in time whether results can be written.

    Args:
        folder: Where the results shall be.
        overwrite: Whether results that are there already may be replaced.

    Raises:
        OutputFolderError: The folder holds something, is a file, or cannot be written.
    """
    folder = folder.absolute()
    if folder.exists():
        if not folder.is_dir():
            raise OutputFolderError(f"{folder}: found a file; accepted: a folder")
        if any(folder.iterdir()) and not overwrite:
            raise OutputFolderError(
                f"{folder}: holds files already; name another folder or allow --overwrite"
            )
    made = [parent for parent in folder.parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as problem:
        _remove_empty(made)
        raise OutputFolderError(f"{folder}: cannot be written: {problem.strerror}") from problem
    try:
        yield work
        work.chmod(0o755)
        if folder.exists():
            shutil.rmtree(folder)
        work.rename(folder)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        _remove_empty(made)
        raise


@contextmanager
def continued_folder(folder: Path, overwrite: bool = False) -> Iterator[Path]:
    """A folder to work in from the start, so that what is in it outlives whatever ends the program.

    Whether what is there may be continued is for `SweepFolder` to say, which makes the folder, too.

    Args:
        folder: Where the results shall be.
        overwrite: Whether what is there is to be removed first.

    Raises:
        OutputFolderError: What is there cannot be removed.
    """
    folder = folder.absolute()
    if overwrite and folder.is_dir():
        try:
            shutil.rmtree(folder)
        except OSError as problem:
            raise OutputFolderError(f"{folder}: cannot be removed: {problem.strerror}") from problem
    yield folder


def _remove_empty(folders: list[Path]) -> None:
    """Removes folders, the deepest first, that exist and hold nothing."""
    for folder in folders:
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
