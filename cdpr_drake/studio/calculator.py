"""One thread for numbers and scenes, so that the page never waits for them.

Kernels are compiled under one lock, a minute long at the first use, and Drake's Meshcat takes calls
only from the thread that made it. All of that happens in the thread of the `Calculator`, beside the
server's, which answers pages.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

T = TypeVar("T")


class Calculator:
    """Work in one thread, in the order in which it comes."""

    def __init__(self) -> None:
        """Starts nothing yet."""
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="calculator")

    def submit(self, work: Callable[[], T]) -> Future[T]:
        """Does some work, whoever may wait for it."""
        return self._executor.submit(work)

    def run(self, work: Callable[[], T], done: Callable[[Future[T]], Any] | None = None) -> None:
        """Does some work, and calls `done` with its future in the caller's event loop."""
        future, loop = self.submit(work), asyncio.get_running_loop()

        def post(future: Future[T]) -> None:
            if done is not None and not loop.is_closed() and not future.cancelled():
                loop.call_soon_threadsafe(done, future)

        future.add_done_callback(post)

    def close(self) -> None:
        """Ends the thread, once the work under way is done."""
        self._executor.shutdown(wait=True, cancel_futures=True)
