"""Which files of a results folder this program wrote: those alone are ever removed.

A folder's marker lists them when a command ends. What a command is about to write meanwhile it
notes in a journal beside the marker, so that it is known whatever ends the program. A file that was
changed after the list is the user's, as is all that stands in neither.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

from cdpr_drake.schema.json_text import load_json
from cdpr_drake.version import __version__

MARKER = ".cdpr_drake.json"
"""File by which this program knows folders that it wrote; no other is ever replaced."""

JOURNAL = ".cdpr_drake.writing"
"""Names of what is written since the marker's list, one a line; gone when a command has ended."""

WORK = "-work-"
"""What follows a results folder's name in that of the hidden one in which it is made."""

DRAWING = ".cdpr_drake.drawing"
"""In a folder whose data is complete while its pictures are drawn, and afterwards where that was
stopped."""

FILES = "files"
"""Key of the list in the marker."""


def mark(folder: Path) -> None:
    """Marks an existing folder as written by this program, if it is not."""
    if _read_marker(folder) is None:
        _write_marker(folder, ())


_PART = re.compile(r"\.part-[a-z0-9_]{8}-(.+)", re.DOTALL)


def new_part(path: Path) -> Path:
    """A new file in which another is written before it has its name, with its ending, which tells
    the format.

    Nobody can foresee its name, and it is no link: a folder may be open to others.

    Raises:
        OSError: It cannot be made.
    """
    handle, name = tempfile.mkstemp(prefix=".part-", suffix=f"-{path.name}", dir=path.parent)
    try:
        os.fchmod(handle, 0o666 & ~_UMASK)
    finally:
        os.close(handle)
    return Path(name)


def _umask() -> int:
    """What files are made without; the system tells it only who changes it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


_UMASK = _umask()


def whole_name(name: str) -> str | None:
    """The name that a file in the making gets; None: it is none."""
    found = _PART.fullmatch(name)
    return None if found is None else found[1]


def left_parts(folder: Path, names: Container[str]) -> list[Path]:
    """Files in the making of these names in a folder, of a program that was killed."""
    with suppress(OSError):
        return [path for path in folder.iterdir() if whole_name(path.name) in names]
    return []


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Where to write a file that appears whole or not at all when the block ends.

    What was there before stays until then.

    Raises:
        OSError: It cannot be written, for instance on a full disk; nothing is left behind.
    """
    claim(path)
    part = new_part(path)
    try:
        yield part
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


class WritingFolder:
    """A results folder that a command writes just now.

    Attributes:
        folder: The folder; it need not be there yet.
        hidden: Whether all of it is this program's, so that nothing need be noted.
    """

    def __init__(self, folder: Path, hidden: bool) -> None:
        """Notes nothing yet."""
        self.folder, self.hidden = folder, hidden
        self._names: set[str] = set()

    def note(self, names: Iterable[str]) -> None:
        """Notes what is about to be written; names from the folder on, those of folders end in /.

        Raises:
            OSError: They cannot be noted.
        """
        new = [] if self.hidden else [name for name in names if name not in self._names]
        if not new:
            return
        journal = os.open(
            self.folder / JOURNAL,
            os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC,
            0o644,
        )
        try:
            os.write(journal, "".join(f"{json.dumps(name)}\n" for name in new).encode())
        finally:
            os.close(journal)
        self._names.update(new)

    def begin(self) -> None:
        """Removes what a killed program left of files in the making."""
        for path in _parts_of(self.folder, _certain(self.folder)):
            path.unlink(missing_ok=True)

    def end(self) -> None:
        """Makes the marker's list of all that is this program's by now."""
        if not self.hidden and ((self.folder / JOURNAL).exists() or self._names):
            _write_marker(self.folder, _there(self.folder, _certain(self.folder)))
            (self.folder / JOURNAL).unlink(missing_ok=True)

    def shown_as(self, folder: Path) -> None:
        """The hidden folder has a name by now, and its marker a list, see `list_all`."""
        claim(folder, ending="/")
        self.folder, self.hidden = folder, False


_writing: list[WritingFolder] = []
"""Those of this process, each after the one that it lies in."""


@contextmanager
def writing(folder: Path, hidden: bool = False) -> Iterator[WritingFolder]:
    """What this program writes into a folder inside the block is known as its own.

    Args:
        folder: Absolute and without links.
        hidden: See `WritingFolder`.

    Raises:
        OSError: A results folder round it cannot be written.
    """
    mine = WritingFolder(folder, hidden)
    claim(folder, ending="/")
    if not hidden:
        mine.begin()
    _writing.append(mine)
    try:
        yield mine
    finally:
        _writing.remove(mine)
        with suppress(OSError):  # a full disk: the journal stays, and says the same
            mine.end()


def claim(*paths: Path, ending: str = "") -> None:
    """Notes files as this program's before they are written, if they lie in a folder in work.

    Raises:
        OSError: They cannot be noted, for instance on a full disk.
    """
    if not _writing:
        return
    for path in paths:
        full = Path(os.path.realpath(path.parent), path.name)
        for each in reversed(_writing):
            if full != each.folder and full.is_relative_to(each.folder):
                each.note([f"{full.relative_to(each.folder).as_posix()}{ending}"])
                break


