"""One process compiles a kernel; all others that need it wait, and then load it."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

LOCK_FILE = "compiling.lock"
"""In the cache folder: a byte of it, far behind its end, is locked for each kernel in work."""

LONGEST_WAIT = 120.0
"""Who waits for another process so long [s] compiles itself: that one may have been stopped."""

POLL = 0.005
"""Time between two looks at a lock that another process has [s]."""

OURS = "cdpr_drake."
"""How the names of modules begin whose kernels are shared; nobody else's are touched."""


class CompilationLocks:
    """Locks by name among the processes that share a cache folder.

    The system takes them away from a process that ends, however it ends. Within a process they are
    free for all: numba lets one thread compile at a time, and kernels that it compiles within
    another one are called by that one, so that nobody waits for one that waits for it.

    Attributes:
        waits: Whether this process waits for another one that compiles.
        saving: Held while a compiled kernel is written.
    """

    def __init__(self, folder: Path) -> None:
        """Opens the file of locks.

        Raises:
            OSError: The folder cannot be written, its file system has no locks, or what has the
                name of the file is no plain file of this user or of the folder's owner.
            ImportError: The system has none.
        """
        self._fcntl = import_module("fcntl")  # not everywhere
        folder.mkdir(parents=True, exist_ok=True)
        self._file = _opened(folder / LOCK_FILE)
        self._held: set[int] = set()
        self.waits, self.saving = False, threading.Lock()
        if self._take(0):
            self._release(0)

    @contextmanager
    def held(self, name: str, wait: bool = True) -> Iterator[bool]:
        """Holds a lock inside the block.

        Args:
            name: Of what is done.
            wait: Whether to wait for a process that has it, for `LONGEST_WAIT` at most.

        Yields:
            Whether it is held.
        """
        byte = int.from_bytes(hashlib.sha256(name.encode()).digest()[:7], "little")
        if byte in self._held:
            yield True
            return
        given_up = time.monotonic() + (LONGEST_WAIT if wait else 0.0)
        try:
            while not (mine := self._take(byte)) and time.monotonic() < given_up:
                self.waits = True
                time.sleep(POLL)
        finally:
            self.waits = False
        try:
            yield mine
        finally:
            if mine:
                self._release(byte)

    def _take(self, byte: int) -> bool:
        """Locks a byte; False where another process has it."""
        try:
            self._fcntl.lockf(self._file, self._fcntl.LOCK_EX | self._fcntl.LOCK_NB, 1, byte)
        except (BlockingIOError, PermissionError):
            return False
        self._held.add(byte)
        return True

    def _release(self, byte: int) -> None:
        self._held.discard(byte)
        self._fcntl.lockf(self._file, self._fcntl.LOCK_UN, 1, byte)


def _opened(path: Path) -> int:
    """A file descriptor of the file of locks, which is made if it is not there; nothing is emptied.

    Raises:
        OSError: It cannot be opened, or is a link, no plain file, or somebody else's.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    file = os.open(path, flags, 0o666)
    there, owners = os.fstat(file), (os.geteuid(), os.stat(path.parent).st_uid)
    if stat.S_ISREG(there.st_mode) and there.st_nlink == 1 and there.st_uid in owners:
        return file
    os.close(file)
    raise OSError(errno.EPERM, "found no plain file of this user", str(path))


_locks: CompilationLocks | None = None

_is_shared = False

_compiled_for = 0.0
"""Wall time that the outermost compilations of this process have taken [s]."""

_compiles = False


def shared_locks() -> CompilationLocks | None:
    """The locks of the cache folder; None where it has none, or cannot be written."""
    global _locks
    folder = os.environ.get("NUMBA_CACHE_DIR")
    if _locks is None and folder:
        with suppress(OSError, ImportError):
            _locks = CompilationLocks(Path(folder))
    return _locks


def compilation_waits() -> bool:
    """Whether this process waits for another one that compiles a kernel."""
    return _locks is not None and _locks.waits


def compilation_time() -> float:
    """Wall time in which this process compiled shared kernels or waited for another one [s]."""
    return _compiled_for


@contextmanager
def _timed() -> Iterator[None]:
    """Adds to `compilation_time`, but for what is compiled within another kernel."""
    global _compiled_for, _compiles
    if _compiles:
        yield
        return
    began, _compiles = time.perf_counter(), True
    try:
        yield
    finally:
        _compiles = False
        _compiled_for += time.perf_counter() - began


def share_compilation() -> CompilationLocks | None:
    """Lets numba in this process compile and keep this package's kernels under the shared locks.

    Once, however often it is asked. Kernels of others, and those that are not kept, are compiled as
    ever; ours without the second entry that numba makes for C, a twelfth of the work, since who
    calls a kernel by its address takes the kernel's own (`numerics.kernel_calls`).

    Returns:
        The locks; None without any, or where numba is not imported: then nothing is changed.
    """
    global _is_shared
    if "numba.core.dispatcher" not in sys.modules:
        return None
    locks, dispatcher = shared_locks(), sys.modules["numba.core.dispatcher"].Dispatcher
    if locks is None or _is_shared:
        return locks
    cache = sys.modules["numba.core.caching"].FunctionCache
    lock = sys.modules["numba.core.compiler_lock"].global_compiler_lock
    compile_here, save_here = dispatcher.compile, cache.save_overload

    def compile_once(self: Any, sig: Any) -> Any:
        name = kernel_lock(self, sig)
        if name is None:
            return compile_here(self, sig)
        self.targetoptions.setdefault("no_cfunc_wrapper", True)
        with lock, _timed(), locks.held(name):  # numba's own first, which is that of threads
            return compile_here(self, sig)

    def save_overload(self: Any, sig: Any, data: Any) -> None:
        # numba reads and writes an index without any lock: two that keep the same kernel for other
        # arguments would overwrite each other's.
        if not _is_ours(self._py_func):
            save_here(self, sig, data)
            return
        with locks.held(f"index {_index(self)}"), locks.saving:
            save_here(self, sig, data)

    _is_shared = True
    dispatcher.compile, cache.save_overload = compile_once, save_overload
    return locks


def kernel_lock(dispatcher: Any, sig: Any) -> str | None:
    """Name of the lock of a kernel and its arguments; None where it is not shared."""
    if not _is_ours(dispatcher.py_func):
        return None
    if getattr(dispatcher._cache, "cache_path", None) is None:  # it is not kept
        return None
    return f"{_index(dispatcher._cache)} {getattr(sig, 'args', sig)}"


def _is_ours(function: Any) -> bool:
    """Whether a function is of this package; those made by `exec` have no module."""
    return (function.__module__ or "").startswith(OURS)


def _index(cache: Any) -> str:
    return f"{cache.cache_path}/{cache._impl.filename_base}"
