"""A command as a process: how it is asked to stop, and what it starts while it is imported.

* `StopRequest`: Ctrl-C, and SIGTERM as batch systems and containers send it, as a polite request.
* `exit_with_parent`: a command that another program started ends with it, also where it was killed.
* `compile_ahead`: which kernels a command will need, so that other processes compile them while it
  starts.
"""

from __future__ import annotations

import os
import signal
import stat
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType

from cdpr_drake.kernel_cache.background import compile_in_background

INTERRUPTED = 130
"""Exit code of what Ctrl-C or SIGTERM ended, as shells have it for the former."""

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""What asks to stop."""

STOPPING = "Stopping; what is finished is written; Ctrl-C again ends this now"
"""Answer to the first Ctrl-C where nothing else is said."""


class StopRequest:
    """Turns the first Ctrl-C or SIGTERM into a polite request; a second one ends the program."""

    def __init__(self, words: str = STOPPING) -> None:
        """Nothing was asked yet.

        Args:
            words: What the first Ctrl-C is answered with on stderr, at once: what is waited for,
                and what a second one does.
        """
        self.asked = False
        self._words = words

    def __call__(self) -> bool:
        """Whether to stop."""
        return self.asked

    def ask(self) -> None:
        """Asks to stop, as the first signal does."""
        self.asked = True

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        for each in SIGNALS:
            signal.signal(each, signal.default_int_handler)
        # Past Python's buffers, which what was interrupted may be writing to. On a terminal this
        # takes the line of a progress bar.
        with suppress(OSError):  # nobody reads it any more
            start = "\r\x1b[2K" if os.isatty(2) else ""
            os.write(2, f"{start}{self._words}\n".encode())

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Listens to Ctrl-C and SIGTERM inside the block."""
        before = {each: signal.signal(each, self._ask) for each in SIGNALS}
        try:
            yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)


LIFELINE = "CDPR_LIFELINE"
"""Environment variable of the file descriptor of a pipe whose other end the program has that
started the command, and nobody else."""

LONGEST_END = 20.0
"""Time to put away what there is before it is ended in earnest, as the studio gives it [s]."""


def exit_with_parent() -> None:
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


DEFAULT = "acrobot_pbvs_taut"
"""The group of what `cdpr simulate` runs unasked; other scenarios need about the same."""

COMPILED = "acrobot_pbvs, compiled engine"

GROUPS = (DEFAULT, COMPILED)
"""All groups of the list."""

SIMULATIONS = ("simulate", "serve", "studio")

QUIET = ("--help", "--finish")
"""Words with which nothing is simulated."""


def compile_ahead(words: Sequence[str]) -> int:
    """Starts processes that compile what a command line will need, before it imports Drake.

    Args:
        words: The command line after `cdpr`.

    Returns:
        How many were started: 0 where all is there, and for commands that need little.
    """
    command = next((word for word in words if not word.startswith("-")), "")
    if command not in SIMULATIONS or any(word in QUIET for word in words):
        return 0
    compiled = "--seeds" in words or any(word.startswith("integration.") for word in words)
    return compile_in_background([DEFAULT, COMPILED] if compiled else [DEFAULT])
