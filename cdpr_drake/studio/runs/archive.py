"""A results folder as one file."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import IO

from cdpr_drake.errors import OutputFolderError

STORED = frozenset({".png", ".npz", ".mp4", ".zip", ".jpg"})
"""Endings of files that are small already."""


def zipped(folder: Path, file: IO[bytes]) -> None:
    """Writes all of a folder into a zip archive, below the folder's name.

    Links are left out: what they lead to may lie anywhere.

    Raises:
        OutputFolderError: The folder is not there, or the disk is full.
    """
    if not folder.is_dir():
        raise OutputFolderError(f"{folder.name}: is not there any more")
    try:
        with zipfile.ZipFile(file, "w") as archive:
            for path in sorted(folder.rglob("*")):
                if path.is_symlink() or not path.is_file():
                    continue
                small = path.suffix.lower() in STORED
                archive.write(
                    path, Path(folder.name) / path.relative_to(folder),
                    zipfile.ZIP_STORED if small else zipfile.ZIP_DEFLATED,
                )  # fmt: skip
    except OSError as problem:
        raise OutputFolderError(
            f"{folder.name}: cannot be packed: {problem.strerror or problem}"
        ) from problem
