"""A log that grows on disk during a run: memory stays small, and no end of a run loses it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, TypeAlias

import numpy as np

from cdpr_drake.analyses.reporting.written_files import claim
from cdpr_drake.arrays import Array
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

Log: TypeAlias = Mapping[str, Array]
"""Times "time", shape (n,) [s], and quantities by name, shape (n, size)."""

PARTS = "log.parts"
"""Folder of a log in the making: a file a quantity, rows of 8-byte numbers, and the layout."""

CHECKPOINT = "checkpoint.npz"
"""State of the run beside its log, see `analyses.simulation`."""

UNWRITTEN_CHECKPOINT = f".{CHECKPOINT}"
"""A checkpoint in the making, which a program that was killed leaves behind."""

LAYOUT = "layout.json"
_NUMBER = np.dtype("<f8")


class LogOnDisk(Mapping[str, Array]):
    """A log in files, one a quantity; each look at a quantity reads it anew from its file.

    The files stay readable through this object after `remove`, as long as it lives.
    """

    def __init__(self, folder: Path, sizes: dict[str, int | None], rows: int, mode: str) -> None:
        """Opens the files of a folder; see `create` and `open`."""
        self._folder, self._sizes, self._rows = folder, sizes, rows
        if mode != "rb":
            claim(*(_file_of(folder, name) for name in sizes))
        self._files: dict[str, BinaryIO] = {
            name: _file_of(folder, name).open(mode, buffering=0)  # type: ignore[misc]
            for name in sizes
        }

    @classmethod
    def create(cls, folder: Path, first: Log) -> LogOnDisk:
        """A log that begins with some rows, in a new folder.

        Raises:
            OSError: It cannot be written.
        """
        folder.mkdir()
        sizes = {
            name: None if values.ndim == 1 else values.shape[1] for name, values in first.items()
        }
        claim(folder / LAYOUT)
        (folder / LAYOUT).write_text(json.dumps(sizes) + "\n", encoding="utf-8")
        log = cls(folder, sizes, 0, "x+b")
        log.append(first)
        return log

    @classmethod
    def open(cls, folder: Path) -> LogOnDisk:
        """What a run left behind that was killed: the rows that are whole in all files.

        Raises:
            OutputFolderError: There is none, or it holds no whole row.
        """
        try:
            sizes = load_json((folder / LAYOUT).read_text(encoding="utf-8"))
            rows = min(
                _file_of(folder, name).stat().st_size // (_NUMBER.itemsize * (size or 1))
                for name, size in sizes.items()
            )
            if rows == 0:
                raise ValueError("no whole row")
            return cls(folder, sizes, rows, "rb")
        except (OSError, ValueError, TypeError, AttributeError) as problem:
            raise OutputFolderError(f"{folder}: no log that can be read: {problem}") from problem

    @classmethod
    def reopen(cls, folder: Path, rows: int) -> LogOnDisk:
        """What a run left behind, to go on writing after a number of rows; later ones are cut off.

        Raises:
            OutputFolderError: There are not as many.
        """
        there = cls.open(folder)
        if there.rows < rows:
            raise OutputFolderError(
                f"{folder}: found {there.rows} rows of the log; accepted: the {rows} of its "
                "checkpoint at least"
            )
        log = cls(folder, there._sizes, rows, "r+b")
        for name, size in log._sizes.items():
            log._files[name].truncate(rows * (size or 1) * _NUMBER.itemsize)
            log._files[name].seek(0, 2)
        return log

    @property
    def rows(self) -> int:
        """Number of rows, the same for all quantities."""
        return self._rows

    def append(self, rows: Log) -> None:
        """Writes more rows, of the same quantities; raises OSError where the disk is full."""
        for name, values in rows.items():
            data = memoryview(np.ascontiguousarray(values, _NUMBER).tobytes())
            while data:
                data = data[self._files[name].write(data) :]
        self._rows += len(rows["time"])

    def block(self, name: str, start: int, stop: int) -> Array:
        """Rows of a quantity from `start` to before `stop`."""
        size = self._sizes[name]
        start, stop = min(start, self._rows), min(stop, self._rows)
        file, count = self._files[name], (stop - start) * (size or 1)
        file.seek(start * (size or 1) * _NUMBER.itemsize)
        values = np.fromfile(file, _NUMBER, count)
        file.seek(0, 2)
        if len(values) < count:
            raise OSError(f"{self._folder / name}: shorter than it was")
        return values if size is None else values.reshape(-1, size)

    def remove(self) -> None:
        """Removes the folder; the log stays readable here until nobody holds it any more."""
        for name in self._files:
            _file_of(self._folder, name).unlink(missing_ok=True)
        for name in (LAYOUT, CHECKPOINT, UNWRITTEN_CHECKPOINT):
            (self._folder / name).unlink(missing_ok=True)
        with suppress(OSError):
            self._folder.rmdir()

    def __getitem__(self, name: str) -> Array:
        """All rows of a quantity, read now."""
        return self.block(name, 0, self._rows)

    def __iter__(self) -> Iterator[str]:
        """Names of the quantities, "time" first."""
        return iter(self._sizes)

    def __len__(self) -> int:
        """Number of quantities."""
        return len(self._sizes)

    def __del__(self) -> None:
        """Closes the files."""
        for file in getattr(self, "_files", {}).values():
            file.close()


def log_block(log: Log, name: str, start: int, stop: int) -> Array:
    """Rows of a quantity from `start` to before `stop`, without reading the others."""
    return log.block(name, start, stop) if isinstance(log, LogOnDisk) else log[name][start:stop]


def log_rows(log: Log, name: str) -> int:
    """Number of rows of a quantity, without reading it."""
    return log.rows if isinstance(log, LogOnDisk) else len(log[name])


def _file_of(folder: Path, name: str) -> Path:
    return folder / f"{name}.f8"
