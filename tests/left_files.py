"""What a command left, beside what it leaves when nobody ends it; see `tests.signals`."""

from __future__ import annotations

import csv
import json
import re
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from cdpr_drake.analyses.frame.folder import foreign_files
from cdpr_drake.analyses.reporting.written_files import MARKER
from cdpr_drake.analyses.runs.log import PARTS

TOLD = re.compile(
    r"/(by_earlier_sessions|note|taken_over|seconds|wall_time_s|microseconds|processor time [^/]*)$"
)
"""Keys and columns of times, and of how often a command was ended; all others are results."""


def broken_files(folder: Path) -> Iterator[str]:
    """Files under a final name that are not whole, by what their ending says they are."""
    for path in sorted(folder.rglob("*")):
        inside = path.relative_to(folder)
        if not path.is_file() or any(part.startswith(".") for part in inside.parts):
            continue
        if PARTS in inside.parts:  # a log in the making
            continue
        try:
            whole = _WHOLE.get(path.suffix, lambda _: True)(path)
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as problem:
            yield f"{inside} is not whole: {problem}"
            continue
        if not whole:
            yield f"{inside} is not whole"


def _whole_csv(path: Path) -> bool:
    with path.open(newline="", encoding="utf-8") as file:
        words = file.read()
    rows = list(csv.reader(words.splitlines()))
    return words.endswith("\n") and len({len(row) for row in rows}) == 1


def _whole_json(path: Path) -> bool:
    json.loads(path.read_text(encoding="utf-8"))
    return True


def _whole_zip(path: Path) -> bool:
    with zipfile.ZipFile(path) as stored:
        return stored.testzip() is None


_WHOLE: dict[str, Callable[[Path], bool]] = {
    ".csv": _whole_csv,
    ".json": _whole_json,
    ".npz": _whole_zip,
    ".png": lambda path: path.read_bytes().endswith(b"IEND\xaeB`\x82"),
    ".pdf": lambda path: path.read_bytes().rstrip().endswith(b"%%EOF"),
    ".html": lambda path: (
        path.read_text(encoding="utf-8").rstrip().endswith(("</html>", "</table>"))
    ),
    ".yaml": lambda path: path.read_text(encoding="utf-8").endswith("\n"),
}


def unknown_files(folder: Path) -> Iterator[str]:
    """Files of results folders that these do not know as their own; nobody else writes here."""
    for marker in folder.rglob(MARKER):
        inside = marker.parent.relative_to(folder)
        if not any(part.startswith(".") for part in inside.parts):
            for name in foreign_files(marker.parent):
                yield f"{inside / name} is not known to be the program's"


class Reference:
    """What a command leaves that nobody ends, from two runs of it."""

    def __init__(self, one: Path, other: Path) -> None:
        """Compares the two."""
        self.folder = one
        names = _names(one)
        if names != _names(other):
            raise RuntimeError(f"{one}: two runs left other files: {names ^ _names(other)}")
        self.same = {n for n in names if (one / n).read_bytes() == (other / n).read_bytes()}
        self.names = names
        self._results, self._unlike = {}, {}
        for name in names:
            if name.endswith(".json"):
                there, again = _results(one / name), _results(other / name)
                self._results[name] = there
                self._unlike[name] = {k for k in there if again.get(k) != there[k]}

    def differs(self, folder: Path, whole: bool) -> Iterator[str]:
        """In which files a folder differs; with `whole`, all must be there, and no others."""
        names = _names(folder)
        if whole and names != self.names:
            missing, more = sorted(self.names - names), sorted(names - self.names)
            yield f"files missing: {missing}, too many: {more}"
        for name in sorted(names & self.names):
            path = folder / name
            if not whole and PurePosixPath(name).name == MARKER:
                continue  # it lists what is there so far, see `unknown_files`
            if path.read_bytes() == (self.folder / name).read_bytes():
                continue
            if name in self._results and (whole or name in self.same):
                there, here = self._results[name], _results(path)
                keys = {k for k in there | here if there.get(k) != here.get(k)}
                if keys := keys - self._unlike[name]:
                    yield f"{name} says other things: {sorted(keys)[:4]}"
            elif name in self.same:
                yield f"{name} has other bytes"


def _names(folder: Path) -> set[str]:
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and PARTS not in path.relative_to(folder).parts
    }


def _results(path: Path) -> dict[str, Any]:
    """Numbers and words of a JSON file by where they stand, but for what is `TOLD`."""
    found = _leaves(json.loads(path.read_text(encoding="utf-8")))
    return {key: value for key, value in found if not TOLD.search(key)}


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers and words of a JSON value, each with where it stands; of a table, by columns."""
    if isinstance(value, dict) and value.keys() >= {"columns", "rows"}:
        names = [f"{name} ({number})" for number, name in enumerate(value["columns"])]
        rows = [dict(zip(names, row, strict=True)) for row in value["rows"]]
        value = {**value, "rows": rows}
    if isinstance(value, dict):
        for name, below in value.items():
            yield from _leaves(below, f"{key}/{name}")
    elif isinstance(value, list):
        for index, below in enumerate(value):
            yield from _leaves(below, f"{key}/{index}")
    else:
        yield key, value
