"""A process that compiles what some groups need: `python -m cdpr_drake.kernel_cache GROUP ...`.

It begins with what is needed last, where the command that started it will come last. It ends when
its standard input does, of which that command holds the other end.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from cdpr_drake.kernel_cache.kernel_list import ListedKernel, needed_kernels, note_complete
from cdpr_drake.kernel_cache.locks import (
    CompilationLocks,
    kernel_lock,
    share_compilation,
    shared_locks,
)
from cdpr_drake.kernel_cache.signatures import signature_of

PAUSE = 0.02
"""Time after which is tried again, where all that is left is in work elsewhere [s]."""


def compile_needed(groups: Sequence[str]) -> bool:
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
        dispatcher, signature = kernel.dispatcher(), signature_of(kernel.signature)
        name = kernel_lock(dispatcher, signature)
        if name is None:
            return True
        with locks.held(name, wait=False) as mine:
            if mine and not _is_kept(dispatcher, signature):
                dispatcher.compile(signature)
            return mine
    except OSError:
        raise
    except Exception:  # it was changed since the list was made
        return True


def _is_kept(dispatcher: Any, signature: tuple[Any, ...]) -> bool:
    """Whether the cache folder has a kernel, by numba's own index."""
    cache = dispatcher._cache
    key = cache._index_key(signature, dispatcher.targetctx.codegen())
    return key in cache._cache_file._load_index()


def _end_with_parent(locks: CompilationLocks) -> None:
    while os.read(0, 1):  # nothing is ever written: it returns at the end
        pass
    with locks.saving:  # half a file would be left
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
