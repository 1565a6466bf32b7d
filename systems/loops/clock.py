"""When a periodic event comes, as Drake says it."""

from __future__ import annotations

import math


def next_time(now: float, period: float) -> float:
    """First multiple of a period after now [s].

    To the last bit that of Drake's LeafSystem, so that events which coincide in a diagram coincide
    in a loop, and steps between events are the same.
    """
    count = math.ceil(now / period)
    later = count * period
    return later if later > now else (count + 1) * period


class Clock:
    """A periodic event, at 0 and at every multiple of its period [s]."""

    def __init__(self, period: float) -> None:
        """With the period."""
        self.period, self.next = period, 0.0

    def strikes(self, now: float) -> bool:
        """Whether the event is due now; if so, the next one is looked for."""
        if self.next != now:
            return False
        self.next = next_time(now, self.period)
        return True


def first_time(clocks: list[Clock], end: float) -> float:
    """When the first of clocks strikes, but not after an end [s]."""
    for clock in clocks:
        if clock.next < end:
            end = clock.next
    return end
