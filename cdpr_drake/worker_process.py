"""What a process that works for another one does first.

It imports nothing of the package: a process whose jobs need nothing of it starts at once.
"""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import sys
import threading
from typing import Any


def become_worker() -> None:
    """Leaves Ctrl-C and SIGTERM to the parent process, and ends with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    # Who started it may have held them back until here.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT, signal.SIGTERM))
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def resident_memory() -> int:
    """Memory of this process that is in use [bytes]; its peak where the system tells no more."""
    try:
        with open("/proc/self/statm", encoding="ascii") as numbers:
            return int(numbers.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except FileNotFoundError:  # macOS
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak if sys.platform == "darwin" else peak * 1024


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)
