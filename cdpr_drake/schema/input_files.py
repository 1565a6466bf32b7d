"""Files that a computation reads, each read once: what is changed on the way changes nothing.

Inside `inputs_read_once` a file is read when it is asked for first, and its content stays. All that
reads files of users asks here: `input_bytes` for content, `input_there` whether there is one, and
`input_path` where Drake reads a file by itself. `SentInputs` takes the contents along to another
process, maybe of another machine, where a file of the same path may say something else.

Files of the package count as its code, and are read where they are.
"""

from __future__ import annotations

import errno
import hashlib
import importlib.util
import os
import stat
from collections.abc import Callable, Iterable
from contextlib import ContextDecorator
from contextvars import ContextVar, Token
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic, Self, TypeVar

_MADE = "|made"
"""End of a key of what was made of a file or folder, instead of its content."""


class InputFiles:
    """Contents of files by absolute path."""

    def __init__(self) -> None:
        """Of none yet."""
        self._contents: dict[str, bytes] = {}

    def content(self, path: Path) -> bytes:
        """The content of a file, read now if that was not done before; raises OSError."""
        key = os.path.abspath(path)
        if key not in self._contents:
            if _is_own(key):
                return path.read_bytes()
            self._contents[key] = path.read_bytes()
        return self._contents[key]

    def made(self, path: Path, make: Callable[[], str]) -> str:
        """The text that is made of a file or folder, now if that was not done before."""
        key = os.path.abspath(path) + _MADE
        if key not in self._contents:
            if _is_own(key):
                return make()
            self._contents[key] = make().encode()
        return self._contents[key].decode()

    def knows(self, path: Path) -> bool:
        """Whether a file or folder was read before."""
        key = os.path.abspath(path)
        return key in self._contents or key + _MADE in self._contents

    def placed(self, paths: Iterable[Path]) -> Path:
        """A folder below which files of these contents lie by their absolute paths."""
        known = {os.path.abspath(path): self.content(path) for path in paths}
        return _placed(tuple(sorted(known.items())))

    def hashes(self, folder: Path) -> dict[str, dict[str, Any]]:
        """SHA-256 and size of all files, by name, or by path where two have one name.

        Without those that lie in a folder of results with the same bytes, as a run's own scenario
        does when the run is continued.
        """
        paths = {
            key: path for key, content in self._contents.items()
            if not _has(folder, Path(path := key.removesuffix(_MADE)).name, content)
        }  # fmt: skip
        names = [Path(path).name for path in paths.values()]
        return {
            Path(path).name if names.count(Path(path).name) == 1 else key: {
                "sha256": hashlib.sha256(self._contents[key]).hexdigest(),
                "bytes": len(self._contents[key]),
            }
            for key, path in sorted(paths.items())
        }


def _has(folder: Path, name: str, content: bytes) -> bool:
    file = folder / name
    return file.is_file() and file.read_bytes() == content


_held: ContextVar[InputFiles | None] = ContextVar("input_files", default=None)


class inputs_read_once(ContextDecorator):  # reads as what holds in the block
    """Within the block, or a call that it decorates, each file is read once; blocks may nest."""

    def __init__(self, files: InputFiles | None = None) -> None:
        """With what was read before; None: what surrounds the block has, or nothing."""
        self._files, self._before = files, list[Token[InputFiles | None]]()

    def __enter__(self) -> Self:
        """Begins the block."""
        self._before.append(_held.set(self._files or _held.get() or InputFiles()))
        return self

    def __exit__(self, *_: object) -> None:
        """What was read is forgotten with the outermost block."""
        _held.reset(self._before.pop())

    def _recreate_cm(self) -> Self:
        """One of its own for each call of what it decorates, also of another thread."""
        return type(self)(self._files)


def inputs_held() -> InputFiles | None:
    """What was read in the block; None: there is no block."""
    return _held.get()


Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class SentInputs(Generic[Job, Result]):
    """Does a job in another process with the files that were read here.

    Attributes:
        work: What does the job.
        files: What was read.
    """

    work: Callable[[Job], Result]
    files: InputFiles

    def __call__(self, job: Job) -> Result:
        """Does it."""
        with inputs_read_once(self.files):
            return self.work(job)


def input_bytes(path: Path) -> bytes:
    """The content of a file; raises OSError."""
    held = _held.get()
    if held is not None and held.knows(path):
        return held.content(path)
    file_size(path)
    return path.read_bytes() if held is None else held.content(path)


def input_text(path: Path) -> str:
    """As UTF-8 with any ends of lines; raises OSError and UnicodeDecodeError."""
    return input_bytes(path).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def input_size(path: Path) -> int:
    """Size of a file [byte]; raises OSError."""
    held = _held.get()
    known = held is not None and held.knows(path)
    return len(input_bytes(path)) if known else file_size(path)


def file_size(path: Path) -> int:
    """Size of a file [byte]; OSError of what may never end, as a pipe or a device."""
    state = path.stat()
    if not (stat.S_ISREG(state.st_mode) or stat.S_ISDIR(state.st_mode)):
        raise OSError(errno.EINVAL, "no regular file", str(path))
    return state.st_size


def input_there(path: Path) -> bool:
    """Whether there is such a file, or was when it was read."""
    held = _held.get()
    return (held is not None and held.knows(path)) or os.path.isfile(path)


def made_of_input(path: Path, make: Callable[[], str]) -> str:
    """The text that is made of a file or folder which other libraries read."""
    held = _held.get()
    return make() if held is None else held.made(path, make)


def input_path(path: Path, beside: Iterable[Path] = ()) -> Path:
    """Where a library finds a file by itself, with the content that was read, and further files.

    Args:
        path: The file.
        beside: Files that it names.
    """
    held = _held.get()
    key = os.path.abspath(path)
    if held is None or _is_own(key):
        return path
    return held.placed([path, *beside]) / key.lstrip("/")


def _is_own(path: str) -> bool:
    return path.startswith(_own_folders())


@cache
def _own_folders() -> tuple[str, ...]:
    found = []
    for name in ("cdpr_drake", "cdpr_drake.models", "cdpr_drake.systems", "cdpr_drake.analyses"):
        spec = importlib.util.find_spec(name)
        for folder in (spec and spec.submodule_search_locations) or ():
            found += [f"{Path(folder).absolute()}/", f"{Path(folder).resolve()}/"]
    return tuple(dict.fromkeys(found))


_folders: dict[tuple[tuple[str, bytes], ...], TemporaryDirectory[str]] = {}
"""Folders of this process with files for libraries, removed when it ends."""


def _placed(contents: tuple[tuple[str, bytes], ...]) -> Path:
    if contents not in _folders:
        folder = TemporaryDirectory(prefix="cdpr-inputs-", ignore_cleanup_errors=True)
        for path, content in contents:
            file = Path(folder.name, path.lstrip("/"))
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        _folders[contents] = folder
    return Path(_folders[contents].name)
