"""When a run may go on: paused, step by step, or at so many times real time."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import monotonic

SLOWEST_SPEED, FASTEST_SPEED = 0.01, 1000.0
"""Factors of real time that are accepted."""

BEHIND = 0.1
"""A run that is later than this is not caught up on: it goes on at its speed from there [s]."""

NEVER = math.inf


class RealtimeRate:
    """Says how long a run has to wait before it goes on.

    Attributes:
        paused: Whether it stands.
        speed: Simulated seconds per second; None: as fast as possible.
    """

    def __init__(self, speed: float | None = None, clock: Callable[[], float] = monotonic) -> None:
        """Going.

        Args:
            speed: As the attribute.
            clock: Time that passes [s].
        """
        self.paused, self.speed = False, speed
        self._clock = clock
        self._until = NEVER
        self._anchor: tuple[float, float] | None = None

    def pause(self) -> None:
        """Stands still from now on."""
        self.paused, self._until = True, NEVER

    def go(self) -> None:
        """Goes on."""
        self.paused, self._until, self._anchor = False, NEVER, None

    def step(self, now: float, seconds: float) -> None:
        """Goes on from a simulated time for so many simulated seconds, and stands then."""
        self.go()
        self._until = now + seconds

    def go_at(self, speed: float | None) -> None:
        """Changes the speed; a run that stands still does so."""
        self.speed, self._anchor = speed, None

    def wait(self, now: float) -> float:
        """Time to wait at a simulated time [s]: 0 to go on, infinite as long as it stands [s]."""
        if not self.paused and now >= self._until * (1.0 - 1e-12):
            self.pause()
        if self.paused:
            self._anchor = None
            return NEVER
        if self.speed is None:
            return 0.0
        wall = self._clock()
        if self._anchor is None:
            self._anchor = (wall, now)
        since, sim = self._anchor
        ahead = since + (now - sim) / self.speed - wall
        if ahead < -BEHIND:
            self._anchor = (wall, now)
        return max(ahead, 0.0)
