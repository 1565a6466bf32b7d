"""The workbenches of a server, one for each browser session."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from cdpr_drake.studio.session import Workbench

MOST_SESSIONS = 24
"""Workbenches that are kept; of more, those go that no page shows, the oldest first."""


class Sessions:
    """Workbenches by the ids of browser sessions."""

    def __init__(self, make: Callable[[], Workbench]) -> None:
        """With what makes a new workbench."""
        self._make = make
        self._benches: dict[str, Workbench] = {}
        self._refused: dict[str, Exception] = {}
        self._pages: dict[str, int] = {}

    def bench_of(self, session: str) -> Workbench | None:
        """The workbench of a session, if there is one."""
        return self._benches.get(session)

    async def prepare(self, session: str) -> None:
        """Makes the workbench of a session that has none, in another thread: it reads files."""
        if session not in self._benches:
            try:
                bench = await asyncio.to_thread(self._make)
                self._benches.setdefault(session, bench)
            except Exception as problem:
                self._refused[session] = problem

    def open_page(self, session: str) -> Workbench:
        """The workbench for a page of a session, made if `prepare` has not.

        Raises:
            CdprError: It cannot be made.
        """
        refused = self._refused.pop(session, None)
        if refused is not None and session not in self._benches:
            raise refused
        bench = self._benches.pop(session, None) or self._make()
        self._benches[session] = bench  # the last one now
        self._pages[session] = self._pages.get(session, 0) + 1
        for other in list(self._benches):
            if len(self._benches) > MOST_SESSIONS and not self._pages.get(other):
                del self._benches[other]
                self._pages.pop(other, None)
        return bench

    def close_page(self, session: str) -> None:
        """Says that a page of a session is closed for good; its workbench is kept."""
        self._pages[session] = max(self._pages.get(session, 0) - 1, 0)

    def benches(self) -> list[Workbench]:
        """All workbenches, the one used last at the end."""
        return list(self._benches.values())
