"""What a process that works for another one does first.

It imports nothing of the package: a process whose jobs need nothing of it starts at once.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
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


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)
