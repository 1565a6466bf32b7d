"""Rows of studies in a folder: each is known by the digest of its call, and kept as it comes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from cdpr_drake.analyses.frame.folder import Folder, differences, read_marker
from cdpr_drake.analyses.workspaces.pose_grid import plain
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

Row = Mapping[str, Any]
Call = partial[Any]
Plan = Sequence[tuple[Mapping[str, Any], Call, str, bool]]
"""Of each row keys, call, digest, and whether it is measured alone."""

ROWS, ARRAYS = "rows.jsonl", "arrays"
"""A line each row, and arrays of rows by digest."""


def digest(call: Call) -> str:
    """What a call is known by: its function and arguments.

    Raises:
        TypeError: An argument has no plain form.
    """
    return hashlib.sha256(json.dumps(_plain_call(call)).encode()).hexdigest()[:20]


def _plain_call(value: Any) -> Any:
    if isinstance(value, partial):
        return [_plain_call(value.func), *map(_plain_call, value.args), _plain_call(value.keywords)]
    if callable(value) and hasattr(value, "__qualname__"):
        return f"{value.__module__.rpartition('.')[2]}.{value.__qualname__}"
    if isinstance(value, Mapping):
        return {str(key): _plain_call(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain_call(item) for item in value]
    return plain(value)


class Arrays(Mapping[str, np.ndarray]):
    """Arrays of a row, read when they are asked for."""

    def __init__(self, path: Path) -> None:
        """Of a file."""
        self.path = path

    def __getitem__(self, name: str) -> np.ndarray:
        with np.load(self.path) as file:
            return np.asarray(file[name])

    def __iter__(self) -> Iterator[str]:
        with np.load(self.path) as file:
            return iter(file.files)

    def __len__(self) -> int:
        return sum(1 for _ in self)


class RowStore:
    """Rows of a folder by the digests of their calls: a line and perhaps a file of arrays each."""

    def __init__(self, folder: Folder) -> None:
        """Of an open folder."""
        self.folder, self.taken = folder, 0
        self.rows = read_rows(folder.path) if folder.resumed else {}
        self._file: TextIO | None = None

    def __enter__(self) -> RowStore:
        """Drops a line that a kill has cut."""
        if self.rows:
            whole = (json.dumps([name, row]) + "\n" for name, row in self.rows.items())
            self.folder.write_text(ROWS, "".join(whole))
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def __contains__(self, name: str) -> bool:
        return name in self.rows

    def add(self, name: str, row: Row) -> None:
        """Keeps a row: its arrays first, so that a line means that all is there.

        Raises:
            OutputFolderError: It cannot be written.
        """
        arrays: dict[str, Any] = {k: a for k, a in row.items() if isinstance(a, np.ndarray)}
        if arrays:
            with self.folder.file(f"{ARRAYS}/{name}.npz") as part, part.open("wb") as file:
                np.savez_compressed(file, **arrays)
        words = plain({key: value for key, value in row.items() if key not in arrays})
        with self.folder.writing():
            if self._file is None:
                self._file = self.folder.claim(ROWS).open("a", encoding="utf-8")
            self._file.write(json.dumps([name, words]) + "\n")
            self._file.flush()
        self.rows[name] = words

    def take_over(self, other: Path) -> None:
        """Takes over rows that other code measured in a folder."""
        for name, row in read_rows(other).items():
            if name not in self.rows:
                path = other / ARRAYS / f"{name}.npz"
                self.add(name, {**row, **(Arrays(path) if path.exists() else {})})
                self.taken += 1

    def in_order(self, plan: Plan, in_memory: bool) -> list[dict[str, Any]]:
        """Rows in the order of the plan, keys first, `arrays` last: in memory, or read later."""
        found = []
        for keys, _, name, _ in plan:
            if name in self.rows:
                path = self.folder.path / ARRAYS / f"{name}.npz"
                arrays = Arrays(path) if path.exists() else None
                kept = dict(arrays) if arrays and in_memory else arrays
                found.append({**plain(keys), **self.rows[name], "arrays": kept})
        return found


def read_rows(folder: Path) -> dict[str, dict[str, Any]]:
    """Rows of a folder by digest; a line that a kill has cut does not count.

    Raises:
        CdprError: A line is none that this program wrote.
    """
    path = folder / ROWS
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    rows = {}
    for number, line in enumerate(lines, 1):
        if not line.endswith("\n"):
            continue
        try:
            name, row = load_json(line)
            rows[str(name)] = dict(row)
        except (ValueError, TypeError) as problem:
            raise CdprError(f"{path}: line {number}: found no row of a study") from problem
    return rows


def check_earlier(folder: Path, arguments: Mapping[str, Any]) -> None:
    """Refuses a folder that has no rows of the same study in the same form.

    Raises:
        CdprError: It has none.
    """
    marker = read_marker(folder)
    told = {} if marker is None else {**marker["arguments"], "code": arguments["code"]}
    if different := list(differences(told, dict(arguments))):
        raise CdprError(f"runs_from: {folder}: {different[0]}; accepted: a folder of this study")
