"""Results folders: one writer at a time, files that appear whole, and no file of others removed.

The marker of a folder holds the arguments of what is computed in it, whether the results are
complete, and the names of the files that this program wrote. The same arguments go on where an
unfinished folder stands. Other files, and files that changed after the results were complete, are
refused and never removed.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, Self

import numpy as np
from filelock import FileLock, Timeout

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.reporting.written_files import MARKER
from cdpr_drake.errors import OutputFolderError, StoppedError
from cdpr_drake.schema.input_files import inputs_held
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.version import __version__

LOCK, PART = ".cdpr_drake.lock", ".part-"
"""The lock, and what the name of a file in the making begins with."""

INPUTS = "inputs.json"
"""Files of users that the results follow from, with their SHA-256 and sizes [byte]."""

LONGEST_VALUE = 60
"""Longer JSON values are not quoted in refusals [characters]."""


class Folder:
    """A results folder that this process writes inside its `with` block.

    Attributes:
        path: The folder.
        resumed: True if an earlier process began the same computation and did not complete it.
    """

    def __init__(
        self, path: Path, arguments: Mapping[str, Any], overwrite: bool = False,
        grows: bool = False, elsewhere: str = "name another folder",
    ) -> None:  # fmt: skip
        """Checks the path; nothing is written before the block.

        Args:
            path: The folder; it need not exist.
            arguments: All that the results depend on, for JSON.
            overwrite: True to remove results of other arguments, and complete ones, first.
            grows: True if complete results of the same arguments may get more, or be read again.
            elsewhere: What one does, other than to overwrite, if other results are there.

        Raises:
            OutputFolderError: The path is a file, a mount point, or the working folder or above it.
        """
        self.path, self.resumed = Path(path).absolute(), False
        self._arguments: Any = load_json(json.dumps(arguments))
        self._overwrite, self._grows, self._elsewhere = overwrite, grows, elsewhere
        self._files: list[str] = []
        self._made: list[Path] = []
        self._open_now = False
        self._lock = FileLock(self.path / LOCK)
        working, real = Path.cwd(), self.path.resolve()
        if real == working or real in working.parents or os.path.ismount(real):
            raise OutputFolderError(
                f"{path}: found the working folder, one above it or a mount point; accepted: a "
                "folder of its own"
            )
        if self.path.exists() and not self.path.is_dir():
            raise OutputFolderError(f"{path}: found a file; accepted: a folder")

    def __enter__(self) -> Self:
        """Locks the folder, and removes older results if `overwrite` says so.

        Raises:
            OutputFolderError: It holds other files or other results, cannot be written, or another
                process writes it.
        """
        with self.writing():
            self._made = [path for path in (self.path, *self.path.parents) if not path.exists()]
            self.path.mkdir(parents=True, exist_ok=True)
            lock_was_there = (self.path / LOCK).exists()
            try:
                self._lock.acquire(timeout=0)
            except Timeout:
                raise OutputFolderError(f"{self.path}: another command writes there") from None
            try:
                self._open()
            except BaseException:
                if not lock_was_there:
                    (self.path / LOCK).unlink(missing_ok=True)
                self._release()
                raise
        return self

    def __exit__(self, *_: object) -> None:
        """Unlocks the folder, and removes it and what was made above it if nothing was written."""
        self._release()

    def _open(self) -> None:
        foreign = foreign_files(self.path)
        if foreign:
            raise OutputFolderError(
                f"{self.path}: holds files that cdpr did not write, or that changed since: "
                f"{', '.join(foreign[:3])}; name another folder"
            )
        marker = read_marker(self.path)
        if marker is not None:
            different = list(differences(marker["arguments"], self._arguments))
            goes_on = self._grows or not marker["complete"]
            self.resumed = goes_on and not different and not self._overwrite
            if not self.resumed and not self._overwrite:
                words = "; ".join(different[:3])
                there = f"other results: {words}" if words else "complete results of this command"
                raise OutputFolderError(
                    f"{self.path}: holds {there}; {self._elsewhere} or add overwrite"
                )
            self._files = marker["files"]
        for path in list(self.path.iterdir()):
            if path.name.startswith(PART) or (path.name in self._files and not self.resumed):
                _remove(path)
        if not self.resumed:
            self._files = []
        self._open_now = True
        self._mark(complete=False)

    def _release(self) -> None:
        with suppress(OSError):
            if self._open_now and not self._files:
                (self.path / MARKER).unlink()
            if [path.name for path in self.path.iterdir()] == [LOCK]:
                (self.path / LOCK).unlink()
            for path in self._made:
                path.rmdir()  # which fails unless it is empty
        self._lock.release()

    def claim(self, name: str) -> Path:
        """The path of a file or folder in it, which is this program's from now on."""
        if name not in self._files:
            self._files.append(name)
            self._mark(complete=False)
        return self.path / name

    @contextmanager
    def file(self, name: str) -> Iterator[Path]:
        """Where to write a file that appears whole, or not at all, when the block ends.

        Args:
            name: Path below the folder; its first part is what is claimed.

        Raises:
            OutputFolderError: It cannot be written, for instance on a full disk.
        """
        with self.writing():
            self.claim(Path(name).parts[0])
            final = self.path / name
            final.parent.mkdir(exist_ok=True)
            part = final.with_name(PART + final.name)
            try:
                yield part
                _sync(part)
                part.replace(final)
            finally:
                part.unlink(missing_ok=True)

    @contextmanager
    def files(self) -> Iterator[Path]:
        """A folder whose files get into this one, each whole, when the block ends.

        Raises:
            OutputFolderError: They cannot be written, for instance on a full disk.
        """
        stage = self.path / f"{PART}files"
        with self.writing():
            shutil.rmtree(stage, ignore_errors=True)
            stage.mkdir()
            try:
                yield stage
                for path in sorted(stage.iterdir()):
                    _sync(path)
                    path.replace(self.claim(path.name))
            finally:
                shutil.rmtree(stage, ignore_errors=True)

    def write_text(self, name: str, words: str) -> None:
        """Writes a text file."""
        with self.file(name) as part:
            part.write_text(words, encoding="utf-8")

    def write_json(self, name: str, value: Any) -> None:
        """Writes numbers and words for other programs; all numbers are finite."""
        self.write_text(name, json.dumps(value, indent=2, allow_nan=False) + "\n")

    def write_arrays(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Writes arrays by name."""
        with self.file(name) as part, part.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    def write_all(
        self,
        writers: Mapping[str, Callable[[Path], object]],
        stop: Callable[[], bool] = lambda: False,
    ) -> dict[str, str]:
        """Writes files by name, one of which spoils no other; returns why some were not written.

        A figure that raises NothingToDraw is left out.
        """
        failed: dict[str, str] = {}
        for name, write in writers.items():
            if stop():
                failed[name] = "not begun, as the command was asked to stop"
                continue
            try:
                with self.file(name) as part:
                    write(part)
            except NothingToDraw:
                continue
            except Exception as problem:  # whatever a figure stumbles over
                failed[name] = (str(problem) or type(problem).__name__).splitlines()[0][:300]
        return failed

    def discard(self) -> None:
        """Removes what was written: nothing was computed."""
        for name in self._files:
            if (self.path / name).exists():
                _remove(self.path / name)
        self._files = []

    def complete(self, **more: Any) -> None:
        """Marks the results as complete, and writes hashes of the files of users that were read.

        Args:
            more: Arguments that make them other results than the same command gives.
        """
        self._arguments |= more
        files = inputs_held()
        hashes = {} if files is None else files.hashes(self.path)
        if hashes:
            self.write_json(INPUTS, hashes)
        with self.writing():
            self._mark(complete=True)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Turns an OSError of the block into OutputFolderError, which says what is kept."""
        try:
            yield
        except OSError as problem:
            raise OutputFolderError(
                f"{self.path}: cannot be written: {problem.strerror or problem}; what was finished "
                "is kept, and the same command goes on"
            ) from problem

    def _mark(self, complete: bool) -> None:
        words = json.dumps(
            {
                "program": "cdpr_drake", "version": __version__, "complete": complete,
                "files": sorted(self._files), "arguments": self._arguments,
            },
            indent=1,
        )  # fmt: skip
        part = self.path / (PART + MARKER)
        part.write_text(words + "\n", encoding="utf-8")
        _sync(part)
        part.replace(self.path / MARKER)


def load_arrays(path: Path) -> dict[str, np.ndarray] | None:
    """Reads what `Folder.write_arrays` wrote; None if it is not there or damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            return {key: stored[key] for key in stored.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return None


def read_marker(folder: Path) -> dict[str, Any] | None:
    """The marker of a results folder; None without one, or if it cannot be read."""
    try:
        marker = load_json((folder / MARKER).read_text(encoding="utf-8"))
        names = {"complete": bool(marker["complete"]), "files": list(marker["files"])}
        return {"arguments": marker["arguments"], **names}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def foreign_files(folder: Path) -> list[str]:
    """Names that this program did not write, or that changed after the results were complete."""
    marker = read_marker(folder)
    names = {MARKER, LOCK} if marker is not None else {LOCK}
    written = [] if marker is None else marker["files"]
    latest = (folder / MARKER).stat().st_mtime_ns if marker and marker["complete"] else None

    def foreign(path: Path) -> bool:
        if path.name in names or path.name.startswith(PART):
            return False
        changed = latest is not None and path.lstat().st_mtime_ns > latest
        return path.name not in written or changed

    return [path.name for path in sorted(folder.iterdir()) if foreign(path)]


def free_folder(base: Path, arguments: Mapping[str, Any]) -> Path:
    """The first of base, base-2, ... that is free, or where these arguments go on."""
    wanted = load_json(json.dumps(arguments))
    for number in count(1):
        path = base if number == 1 else base.with_name(f"{base.name}-{number}")
        marker = read_marker(path)
        goes_on = marker is not None and not marker["complete"] and marker["arguments"] == wanted
        if not path.exists() or (goes_on and not is_locked(path)):
            return path
    raise AssertionError


@contextmanager
def results_folder(
    name: str, arguments: Mapping[str, Any], folder: Path | str | None, overwrite: bool,
    results: Path | None, grows: bool = False,
) -> Iterator[Folder | None]:  # fmt: skip
    """The open results folder of a verb; None if nothing is kept.

    Args:
        name: Name of a folder, if none is given: beside `results` a free one of this name, such as
            plans/ROBOT; if it grows one in `results`, which the same arguments give again.
        arguments: All that the results depend on, for JSON.
        folder: The folder; None: one by `name`.
        overwrite: As of `Folder`, like grows.
        results: As of `Follow`.
        grows: True if complete results of the same arguments may get more, or be read again.
    """
    if folder is None and results is None:
        yield None
        return
    if folder is None and grows:
        digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
        folder = (results or Path()) / f"{name}-{digest[:8]}"
    path = folder or free_folder((results or Path()).parent / name, arguments)
    with Folder(Path(path), arguments, overwrite, grows) as opened:
        yield opened


def write_result(
    result: Any, results: Folder, formats: Sequence[str], follow: Follow,
    pages: Mapping[str, Callable[[Path], object]] | None = None, complete: bool = False,
) -> None:  # fmt: skip
    """Writes a result into a folder: numbers first, then figures, one of which spoils no other.

    Args:
        result: A `Result` with `write(folder)`, and `failed`, to which files that fail are added.
        results: The open folder.
        formats: Formats of figures.
        follow: Who follows.
        pages: Writers of files that are drawn like figures, by name.
        complete: True if all numbers are there: figures that are not are drawn.

    Raises:
        OutputFolderError: A file of numbers cannot be written.
        StoppedError: The work was asked to stop before all figures were drawn.
    """
    from cdpr_drake.analyses.frame.figures import figure_writers

    follow.doing("Writing results")
    if not complete:
        result.write(results)
    writers = {**figure_writers(result.figures(), formats), **(pages or {})}
    if complete:
        writers = {name: w for name, w in writers.items() if not (results.path / name).exists()}
    result.failed.update(results.write_all(writers, follow.stop))
    if follow.stop():
        raise StoppedError(
            f"stopped before all figures were drawn; numbers are in {results.path}, and the same "
            "command goes on"
        )
    results.complete()


def shown_path(folder: Path) -> Path:
    """A path as users read it: from the working folder if it lies below."""
    here = Path.cwd().resolve()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder


def is_locked(folder: Path) -> bool:
    """True if a process writes a results folder."""
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        return True
    lock.release()
    return False


def differences(there: Any, here: Any, key: str = "") -> Iterator[str]:
    """Words for each place at which two JSON values differ, such as `seed is 1 there, 2 here`."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in {**there, **here}:
            full = f"{key}.{name}" if key else str(name)
            if name not in there:
                yield f"{full} is not there, {_quoted(here[name])} here"
            elif name not in here:
                yield f"{full} is {_quoted(there[name])} there, not here"
            else:
                yield from differences(there[name], here[name], full)
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for index, (first, second) in enumerate(zip(there, here, strict=True)):
            yield from differences(first, second, f"{key}[{index}]")
    elif there != here:
        yield f"{key} is {_quoted(there)} there, {_quoted(here)} here"


def _quoted(value: Any) -> str:
    words = json.dumps(value)
    return words if len(words) <= LONGEST_VALUE else "another"


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _sync(path: Path) -> None:
    """Brings a file's content to the disk before it gets its name."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
