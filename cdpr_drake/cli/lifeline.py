"""Commands that another program started end with it, also where that was killed."""

from __future__ import annotations

import os
import signal
import stat
import threading
import time

LIFELINE = "CDPR_LIFELINE"
"""Environment variable of the file descriptor of a pipe whose other end the program has that
started the command, and nobody else."""

LONGEST_END = 20.0
"""Time to put away what there is before it is ended in earnest, as the studio gives it [s]."""


def hold_lifeline() -> None:
    """Ends this process when who started it is gone, if the environment has a `LIFELINE`.

    First by SIGTERM, which commands take as a wish, then by SIGKILL, with all that it started.
    """
    words = os.environ.pop(LIFELINE, "")  # nobody that is started from here holds on to it
    if not words.isdecimal():
        return
    threading.Thread(target=_watch, args=[int(words)], daemon=True, name="lifeline").start()


def _watch(pipe: int) -> None:
    try:
        if not stat.S_ISFIFO(os.fstat(pipe).st_mode):
            return
        while os.read(pipe, 1):  # nothing is ever written: it returns at the end
            pass
    except OSError:
        return  # it is no pipe of ours
    main = threading.main_thread().ident
    assert main is not None
    signal.pthread_kill(main, signal.SIGTERM)  # there, so that a call that waits is interrupted
    time.sleep(LONGEST_END)
    if os.getpgid(0) == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)
