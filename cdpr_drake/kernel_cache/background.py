"""Processes in the background that compile what a command will need, while it goes on.

Each is `python -m cdpr_drake.kernel_cache.background GROUP ...`. It begins with what is needed
last, where the command that started it will come last. It ends when its standard input does, of
which that command holds the other end.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Collection, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from cdpr_drake.blas_threads import ONE_THREAD
from cdpr_drake.errors import CdprError
from cdpr_drake.kernel_cache.kernel_list import (
    ListedKernel,
    is_complete,
    needed_kernels,
    note_complete,
)
from cdpr_drake.kernel_cache.locks import (
    CompilationLocks,
    kernel_lock,
    share_compilation,
    shared_locks,
)

HELPERS = "CDPR_COMPILE_HELPERS"
"""Environment variable: how many processes compile in the background at most; 0: none."""

MOST = "3"
"""More would wait for each other: kernels call kernels."""

LONGEST_END = 5.0
"""A process that compiles is killed if it has not ended by itself after so long [s]."""

PAUSE = 0.02
"""Time after which is tried again, where all that is left is in work elsewhere [s]."""


def compile_in_background(groups: Collection[str]) -> int:
    """Starts processes that compile the kernels of some groups into the cache folder.

    Nothing is started where all are there, where this process may use one processor only, or where
    nothing can be kept. The processes are silent, and end with this one, also where it is killed.

    Args:
        groups: Names out of `group_names`.

    Returns:
        How many were started; never more than there are processors beside this process's own.

    Raises:
        CdprError: The environment variable `HELPERS` is no number.
    """
    words = os.environ.get(HELPERS) or MOST
    if not words.isdecimal():
        raise CdprError(f"{HELPERS}: found {words!r}; accepted: a whole number from 0 on")
    count = min(int(words), _processors() - 1)
    if count < 1 or not groups or not sys.executable or is_complete(groups):
        return 0
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" or shared_locks() is None:
        return 0
    for started in range(count):
        try:
            _start(groups)
        except OSError:  # the system has no more processes: the command compiles by itself
            return started
    return count


def helpers_started() -> int:
    """How many processes this one has started to compile in the background."""
    return len(_started)


_started: list[Any] = []


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _start(groups: Collection[str]) -> None:
    import subprocess

    above = str(Path(__file__).parent.parent.parent)
    path = os.environ.get("PYTHONPATH")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([above, *([path] if path else [])]),
        **ONE_THREAD,
        HELPERS: "0",
    }
    # -P: nothing in the working folder is imported by accident.
    command = [sys.executable, "-P", "-m", "cdpr_drake.kernel_cache.background", *groups]
    process = subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        stderr=None if os.environ.get("CDPR_TRACEBACK") else subprocess.DEVNULL,
    )  # fmt: skip
    _started.append(process)
    threading.Thread(target=process.wait, daemon=True).start()  # nothing is left when it ends
    atexit.register(_end, process)


def _end(process: Any) -> None:
    """Ends a process by the pipe that it holds on to; it may be writing a kernel."""
    import subprocess

    process.stdin.close()
    try:
        process.wait(LONGEST_END)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def compile_needed(groups: Collection[str]) -> bool:
    """Compiles what is missing of the kernels of some groups, and notes that all are there.

    Any number of processes may do so at the same time, and share the work.

    Args:
        groups: Names out of `group_names`.

    Returns:
        Whether they could be kept: False without a cache folder that can be written.

    Raises:
        OSError: A kernel cannot be kept, for instance as the disk is full.
    """
    import_module("numba")
    locks = share_compilation()
    if locks is None:
        return False
    compile_listed(needed_kernels(groups), locks)
    note_complete(groups)
    return True


def compile_listed(kernels: Sequence[ListedKernel], locks: CompilationLocks) -> None:
    """Compiles kernels that no other process compiles, from the last one to the first.

    Those that a kernel calls come before it, so that all processes together find work. A kernel
    that does not exist or compile any more is left to who needs it. In the end all are there.

    Raises:
        OSError: Nothing can be kept, for instance as the disk is full.
    """
    done: set[int] = set()
    listed = {kernel.number for kernel in kernels}
    while len(done) < len(listed):
        for kernel in reversed(kernels):
            if kernel.number not in done and (kernel.calls & listed) <= done:
                if not _try(kernel, locks):
                    continue
                done.add(kernel.number)
                break  # and what this makes possible, from the last one again
        else:
            time.sleep(PAUSE)


def _try(kernel: ListedKernel, locks: CompilationLocks) -> bool:
    """Compiles a kernel if it is not there; False where another process does."""
    try:
        dispatcher, types = kernel.dispatcher(), kernel.types()
        name = kernel_lock(dispatcher, types)
        if name is None:
            return True
        with locks.held(name, wait=False) as mine:
            if mine and not _is_kept(dispatcher, types):
                dispatcher.compile(types)
            return mine
    except OSError:
        raise
    except Exception:  # it was changed since the list was made
        return True


def _is_kept(dispatcher: Any, types: tuple[Any, ...]) -> bool:
    """Whether the cache folder has a kernel, by numba's own index."""
    cache = dispatcher._cache
    key = cache._index_key(types, dispatcher.targetctx.codegen())
    return key in cache._cache_file._load_index()


def _end_with_parent(locks: CompilationLocks) -> None:
    while os.read(0, 1):  # nothing is ever written: it returns at the end
        pass
    with locks.saving:  # the index would name a kernel that is not there
        os._exit(1)


def main() -> None:
    """Compiles what the groups need that the command line names."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # silent
    gc.disable()  # the compiler makes many objects and little garbage
    locks = shared_locks()
    if locks is None:
        return
    threading.Thread(target=_end_with_parent, args=[locks], daemon=True).start()
    compile_needed(sys.argv[1:])
    os._exit(0)  # taking down numba and what kernels' modules import takes longer than a kernel


if __name__ == "__main__":
    main()
