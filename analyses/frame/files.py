"""Writes files into a folder: all or none, and replaces none unless it may."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from cdpr_drake.analyses.frame.result import Result
from cdpr_drake.errors import OutputFolderError, why_not_read


@dataclass(frozen=True, repr=False)
class WrittenFiles(Result):
    """Files that were written.

    Attributes:
        about: What they are, for JSON.
        paths: The files.
        remarks: What a user has to know of them.
        more: What else JSON has.
    """

    about: Mapping[str, Any]
    paths: Sequence[Path]
    remarks: Sequence[str] = ()
    more: Mapping[str, Any] | None = None

    def as_dict(self) -> dict[str, Any]:
        """What they are, and their paths."""
        return {**self.about, "files": [str(path) for path in self.paths], **(self.more or {})}

    def lines(self) -> list[str]:
        """Their paths."""
        return [str(path) for path in self.paths]

    def notes(self) -> Sequence[str]:
        """What a user has to know."""
        return self.remarks


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
    existing = [str(path) for path in paths if path.exists()]
    if existing and not overwrite:
        raise OutputFolderError(
            f"out: found {', '.join(existing)}; accepted: a folder without, or add --overwrite"
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
        words = f"{folder}: cannot be written: {why_not_read(problem)}"
        raise OutputFolderError(words) from problem
    return paths


def copy_new(contents: dict[str, bytes], folder: Path) -> list[str]:
    """Writes files that are not there yet; returns their names.

    Args:
        contents: By name.
        folder: Made where there is none.

    Raises:
        OutputFolderError: A file of that name is there with another content, and nothing was
            written; or one cannot be written, and none is left.
    """
    check_no_file(folder)
    existing = [
        name for name in contents if (folder / name).exists() or (folder / name).is_symlink()
    ]
    changed = [name for name in existing if not _holds(folder / name, contents[name])]
    if changed:
        raise OutputFolderError(
            f"{folder}: found {', '.join(changed)} with other content, which is never "
            "overwritten; accepted: another folder"
        )
    written: list[str] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in contents:
            if name not in existing:
                with (folder / name).open("xb") as file:
                    written.append(name)
                    file.write(contents[name])
    except OSError as problem:
        for name in written:
            (folder / name).unlink(missing_ok=True)
        words = f"{folder}: cannot be written: {why_not_read(problem)}"
        raise OutputFolderError(words) from problem
    return written


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:
        return False
