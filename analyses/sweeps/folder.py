"""A folder that keeps the finished chunks of a sweep, and what the sweep was asked for."""

from __future__ import annotations

import json
import re
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.written_files import (
    JOURNAL,
    MARKER,
    mark,
    whole_file,
    whole_name,
)
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

ARGUMENTS = "arguments.json"
"""What the sweep was asked for; another sweep may not use the folder."""

CHUNKS = "chunks"
"""Folder of the chunks, one file each."""

OWN_FILE = re.compile(r"arguments\.json|[a-z_]+\.npz")
"""Names of files of which a killed process may have left one in the making in the folder."""

NAMED_DIFFERENCES = 3
"""So many differences between arguments are named in an error."""

LONGEST_VALUE = 40
"""A value of more characters is not written out in an error."""


class SweepFolder:
    """Chunks on disk under the arguments that they were computed for.

    A chunk's file appears whole or not at all, so whatever ends the program, what is there can
    be used.
    """

    def __init__(self, folder: Path, arguments: dict[str, Any]) -> None:
        """Opens the folder, or makes it if it does not exist.

        Args:
            folder: The folder.
            arguments: All that the numbers depend on, for JSON.

        Raises:
            OutputFolderError: The folder belongs to other arguments, which are named, holds other
                files, is a file, or cannot be written.
        """
        self.folder = folder.absolute()
        words = json.dumps(arguments, indent=2, allow_nan=False)
        try:
            self._open(words)
        except OSError as problem:
            raise OutputFolderError(
                f"{self.folder}: cannot be written: {problem.strerror}"
            ) from problem

    def _open(self, words: str) -> None:
        stored = self.folder / ARGUMENTS
        if stored.is_file():
            different = list(differences(read_arguments(stored), load_json(words)))
            if different:
                more = len(different) - NAMED_DIFFERENCES
                raise OutputFolderError(
                    f"{self.folder}: holds results of other arguments: "
                    + "; ".join(different[:NAMED_DIFFERENCES])
                    + (f"; and {more} more" if more > 0 else "")
                    + "; name another folder"
                )
        else:
            check_sweep_folder(self.folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        mark(self.folder)
        for path in self.folder.iterdir():
            if OWN_FILE.fullmatch(whole_name(path.name) or ""):
                path.unlink()
        if not stored.is_file():
            write_whole(stored, words + "\n")

    def load(self, task: str, start: int, stop: int) -> dict[str, np.ndarray] | None:
        """The arrays of items start to stop of a task; None if not there or damaged."""
        return load_arrays(self._chunk(task, start, stop))

    def _chunk(self, task: str, start: int, stop: int) -> Path:
        return self.folder / CHUNKS / f"{task}-{start:07d}-{stop:07d}.npz"

    def store(self, task: str, start: int, stop: int, arrays: dict[str, np.ndarray]) -> None:
        """Keeps the arrays of a chunk.

        Raises:
            OutputFolderError: The folder cannot be written, for instance on a full disk.
        """
        try:
            (self.folder / CHUNKS).mkdir(exist_ok=True)
            store_arrays(self._chunk(task, start, stop), arrays)
        except OSError as problem:
            raise OutputFolderError(
                f"{self.folder}: cannot be written: {problem.strerror}; what was finished "
                "before is kept, and found by the same command"
            ) from problem


def check_sweep_folder(folder: Path) -> None:
    """Refuses what can be no folder of a sweep, whatever its arguments are.

    Raises:
        OutputFolderError: It holds other files, is a file, or cannot be read.
    """
    folder = folder.absolute()
    try:
        if not folder.exists() or (folder / ARGUMENTS).is_file():
            return
        if not folder.is_dir():
            raise OutputFolderError(f"{folder}: found a file; accepted: a folder")
        foreign = [path.name for path in folder.iterdir() if not _in_the_making(path.name)]
        if any(name not in (MARKER, JOURNAL) for name in foreign):
            raise OutputFolderError(
                f"{folder}: holds files already, not those of a sweep; name another folder"
            )
    except OSError as problem:
        raise OutputFolderError(f"{folder}: cannot be read: {problem.strerror}") from problem


def _in_the_making(name: str) -> bool:
    """Whether a file is what a killed process left of one of a sweep's, or of the marker."""
    whole = whole_name(name) or ""
    return whole == MARKER or OWN_FILE.fullmatch(whole) is not None


def load_arrays(path: Path) -> dict[str, np.ndarray] | None:
    """Reads what `store_arrays` wrote; None if it is not there or damaged."""
    try:
        # An open file is closed even where numpy stumbles over what is in it.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            return {key: stored[key] for key in stored.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return None


def store_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Writes arrays to a file that appears whole or not at all."""

    with whole_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def differences(there: Any, here: Any, key: str = "") -> Iterator[str]:
    """Words for each place where two JSON values differ, such as `seed is 1 there, 2 here`."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(name for name in there if name not in here)]:
            full = f"{key}.{name}" if key else str(name)
            if name not in there:
                yield f"{full} is not there, {_words(here[name])} here"
            elif name not in here:
                yield f"{full} is {_words(there[name])} there, not here"
            else:
                yield from differences(there[name], here[name], full)
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for index, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from differences(one, other, f"{key}[{index}]")
    elif there != here:
        yield f"{key} is {_words(there)} there, {_words(here)} here"


def read_arguments(path: Path) -> Any:
    """What a sweep was asked for.

    Raises:
        OutputFolderError: The file holds no JSON.
        OSError: It cannot be read.
    """
    try:
        return load_json(path.read_text(encoding="utf-8"))
    except ValueError as problem:
        raise OutputFolderError(
            f"{path}: found no JSON; remove the folder or name another"
        ) from problem


def _words(value: Any) -> str:
    words = json.dumps(value)
    return words if len(words) <= LONGEST_VALUE else "given"
