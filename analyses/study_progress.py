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
    """

    what: str
    done: float
    total: float
    wall_time: float
    rate: str = "x real time"