def list_all(folder: Path) -> None:
    """Lists all that is in a folder, which nobody else has seen, in its marker.

    Raises:
        OSError: It cannot be written.
    """
    names = []
    for parent, _, files in os.walk(folder):
        above = Path(parent).relative_to(folder)
        names += [(above / file).as_posix() for file in files]
    _write_marker(folder, names)


def others_in(folder: Path) -> list[str]:
    """What is in a results folder and not certain to be this program's, by name.

    A folder in which nothing is stands for all that it holds, and its name ends in /.
    """
    listed = _certain(folder)
    parents = {str(parent) for name in listed for parent in PurePosixPath(name).parents}
    found: list[str] = []

    def look(place: Path, above: str) -> None:
        for entry in sorted(os.scandir(place), key=lambda entry: entry.name):
            name = f"{above}{entry.name}"
            if not entry.is_dir(follow_symlinks=False):
                if not (name in listed or _is_own(entry.name, name, listed)):
                    found.append(name)
            elif f"{name}/" in listed:
                found.extend(f"{name}/{below}" for below in _others_below(Path(entry.path)))
            elif name in parents:
                look(Path(entry.path), f"{name}/")
            else:
                found.append(f"{name}/")

    look(folder, "")
    return found


def remove_written(folder: Path) -> None:
    """Removes what is certain to be this program's, and the folder, if nothing else is in it.

    What stays is no results folder any more. Links are not followed.
    """
    listed = _certain(folder)
    folders = {folder}
    for part in [*_parts_of(folder, listed), *left_parts(folder, (MARKER,))]:
        with suppress(OSError):
            part.unlink()
    for name in listed:
        path = _inside(folder, name)
        if path is None:
            continue
        if not name.endswith("/"):
            with suppress(OSError):  # it is gone, or a folder by now
                path.unlink()
        elif _is_work(path):
            shutil.rmtree(path, ignore_errors=True)
        elif path.is_dir():
            remove_written(path)
        while (path := path.parent) != folder:
            folders.add(path)
    for own in (MARKER, JOURNAL):
        (folder / own).unlink(missing_ok=True)
    for each in sorted(folders, key=lambda path: len(path.parts), reverse=True):
        with suppress(OSError):  # somebody else's are in it
            each.rmdir()


def _others_below(folder: Path) -> list[str]:
    """As `others_in`, of a listed folder inside another one."""
    return [] if _is_work(folder) else others_in(folder)


def _is_work(folder: Path) -> bool:
    """Whether a listed folder is one in the making, which nobody has seen."""
    return folder.name.startswith(".") and WORK in folder.name


def _is_own(name: str, path: str, listed: set[str]) -> bool:
    """Whether a file is the marker, or what is left of one in the making."""
    if name in (MARKER, JOURNAL):
        return True
    whole = whole_name(name)
    return whole is not None and (
        whole == MARKER or str(PurePosixPath(path).with_name(whole)) in listed
    )


def _parts_of(folder: Path, names: set[str]) -> list[Path]:
    """Files in the making of names in a list of a folder."""
    below: dict[Path, set[str]] = {}
    for name in names:
        path = None if name.endswith("/") else _inside(folder, name)
        if path is not None:
            below.setdefault(path.parent, set()).add(path.name)
    return [part for place, wanted in below.items() for part in left_parts(place, wanted)]


def _certain(folder: Path) -> set[str]:
    """Names of what is certain to be this program's: noted, or listed and not changed since."""
    names = set()
    with suppress(OSError):
        for line in (folder / JOURNAL).read_text(encoding="utf-8").splitlines():
            with suppress(ValueError):  # the last one of who was killed
                names.add(str(load_json(line)))
    marker = _read_marker(folder)
    listed = [] if marker is None else marker.get(FILES)
    if not isinstance(listed, list):
        return names
    with suppress(OSError):
        when = os.lstat(folder / MARKER).st_mtime_ns
        for name in map(str, listed):
            path = _inside(folder, name)
            with suppress(OSError):
                if path is not None and (name.endswith("/") or os.lstat(path).st_mtime_ns <= when):
                    names.add(name)
    return names


def _there(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Those names under which something is: a file, or a folder where the name says so."""
    for name in names:
        path = _inside(folder, name)
        with suppress(OSError):
            if path is not None and stat.S_ISDIR(os.lstat(path).st_mode) == name.endswith("/"):
                yield name


def _inside(folder: Path, name: str) -> Path | None:
    """The path of a name in a list; None where it leads elsewhere, by dots or links."""
    pure = PurePosixPath(name)
    if pure.is_absolute() or not pure.parts or ".." in pure.parts:
        return None
    place = folder
    for part in pure.parts[:-1]:
        place = place / part
        if place.is_symlink():
            return None
    return place / pure.name


def _read_marker(folder: Path) -> dict[str, Any] | None:
    """What the marker says; None without one that can be read."""
    try:
        content = load_json((folder / MARKER).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def _write_marker(folder: Path, names: Iterable[str]) -> None:
    """Writes the marker, and removes before what killed programs left of it in the making."""
    listed = sorted(
        name for name in names if name not in (MARKER, JOURNAL) and whole_name(name) != MARKER
    )
    words = json.dumps({"program": "cdpr_drake", "version": __version__, FILES: listed}, indent=1)
    for left in left_parts(folder, (MARKER,)):
        with suppress(OSError):  # somebody else's folder of that name
            left.unlink()
    part = new_part(folder / MARKER)
    try:
        part.write_text(words + "\n", encoding="utf-8")
        part.replace(folder / MARKER)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
