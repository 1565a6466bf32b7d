"""Ctrl-C as a polite request."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code of what Ctrl-C ended, as shells have it."""


class StopRequest:
    """Turns the first Ctrl-C into a polite request; a second one ends the program."""

    def __init__(self) -> None:
        """Nothing was asked yet."""
        self.asked = False

    def __call__(self) -> bool:
        """Whether to stop."""
        return self.asked

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Listens to Ctrl-C inside the block."""
        before = signal.signal(signal.SIGINT, self._ask)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
