"""Who writes a folder is alone there; names that nobody has."""

from __future__ import annotations

import errno
import fcntl
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cdpr_drake.analyses.reporting.written_files import claim
from cdpr_drake.errors import OutputFolderError

TRIES, PAUSE = 20, 0.01
"""How often a lock is tried that is held, and the time between [s]: who looks for a free name holds
it for an instant."""

_FLAGS = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
"""A link is not followed, nothing is emptied, and a pipe keeps nobody waiting."""


class _ForeignError(OSError):
    """What has the name of a lock is not one of this user's."""


def free_folder(base: Path) -> Path:
    """`base`, or the first of base-2, base-3, ... that is not there and that nobody is writing."""
    number, folder = 1, base
    while folder.exists() or _is_locked(folder):
        number += 1
        folder = base.with_name(f"{base.name}-{number}")
    return folder


def _lock_of(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.lock")


def _is_locked(folder: Path) -> bool:
    """Whether a run is writing this folder, or something else has the name of its lock.

    A file that a killed run left says nothing.
    """
    try:
        file = _opened(_lock_of(folder))
    except FileNotFoundError:
        return False
    except OSError as problem:
        if problem.errno in (errno.EMFILE, errno.ENFILE):  # else every name would be one
            raise
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(file)
    return False


def _opened(lock: Path) -> int:
    """A file descriptor of a lock that is there: an empty file of this user, or the folder's owner.

    Raises:
        _ForeignError: It is something else: a link, a folder, somebody's file, one with content.
        OSError: It cannot be opened.
    """
    try:
        file = os.open(lock, _FLAGS)
    except OSError as problem:
        if problem.errno in (errno.ELOOP, errno.EISDIR, errno.ENXIO):
            raise _ForeignError(problem.errno, problem.strerror) from problem
        raise
    try:
        there, owners = os.fstat(file), (os.geteuid(), os.stat(lock.parent).st_uid)
        plain = stat.S_ISREG(there.st_mode) and there.st_nlink <= 1 and there.st_size == 0
        if not plain or there.st_uid not in owners:
            raise _ForeignError(errno.EEXIST, os.strerror(errno.EEXIST))
    except BaseException:
        os.close(file)
        raise
    return file


def _made_or_opened(lock: Path) -> int:
    """As `_opened`; a lock that is not there is made, which needs no look at its owner.

    In a results folder that is written just now, it is noted as the program's before.
    """
    while True:
        if not os.path.lexists(lock):
            claim(lock)
            with suppress(FileExistsError):
                return os.open(lock, _FLAGS | os.O_CREAT | os.O_EXCL, 0o600)
        with suppress(FileNotFoundError):  # removed in between
            return _opened(lock)


@contextmanager
def locked(final: Path) -> Iterator[None]:
    """Nobody else writes this folder inside the block; whatever ends this program frees it.

    Raises:
        OutputFolderError: Somebody does, the lock cannot be written, or a file that is no lock of
            this user has its name, which stays as it is.
    """
    lock = _lock_of(final)
    try:
        file = _acquired(lock)
    except _ForeignError as problem:
        raise OutputFolderError(
            f"{final}: found {lock.name} beside it, which is no lock of cdpr and stays; name "
            "another folder, or remove that file"
        ) from problem
    except BlockingIOError as problem:
        raise OutputFolderError(
            f"{final}: another run is writing there; name another folder"
        ) from problem
    except OSError as problem:
        raise OutputFolderError(f"{final}: cannot be written: {problem.strerror}") from problem
    try:
        yield
    finally:
        with suppress(OSError):
            if _names(lock, file):
                lock.unlink()  # before it is let go: nobody else can hold this file
        os.close(file)


def _acquired(lock: Path) -> int:
    """A file descriptor that holds a lock, and that the lock's path names.

    Raises:
        BlockingIOError: Somebody else holds it.
        OSError: As `_made_or_opened`.
    """
    tries = TRIES
    while True:
        file = _made_or_opened(lock)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _names(lock, file):
                return file
        except BlockingIOError:
            tries -= 1
            if not tries:
                os.close(file)
                raise
            time.sleep(PAUSE)
        except BaseException:
            os.close(file)
            raise
        # Who held it has removed it meanwhile: what is held names nothing.
        os.close(file)


def _names(lock: Path, file: int) -> bool:
    """Whether a path is that of an open file."""
    with suppress(FileNotFoundError):
        return os.path.samestat(os.lstat(lock), os.fstat(file))
    return False
