"""Samples of a run that are kept, so that a page that is opened late has them all, thinned."""

from __future__ import annotations

import threading
from typing import Any

MOST_SAMPLES = 3000
"""Samples that are kept; beyond, every second one is left out, and so on."""


class Samples:
    """Samples in the order of time, evenly thinned where there are many."""

    def __init__(self, limit: int = MOST_SAMPLES) -> None:
        """With room for so many."""
        self._limit, self._stride, self._count = limit, 1, 0
        self._kept: list[dict[str, Any]] = []
        self._last: dict[str, Any] | None = None
        self._lock = threading.Lock()

    def add(self, sample: dict[str, Any]) -> None:
        """Adds the newest one."""
        with self._lock:
            if self._count % self._stride == 0:
                self._kept.append(sample)
                if len(self._kept) > self._limit:
                    self._kept = self._kept[::2]
                    self._stride *= 2
            self._count += 1
            self._last = sample

    def all(self) -> list[dict[str, Any]]:
        """Those that are kept, the newest in any case the last."""
        with self._lock:
            found = list(self._kept)
            if self._last is not None and (not found or found[-1] is not self._last):
                found.append(self._last)
        return found

    @property
    def last(self) -> dict[str, Any] | None:
        """The newest one."""
        return self._last
