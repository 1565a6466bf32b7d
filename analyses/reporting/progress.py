"""Where a study stands."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StudyProgress:
    """Where a study stands.

    Attributes:
        what: What it is doing, in a few words.
        done: Work done, in simulated time [s] or in what `rate` counts.
        total: All work, the same.
        wall_time: Time since it began [s].
        rate: Words for the work done per second.
        found: Of the work done, what earlier sessions left in the folder.
        items: Words for what is counted.
    """

    what: str
    done: float
    total: float
    wall_time: float
    rate: str = "x real time"
    found: float = 0.0
    items: str = "s"

    @property
    def speed(self) -> float:
        """Work done per second since it began."""
        return (self.done - self.found) / max(self.wall_time, 1e-9)
