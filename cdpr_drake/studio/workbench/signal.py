"""Tells who listens that something has changed."""

from __future__ import annotations

from collections.abc import Callable

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
