"""Compiled kernels are kept in the user's cache folder, never inside the installed package.

numba would put them beside the sources. There they survive an uninstall as a package without code,
and cannot be written on a read-only or shared installation. Nor does numba notice that a kernel
which another one calls has changed, so each state of the sources has a folder of its own.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import logging
import os
import shutil
import stat
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import platformdirs

_LOG = logging.getLogger(__name__)

KEPT = 3
"""Folders of so many states of the sources are kept, the youngest ones."""

IN_USE = 3600.0
"""A folder that a process began to use within so long [s] is kept as well."""

NUMBA_VARIABLE = "NUMBA_CACHE_DIR"


def use_kernel_cache() -> None:
    """Tells numba where to keep compiled kernels, unless the user has said so.

    numba runs what it finds there, so only folders count that nobody else can write to: real ones
    of this user. Where there is none, this process and those that it starts have a fresh one, which
    goes with it; stderr says why.
    """
    if os.environ.get(NUMBA_VARIABLE):
        return
    folder = _kept_folder()
    os.environ[NUMBA_VARIABLE] = str(folder)
    if "numba" in sys.modules:  # it has read its environment already
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def _kept_folder() -> Path:
    """A private folder of this state of the sources: in the user's cache folder, or in one for
    temporary files where there is none, or a fresh one."""
    temporary = Path(tempfile.gettempdir()) / f"cdpr_drake-{os.getuid()}"
    try:
        folders = [Path(platformdirs.user_cache_dir("cdpr_drake")), temporary]
    except (OSError, RuntimeError, KeyError):  # no home
        folders = [temporary]
    problems = []
    for folder in folders:
        state = folder / "kernels" / state_of_sources()
        try:
            _check_above(folder)
            _private(folder)
            _private(state.parent)
            _forget_old(state)
            _private(state, anew=True)
            os.utime(state)  # fails on a read-only disk
            return state
        except UntrustedFolderError as problem:
            problems.append(str(problem))
        except OSError:  # as in a container without a home
            continue
    fresh = Path(tempfile.mkdtemp(prefix="cdpr_drake-kernels-"))
    atexit.register(_remove, fresh, os.getpid())
    why = "; ".join(problems) or "no cache folder can be written"
    _LOG.warning(
        "cdpr_drake: compiled kernels are not kept: %s; %s names another folder",
        why, NUMBA_VARIABLE,
    )  # fmt: skip
    return fresh


class UntrustedFolderError(Exception):
    """A folder that somebody else could have written to."""


def _check_above(folder: Path) -> None:
    """Refuses a place in which anybody may put another folder in the place of this one.

    Raises:
        UntrustedFolderError: A folder above can be written by all, and has no sticky bit.
        OSError: It cannot be looked at.
    """
    place = folder.parent.resolve()
    for each in (place, *place.parents):
        if each.exists():
            mode = each.stat().st_mode
            if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
                raise UntrustedFolderError(f"{each} can be written by all users")


def _private(folder: Path, anew: bool = False) -> None:
    """Makes a folder that nobody else can write to, or finds it to be one.

    Args:
        folder: What is above it is private, or cannot be renamed by others.
        anew: Whether one of this user's that others can look into is replaced by an empty one, as
            they may have written to what is in it; else it is closed to what they would write.

    Raises:
        UntrustedFolderError: It is a link, no folder, or somebody else's.
        OSError: It cannot be made or changed.
    """
    folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with suppress(FileExistsError):
        os.mkdir(folder, 0o700)
    there = os.lstat(folder)
    if stat.S_ISLNK(there.st_mode):
        raise UntrustedFolderError(f"{folder} is a link")
    if not stat.S_ISDIR(there.st_mode):
        raise UntrustedFolderError(f"{folder} is no folder")
    if there.st_uid != os.geteuid():
        raise UntrustedFolderError(f"{folder} belongs to user {there.st_uid}, not {os.geteuid()}")
    if anew and there.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        aside = Path(tempfile.mkdtemp(prefix=f"{folder.name}-", dir=folder.parent))
        folder.rename(aside / folder.name)
        shutil.rmtree(aside, ignore_errors=True)
        _private(folder)
    elif there.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        os.chmod(folder, stat.S_IMODE(there.st_mode) & ~(stat.S_IWGRP | stat.S_IWOTH))


def _remove(folder: Path, process: int) -> None:
    """Removes a fresh folder at the end of the process that made it, not of one forked from it."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def state_of_sources() -> str:
    """Twelve digits that change with the time or size of any file of the packages with kernels."""
    here, hashed = Path(__file__).parent.parent, hashlib.sha256(sys.version.encode())
    for room in sorted(os.scandir(here), key=lambda entry: entry.name):
        if room.is_dir(follow_symlinks=False) and room.name not in _WITHOUT_KERNELS:
            for path in sorted(Path(room.path).rglob("*.py")):
                there = path.stat()
                hashed.update(f"{path} {there.st_size} {there.st_mtime_ns}\n".encode())
    return hashed.hexdigest()[:12]


_WITHOUT_KERNELS = (
    "models", "systems", "analyses", "cli", "formats", "schema", "sections", "studio",
    "kernel_cache", "__pycache__",
)  # fmt: skip


def _forget_old(folder: Path) -> None:
    """Removes what was compiled from sources that are no longer in use."""
    if folder.exists():
        return
    with suppress(OSError):
        states = sorted(
            (each.stat().st_mtime, each.path)
            for each in os.scandir(folder.parent)
            if each.is_dir(follow_symlinks=False)
        )
        for used, old in states[: 1 - KEPT]:
            if time.time() - used > IN_USE:  # else another checkout may be at work
                shutil.rmtree(old, ignore_errors=True)
