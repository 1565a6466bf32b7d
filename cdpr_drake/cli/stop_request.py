"""Ctrl-C, and SIGTERM as batch systems and containers send it, as a polite request."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

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
