"""Writes files of a robot into a folder: all or none, and none that is there unless asked to."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import NamedTemporaryFile

from cdpr_drake.errors import OutputFolderError


def check_no_file(folder: Path) -> None:
    """Refuses a file where a folder is wanted.

    Raises:
        OutputFolderError: It is a file.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputFolderError(f"{folder}: found a file; accepted: a folder")


def write_files(folder: Path, files: dict[str, str], overwrite: bool) -> list[Path]:
    """Writes files, each at once; returns their paths.

    Args:
        folder: Made where there is none.
        files: Text of each file, by its name.
        overwrite: Whether files of these names are replaced; others stay in any case.

    Raises:
        OutputFolderError: A file is there already, the folder is a file or cannot be written to.
    """
    check_no_file(folder)
    paths = [folder / name for name in files]
    there = [str(path) for path in paths if path.exists()]
    if there and not overwrite:
        raise OutputFolderError(
            f"--out: found {', '.join(there)}; accepted: a folder without, or --overwrite"
        )
    parts: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for text in files.values():
            with NamedTemporaryFile(
                "w", dir=folder, prefix=".part-", delete=False, encoding="utf-8"
            ) as part:
                parts.append(Path(part.name))
                part.write(text)
            os.chmod(part.name, 0o644)
        for part_path, path in zip(parts, paths, strict=True):
            part_path.replace(path)
    except OSError as problem:
        for part_path in parts:
            part_path.unlink(missing_ok=True)
        raise OutputFolderError(f"{folder}: cannot be written: {problem.strerror}") from problem
    return paths
