"""One thread for numbers and scenes, so that the page never waits for them, and signals of changes.

Compiled kernels are compiled under one lock, a minute long at the first use, and Drake's Meshcat
takes calls from the thread only that made it. So all of that happens in one thread, the
`Calculator`'s, beside that of the server, which answers pages. `Signal` tells who listens that
something has changed.
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

    def run(self, work: Callable[[], T], done: Callable[[Future[T]], Any] | None = None) -> None:
        """Does some work, and calls `done` with its future in the caller's event loop.

        Without an event loop it waits for the work, and raises what that does.
        """
        future = self.submit(work)
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            future.result()
            if done is not None:
                done(future)
            return
        if done is not None:
            future.add_done_callback(lambda one: _post(loop, done, one))

    def submit(self, work: Callable[[], T]) -> Future[T]:
        """Does some work, whoever may wait for it."""
        return self._executor.submit(work)

    def close(self) -> None:
        """Ends the thread, once the work under way is done."""
        self._executor.shutdown(wait=True, cancel_futures=True)


def _post(loop: asyncio.AbstractEventLoop, done: Callable[..., Any], future: Future[Any]) -> None:
    if not loop.is_closed() and not future.cancelled():
        loop.call_soon_threadsafe(done, future)


Listener = Callable[[], None]


class Signal:
    """Callbacks that are called when something has changed."""

    def __init__(self) -> None:
        """Without any."""
        self._listeners: dict[int, Listener] = {}
        self._next = 0

    def connect(self, listener: Listener) -> Callable[[], None]:
        """Calls `listener` from now on; what is returned ends that, also when called twice."""
        number, self._next = self._next, self._next + 1
        self._listeners[number] = listener

        def disconnect() -> None:
            self._listeners.pop(number, None)

        return disconnect

    def emit(self) -> None:
        """Calls all of them, in the order in which they came."""
        for listener in list(self._listeners.values()):
            listener()

    def __len__(self) -> int:
        return len(self._listeners)
